//! Near-light correction: a light closer to a surface than the spacing of entry points illuminates
//! an area between them, which they sample poorly or not at all. Rays from the light sample it
//! instead, and the entry points around share the result. In: entry points, a point or spot light.
//! Out: corrected form factors.

use crate::cpu::lights::{Intensities, lattice_point, sample_light};
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, HostBlock, MAX_LOOP_ITERATIONS, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::types::{CHANNEL_SHIFT, LIGHT_POINT, LIGHT_SPOT, LightSource, PathVertex, Surface};
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

gpu_struct! {
    /// A ray from the light.
    pub struct NearRay {
        /// Unit direction away from the light.
        pub direction: Vec3,
        /// Flux of the ray per unit of the light's intensity, sr.
        pub flux: f32,
    }
}

gpu_struct! {
    /// The hit of such a ray.
    pub struct NearHit {
        /// Hit on a diffuse surface, metres.
        pub position: Vec3,
        /// Distance from the light, metres.
        pub distance: f32,
        /// Unit geometric normal of the side that was hit.
        pub normal: Vec3,
        /// Height above and below the hit within which points count as its surface, metres.
        pub clearance: f32,
        /// Flux of the ray, sr; zero if entry points determine the light there.
        pub flux: f32,
        /// Sum of the weights of all entry points that share the hit's light, m².
        pub sum: f32,
    }
}

gpu_struct! {
    /// An entry point near the light.
    pub struct NearPoint {
        /// Position on the surface, metres.
        pub position: Vec3,
        /// Area that the entry point stands for.
        pub area_m2: f32,
        /// Unit geometric normal.
        pub normal: Vec3,
        /// Index of the entry point.
        pub index: u32,
    }
}

gpu_struct! {
    /// Bits of positive floats, which order as integers do.
    pub struct NearState {
        /// Distance of the nearest hit, metres.
        pub nearest: u32,
        /// Height from which an entry point must see the light, metres.
        pub height: u32,
    }
}

gpu_struct! {
    pub struct NearLightsPush {
        /// Position of the light, metres.
        pub light_position: Vec3,
        /// Mean spacing of all entry points, metres.
        pub mean_spacing: f32,
        /// Spacing of entry points beside the light, metres.
        pub spacing: f32,
        /// Mean area of an entry point.
        pub area_m2: f32,
        /// Rays from the light.
        pub ray_count: u32,
        /// Entry points near the light.
        pub point_count: u32,
        /// First point of the list of this dispatch.
        pub first_point: u32,
        /// 1 + the channel of the light; 0: all.
        pub channel: u32,
        /// One past its last point.
        pub end_point: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] =
    &[NearRay::LAYOUT, NearHit::LAYOUT, NearPoint::LAYOUT, NearState::LAYOUT, NearLightsPush::LAYOUT];

// As in `glsl/include/near_lights.glsl`, which explains them.

/// Distance of a light from the nearest surface, in mean spacings of entry points, above which the
/// correction does not apply.
const CLOSE: f32 = 4.0;
/// Distance from the light, in mean spacings, beyond which entry points determine the light.
const REACH: f32 = 8.0;
/// Distance, in local spacings, within which entry points share the light of a hit.
const SHARED: f32 = 16.0;
/// Height, in local spacings, from which an entry point must see the light.
const OVER: f32 = 2.0;

/// Rays from a light.
const RAYS: u32 = 1024;
/// Entry points that one invocation goes through.
const POINTS_AT_A_TIME: u32 = 1 << 15;
const _: () = assert!(POINTS_AT_A_TIME < MAX_LOOP_ITERATIONS);

/// The entry points, sorted by position, and the buffers for one light at a time.
pub struct NearLights {
    context: Arc<Context>,
    hits_pipeline: Pipeline,
    points_pipeline: Pipeline,
    sums_pipeline: Pipeline,
    pipeline: Pipeline,
    /// 1 for each material whose light beams handle.
    glossy_materials: Buffer,
    rays: Buffer,
    hits: Buffer,
    near_points: Buffer,
    seen_points: Buffer,
    /// Sorted along the rows of a grid.
    points: Vec<NearPoint>,
    /// Key of each occupied cell, and its first point; the end last.
    cells: Vec<(u64, u32)>,
    low: Vec3,
    spacing: f32,
    area_m2: f32,
}

/// The inputs of one light's correction.
#[derive(Clone, Debug)]
pub struct NearInputs {
    /// Position of the light, metres.
    pub light_position: Vec3,
    /// 1 + the channel of the light; 0: all.
    pub channel: u32,
    /// Spacing of entry points beside the light, metres.
    pub spacing: f32,
    /// Rays from the light.
    pub rays: Vec<NearRay>,
    /// Entry points that the correction may change.
    pub points: Vec<NearPoint>,
}

impl NearLights {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "near_lights";

    /// Sorts the entry points, with a mean area of `area_m2`, by position. It omits those on
    /// materials that may be glossy: beams handle these.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        entry_points: &[PathVertex],
        surfaces: &[Surface],
        may_be_glossy: &[bool],
        area_m2: f32,
    ) -> Result<Self> {
        let pipeline = |stem| Pipeline::new(context, stem, &[]);
        let buffer =
            |name, bytes: usize| Buffer::storage(context, GrowsWith::EntryPoints.named(name), bytes as u64);
        let flags: Vec<u32> = may_be_glossy.iter().map(|&is_glossy| u32::from(is_glossy)).collect();
        let mut made = Self {
            context: context.clone(),
            hits_pipeline: pipeline("near_light_hits")?,
            points_pipeline: pipeline("near_light_points")?,
            sums_pipeline: pipeline("near_light_sums")?,
            pipeline: pipeline(Self::STEM)?,
            glossy_materials: Buffer::from_slice(context, "glossy materials", &flags)?,
            rays: buffer("near rays", RAYS as usize * size_of::<NearRay>())?,
            hits: buffer("near hits", RAYS as usize * size_of::<NearHit>())?,
            near_points: buffer("near points", 0)?,
            seen_points: buffer("seen near points", 0)?,
            points: Vec::new(),
            cells: Vec::new(),
            low: entry_points.iter().fold(Vec3::INFINITY, |low, point| low.min(point.position)),
            spacing: area_m2.sqrt(),
            area_m2,
        };
        let mut sorted: Vec<(u64, NearPoint)> = (0..)
            .zip(entry_points)
            .filter(|(_, point)| {
                let material = surfaces[point.side as usize / 2].material;
                point.weight > 0.0 && !may_be_glossy[material as usize]
            })
            .map(|(index, point)| {
                let normal = surfaces[point.side as usize / 2].normal_of(point.side % 2 == 1);
                let area_m2 = point.weight * area_m2;
                (made.cell(point.position), NearPoint { position: point.position, area_m2, normal, index })
            })
            .collect();
        sorted.sort_unstable_by_key(|(cell, point)| (*cell, point.index));
        for (place, (cell, point)) in (0..).zip(sorted) {
            if made.cells.last().is_none_or(|last| last.0 != cell) {
                made.cells.push((cell, place));
            }
            made.points.push(point);
        }
        made.cells.push((u64::MAX, made.points.len() as u32));
        Ok(made)
    }

    fn cell(&self, position: Vec3) -> u64 {
        let cell = (position - self.low) / (REACH * self.spacing);
        cell.to_array().into_iter().fold(0, |key, along| key << 21 | (along.clamp(0.0, 2_097_151.0) as u64))
    }

    /// The entry points within `reach` metres of a position.
    fn within(&self, position: Vec3, reach: f32) -> impl Iterator<Item = &NearPoint> {
        let step = REACH * self.spacing;
        let rows = (reach / step).ceil() as i32;
        let at = move |x: i32, y: i32, z: i32| position + step * Vec3::new(x as f32, y as f32, z as f32);
        let columns = (-rows..=rows).flat_map(move |x| (-rows..=rows).map(move |y| (x, y)));
        let mut spans: Vec<[u64; 2]> =
            columns.map(|(x, y)| [-rows, rows].map(|z| self.cell(at(x, y, z)))).collect();
        // Cells below the lowest corner have equal keys.
        spans.sort_unstable();
        spans.dedup();
        let points = spans.into_iter().flat_map(|[first, last]| {
            let [first, end] = [first, last + 1].map(|key| self.cells.partition_point(|cell| cell.0 < key));
            &self.points[self.cells[first].1 as usize..self.cells[end].1 as usize]
        });
        points.filter(move |point| point.position.distance(position) < reach)
    }

    /// Spacing of entry points beside a light, metres. `None` if no surface is near enough for a
    /// correction. Entry points are denser in cavities and corners.
    fn spacing_at(&self, light_position: Vec3) -> Option<f32> {
        // A surface closer than `CLOSE` spacings has an entry point within one and a half more.
        let beside = self.within(light_position, (CLOSE + 1.5) * self.spacing);
        let (count, area_m2) =
            beside.fold((0.0, 0.0), |(count, area), point| (count + 1.0, area + point.area_m2));
        (count > 0.0).then(|| (area_m2 / count).sqrt())
    }

    /// The inputs of a light's correction. `None` if the light is far from all surfaces, or neither
    /// a point nor a spot light. Traces no ray.
    pub fn inputs(&self, light: &LightSource, intensities: Intensities<'_>) -> Option<NearInputs> {
        let is_small = [LIGHT_POINT, LIGHT_SPOT].contains(&light.kind);
        let spacing = self.spacing_at(light.position).filter(|_| is_small)?;
        let reach = REACH * self.spacing + SHARED * spacing;
        Some(NearInputs {
            light_position: light.position,
            channel: light.shape >> CHANNEL_SHIFT,
            spacing,
            rays: rays(light, intensities),
            points: self.within(light.position, reach).copied().collect(),
        })
    }

    /// Allocates memory for corrections with these inputs.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn reserve(&mut self, inputs: &[NearInputs]) -> Result<()> {
        let count = inputs.iter().map(|inputs| inputs.points.len()).max().unwrap_or(0);
        if (size_of::<NearPoint>() * count) as u64 > self.near_points.bytes() {
            let buffer = |name, bytes| {
                Buffer::storage(&self.context, GrowsWith::EntryPoints.named(name), (count * bytes) as u64)
            };
            (self.near_points, self.seen_points) =
                (buffer("near points", size_of::<NearPoint>())?, buffer("seen near points", 4)?);
        }
        Ok(())
    }

    /// Corrects the form factors of a light; `state` holds a [`NearState`]. Records into an open
    /// pass, after [`Self::reserve`]. The caller records a barrier to transfers between lights.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        inputs: &NearInputs,
        (state, factors): (&Buffer, &Buffer),
    ) {
        let height = OVER * inputs.spacing;
        pass.upload(&self.rays, &inputs.rays);
        pass.upload(&self.near_points, &inputs.points);
        pass.upload(state, &[NearState { nearest: f32::INFINITY.to_bits(), height: height.to_bits() }]);
        pass.barrier(TRANSFER_TO_COMPUTE);
        let (ray_count, point_count) = (inputs.rays.len() as u32, inputs.points.len() as u32);
        let push = |points: std::ops::Range<u32>| NearLightsPush {
            light_position: inputs.light_position,
            mean_spacing: self.spacing,
            spacing: inputs.spacing,
            area_m2: self.area_m2,
            ray_count,
            point_count,
            first_point: points.start,
            channel: inputs.channel,
            end_point: points.end,
        };
        let all = push(0..point_count);
        let tracing =
            [("Nodes", &scene.nodes), ("Triangles", &scene.triangles), ("Surfaces", &scene.surfaces)];
        let [nodes, triangles, surfaces] = tracing;
        let truncated = ("TruncatedLoops", &scene.truncated_loops);
        let (points, state) = (("NearPoints", &self.near_points), ("NearStates", state));
        let (seen, hits) = (("SeenPoints", &self.seen_points), ("NearHits", &self.hits));
        let (materials, rays) = (("GlossyMaterials", &self.glossy_materials), ("NearRays", &self.rays));
        let bindings = [nodes, triangles, surfaces, materials, rays, hits, state, truncated];
        pass.dispatch(&self.hits_pipeline, [ray_count, 1, 1], &all, &bindings);
        pass.barrier(COMPUTE_TO_COMPUTE);
        let bindings = [nodes, triangles, surfaces, points, state, seen, truncated];
        pass.dispatch(&self.points_pipeline, [point_count, 1, 1], &all, &bindings);
        for first in (0..point_count).step_by(POINTS_AT_A_TIME as usize) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            let push = push(first..point_count.min(first + POINTS_AT_A_TIME));
            pass.dispatch(&self.sums_pipeline, [ray_count, 1, 1], &push, &[points, state, seen, hits]);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        let bindings = [points, state, seen, hits, ("FormFactors", factors)];
        pass.dispatch(&self.pipeline, [point_count, 1, 1], &all, &bindings);
    }

    /// Copies the distance of the nearest hit, bits of a float, to a word of a block.
    pub fn copy_nearest(&self, rec: &mut Recorder, state: &Buffer, block: &HostBlock, word: u32) {
        rec.copy_to_host(state, 0, block, word, 1);
    }

    /// Whether a light with this distance to the nearest hit is corrected.
    pub fn is_near(&self, nearest: f32) -> bool {
        nearest < CLOSE * self.spacing
    }
}

/// Rays from a point or spot light, evenly over its cone.
fn rays(light: &LightSource, intensities: Intensities<'_>) -> Vec<NearRay> {
    let unit = LightSource { emission: Vec3::ONE, ..*light };
    let (axis, least) = match light.kind {
        LIGHT_SPOT => (light.axis, light.outer_angle.cos()),
        _ => (Vec3::Y, -1.0),
    };
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    let turn = PI * (3.0 - 5.0_f32.sqrt());
    let rays = (0..RAYS).map(|ray| {
        let cosine = 1.0 - (1.0 - least) * (ray as f32 + 0.5) / RAYS as f32;
        let (sine, angle) = ((1.0 - cosine * cosine).max(0.0).sqrt(), turn * ray as f32);
        let direction = cosine * axis + sine * (angle.cos() * tangent + angle.sin() * bitangent);
        let place = (light.position + direction).as_dvec3();
        let sample = sample_light(&unit, intensities, place, lattice_point(light, 0));
        let intensity = sample.map_or(0.0, |sample| sample.irradiance.x);
        NearRay { direction, flux: intensity as f32 * TAU * (1.0 - least) / RAYS as f32 }
    });
    rays.filter(|ray| ray.flux > 0.0).collect()
}
