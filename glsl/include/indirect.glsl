// Workgroup counts of indirect dispatches, swizzled so that flat_workgroup() is right in them: as
// Tuning::swizzled in src/gpu/tuning.rs.
layout(constant_id = 11) const uint STRIP = 1u;
layout(constant_id = 12) const uint LAYERS = 1u;

// Workgroups along each axis.
uvec3 swizzled(uint groups) {
    uint of_layer = (groups + LAYERS - 1u) / LAYERS;
    return uvec3(min(of_layer, STRIP), (of_layer + STRIP - 1u) / STRIP, LAYERS);
}
