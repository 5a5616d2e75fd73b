// Shadow rays that start from the roots of a shaft. Include after texels.glsl, shafts.glsl,
// light_kind.glsl and direct.glsl. The including shader binds the texels `ShaftRoots` and `uint
// shaft_list[]`.
//
// A kernel runs twice, because the lanes of a CPU execute all code that one of them needs. The
// first run tests triangles and skips batches with nodes. The second run takes the list of skipped
// batches and traverses the tree. Without shafts it runs once, and rays start from the root: on a
// GPU, the nodes of a shaft, opened one after another, cost more than they save its rays.

layout(constant_id = 13) const uint STARTS_AT = 0u;
// As in src/passes/frame/shafts.rs.
const uint AT_TRIANGLES = 0u;
const uint AT_NODES = 1u;
const uint AT_ROOT = 2u;

const uint NO_BATCH = 0xffffffffu;

// The batch that a workgroup takes.
uint batch_of(uint workgroup) {
    if (STARTS_AT == AT_ROOT) return workgroup;
    if (STARTS_AT == AT_TRIANGLES) return (word_at(ShaftRoots, workgroup * SHAFT_WORDS) >> 16) == 0u ? workgroup : NO_BATCH;
    return workgroup < shaft_list[3] ? shaft_list[4u + workgroup] : NO_BATCH;
}

// As is_lit, for a point of the shaft's batch.
bool is_lit_in(uint shaft, vec3 position, vec3 normal, LightSample light) {
    if (STARTS_AT == AT_ROOT) return is_lit(position, normal, light);
    Ray ray = shadow_ray(position, normal, light);
    Shear shear = shear_along(without_zeros(ray.direction));
    Hit hit = Hit(ray.t_max, 0u, vec3(0.0));
    uint first = shaft * SHAFT_WORDS + 1u;
    uint counts = word_at(ShaftRoots, first - 1u);
    bool is_hidden = false;
    for (uint i = 0u; i < (counts & 0xffffu) && !is_hidden; ++i) is_hidden = intersect_triangle(word_at(ShaftRoots, first + i), ray.origin, shear, false, hit);
    uint nodes = counts >> 16;
    if (STARTS_AT == AT_TRIANGLES || is_hidden || nodes == 0u) return !is_hidden;
    // Nodes are stored at the end.
    uint last = first + MAX_ROOTS - 1u;
    return !trace_from(word_at(ShaftRoots, last), ShaftRoots, last + 1u - nodes, nodes - 1u, ray, true, hit);
}

// As light_factor, for a point of the shaft's batch and a light of LIGHT_KIND. Adds to `seen`.
float light_factor_in(uint shaft, LightSource light, uint first, uint end, uint flags, vec3 position, vec3 normal, vec3 shading, float area,
                      inout uint seen) {
    float sum = 0.0;
    uint row = lattice_row(light, first);
    for (uint i = first; i < end_of_kind(first, end); ++i) {
        vec2 u = lattice_place(light, i, row);
        row = next_row(light, row);
        LightSample found;
        float factor = open_factor(light, u, position, normal, shading, area, found);
        if (!is_due(found, factor, flags)) continue;
        bool lit = is_lit_in(shaft, position, normal, found);
        if (factor > 0.0) seen |= lit ? SEES_LIT : SEES_HIDDEN;
        if (lit) sum += factor * passed_by_panes(shadow_ray(position, normal, found), light.shape >> CHANNEL_SHIFT);
    }
    return sum / float(light.samples);
}
