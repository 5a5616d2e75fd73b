// A scene list may be longer than one binding. The bound list then has one item, whose first
// words are the address of the real list; USE_BUFFER_DEVICE_ADDRESS selects that kernel.
// Include after types.glsl.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

// Nodes, triangles and surfaces are bound as texels of four words: one load each. A struct member
// in storage is one load a word, which a CPU does lane by lane.
const uint NODE_TEXELS = 5u;
const uint TRIANGLE_TEXELS = 3u;
const uint SURFACE_TEXELS = 4u;

layout(constant_id = 15) const uint USE_BUFFER_DEVICE_ADDRESS = 0;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer NodeList { Node items[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer TriangleList { Triangle items[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer SurfaceList { Surface items[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer WordList { uint items[]; };
