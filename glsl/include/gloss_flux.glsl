// What the vertices of a base cluster send towards a direction by their Phong lobes. The including shader declares the constant
// ENTRY_POINTS and binds Materials, ReflectedFlux, FirstDeposits, Deposits, GlossVertices and GlossBeams.

// What an invocation takes of a cluster's vertices in one dispatch.
struct GlossPart {
    vec3 emission;    // entry points: of the light, times the area that each of them stands for, in the mean
    uint beam_count;  // entry points: of each
    uint first;       // vertex
    uint count;       // of vertices: bounds the work of an invocation
    uint adds;        // 1: to what was found so far
};

// π times the lobes' radiance, times the cluster's area, W: of light straight from one light (ENTRY_POINTS == 1) or of all light from
// surfaces. `shift` turns the index of a deposit into that of its vertex.
vec3 gloss_flux(uint cluster, uint shift, vec3 toward, GlossPart part) {
    vec3 flux = vec3(0.0);
    uint list = 2u * cluster + (ENTRY_POINTS == 1u ? 0u : 1u);
    uint first = first_deposits[list] + part.first;
    uint end = min(first_deposits[list + 1u], first + part.count);
    for (uint i = first; i < end; ++i) {
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
