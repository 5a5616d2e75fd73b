// Workgroup counts of indirect dispatches, swizzled so that flat_workgroup() is right in them: as
// Tuning::swizzled in src/gpu/tuning.rs.
layout(constant_id = 11) const uint STRIP = 1u;
layout(constant_id = 12) const uint SLICES = 1u;

// Workgroups along each axis.
uvec3 swizzled(uint groups) {
    uint of_slice = (groups + SLICES - 1u) / SLICES;
    return uvec3(min(of_slice, STRIP), (of_slice + STRIP - 1u) / STRIP, SLICES);
}
