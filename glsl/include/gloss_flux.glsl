// Outgoing flux of a cluster's vertices in a direction, by their Phong lobes. The including
// shader declares the constant HAS_ONE_BEAM. It binds GlossLobes, GlossMirrors, GlossBeams,
// EntryIndices, BaseRanges and VertexOffsets.

// The vertices below a cluster that an invocation handles in one dispatch.
struct GlossSpan {
    uint lobe_count;  // entry points in glossy clusters; their lobes come first
    uint beam_count;  // of each entry point
    uint first;       // vertex of either kind
    uint end;         // one past the last vertex; bounds the work of an invocation
    uint adds;        // 1: adds to the sum of earlier dispatches
    uint most;        // maximum of vertices below a cluster; of more, a sample stands for all. 0: all vertices count
};

// Irradiance of an entry point times its lobe in a direction: its beams.
float beams_towards(uint entry, float exponent, vec3 toward, uint beam_count) {
    float sum = 0.0;
    uint count = HAS_ONE_BEAM == 1u ? 1u : beam_count;
    for (uint beam = entry * count; beam < (entry + 1u) * count; ++beam) {
        vec4 found = numbers(texelFetch(GlossBeams, int(beam)));  // a `GlossBeam`
        sum += found.w * phong_lobe(found.xyz, toward, exponent);
    }
    return sum;
}

// The vertices of one kind, out of the range `all`, that a dispatch takes.
uvec2 taken(uvec2 all, GlossSpan span, uint step, uint seed) {
    if (step > 1u) return uvec2(all.x + seed % step, all.y);
    return all.x + min(uvec2(span.first, span.end), all.y - all.x);
}

// π times the radiance that the lobes of the vertices below a cluster send in a direction, times
// the cluster's area: W per unit of a light's emission. If it samples the vertices, it takes every
// n-th, and `seed` selects the first one.
vec3 gloss_flux_below(uint cluster, vec3 toward, GlossSpan span, uint seed) {
    uvec2 bases = base_ranges[cluster];
    // The vertices of consecutive base clusters are consecutive: entry points, and others.
    uvec2 first = vertex_offsets[bases.x], end = vertex_offsets[bases.y];
    uvec2 count = end - first;
    uint step = span.most == 0u ? 1u : max(1u, (count.x + count.y) / span.most);
    // A sample is small enough for the first dispatch to take all of it.
    if (step > 1u && span.first != 0u) return vec3(0.0);
    vec3 flux = vec3(0.0);
    uvec2 range = taken(uvec2(first.y, end.y), span, step, seed);
    for (uint i = range.x; i < range.y; i += step) {
        vec4 lobe = numbers(texelFetch(GlossLobes, int(span.lobe_count + i)));
        vec3 mirror = numbers(texelFetch(GlossMirrors, int(i))).xyz;
        flux += lobe.xyz * phong_lobe(mirror, toward, lobe.w);
    }
    range = taken(uvec2(first.x, end.x), span, step, seed);
    for (uint i = range.x; i < range.y; i += step) {
        vec4 lobe = numbers(texelFetch(GlossLobes, int(i)));
        flux += lobe.xyz * beams_towards(word_at(EntryIndices, i), lobe.w, toward, span.beam_count);
    }
    return float(step) * flux;
}
