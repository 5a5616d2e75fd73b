// What the vertices of a cluster send towards a direction by their Phong lobes. The including shader declares the constant
// ENTRY_POINTS and binds Materials, ReflectedFlux, FirstDeposits, Deposits, GlossVertices, GlossBeams, BaseRanges and
// GlossShifts.

// What an invocation takes in one dispatch of the vertices below a cluster, those of one base cluster after those of another.
struct GlossPart {
    vec3 emission;    // entry points: of the light, times the area that each of them stands for, in the mean
    uint beam_count;  // entry points: of each
    uint first;       // vertex
    uint end;         // vertex; bounds the work of an invocation
    uint adds;        // 1: to what was found so far
};

// π times the lobes' radiance, times the cluster's area, W: of light straight from one light (ENTRY_POINTS == 1) or of all light from
// surfaces, at a run of deposits. `shift` turns the index of a deposit into that of its vertex.
vec3 gloss_flux(uvec2 run, uint shift, vec3 toward, GlossPart part) {
    vec3 flux = vec3(0.0);
    for (uint i = run.x; i < run.y; ++i) {
        GlossVertex vertex = gloss_vertices[i + shift];
        Reflectance material = materials[vertex.material];
        vec3 throughput = deposits[i].throughput;
        if (ENTRY_POINTS == 0u) {
            flux += throughput * reflected_flux[deposits[i].path] * lobe_share(material, vertex.mirror, toward);
        } else if (vertex.entry != NO_ENTRY) {
            vec3 shine = vec3(0.0);
            for (uint beam = vertex.entry * part.beam_count; beam < (vertex.entry + 1u) * part.beam_count; ++beam) {
                shine += gloss_beams[beam].factor * lobe_share(material, gloss_beams[beam].mirror, toward);
            }
            flux += throughput * part.emission * shine;
        }
    }
    return flux;
}

// The same of the part below a cluster.
vec3 gloss_flux_below(uint cluster, vec3 toward, GlossPart part) {
    vec3 flux = vec3(0.0);
    uint passed = 0u;
    for (uint base = base_ranges[cluster].x; base < base_ranges[cluster].y; ++base) {
        uint shift = gloss_shifts[base];
        if (shift == NO_ENTRY) continue;
        uint list = 2u * base + (ENTRY_POINTS == 1u ? 0u : 1u);
        uint first = first_deposits[list];
        uint count = first_deposits[list + 1u] - first;
        uvec2 run = clamp(uvec2(part.first, part.end), passed, passed + count) - passed;
        flux += gloss_flux(first + run, shift, toward, part);
        passed += count;
    }
    return flux;
}
