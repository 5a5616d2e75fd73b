// Position in a one-dimensional dispatch. The host swizzles its workgroups as suits the device
// (src/gpu/tuning.rs); the last ones may have nothing to do: compare with a count from the push
// block. A shader of one-dimensional work asks here and never reads gl_GlobalInvocationID.

// Strips of workgroups along x go to the layers along z in turn, and then to the next row.
uint flat_workgroup() { return gl_WorkGroupID.x + gl_NumWorkGroups.x * (gl_WorkGroupID.z + gl_NumWorkGroups.z * gl_WorkGroupID.y); }

// A macro, so that it expands where the local size is known: in a function compiled ahead of the
// shader's `layout(local_size_x = …)`, gl_WorkGroupSize is silently 1.
#define flat_invocation() (flat_workgroup() * gl_WorkGroupSize.x + gl_LocalInvocationIndex)

// Column and row of a place below 2³¹, in rows of `width` places. Processors divide integers lane
// by lane, floats all at once. A quotient of floats, divisions off by 2.5 units as Vulkan allows,
// is off by a row and 2⁻²¹ of all at most, which the columns that are left over tell.
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

// Where workgroups take square tiles of an image so many points wide, row by row: the invocation's
// place in its tile.
uvec2 place_in_tile(uint side) { return uvec2(gl_LocalInvocationIndex % side, gl_LocalInvocationIndex / side); }

// Where edge pixels are listed tile by tile of 8×8, row by row, and within along a Morton curve, so
// that neighbours in the list are neighbours in the image: the place of a pixel of an image so many
// pixels wide, and the pixel of a place, which may lie outside of it.
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

// The first point of the tile of that number.
uvec2 corner_of_tile(uint tile, uint side, uint width) {
    uint tiles = (width + side - 1u) / side;
    return side * in_rows(tile, tiles);
}
