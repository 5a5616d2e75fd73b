// The scene's lists may be longer than what the device binds. Then what is bound is a list with one
// item, whose first words are the address of the others; the host picks the kernel by what it
// binds. Include behind types.glsl.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

// Nodes, triangles and surfaces are bound as texels of four words: one load, where a member of a
// structure is a load a word, for which a processor goes from lane to lane.
const uint NODE_TEXELS = 5u;
const uint TRIANGLE_TEXELS = 3u;
const uint SURFACE_TEXELS = 4u;

layout(constant_id = 15) const uint USE_BUFFER_DEVICE_ADDRESS = 0;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer NodeList { Node items[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer TriangleList { Triangle items[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer SurfaceList { Surface items[]; };
