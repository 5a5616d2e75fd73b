// Position in a one-dimensional dispatch. The host deals its workgroups as suits the device (src/gpu/tuning.rs); the last ones may have nothing
// to do: compare with a count from the push block. A shader of one-dimensional work asks here and never reads gl_GlobalInvocationID.

// Strips of workgroups along x go to the layers along z in turn, and then to the next row.
uint flat_workgroup() { return gl_WorkGroupID.x + gl_NumWorkGroups.x * (gl_WorkGroupID.z + gl_NumWorkGroups.z * gl_WorkGroupID.y); }

// A macro, so that it expands where the local size is known: in a function compiled ahead of the shader's
// `layout(local_size_x = …)`, gl_WorkGroupSize is silently 1.
#define flat_invocation() (flat_workgroup() * gl_WorkGroupSize.x + gl_LocalInvocationIndex)

// Where workgroups take square tiles of an image so many points wide, row by row: the invocation's place in its tile.
uvec2 place_in_tile(uint side) { return uvec2(gl_LocalInvocationIndex % side, gl_LocalInvocationIndex / side); }

// The first point of the tile of that number.
uvec2 corner_of_tile(uint tile, uint side, uint width) {
    uint tiles = (width + side - 1u) / side;
    return side * uvec2(tile % tiles, tile / tiles);
}
