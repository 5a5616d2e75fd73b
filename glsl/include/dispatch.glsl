// Position in a one-dimensional dispatch. The host spreads a dispatch with more workgroups than the device takes along x
// over y, so a shader of one-dimensional work asks here and never reads gl_GlobalInvocationID. The last row may hold
// workgroups with nothing to do: compare with a count from the push block.

uint flat_workgroup() {
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

// A macro, so that it expands where the local size is known: in a function compiled ahead of the shader's
// `layout(local_size_x = …)`, gl_WorkGroupSize is silently 1.
#define flat_invocation() (flat_workgroup() * gl_WorkGroupSize.x + gl_LocalInvocationIndex)
