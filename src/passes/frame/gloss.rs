//! Surfaces that shine: their first reflection at entry points, and what clusters send towards the directions in which they are
//! read. [Yue §1, §2] Scenes without such surfaces have none of this.
//! In: form factors (1/m²), path flux (W), deposits. Out: reflected flux of paths (W), flux of slots (W).

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::form_factors::FormFactors;
use crate::passes::precompute::gloss::GlossTables;
use crate::scene::directions::Directions;
use glam::{UVec2, Vec3};
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
    }
}

gpu_struct! {
    /// Light that arrives at such an entry point from one sample of one light.
    pub struct GlossBeam {
        /// Unit direction in which a mirror would send it on.
        pub mirror: Vec3,
        /// W.
        pub flux: Vec3,
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
        /// Index of the direction.
        pub direction: u32,
        /// Base level: added to the index of a deposit it gives that of its vertex, modulo 2³².
        pub shift: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_entries`.
    pub struct GlossEntriesPush {
        /// Entry points that may shine.
        pub entry_count: u32,
        /// Lights.
        pub light_count: u32,
        /// Paths.
        pub path_count: u32,
        /// That each entry point stands for, in the mean.
        pub area_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_base`.
    pub struct GlossBasePush {
        /// Slots of the base level.
        pub slot_count: u32,
        /// Beams of an entry point.
        pub beam_count: u32,
        /// Vertices of this dispatch, of each cluster: first, and how many.
        pub window: UVec2,
    }
}

gpu_struct! {
    /// Push constants of `gloss_level`.
    pub struct GlossLevelPush {
        /// First slot of the level.
        pub first_slot: u32,
        /// Its slots.
        pub slot_count: u32,
        /// Slots of the base level.
        pub base_count: u32,
    }
}

/// What these passes share with their shaders.
pub const LAYOUTS: &[Layout] = &[
    GlossEntry::LAYOUT,
    GlossBeam::LAYOUT,
    GlossVertex::LAYOUT,
    GlossSlot::LAYOUT,
    GlossEntriesPush::LAYOUT,
    GlossBasePush::LAYOUT,
    GlossLevelPush::LAYOUT,
];

/// Turns of the loop over a cluster's vertices and their beams in one dispatch.
const MOST_TURNS: u32 = 1 << 14;

/// Marks a vertex that is no entry point that may shine, and a base cluster without vertices that may.
pub const NO_ENTRY: u32 = u32::MAX;

/// The pipelines, the tables, and the light that they hold.
pub struct Gloss {
    entries_pipeline: Pipeline,
    base: Pipeline,
    level: Pipeline,
    entries: Buffer,
    entry_count: u32,
    /// `GlossVertex`s.
    pub vertices: Buffer,
    /// Added to the index of a deposit of each base cluster it gives that of its vertex; [`NO_ENTRY`] where nothing shines.
    pub shifts: Buffer,
    /// First base cluster below each cluster, and the end.
    pub base_ranges: Buffer,
    directions: Buffer,
    /// Vertices of a base cluster at most.
    most_vertices: u32,
    levels: Vec<Range<u32>>,
    first_children: Buffer,
    children: Buffer,
    /// `GlossBeam`s of each entry point that may shine.
    pub beams: Buffer,
    /// Beams of an entry point.
    pub beam_count: u32,
    /// `GlossSlot`s.
    pub slots: Buffer,
    /// Flux that each path carries on from its entry point, albedo included where that may shine, W; three floats.
    pub reflected_flux: Buffer,
    /// Of each slot, W; three floats: over the cluster's area it adds to albedo times irradiance.
    pub fluxes: Buffer,
}

impl Gloss {
    /// The name of the first pass in timings.
    pub const ENTRIES_STEM: &str = "gloss_entries";
    /// The name of the second pass in timings.
    pub const STEM: &str = "gloss_base";

    /// Uploads the tables, with room for that many beams at each entry point.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        tables: &GlossTables,
        directions: Directions,
        path_count: u32,
        beam_count: u32,
    ) -> Result<Self> {
        let middles: Vec<Vec3> =
            (0..directions.count()).map(|bin| directions.middle(bin).as_vec3()).collect();
        let entry_count = tables.entries.len() as u32;
        let beams = u64::from(entry_count) * u64::from(beam_count) * size_of::<GlossBeam>() as u64;
        Ok(Self {
            entries_pipeline: Pipeline::new(context, Self::ENTRIES_STEM, &[])?,
            base: Pipeline::new(context, Self::STEM, &[])?,
            level: Pipeline::new(context, "gloss_level", &[])?,
            entries: Buffer::from_slice(context, "gloss entries", &tables.entries)?,
            entry_count,
            vertices: Buffer::from_slice(context, "gloss vertices", &tables.vertices)?,
            shifts: Buffer::from_slice(context, "gloss shifts", &tables.shifts)?,
            base_ranges: Buffer::from_slice(context, "base ranges", &tables.base_ranges)?,
            directions: Buffer::from_slice(context, "directions", &middles)?,
            most_vertices: tables.most_vertices,
            levels: tables.levels.clone(),
            first_children: Buffer::from_slice(context, "gloss first children", &tables.first_children)?,
            children: Buffer::from_slice(context, "gloss children", &tables.children)?,
            beams: Buffer::storage(context, "gloss beams", beams)?,
            beam_count,
            slots: Buffer::from_slice(context, "gloss slots", &tables.slots)?,
            reflected_flux: Buffer::storage(context, "reflected flux", u64::from(path_count) * 12)?,
            fluxes: Buffer::storage(context, "gloss fluxes", tables.slots.len() as u64 * 12)?,
        })
    }

    /// Vertices to take of each cluster, one dispatch after the other: first, and how many. Bounds the work of an invocation, for
    /// lavapipe ends all loops of a shader, silently, once they have turned 65 535 times in all.
    pub fn windows(&self) -> impl Iterator<Item = UVec2> {
        let length = (MOST_TURNS / self.beam_count.max(1)).max(1);
        (0..self.most_vertices.max(1)).step_by(length as usize).map(move |first| UVec2::new(first, length))
    }

    /// The first reflection at entry points that may shine. Other paths' reflected flux is their path flux.
    pub fn record_entries(
        &self,
        rec: &mut Recorder,
        form_factors: &FormFactors,
        materials: &Buffer,
        lights: &Buffer,
    ) {
        rec.pass(Self::ENTRIES_STEM).dispatch(
            &self.entries_pipeline,
            [self.entry_count, 1, 1],
            &GlossEntriesPush {
                entry_count: self.entry_count,
                light_count: self.beam_count,
                path_count: form_factors.point_count(),
                area_m2: form_factors.area_m2(),
            },
            &[
                ("Materials", materials),
                ("Lights", lights),
                ("FormFactors", &form_factors.factors),
                ("GlossEntries", &self.entries),
                ("GlossBeams", &self.beams),
                ("ReflectedFlux", &self.reflected_flux),
            ],
        );
    }

    /// What clusters send towards the directions that are read: the base level, then each coarser one.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer, first_deposits: &Buffer, deposits: &Buffer) {
        let mut pass = rec.pass(Self::STEM);
        let base_count = self.levels[0].len() as u32;
        for window in self.windows() {
            if window.x > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.base,
                [base_count, 1, 1],
                &GlossBasePush { slot_count: base_count, beam_count: self.beam_count, window },
                &[
                    ("Materials", materials),
                    ("ReflectedFlux", &self.reflected_flux),
                    ("FirstDeposits", first_deposits),
                    ("Deposits", deposits),
                    ("GlossVertices", &self.vertices),
                    ("GlossBeams", &self.beams),
                    ("GlossSlots", &self.slots),
                    ("Directions", &self.directions),
                    ("GlossFluxes", &self.fluxes),
                ],
            );
        }
        for level in self.levels[1..].iter().filter(|level| !level.is_empty()) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.level,
                [level.len() as u32, 1, 1],
                &GlossLevelPush { first_slot: level.start, slot_count: level.len() as u32, base_count },
                &[
                    ("FirstChildren", &self.first_children),
                    ("Children", &self.children),
                    ("GlossFluxes", &self.fluxes),
                ],
            );
        }
    }
}
