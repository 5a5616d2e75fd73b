//! Direct light at entry points that may be glossy: beams of each light, and the first
//! reflection into the paths. [Yue §1] In: lights. Out: beams and outgoing flux after the first
//! bounce, per unit emission.

use crate::gpu::{Buffer, PassScope, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss::{Gloss, GlossLight};
use crate::passes::{OneLight, SceneBuffers};
use glam::Vec3;

gpu_struct! {
    /// Push constants of `gloss_beams`.
    pub struct GlossBeamsPush {
        /// Entry points that may be glossy.
        pub entry_count: u32,
        /// Row of the light's first part.
        pub light: u32,
        /// All beams of an entry point.
        pub beam_count: u32,
        /// Beams of an entry point that this dispatch writes, the first ones.
        pub part_beams: u32,
        /// Point samples of the light.
        pub sample_count: u32,
        /// Point samples that share a beam.
        pub samples_per_beam: u32,
        /// Mean area of an entry point.
        pub area_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_entries`.
    pub struct GlossEntriesPush {
        /// Entry points that may be glossy.
        pub entry_count: u32,
        /// Beams of an entry point.
        pub beam_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[GlossBeamsPush::LAYOUT, GlossEntriesPush::LAYOUT];

impl Gloss {
    /// Timing name of tracing the beams.
    pub const BEAMS_STEM: &str = "gloss_beams";
    /// Timing name of the first reflection.
    pub const ENTRIES_STEM: &str = "gloss_entries";

    /// Traces the beams of a light, and initialises the outgoing flux after the first bounce with
    /// its form `factors`, which are exact at entry points that are not glossy. Records into an
    /// open pass; the caller records a barrier to dispatches between two lights.
    pub fn record_beams(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        factors: &Buffer,
        found: &GlossLight<'_>,
    ) {
        self.copy.record(pass, &[(Vec3::ONE, factors)], self.path_count, 1.0, found.first_bounce);
        if light.part_count == 0 {
            return;
        }
        pass.dispatch(
            &self.trace[usize::from(light.sample_count() > 1)],
            [self.entry_count * light.part_beams(), 1, 1],
            &GlossBeamsPush {
                entry_count: self.entry_count,
                light: light.row,
                beam_count: light.beam_count(),
                part_beams: light.part_beams(),
                sample_count: light.sample_count(),
                samples_per_beam: light.samples_per_beam(),
                area_m2: self.area_m2,
            },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Lights", light.table),
                ("GlossEntries", &self.entries),
                ("GlossBeams", found.beams),
                ("TruncatedLoops", &scene.truncated_loops),
                ("FormFactors", factors),
            ],
        );
    }

    /// Computes the first reflection at entry points that may be glossy.
    pub fn record_entries(&self, rec: &mut Recorder, materials: &Buffer, due: &[GlossLight<'_>]) {
        let mut pass = rec.pass(Self::ENTRIES_STEM);
        for light in due {
            pass.dispatch(
                &self.reflect,
                [self.entry_count, 1, 1],
                &GlossEntriesPush { entry_count: self.entry_count, beam_count: light.beam_count },
                &[
                    ("Materials", materials),
                    ("GlossEntries", &self.entries),
                    ("GlossBeams", light.beams),
                    ("FirstBounceFlux", light.first_bounce),
                ],
            );
        }
    }
}
