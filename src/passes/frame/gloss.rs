//! Surfaces that shine: their first reflection at entry points, and what clusters send towards the directions in which they are
//! read. [Yue §1, §2] Scenes without such surfaces have none of this.
//! In: lights, deposits. Out: reflected flux of paths (W), flux of slots (W).

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::passes::precompute::gloss::GlossTables;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// An entry point that may shine.
    pub struct GlossEntry {
        /// Where it is.
        pub position: Vec3,
        /// Its path.
        pub path: u32,
        /// Unit geometric normal of its side.
        pub normal: Vec3,
        /// Its area over the mean of all.
        pub weight: f32,
        /// Unit direction in which its path leaves; zero where that ends at once.
        pub departure: Vec3,
        /// Its material.
        pub material: u32,
        /// Packed colour of the image there; white where there is none.
        pub colour: u32,
    }
}

gpu_struct! {
    /// Light that arrives at such an entry point from one point sample of a light.
    pub struct GlossBeam {
        /// Unit direction in which a mirror would send it on.
        pub mirror: Vec3,
        /// Irradiance per unit of the light's emission: 1/m² of point and spot lights, sr of area lights, 1 of directional ones.
        pub factor: f32,
    }
}

gpu_struct! {
    /// A path vertex in a cluster that may shine.
    pub struct GlossVertex {
        /// Unit direction in which a mirror would send its light on; idle at entry points.
        pub mirror: Vec3,
        /// Its material.
        pub material: u32,
        /// At an entry point that may shine: its index; else [`NO_ENTRY`].
        pub entry: u32,
    }
}

gpu_struct! {
    /// One outgoing direction of one cluster.
    pub struct GlossSlot {
        /// The cluster.
        pub cluster: u32,
        /// The direction, unit: the mean of those from which it is read.
        pub direction: Vec3,
    }
}

gpu_struct! {
    /// What an invocation takes in one dispatch of the vertices below a cluster.
    pub struct GlossPart {
        /// Entry points: emission of the light, times the area that each of them stands for, in the mean.
        pub emission: Vec3,
        /// Entry points: beams of each.
        pub beam_count: u32,
        /// First vertex.
        pub first: u32,
        /// The vertex behind the last: bounds the work of an invocation.
        pub end: u32,
        /// 1: adds to what was found so far.
        pub adds: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_base`.
    pub struct GlossBasePush {
        /// What to take.
        pub part: GlossPart,
        /// Slots that are not sums of others: the first so many.
        pub slot_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_sum`.
    pub struct GlossSumPush {
        /// Of the light.
        pub emission: Vec3,
        /// Slots that are not sums of others, or samples of pixels.
        pub count: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_level`.
    pub struct GlossLevelPush {
        /// First slot of the level.
        pub first_slot: u32,
        /// Its slots.
        pub slot_count: u32,
        /// Slots that are not sums.
        pub leaf_count: u32,
    }
}

/// What these passes share with their shaders.
pub const LAYOUTS: &[Layout] = &[
    GlossEntry::LAYOUT,
    GlossBeam::LAYOUT,
    GlossVertex::LAYOUT,
    GlossSlot::LAYOUT,
    GlossPart::LAYOUT,
    GlossBasePush::LAYOUT,
    GlossSumPush::LAYOUT,
    GlossLevelPush::LAYOUT,
];

/// Turns of the loop over a cluster's vertices and their beams in one dispatch; a sample of a pixel asks four clusters.
const MOST_TURNS: u32 = 1 << 13;

/// Marks a vertex that is no entry point that may shine, and a base cluster without vertices that may.
pub const NO_ENTRY: u32 = u32::MAX;

/// A light, as far as surfaces that shine are concerned.
#[derive(Clone, Copy)]
pub struct GlossLight<'a> {
    /// In units that its kind has.
    pub emission: Vec3,
    /// Point samples, and so beams at each entry point that may shine.
    pub samples: u32,
    /// `GlossBeam`s, entry point by entry point.
    pub beams: &'a Buffer,
    /// What each slot that is no sum sends of it by the first reflection, per unit of its emission; three floats.
    pub slots: &'a Buffer,
    /// The same of what rays of shining pixels meet, for each sample.
    pub hits: &'a Buffer,
}

/// A dispatch over the vertices of clusters.
pub(super) struct Dispatch<'a> {
    /// Over entry points, or over other vertices.
    pub(super) entry_points: bool,
    pub(super) part: GlossPart,
    pub(super) beams: &'a Buffer,
}

/// The pipelines, the tables, and the light that they hold.
pub struct Gloss {
    pub(super) trace: Pipeline,
    pub(super) reflect: Pipeline,
    /// Over other vertices, and over entry points.
    base: [Pipeline; 2],
    sum: Pipeline,
    level: Pipeline,
    pub(super) entries: Buffer,
    pub(super) entry_count: u32,
    pub(super) area_m2: f32,
    /// `GlossVertex`s.
    pub vertices: Buffer,
    /// Added to the index of a deposit of each base cluster it gives that of its vertex; [`NO_ENTRY`] where nothing shines.
    pub shifts: Buffer,
    /// First base cluster below each cluster, and the end.
    pub base_ranges: Buffer,
    /// Vertices of a base cluster at most.
    most_vertices: u32,
    /// Slots that are no sums: the first so many.
    pub leaf_count: u32,
    /// Slots that are sums, by level.
    sums: Vec<Range<u32>>,
    first_children: Buffer,
    children: Buffer,
    /// `GlossSlot`s.
    pub slots: Buffer,
    /// Flux that arrives at each path's entry point, W; three floats. Where nothing shines, clusters have layers and nobody needs it.
    pub path_flux: Buffer,
    /// Flux that each path carries on from its entry point, albedo included where that may shine, W; three floats.
    pub reflected_flux: Buffer,
    /// Of each slot, W; three floats: over the cluster's area it adds to albedo times irradiance.
    pub fluxes: Buffer,
}

impl Gloss {
    /// What the outgoing directions of clusters are called in timings.
    pub const STEM: &str = "gloss_base";

    /// Uploads the tables; each of `path_count` entry points stands for `area_m2` in the mean.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        tables: &GlossTables,
        path_count: u32,
        area_m2: f32,
    ) -> Result<Self> {
        let base = |entry_points| Pipeline::new(context, Self::STEM, &[("ENTRY_POINTS", entry_points)]);
        Ok(Self {
            trace: Pipeline::new(context, Self::BEAMS_STEM, &[])?,
            reflect: Pipeline::new(context, Self::ENTRIES_STEM, &[scene.textures.constant()])?,
            base: [base(0)?, base(1)?],
            sum: Pipeline::new(context, "gloss_sum", &[])?,
            level: Pipeline::new(context, "gloss_level", &[])?,
            entries: Buffer::from_slice(context, "gloss entries", &tables.entries)?,
            entry_count: tables.entries.len() as u32,
            area_m2,
            vertices: Buffer::from_slice(context, "gloss vertices", &tables.vertices)?,
            shifts: Buffer::from_slice(context, "gloss shifts", &tables.shifts)?,
            base_ranges: Buffer::from_slice(context, "base ranges", &tables.base_ranges)?,
            most_vertices: tables.most_vertices,
            leaf_count: tables.leaf_count,
            sums: tables.sums.clone(),
            first_children: Buffer::from_slice(context, "gloss first children", &tables.first_children)?,
            children: Buffer::from_slice(context, "gloss children", &tables.children)?,
            slots: Buffer::from_slice(context, "gloss slots", &tables.slots)?,
            path_flux: Buffer::storage(context, "path flux", u64::from(path_count) * 12)?,
            reflected_flux: Buffer::storage(context, "reflected flux", u64::from(path_count) * 12)?,
            fluxes: Buffer::storage(context, "gloss fluxes", tables.slots.len() as u64 * 12)?,
        })
    }

    /// Room for the beams of a light of so many point samples.
    pub fn beam_bytes(&self, samples: u32) -> u64 {
        u64::from(self.entry_count) * u64::from(samples) * size_of::<GlossBeam>() as u64
    }

    /// Dispatches over all vertices of clusters that are no entry points, in order. Each is cut so that an invocation's work is bounded:
    /// lavapipe ends all loops of a shader, silently, once they have turned 65 535 times in all.
    pub(super) fn path_dispatches(&self) -> impl Iterator<Item = Dispatch<'_>> {
        self.windows(1).map(|(first, end)| {
            // No beams are looked at.
            let part =
                GlossPart { emission: Vec3::ZERO, beam_count: 0, first, end, adds: u32::from(first > 0) };
            Dispatch { entry_points: false, part, beams: &self.vertices }
        })
    }

    /// The same over entry points, of one unit of a light's emission.
    pub(super) fn light_dispatches<'a>(
        &'a self,
        light: &GlossLight<'a>,
    ) -> impl Iterator<Item = Dispatch<'a>> {
        let GlossLight { samples, beams, .. } = *light;
        self.windows(samples).map(move |(first, end)| {
            let (emission, adds) = (Vec3::splat(self.area_m2), u32::from(first > 0));
            let part = GlossPart { emission, beam_count: samples, first, end, adds };
            Dispatch { entry_points: true, part, beams }
        })
    }

    /// First of the vertices that a dispatch takes below a cluster, and the one behind the last; each has so many beams. The last dispatch takes
    /// whatever is left: rays from pixels may read clusters of more vertices.
    fn windows(&self, beams: u32) -> impl Iterator<Item = (u32, u32)> + use<> {
        let count = (MOST_TURNS / beams.max(1)).max(1);
        let last = self.most_vertices.saturating_sub(1) / count * count;
        let end = move |first| if first == last { u32::MAX } else { first + count };
        (0..=last).step_by(count as usize).map(move |first| (first, end(first)))
    }

    /// Adds a light's part, so many values of it, to a total; ends with a barrier, for the next light.
    pub(super) fn record_sum(
        &self,
        pass: &mut PassScope<'_>,
        emission: Vec3,
        count: u32,
        part: &Buffer,
        total: &Buffer,
    ) {
        let push = GlossSumPush { emission, count };
        let buffers = [("LightPart", part), ("GlossTotal", total)];
        pass.dispatch(&self.sum, [count, 1, 1], &push, &buffers);
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    /// What clusters send towards the directions that are read: from their vertices, then the sums of large ones, level by level.
    /// `due` are lights whose slots are out of date.
    pub fn record(
        &self,
        rec: &mut Recorder,
        materials: &Buffer,
        (first_deposits, deposits): (&Buffer, &Buffer),
        due: &[GlossLight<'_>],
        lights: &[GlossLight<'_>],
    ) {
        let mut pass = rec.pass(Self::STEM);
        let leaf_count = self.leaf_count;
        let own = self.path_dispatches().map(|dispatch| (dispatch, &self.fluxes));
        let of_lights = due
            .iter()
            .flat_map(|light| self.light_dispatches(light).map(move |dispatch| (dispatch, light.slots)));
        for (Dispatch { entry_points, part, beams }, fluxes) in own.chain(of_lights) {
            pass.dispatch(
                &self.base[usize::from(entry_points)],
                [leaf_count, 1, 1],
                &GlossBasePush { part, slot_count: leaf_count },
                &[
                    ("Materials", materials),
                    ("ReflectedFlux", &self.reflected_flux),
                    ("FirstDeposits", first_deposits),
                    ("Deposits", deposits),
                    ("GlossVertices", &self.vertices),
                    ("GlossBeams", beams),
                    ("GlossSlots", &self.slots),
                    ("BaseRanges", &self.base_ranges),
                    ("GlossShifts", &self.shifts),
                    ("GlossFluxes", fluxes),
                ],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        for light in lights {
            self.record_sum(&mut pass, light.emission, leaf_count, light.slots, &self.fluxes);
        }
        for level in &self.sums {
            pass.dispatch(
                &self.level,
                [level.len() as u32, 1, 1],
                &GlossLevelPush { first_slot: level.start, slot_count: level.len() as u32, leaf_count },
                &[
                    ("FirstChildren", &self.first_children),
                    ("Children", &self.children),
                    ("GlossFluxes", &self.fluxes),
                ],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
    }
}
