//! Structures that passes exchange; `glsl/include/types.glsl` mirrors them. World space in
//! metres, linear Rec.709.

use crate::layout::{GpuStruct, Layout, gpu_struct};
use bytemuck::Zeroable;
use glam::{Mat3, UVec2, UVec3, UVec4, Vec3, Vec4};

/// Marks a gather ray that left the scene.
pub const NO_TARGET: u32 = u32::MAX;
/// Marks a ray that hit nothing.
pub const NO_SIDE: u32 = u32::MAX;
/// Marks a point that no cluster holds, and the parent of a root cluster.
pub const NO_CLUSTER: u32 = u32::MAX;

/// Flag of a count: the device truncated the loops that counted.
pub const LOOP_TRUNCATED: u32 = 1 << 31;

gpu_struct! {
    /// One triangle for traversal, in BVH leaf order. Three texels; the bits of `w` are the first
    /// word of its opacity micromap (0: it has none), the micromap's level, and unused.
    pub struct Triangle {
        pub p0: Vec4,
        pub p1: Vec4,
        pub p2: Vec4,
    }
}

gpu_struct! {
    /// Data of a triangle that a hit needs besides its corners.
    pub struct Surface {
        /// Unit geometric normal of the front side.
        pub normal: Vec3,
        /// Index into the material table.
        pub material: u32,
        /// Bits 0–5 cluster code of the front, 6–11 of the back, 12 front takes part in transport,
        /// 13 back does.
        pub sides: u32,
        /// Unit shading normal at the first corner.
        pub n0: Vec3,
        /// Unit shading normal at the second corner.
        pub n1: Vec3,
        /// Unit shading normal at the third corner.
        pub n2: Vec3,
        /// Four whole texels.
        pub unused: UVec2,
    }
}

gpu_struct! {
    /// A line at which a shadow may end: an edge of one or two triangles.
    pub struct SilhouetteEdge {
        pub from: Vec3,
        pub to: Vec3,
        /// The corner of one triangle that is not on the edge.
        pub first: Vec3,
        /// That of the other; the same if shadows end at this edge for every light.
        pub second: Vec3,
    }
}

/// An edge at which pixels of every view may show two surfaces, in place of its second triangle.
pub const EVERY_VIEW: u32 = u32::MAX;

gpu_struct! {
    /// An edge of the mesh at which a pixel may show two surfaces.
    pub struct MeshEdge {
        /// A triangle of which it is a side: 4·triangle + the number of the corner opposite.
        pub own: u32,
        /// The other triangle likewise; [`EVERY_VIEW`]: the edge is more than an outline.
        pub other: u32,
    }
}

gpu_struct! {
    /// Node of the eight-wide compressed BVH, 80 bytes. [Ylitie §3] It has five times four words: a
    /// processor loads four words about as fast as one.
    pub struct Node {
        /// Low corner of the node's box, bits of floats; then bytes: exponents of the cell size
        /// along x, y, z, and the mask of inner children.
        pub frame: UVec4,
        /// Index of the first inner child; index of the first triangle of the leaf children; a byte
        /// for each child with its kind.
        pub children: UVec4,
        /// Low x planes, a byte for each child, then high x planes.
        pub x_planes: UVec4,
        /// The y planes, in the same layout.
        pub y_planes: UVec4,
        /// The z planes, in the same layout.
        pub z_planes: UVec4,
    }
}

impl Node {
    /// Low corner of the box.
    pub fn origin(&self) -> Vec3 {
        Vec3::from_array(self.frame.truncate().to_array().map(f32::from_bits))
    }

    /// Inner children, which are contiguous: the first and their number.
    pub fn inner_children(&self) -> (u32, u32) {
        (self.children.x, (self.frame.w >> 24).count_ones())
    }
}

gpu_struct! {
    /// Finest cells of the volumetric hierarchy.
    pub struct Grid {
        /// Low corner of the cell that the octree names the first: near it, coordinates are exact.
        pub low: Vec3,
        /// 1 / size of a finest cell, 1/m.
        pub inverse_cell: f32,
        /// Finest cells along each axis.
        pub cells: UVec3,
        /// How far a point is pulled inside its surface before it is binned, metres.
        pub pull: f32,
    }
}

gpu_struct! {
    /// Ball around a region of small cells.
    pub struct Guide {
        /// Its middle, metres.
        pub centre: Vec3,
        /// Half of its diagonal, metres.
        pub radius: f32,
        /// Area of an entry point in it, over that in the region with the smallest cells.
        pub weight: f32,
    }
}

gpu_struct! {
    /// A point of a precomputed light path.
    pub struct PathVertex {
        /// Where the path meets the surface.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
        /// Unit direction of travel when it arrived; zero at an entry point.
        pub incoming: Vec3,
        /// cosθ/(π·pdf) over the survival probability of the step that led here; at an entry point,
        /// its area over the mean of all.
        pub weight: f32,
        /// Base cluster that it contributes to.
        pub cluster: u32,
        /// 1 − cosα of the step that led here. α is the angle between the step's direction and
        /// the mirror direction at the vertex before. Zero if that vertex is not glossy or is
        /// an entry point.
        pub lobe: f32,
    }
}

gpu_struct! {
    /// What a path vertex adds to its cluster; listed cluster by cluster.
    pub struct Contribution {
        /// Fraction of the path's flux that arrives at this vertex, per channel.
        pub throughput: Vec3,
        /// Bits 0–23: index of the path; 24–31: accessibility, the weight of the vertex for distant
        /// readers, in units of 1/[`OPEN`].
        pub what: u32,
    }
}

/// Accessibility of a path vertex that counts fully.
pub const OPEN: u32 = 255;
/// Bits of a contribution that name its path.
const PATH_BITS: u32 = 24;

impl Contribution {
    /// A contribution whose throughput is not yet computed.
    pub fn new(path: u32, accessibility: u32) -> Self {
        Self { throughput: Vec3::ZERO, what: path | accessibility << PATH_BITS }
    }

    /// Index of the path.
    pub fn path(&self) -> u32 {
        self.what & ((1 << PATH_BITS) - 1)
    }

    /// Weight of the vertex for distant readers, 0..=[`OPEN`].
    pub fn accessibility(&self) -> u32 {
        self.what >> PATH_BITS
    }
}

gpu_struct! {
    /// The contributions of a base cluster: a CSR range of the list.
    pub struct ContributionRange {
        /// First contribution of an entry point.
        pub first: u32,
        /// First contribution of another vertex.
        pub first_other: u32,
        /// Index after the last contribution.
        pub end: u32,
        /// 1: each contribution counts fully, whatever its accessibility.
        pub is_unweighted: u32,
    }
}

gpu_struct! {
    /// A point where indirect irradiance is gathered; its record is splatted to pixels.
    pub struct CachePoint {
        /// Position on the surface.
        pub position: Vec3,
        /// Validity radius, metres.
        pub radius: f32,
        /// Unit shading normal.
        pub normal: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
        /// The nearest occluder plane, `(x - position)·occluder = 1`, 1/m; zero if there is none.
        pub occluder: Vec3,
        /// Unit geometric normal on its side.
        pub facet: Vec3,
        /// 1/m; the length is half of the clearance, beyond which the record counts less.
        pub inverse_reach: f32,
        /// Random stream index of its gather rays.
        pub stream: u32,
    }
}

gpu_struct! {
    /// One final gather ray, as frames read it.
    pub struct GatherRay {
        /// `number | (2·material + is_far) << cluster_bits`; [`NO_TARGET`] where the ray left the
        /// scene. See [`Met`](crate::passes::gather_targets::Met).
        pub target: u32,
        /// Two half floats: the ray's weight in the translational gradient along tangent and
        /// bitangent, in units of 1/minimum distance.
        pub gradient: u32,
    }
}

/// Rays of a cache point that meet one gather target, a cluster with a material, in two words that
/// the device reads as one vector. In scenes with images, merged rays also have the same colour.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MergedRay {
    /// `gather target | (number of rays - 1) << target_bits`.
    pub target_index: u32,
    /// Sums of the rays' weights in both gradients along tangent and bitangent, two numbers with a
    /// common exponent. Bits 0–20 (eight, eight and five): the translational gradient, in 2⁻²⁶ of
    /// the unit of [`GatherRay::gradient`]. Bits 21–31 (four, four and three): the rotational
    /// gradient, tanθ across each azimuth, in `MergedRayPacking::rotation_unit`.
    pub change: u32,
}

/// log₂ of the unit of a merged ray's weight in the translational gradient.
pub const MOVEMENT_EXPONENT: i32 = -26;

gpu_struct! {
    /// Irradiance at a cache point and its first-order change, with a column for each channel of
    /// RGB: W/m² and W/m³.
    pub struct Record {
        /// Position of the cache point, where the extrapolation starts.
        pub position: Vec3,
        /// Indirect irradiance, W/m².
        pub irradiance: Vec3,
        /// Column c: gradient of channel c under movement, world axes.
        pub translation: Mat3,
        /// Column c: its dot product with a shading normal is the change of channel
        /// c under rotation.
        pub rotation: Mat3,
    }
}

gpu_struct! {
    /// The surface that a primary ray meets.
    pub struct PixelSurface {
        /// Point on the surface.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side); [`NO_SIDE`] where the ray left the scene.
        pub side: u32,
        /// Unit shading normal on the visible side.
        pub normal: Vec3,
        /// Area that the pixel covers at this depth, facing the camera, m².
        pub footprint: f32,
    }
}

gpu_struct! {
    /// A pinhole camera: the ray of image point (x, y) in [-1, 1]² has direction
    /// `forward + x·right - y·up`.
    pub struct View {
        /// Centre of projection.
        pub position: Vec3,
        /// Area of a pixel on the image plane at distance 1.
        pub pixel_area: f32,
        /// Half the image plane's width.
        pub right: Vec3,
        pub width: u32,
        /// Half the image plane's height.
        pub up: Vec3,
        pub height: u32,
        /// Unit viewing direction.
        pub forward: Vec3,
    }
}

gpu_struct! {
    /// Reflectance of a material.
    pub struct Reflectance {
        pub diffuse: Vec3,
        pub exponent: f32,
        pub specular: Vec3,
        /// [`EDITABLE`] and [`MAY_BE_GLOSSY`].
        pub flags: u32,
    }
}

/// Flag of an editable material: its paths are cosine sampled for any reflectance.
pub const EDITABLE: u32 = 1;
/// Flag of a material that has a Phong lobe or may get one. Light paths and clusters then store the
/// data for lobes.
pub const MAY_BE_GLOSSY: u32 = 2;

/// Bit of [`Surface::sides`]: the shading normals describe a smooth surface around the facet.
pub const ROUNDED: u32 = 0x4000;

/// Value of [`Texture::is_clamped`]: beyond a triangle its nearest colour continues.
pub const CLAMPED_TO_TRIANGLE: u32 = 2;

gpu_struct! {
    /// Location and size of a material's image.
    pub struct Texture {
        /// Index of the upper left texel.
        pub first: u32,
        /// Width in texels; 0: the material has no image.
        pub width: u32,
        pub height: u32,
        /// 1: the outermost texels continue beyond the edges; 0: the image repeats. Or
        /// [`CLAMPED_TO_TRIANGLE`] for vertex colours.
        pub is_clamped: u32,
    }
}

gpu_struct! {
    /// A light of any kind; fields that its kind does not use are zero.
    pub struct LightSource {
        /// Point and spot: position; area: corner.
        pub position: Vec3,
        /// One of the `LIGHT_*`.
        pub kind: u32,
        /// Spot: unit axis; area: unit normal of the emitting side; directional: unit
        /// direction of travel.
        pub axis: Vec3,
        /// Area light: area, m². Spot: first word of its measured intensities, 0 if it has none.
        pub area: f32,
        /// Point and spot: intensity, W/sr; area: radiance, W/m²/sr; directional: irradiance of a
        /// facing surface, W/m².
        pub emission: Vec3,
        /// Spot: half-angle up to which the intensity is full, radians.
        pub inner_angle: f32,
        /// Area: first edge from the corner.
        pub edge_u: Vec3,
        /// Spot: half-angle from which the intensity is zero, radians.
        pub outer_angle: f32,
        /// Area: second edge from the corner.
        pub edge_v: Vec3,
        /// Area: point samples that stand for it in form factors; 1 for other kinds.
        pub samples: u32,
        /// Area: step of the lattice that they form.
        pub stride: u32,
        /// Area: modulus of the lattice's steps: `samples`, or one more.
        pub modulus: u32,
        /// Emission of this part over the emission of its light; 1 for a light of one part.
        pub relative: f32,
        /// Area: [`SHAPE_TRIANGLE`], [`SHAPE_TWO_SIDED`], [`SHAPE_SURFACE`]. All kinds: the
        /// channel, shifted by [`CHANNEL_SHIFT`].
        pub shape: u32,
    }
}

/// Flag of a dispatch for a light: rays are traced although they cannot bring light.
pub const TRACES_ALL: u32 = 1;
/// Flag of a dispatch for a light: the result is added to that of the light's earlier parts.
pub const ADDS: u32 = 2;
/// Flag of a dispatch: pixels that see only a part of the light get a negative sign.
pub const MARKS_PENUMBRA: u32 = 8;
/// Flag of a dispatch for a light: the light has a map of silhouettes.
pub const HAS_SILHOUETTES: u32 = 16;
/// Flag of a dispatch for a light: the light is the sky, as a whole.
pub const IS_SKY: u32 = 4;

/// Area light: half of the parallelogram, between the corner and the ends of both edges.
pub const SHAPE_TRIANGLE: u32 = 1;
/// Area light: both sides emit.
pub const SHAPE_TWO_SIDED: u32 = 2;
/// Area light: it is surface of the model.
pub const SHAPE_SURFACE: u32 = 4;

/// Shift of the bits in `LightSource::shape` that hold 1 + the channel of a light of one colour; 0
/// for light of all colours. Panes let each channel pass by another fraction.
pub const CHANNEL_SHIFT: u32 = 8;

/// Isotropic point light.
pub const LIGHT_POINT: u32 = 0;
/// Point light limited to a cone.
pub const LIGHT_SPOT: u32 = 1;
/// Area light: a one-sided parallelogram.
pub const LIGHT_AREA: u32 = 2;
/// Directional light: parallel rays.
pub const LIGHT_DIRECTIONAL: u32 = 3;
/// Light of several parts, as path and photon tracing sample it: `stride` is the row of the first
/// part, `modulus` the number of parts. Each part stores the cumulative probability up to its own
/// end in `inner_angle`.
pub const LIGHT_GROUP: u32 = 4;
/// A part of the sky between two azimuths and two heights: `edge_u` holds the first azimuth, the
/// difference of azimuths and the first height, `area` the solid angle, `outer_angle` the
/// difference of heights.
pub const LIGHT_SKY: u32 = 5;

impl LightSource {
    /// An isotropic point light with this intensity, W/sr.
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self {
            position,
            emission: intensity,
            kind: LIGHT_POINT,
            samples: 1,
            modulus: 1,
            relative: 1.0,
            ..Zeroable::zeroed()
        }
    }
}

gpu_struct! {
    /// The sky as the image shows it.
    pub struct Background {
        /// Factor of its texels.
        pub tint: Vec3,
        /// Width of the image in texels; 0: no sky.
        pub width: u32,
        /// Rotation about +Y of each channel, radians.
        pub turn: Vec3,
        /// Height of the image.
        pub height: u32,
    }
}

/// Layouts of everything above.
pub const LAYOUTS: &[Layout] = &[
    Triangle::LAYOUT,
    Surface::LAYOUT,
    SilhouetteEdge::LAYOUT,
    MeshEdge::LAYOUT,
    Node::LAYOUT,
    Grid::LAYOUT,
    Guide::LAYOUT,
    PathVertex::LAYOUT,
    Contribution::LAYOUT,
    CachePoint::LAYOUT,
    GatherRay::LAYOUT,
    Record::LAYOUT,
    PixelSurface::LAYOUT,
    View::LAYOUT,
    Reflectance::LAYOUT,
    Texture::LAYOUT,
    LightSource::LAYOUT,
    Background::LAYOUT,
];
