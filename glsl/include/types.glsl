// Structs shared by passes; they mirror src/types.rs, and tests/interface.rs compares
// both. Scalar layout.

// One triangle for traversal, in BVH leaf order. World space, metres. Three texels; the bits of `w`
// locate its opacity micromap: first word, counted from the start of the list of triangles (0: it
// has none); level; unused.
struct Triangle {
    vec4 p0;
    vec4 p1;
    vec4 p2;
};

// Attributes of that triangle besides its corners.
struct Surface {
    vec3 normal;    // unit geometric normal of the front side
    uint material;  // index into the material table
    uint sides;     // see SIDE_* below
    vec3 n0;        // unit shading normals at the corners
    vec3 n1;
    vec3 n2;
    uvec2 unused;   // to whole texels
};

// Surface.sides: bits 0-5 cluster code of the front, 6-11 of the back, 12 front takes part in
// transport, 13 back does, 14 ROUNDED.
uint side_code(uint sides, bool back) { return (sides >> (back ? 6u : 0u)) & 63u; }
const uint ROUNDED = 0x4000u;  // the shading normals describe a smooth surface around the facet
bool side_is_active(uint sides, bool back) { return (sides & (back ? 0x2000u : 0x1000u)) != 0u; }

// A line at which a shadow may end: an edge of one or two triangles.
struct SilhouetteEdge {
    vec3 from;
    vec3 to;
    vec3 first;   // the corner of one triangle that is not on the edge
    vec3 second;  // that of the other; the same if shadows end at this edge for every light
};

// An edge of the mesh at which a pixel may show two surfaces.
struct MeshEdge {
    uint own;    // a triangle of which it is a side: 4·triangle + the number of the corner opposite
    uint other;  // likewise the other triangle, if the edge counts only where it is an outline; else EVERY_VIEW
};

const uint EVERY_VIEW = 0xffffffffu;

// Node of the eight-wide compressed BVH, 80 bytes. [Ylitie §3] Five times four words: a CPU loads
// four words in about the time of one.
struct Node {
    uvec4 frame;     // low corner of the node's box, bits of floats; bytes: exponents of the cell size along x, y, z, mask of inner children
    uvec4 children;  // first inner child; first triangle of the leaf children; a byte a child
    uvec4 x_planes;  // low ones, a byte a child; high ones
    uvec4 y_planes;
    uvec4 z_planes;
};

// Finest cells of the volumetric hierarchy.
struct Grid {
    vec3 low;            // low corner of the cell that the octree names the first, metres
    float inverse_cell;  // 1 / size of a finest cell, 1/m
    uvec3 cells;         // finest cells along each axis
    float pull;          // how far a point is pulled inside its surface before it is binned, metres
};

// Ball around a region of small cells.
struct Guide {
    vec3 centre;   // metres
    float radius;  // metres
    float weight;  // area of an entry point in it, over that in the region with the smallest cells
};

// A point of a precomputed light path.
struct PathVertex {
    vec3 position;
    uint side;      // 2·triangle + (1 if the back side)
    vec3 incoming;  // unit direction of travel when it arrived; zero at an entry point
    float weight;   // cosθ/(π·pdf) over the survival probability of the step that led here; at an entry point, its area over the mean
    uint cluster;   // base cluster that it contributes to
    float lobe;     // 1 - cosα of the step that led here, α off the mirror direction at the vertex before; zero where that is not glossy
};

// Contribution of a path vertex to its cluster; listed cluster by cluster.
struct Contribution {
    vec3 throughput;  // fraction of the path's flux that arrives at this vertex, per channel
    uint what;        // bits 0-23: path; 24-31: ambient accessibility of the vertex, in 255ths
};

// CSR range of the contributions of a base cluster.
struct ContributionRange {
    uint first;        // first contribution of an entry point
    uint first_other;  // first contribution of another vertex
    uint end;
    uint is_unweighted;     // 1: accessibility does not weight the contributions
};

uint path_of(Contribution contribution) { return contribution.what & 0xffffffu; }

// Weight of a contribution's throughput in its cluster.
float contribution_weight(Contribution contribution, bool is_unweighted) { return is_unweighted ? 1.0 : float(contribution.what >> 24) / 255.0; }

// A point where indirect irradiance is gathered; its record is splatted to pixels.
struct CachePoint {
    vec3 position;
    float radius;   // validity radius, metres
    vec3 normal;    // unit shading normal
    uint side;      // 2·triangle + (1 if the back side)
    vec3 occluder;      // nearest occluder plane dot(x - position, occluder) = 1, of a standing wall or a covering surface; zero: none
    vec3 facet;     // unit geometric normal on its side
    float inverse_reach;  // 1/m; the length is half of the clearance, beyond which the record counts less
    uint stream;    // random stream index of its gather rays
};

// Links of a cluster in the hierarchy.
struct ClusterLink {
    uint parent;         // cluster one level up; NO_CLUSTER at the root
    float entry_points;  // expected number on its surface
};

// A final gather ray as frames read it.
struct GatherRay {
    uint target;    // number of what it reads | (2·material + (1 if far away)) << cluster_bits; NO_TARGET where the ray left the scene
    uint gradient;  // two halves: its weight in the translational gradient along tangent and bitangent, 1/min_distance
};

// Irradiance at a cache point and its first-order change, one column for each channel of RGB: world
// axes, W/m² and W/m³.
struct Record {
    vec3 position;     // of the cache point: where the extrapolation starts
    vec3 irradiance;
    mat3 translation;  // column c: gradient of channel c under movement
    mat3 rotation;     // column c: its dot product with a shading normal is the change of channel c under rotation
};

// The surface at a primary ray.
struct PixelSurface {
    vec3 position;
    uint side;       // 2·triangle + (1 if the back side); NO_SIDE where the ray left the scene
    vec3 normal;     // unit shading normal on the visible side
    float footprint; // area of the pixel at that depth, facing the camera, m²
};

// A pinhole camera: the ray of image point (x, y) in [-1, 1]² has direction forward + x·right -
// y·up.
struct View {
    vec3 position;     // metres
    float pixel_area;  // area of a pixel on the image plane at distance 1
    vec3 right;        // half the image plane's width
    uint width;        // pixels
    vec3 up;           // half the image plane's height
    uint height;
    vec3 forward;      // unit
};

// Reflectance of a material. Linear Rec.709.
struct Reflectance {
    vec3 diffuse;
    float exponent;
    vec3 specular;
    uint flags;      // EDITABLE, MAY_BE_GLOSSY
};

const uint EDITABLE = 1u;   // its paths are cosine sampled, whatever its reflectance
const uint MAY_BE_GLOSSY = 2u;  // it has a Phong lobe, or may get one

// Location of a material's image.
struct Texture {
    uint first;       // its upper left texel
    uint width;       // texels; 0: the material has no image
    uint height;
    uint is_clamped;  // 1: clamped to the outermost texels; 0: repeated
};

// A light of any kind; fields that its kind does not use are zero.
struct LightSource {
    vec3 position;      // point, spot: where it is; area: its corner
    uint kind;          // LIGHT_*
    vec3 axis;          // spot: unit axis; area: unit normal of the emitting side; directional: unit direction of travel
    float area;         // area: m²; spot: first word of its measured intensities, 0 if it has none
    vec3 emission;      // point, spot: W/sr; area: W/m²/sr; directional: W/m² on a facing surface
    float inner_angle;  // spot: half-angles up to which the intensity is full, and from which on it is zero
    vec3 edge_u;        // area: edges from the corner
    float outer_angle;
    vec3 edge_v;
    uint samples;       // area: its point samples in the light-path method; 1 for other kinds
    uint stride;        // area: step and modulus of the samples' lattice
    uint modulus;
    float relative;     // emission of this part over that of its light; 1 for a light of one part
    uint shape;         // area: SHAPE_*; and 1 + its channel << CHANNEL_SHIFT if it has one colour
};

const uint CHANNEL_SHIFT = 8u;
const uint SHAPE_TRIANGLE = 1u;   // area: half of the parallelogram, between the corner and the ends of both edges
const uint SHAPE_TWO_SIDED = 2u;  // area: both sides emit
const uint SHAPE_SURFACE = 4u;    // area: it is surface of the model

// Flags of a dispatch for one part of a light.
const uint TRACES_ALL = 1u;  // rays are traced although they cannot bring light
const uint ADDS = 2u;        // the result is added to that of the light's earlier parts
const uint IS_SKY = 4u;      // the light is the sky, as a whole
const uint MARKS_PENUMBRA = 8u;  // pixels that see only a part of the light are marked
const uint HAS_SILHOUETTES = 16u;  // the light has a map of silhouettes

const uint LIGHT_POINT = 0u;
const uint LIGHT_SPOT = 1u;
const uint LIGHT_AREA = 2u;
const uint LIGHT_DIRECTIONAL = 3u;
const uint LIGHT_GROUP = 4u;  // several parts, for path and photon tracing: see src/types.rs
const uint LIGHT_SKY = 5u;    // a part of the sky: see src/types.rs

// The sky as the image shows it.
struct Background {
    vec3 tint;    // factor of its texels
    uint width;   // of the image, texels; 0: no sky
    vec3 turn;    // rotation about +Y of each channel, radians
    uint height;
};

const uint NO_TARGET = 0xffffffffu;
const uint NO_SIDE = 0xffffffffu;
const uint NO_CLUSTER = 0xffffffffu;
