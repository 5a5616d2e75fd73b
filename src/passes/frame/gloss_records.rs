//! Broad Phong lobes at records: the light that they reflect towards the camera (after Krivanek's
//! radiance caching). Pixels take it from records by their splat weights, and trace no rays. In:
//! merged rays, radiance of gather targets. Out: lobes (W/m²/sr per unit of specular albedo).

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::frame::antialias::{EdgeCapacity, SeenFragments};
use crate::passes::frame::gather::Gather;
use crate::passes::frame::gloss::LITTLE;
use crate::passes::frame::splat::Splat;
use crate::passes::has_textures;
use crate::scene::Material;
use glam::{Mat3, Vec2, Vec3, Vec4, Vec4Swizzles};
use std::f64::consts::PI;
use std::sync::Arc;

gpu_struct! {
    /// A broad lobe at a record.
    pub struct GlossRecord {
        /// Per unit of specular albedo, W/m²/sr.
        pub radiance: Vec3,
        /// Unit mirror direction of the camera.
        pub mirror: Vec3,
        /// Column c: gradient of channel c as the mirror direction turns.
        pub change: Mat3,
        pub unused: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_read`.
    pub struct GlossReadPush {
        /// Capacity for samples of edge pixels.
        pub edge_capacity: EdgeCapacity,
        /// Size of the image, pixels.
        pub width: u32,
        pub height: u32,
        /// Capacity of the list of splat weights.
        pub weight_capacity: u32,
        /// Exponents of broad lobes ([`BroadLobes::packed`]).
        pub broad_exponents: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_records`.
    pub struct GlossRecordsPush {
        /// The camera, metres.
        pub eye: Vec3,
        /// First cache point of the bound buffer of the merged rays.
        pub first_point: u32,
        pub end_point: u32,
        /// Records of all buffers.
        pub record_count: u32,
        /// Width of the gather target field in a `MergedRay`.
        pub target_bits: u32,
        /// Rays of a hemisphere.
        pub rays: f32,
        pub exponent_count: u32,
        /// Exponents of the lobes, ascending.
        pub first_exponents: Vec2,
        pub other_exponents: Vec2,
    }
}

gpu_struct! {
    /// Push constants of `gloss_broad`.
    pub struct GlossBroadPush {
        /// Capacity for samples of edge pixels.
        pub edge_capacity: EdgeCapacity,
        /// Size of the image, pixels.
        pub width: u32,
        pub height: u32,
        /// The camera, metres.
        pub eye: Vec3,
        /// Capacity of the list of splat weights.
        pub weight_capacity: u32,
        pub record_count: u32,
        /// Exponents of broad lobes ([`BroadLobes::packed`]).
        pub broad_exponents: u32,
        pub exponent_count: u32,
        /// Exponents of the lobes at records, ascending.
        pub first_exponents: Vec2,
        pub other_exponents: Vec2,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] =
    &[GlossRecord::LAYOUT, GlossReadPush::LAYOUT, GlossRecordsPush::LAYOUT, GlossBroadPush::LAYOUT];

/// Rays of a hemisphere for each unit of the exponent. A lobe of exponent n holds 2/(n+2) of a
/// hemisphere's rays: at this limit four.
const RAYS_OF_EXPONENT: u32 = 2;

/// The same for strong lobes on a small part of the surfaces: as many rays as a pixel would trace.
/// Rays from pixels are more exact there, and few pixels have them.
const RAYS_OF_STRONG_EXPONENT: u32 = 16;

/// Fraction of the scene's area up to which a part is small.
const SMALL_PART: f64 = 1.0 / 3.0;

/// Exponents up to which lobes take their light from records.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BroadLobes {
    /// Of lobes with little of the reflected light.
    pub little: u32,
    /// Of stronger lobes.
    pub strong: u32,
}

impl BroadLobes {
    /// The lobes among these materials in which enough of a cache point's gather rays lie;
    /// `parts` are the materials' fractions of the scene's area.
    pub fn new(materials: &[Material], parts: &[f64], rays: u32) -> Self {
        let is_strong = |material: &&Material| material.specular != Vec3::ZERO && !has_little(material);
        let of_strong = materials.iter().zip(parts).filter(|(material, _)| is_strong(material));
        let is_small = of_strong.map(|(_, part)| part).sum::<f64>() <= SMALL_PART;
        let rays_of_strong = if is_small { RAYS_OF_STRONG_EXPONENT } else { RAYS_OF_EXPONENT };
        Self { little: rays / RAYS_OF_EXPONENT, strong: rays / rays_of_strong }
    }

    /// Whether records bring the lobe's light to pixels.
    pub fn hold(self, material: &Material) -> bool {
        let most = if has_little(material) { self.little } else { self.strong };
        material.specular != Vec3::ZERO && material.exponent <= most as f32
    }

    /// For kernels: `little` in bits 0-15, `strong` in bits 16-31.
    pub fn packed(self) -> u32 {
        self.little.min(0xffff) | self.strong.min(0xffff) << 16
    }
}

/// Whether the lobe has little of the reflected light, in the rounding of the kernels.
fn has_little(material: &Material) -> bool {
    material.specular.cmple(LITTLE * (material.diffuse + material.specular)).all()
}

/// Exponents of the lobes that records have. Pixels interpolate between them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LobeExponents {
    /// The first [`Self::count`] ascend.
    pub values: Vec4,
    /// Number of exponents, 4 at most.
    pub count: u32,
    /// The lobes of which they are.
    pub broad: BroadLobes,
}

impl LobeExponents {
    /// The exponents of the broad lobes among these materials. Up to four are exact.
    pub fn new(materials: &[Material], broad: BroadLobes) -> Self {
        let lobes = materials.iter().filter(|material| broad.hold(material));
        let mut exponents: Vec<f32> = lobes.map(|material| material.exponent).collect();
        exponents.sort_unstable_by(f32::total_cmp);
        exponents.dedup();
        let count = exponents.len().min(4);
        let (Some(&low), Some(&high)) = (exponents.first(), exponents.last()) else {
            return Self { broad, ..Self::default() };
        };
        let between = |place: usize| match place {
            0 => low,
            3 => high,
            _ => low * (high / low).powf(place as f32 / 3.0),
        };
        let value = |place: usize| match exponents.len() {
            5.. => between(place),
            _ => exponents[place.min(count - 1)],
        };
        Self { values: Vec4::from_array([0, 1, 2, 3].map(value)), count: count as u32, broad }
    }
}

/// Cells of the table of an exponent's albedos (`glsl/gloss_records.comp`).
const ALBEDO_CELLS: usize = 32;

/// Directions of a lobe over which its albedo is a mean.
const ALBEDO_SAMPLES: u32 = 512;

/// Albedos of four lobes by the cosine of the mirror direction, cell by cell.
fn albedos(exponents: LobeExponents) -> Vec<f32> {
    let cosines = (0..=ALBEDO_CELLS).map(|cell| cell as f64 / ALBEDO_CELLS as f64);
    let of =
        |exponent: f32| cosines.clone().map(move |cosine| lobe_albedo(f64::from(exponent), cosine) as f32);
    exponents.values.to_array().into_iter().flat_map(of).collect()
}

/// Albedo of the Phong lobe (n+2)/(2π)·cosⁿα of unit specular albedo, for light whose mirror
/// direction has that cosine: the lobe's part above the surface, times cosθ. The azimuth is
/// integrated exactly; the mean is over cosα, of density (n+1)/(2π)·cosⁿα. [Lafortune 1994]
pub fn lobe_albedo(exponent: f64, cosine: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let above = |sample: u32| {
        let height = ((f64::from(sample) + 0.5) / f64::from(ALBEDO_SAMPLES)).powf(1.0 / (exponent + 1.0));
        // cosθ = along + across·cosφ at azimuth φ.
        let (along, across) = (cosine * height, sine * (1.0 - height * height).sqrt());
        if along >= across {
            return along;
        }
        let end = (-along / across).acos();
        (along * end + across * end.sin()) / PI
    };
    let mean = (0..ALBEDO_SAMPLES).map(above).sum::<f64>() / f64::from(ALBEDO_SAMPLES);
    (exponent + 2.0) / (exponent + 1.0) * mean
}

/// Lobes at records as pixels read them.
#[derive(Clone, Copy)]
pub struct RecordLobes<'a> {
    /// The lobes that records have.
    pub lobes: &'a GlossRecords,
    /// The records of each pixel and edge point, with their weights.
    pub splat: &'a Splat,
    /// The camera, metres.
    pub eye: Vec3,
}

impl RecordLobes<'_> {
    /// Whether some material has a broad lobe.
    pub fn are_read(&self) -> bool {
        self.lobes.exponents.count > 0
    }

    /// Adds the light of broad lobes to the radiance of glossy pixels, given how many there are,
    /// and which. Records into an open pass.
    pub(super) fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        seen: SeenFragments<'_>,
        [gloss_offsets, gloss_pixels, gloss_radiance]: [&Buffer; 3],
    ) {
        let GlossRecords { gloss, records, record_count, exponents, .. } = self.lobes;
        let ([weight_ranges, weights], [_, weight_capacity]) = (self.splat.lists(), self.splat.capacity());
        let ([width, height], SeenFragments { antialias, .. }) = (seen.size(), seen);
        pass.dispatch(
            gloss,
            [width * height, 1, 1],
            &GlossBroadPush {
                edge_capacity: antialias.capacity,
                width,
                height,
                eye: self.eye,
                weight_capacity,
                record_count: *record_count,
                broad_exponents: exponents.broad.packed(),
                exponent_count: exponents.count,
                first_exponents: exponents.values.xy(),
                other_exponents: exponents.values.zw(),
            },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", seen.pixels),
                ("EdgeNumbers", &antialias.numbers),
                ("FragmentFirsts", &antialias.fragments.firsts),
                ("Fragments", &antialias.fragments.list),
                ("FragmentSurfaces", &antialias.fragments.surfaces),
                ("GlossOffsets", gloss_offsets),
                ("GlossPixels", gloss_pixels),
                ("WeightRanges", weight_ranges),
                ("EdgeWeightRanges", self.splat.edge_ranges()),
                ("Weights", weights),
                ("GlossRecords", records),
                ("GlossRadiance", gloss_radiance),
            ],
        );
    }
}

/// The pipelines and the lobes.
pub struct GlossRecords {
    mark: Pipeline,
    pipeline: Pipeline,
    gloss: Pipeline,
    /// One for each record that pixels with a broad lobe read.
    is_read: Buffer,
    /// Albedos of the exponents' lobes, [`ALBEDO_CELLS`] + 1 of each.
    albedos: Buffer,
    /// `GlossRecord`s, exponent by exponent.
    pub records: Buffer,
    record_count: u32,
    exponents: LobeExponents,
    albedo_table: Vec<f32>,
}

impl GlossRecords {
    /// Timing name of the lobes at records.
    pub const STEM: &str = "gloss_records";

    /// Allocates lobes for the records of `gather`.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, gather: &Gather, exponents: LobeExponents) -> Result<Self> {
        let record_count = gather.point_count();
        let has_lobes = gather.merged_rays.has_directions;
        let count = if has_lobes { u64::from(record_count.max(1)) } else { 1 };
        Ok(Self {
            mark: Pipeline::new(context, "gloss_read", &[])?,
            pipeline: Pipeline::new(context, Self::STEM, &[has_textures(gather.merged_rays.has_colours)])?,
            gloss: Pipeline::new(context, "gloss_broad", &[])?,
            is_read: Buffer::storage(context, GrowsWith::GatherRays.named("records of lobes"), 4 * count)?,
            albedos: Buffer::storage(
                context,
                GrowsWith::GatherRays.named("lobe albedos"),
                4 * 4 * (ALBEDO_CELLS as u64 + 1),
            )?,
            records: Buffer::storage(
                context,
                GrowsWith::GatherRays.named("lobes at records"),
                4 * count * size_of::<GlossRecord>() as u64,
            )?,
            record_count,
            exponents,
            albedo_table: albedos(exponents),
        })
    }

    /// The exponents of the lobes.
    pub fn exponents(&self) -> LobeExponents {
        self.exponents
    }

    /// Takes over the exponents of edited materials.
    pub fn edited(&mut self, exponents: LobeExponents) {
        if self.exponents != exponents {
            (self.exponents, self.albedo_table) = (exponents, albedos(exponents));
        }
    }

    /// Marks the records that pixels read, and computes the lobes there, as seen from `eye`. Some
    /// material has a broad lobe.
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        (seen, splat): (SeenFragments<'_>, &Splat),
        gather: &Gather,
        eye: Vec3,
    ) {
        let LobeExponents { values, count, broad } = self.exponents;
        rec.upload(&self.albedos, &self.albedo_table);
        let mut pass = rec.pass(Self::STEM);
        pass.fill_zero(&self.is_read);
        pass.barrier(TRANSFER_TO_COMPUTE);
        let ([weight_ranges, weights], [pixel_count, weight_capacity]) = (splat.lists(), splat.capacity());
        let ([width, height], SeenFragments { pixels, antialias }) = (seen.size(), seen);
        pass.dispatch(
            &self.mark,
            [pixel_count, 1, 1],
            &GlossReadPush {
                edge_capacity: antialias.capacity,
                width,
                height,
                weight_capacity,
                broad_exponents: broad.packed(),
            },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("EdgeNumbers", &antialias.numbers),
                ("FragmentFirsts", &antialias.fragments.firsts),
                ("Fragments", &antialias.fragments.list),
                ("FragmentSurfaces", &antialias.fragments.surfaces),
                ("WeightRanges", weight_ranges),
                ("EdgeWeightRanges", splat.edge_ranges()),
                ("Weights", weights),
                ("IsRead", &self.is_read),
            ],
        );
        let [radiances, lobe_radiances] = gather.radiances();
        for rays in &gather.merged_rays.chunks {
            // The dispatches write disjoint records, but the hazard check works by buffer.
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.pipeline,
                [rays.points.len() as u32 * count, 1, 1],
                &GlossRecordsPush {
                    eye,
                    first_point: rays.points.start,
                    end_point: rays.points.end,
                    record_count: self.record_count,
                    target_bits: gather.merged_rays.target_bits,
                    rays: gather.hemisphere.rays() as f32,
                    exponent_count: count,
                    first_exponents: values.xy(),
                    other_exponents: values.zw(),
                },
                &[
                    ("CachePoints", &gather.cache_points),
                    ("MergedRayOffsets", &rays.merged_ray_offsets),
                    ("MergedRays", &rays.merged_rays),
                    ("MergedRayDirections", &rays.directions),
                    ("MergedRayColours", &rays.colours),
                    ("Radiances", radiances),
                    ("LobeRadiances", lobe_radiances),
                    ("IsRead", &self.is_read),
                    ("LobeAlbedos", &self.albedos),
                    ("GlossRecords", &self.records),
                ],
            );
        }
    }
}
