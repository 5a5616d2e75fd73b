// Outgoing flux of a cluster's vertices in a direction, by their Phong lobes. The including
// shader declares the constants ENTRY_POINTS and LIGHTS. It binds Materials, FirstBounceFlux0
// to FirstBounceFlux3, ContributionRanges, Contributions, GlossVertices, GlossBeams,
// BaseRanges and GlossShifts.

// The vertices below a cluster that an invocation handles in one dispatch, base cluster
// after base cluster.
struct GlossSpan {
    float area_m2;    // mean area of an entry point
    uint beam_count;  // entry points: of each
    uint first;       // vertex
    uint end;         // one past the last vertex; bounds the work of an invocation
    uint adds;        // 1: adds to the sum of earlier dispatches
    uint most;        // maximum of vertices below a cluster; of more, a sample stands for all. 0: all vertices count
};

// Outgoing flux from one light, or from each of four.
struct GlossFlux {
    vec3 of_light[4];  // W per unit of the light's emission
};

// `precise` forbids fused multiply-add, so that one light and four round alike.
void add(inout vec3 sum, vec3 first, vec3 second) {
    precise vec3 added = sum + first * second;
    sum = added;
}

// Adds π times the lobes' radiance times the cluster's area, W per unit of a light's emission: of
// light straight from the light (ENTRY_POINTS == 1) or from surfaces. Takes every `step`th
// contribution of the range `range`, with `area_m2` each. `shift` turns the index of a contribution
// into that of its vertex. In an unweighted cluster all of each contribution counts.
void add_gloss_flux(inout GlossFlux flux, uvec2 range, uint step, float area_m2, bool is_unweighted, uint shift, vec3 toward, GlossSpan span) {
    for (uint i = range.x; i < range.y; i += step) {
        GlossVertex vertex = gloss_vertices[i + shift];
        Reflectance material = materials[vertex.material];
        Contribution contribution = contributions[i];
        vec3 throughput = area_m2 * contribution_weight(contribution, is_unweighted) * contribution.throughput;
        if (ENTRY_POINTS == 0u) {
            vec3 fraction = throughput * lobe_term(material, vertex.mirror, toward);
            uint path = path_of(contribution);
            add(flux.of_light[0], fraction, first_bounce_flux_0[path]);
            if (LIGHTS == 1u) continue;
            add(flux.of_light[1], fraction, first_bounce_flux_1[path]);
            add(flux.of_light[2], fraction, first_bounce_flux_2[path]);
            add(flux.of_light[3], fraction, first_bounce_flux_3[path]);
        } else if (vertex.entry != NO_ENTRY) {
            vec3 gloss = vec3(0.0);
            for (uint beam = vertex.entry * span.beam_count; beam < (vertex.entry + 1u) * span.beam_count; ++beam) {
                gloss += gloss_beams[beam].factor * lobe_term(material, gloss_beams[beam].mirror, toward);
            }
            add(flux.of_light[0], throughput, gloss);
        }
    }
}

// Base clusters visited for each sampled vertex.
const uint BASES = 4u;

// Outgoing flux of the vertices below a cluster. If it samples them, it takes every n-th vertex,
// and `seed` selects the first one.
GlossFlux gloss_flux_below(uint cluster, vec3 toward, GlossSpan span, uint seed) {
    GlossFlux flux = GlossFlux(vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)));
    uvec2 bases = base_ranges[cluster];
    uint base_step = 1u;
    uint step = 1u;
    if (span.most != 0u) {
        base_step = max(1u, (bases.y - bases.x) / (BASES * span.most));
        // Contributions are in the order of their base clusters.
        uint contribution_count = contribution_ranges[bases.y - 1u].end - contribution_ranges[bases.x].first;
        step = max(1u, contribution_count / (base_step * span.most));
    }
    bool is_sampled = base_step * step > 1u;
    // A sample is small enough for the first dispatch to take all of it.
    if (is_sampled && span.first != 0u) return flux;
    uint first_asked = seed % step;
    float area_m2 = span.area_m2 * float(base_step * step);
    uint passed = 0u;
    for (uint base = bases.x + (seed >> 16) % base_step; base < bases.y; base += base_step) {
        uint shift = gloss_shifts[base];
        if (shift == NO_ENTRY) continue;
        ContributionRange contributions_here = contribution_ranges[base];
        uint first = ENTRY_POINTS == 1u ? contributions_here.first : contributions_here.first_other;
        uint count = (ENTRY_POINTS == 1u ? contributions_here.first_other : contributions_here.end) - first;
        uvec2 range = clamp(uvec2(span.first, span.end), passed, passed + count) - passed;
        if (is_sampled) range = uvec2((first_asked + step - passed % step) % step, count);
        add_gloss_flux(flux, first + range, step, area_m2, contributions_here.is_unweighted != 0u, shift, toward, span);
        passed += count;
    }
    return flux;
}
