// Position in a one-dimensional dispatch. The host swizzles workgroups to suit the device
// (src/gpu/tuning.rs). The last ones may be superfluous: compare with a count in the push block.
// Kernels of one-dimensional work use these functions instead of gl_GlobalInvocationID.

// Strips of workgroups along x go to the slices along z in turn, and then to the next row.
uint flat_workgroup() { return gl_WorkGroupID.x + gl_NumWorkGroups.x * (gl_WorkGroupID.z + gl_NumWorkGroups.z * gl_WorkGroupID.y); }

// A macro, so that it expands where the local size is known: in a function compiled ahead of the
// shader's `layout(local_size_x = …)`, gl_WorkGroupSize is silently 1.
#define flat_invocation() (flat_workgroup() * gl_WorkGroupSize.x + gl_LocalInvocationIndex)

// Column and row of `place` < 2³¹, in rows of `width`. CPUs divide integers lane by lane, but
// floats in one instruction. Vulkan allows a float division an error of 2.5 units, so the quotient
// is off by at most a row and 2⁻²¹ of all rows; the column corrects it.
uvec2 in_rows(uint place, uint width) {
    float inverse = 1.0 / float(width);
    uint row = uint(float(place) * inverse);
    int column = int(place - row * width);
    int more = int(floor(float(column) * inverse));
    row += uint(more);
    column -= more * int(width);
    // That quotient may be off by one.
    int last = column < 0 ? -1 : column >= int(width) ? 1 : 0;
    return uvec2(column - last * int(width), row + uint(last));
}

// The invocation's position in its tile of side × side points, row by row; a workgroup
// is one tile.
uvec2 place_in_tile(uint side) { return uvec2(gl_LocalInvocationIndex % side, gl_LocalInvocationIndex / side); }

// Tile order: tiles of 8×8 pixels, row by row, with a Morton curve in each, so that neighbours in
// the list are neighbours in the image. These two functions map a pixel of an image of `width`
// pixels to its position in that order, and back. A position may map to a pixel outside the image.
uint place_in_tiles(uvec2 pixel, uint width) {
    uvec2 tile = pixel / 8u, within = pixel % 8u;
    uvec2 spread = (within & 1u) | (within & 2u) << 1 | (within & 4u) << 2;
    return 64u * (tile.y * ((width + 7u) / 8u) + tile.x) + (spread.x | spread.y << 1);
}

uvec2 pixel_in_tiles(uint place, uint width) {
    uint tiles = (width + 7u) / 8u;
    uvec2 spread = uvec2(place, place >> 1);
    uvec2 within = (spread & 1u) | (spread >> 1 & 2u) | (spread >> 2 & 4u);
    return 8u * in_rows(place / 64u, tiles) + within;
}

uint tiles_around(uvec2 size) { return ((size.x + 7u) / 8u) * ((size.y + 7u) / 8u); }

// The first point of a tile, by its index.
uvec2 corner_of_tile(uint tile, uint side, uint width) {
    uint tiles = (width + side - 1u) / side;
    return side * in_rows(tile, tiles);
}
