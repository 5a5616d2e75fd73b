//! Glossy surfaces: their first reflection at entry points, and the outgoing flux of clusters in
//! the direction bins that are read. [Yue §1, §2] Scenes without glossy surfaces skip it. In:
//! lights, contributions. Out: for each light the outgoing flux of gloss bins, per unit emission;
//! flux of gloss bins (W).
//!
//! The results are linear in the lights and kept for each light: a change of colour
//! visits no vertex.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, MAX_LOOP_ITERATIONS, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::frame::light_sum::LightSum;
use crate::passes::gloss_tables::GlossTables;
use crate::scene::Material;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// Light of one point sample at an entry point that may be glossy.
    pub struct GlossBeam {
        /// Unit mirror direction of the light.
        pub mirror: Vec3,
        /// Irradiance per unit of the light's emission: 1/m² of point and spot lights, sr of area
        /// lights, 1 of directional ones.
        pub factor: f32,
    }
}

gpu_struct! {
    /// The vertices below a cluster that an invocation handles in one dispatch.
    pub struct GlossSpan {
        /// Mean area of an entry point.
        pub area_m2: f32,
        /// Entry points: beams of each.
        pub beam_count: u32,
        pub first: u32,
        /// One past the last vertex; bounds the work of an invocation.
        pub end: u32,
        /// 1: adds to the sum of earlier dispatches.
        pub adds: u32,
        /// Maximum of vertices below a cluster; of more, a sample stands for all. 0:
        /// all vertices count.
        pub most: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_base`.
    pub struct GlossBasePush {
        /// Vertices of this dispatch.
        pub span: GlossSpan,
        /// The first gloss bins, which are no sums of other gloss bins.
        pub bin_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_level`.
    pub struct GlossLevelPush {
        /// First gloss bin of the level.
        pub first_bin: u32,
        pub bin_count: u32,
        /// Gloss bins that are no sums.
        pub leaf_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] =
    &[GlossBeam::LAYOUT, GlossSpan::LAYOUT, GlossBasePush::LAYOUT, GlossLevelPush::LAYOUT];

/// Iterations of the loop over a cluster's vertices and their beams in one dispatch. A sample of a
/// pixel visits four clusters.
const MAX_ITERATIONS: u32 = 1 << 13;
const _: () = assert!(4 * MAX_ITERATIONS < MAX_LOOP_ITERATIONS);

/// Lights of one dispatch if as many are due: lobes are evaluated once for all of them.
const LIGHTS: usize = 4;

/// Exponent above which a lobe is so sharp that few vertices of a cluster contribute in one
/// direction. All vertices are then needed.
const BROAD: f32 = 100.0;

/// Fraction of the reflected light up to which an error of the lobe's light is small beside
/// the diffuse light.
const LITTLE: f32 = 0.4;

/// Whether a material has weak and broad gloss: a sample of a cluster's vertices, in few direction
/// bins, suffices for its lobe.
pub fn is_little(material: &Material) -> bool {
    material.exponent <= BROAD && material.gloss_fraction() <= LITTLE
}

/// Number of vertices of a cluster that estimate the outgoing light of a lobe well enough; 0: all
/// are needed. At this number the noise of a cluster is about that of the smallest clusters, which
/// hold no more vertices.
pub fn vertices_for(material: &Material) -> u32 {
    if !is_little(material) {
        return 0;
    }
    let excess = (material.gloss_fraction() / 0.25).max(1.0);
    (4.0 * excess * excess * (material.exponent + 1.0).sqrt()).ceil() as u32
}

/// The cached contributions of a light on glossy surfaces.
#[derive(Clone, Copy)]
pub struct GlossLight<'a> {
    /// Beams at each entry point that may be glossy.
    pub beam_count: u32,
    /// `GlossBeam`s, entry point by entry point.
    pub beams: &'a Buffer,
    /// Outgoing flux after the first bounce of each path, per unit of the light's emission and
    /// of the mean area of an entry point: three floats. It is the form factor if the entry
    /// point is not glossy.
    pub first_bounce: &'a Buffer,
    /// Outgoing flux of each gloss bin that is no sum, per unit of the light's
    /// emission; three floats.
    pub bins: &'a Buffer,
    /// Light of glossy surfaces on the rays of each sample, per unit of emission; three floats.
    pub hits: &'a Buffer,
}

/// A dispatch over the vertices of clusters, for one light or for [`LIGHTS`].
pub(super) struct Dispatch<'a> {
    /// Over entry points, or over other vertices.
    entry_points: bool,
    pub(super) span: GlossSpan,
    lights: &'a [GlossLight<'a>],
}

impl<'a> Dispatch<'a> {
    /// The light at an index; an arbitrary one beyond the last.
    pub(super) fn light(&self, place: usize) -> &GlossLight<'a> {
        self.lights.get(place).unwrap_or(&self.lights[0])
    }
}

/// The kernels of a pass over the vertices of clusters.
pub(super) struct VertexKernels {
    /// Over entry points, for one light.
    entry_points: Pipeline,
    /// Over other vertices, for one light and for [`LIGHTS`].
    others: [Pipeline; 2],
}

impl VertexKernels {
    pub(super) fn new(context: &Arc<Context>, shader: &'static str) -> Result<Self> {
        let kernel = |entry_points, lights: usize| {
            let constants = [("ENTRY_POINTS", entry_points), ("LIGHTS", lights as u32)];
            Pipeline::new(context, shader, &constants)
        };
        Ok(Self { entry_points: kernel(1, 1)?, others: [kernel(0, 1)?, kernel(0, LIGHTS)?] })
    }

    pub(super) fn of(&self, dispatch: &Dispatch<'_>) -> &Pipeline {
        match dispatch.entry_points {
            true => &self.entry_points,
            false => &self.others[usize::from(dispatch.lights.len() > 1)],
        }
    }
}

/// The pipelines, the tables, and the light that they hold.
pub struct Gloss {
    pub(super) trace: Pipeline,
    pub(super) reflect: Pipeline,
    base: VertexKernels,
    pub(super) copy: LightSum,
    pub(super) sum: LightSum,
    level: Pipeline,
    pub(super) entries: Buffer,
    pub(super) entry_count: u32,
    pub(super) area_m2: f32,
    /// A `GlossVertex` for each glossy vertex.
    pub vertices: Buffer,
    /// Offset from the index of a contribution to that of its vertex, for each base cluster;
    /// [`NO_ENTRY`](crate::passes::gloss_tables::NO_ENTRY) if it is not glossy.
    pub shifts: Buffer,
    /// Range of base clusters below each cluster.
    pub base_ranges: Buffer,
    /// Maximum number of vertices of a base cluster.
    max_vertices: u32,
    /// Maximum of vertices sampled below a cluster; initially 0: all.
    pub max_asked: u32,
    /// Number of gloss bins that are no sums; they come first.
    pub leaf_count: u32,
    /// Gloss bins that are sums, by level.
    sums: Vec<Range<u32>>,
    child_offsets: Buffer,
    children: Buffer,
    /// A `GlossBin` for each direction bin.
    pub bins: Buffer,
    pub(super) path_count: u32,
    /// Flux of each gloss bin, W; three floats. Flux over the cluster's area is a radiosity, like
    /// albedo times irradiance.
    pub fluxes: Buffer,
}

impl Gloss {
    /// Timing name of the outgoing directions of clusters.
    pub const STEM: &str = "gloss_base";

    /// Uploads the tables; the `path_count` entry points have a mean area of `area_m2`.
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
        Ok(Self {
            trace: Pipeline::new(context, Self::BEAMS_STEM, &[])?,
            reflect: Pipeline::new(context, Self::ENTRIES_STEM, &[scene.textures.constant()])?,
            base: VertexKernels::new(context, Self::STEM)?,
            copy: LightSum::new(context)?,
            sum: LightSum::of_colours(context)?,
            level: Pipeline::new(context, "gloss_level", &[])?,
            entries: Buffer::from_slice(
                context,
                GrowsWith::EntryPoints.named("gloss entries"),
                &tables.entries,
            )?,
            entry_count: tables.entries.len() as u32,
            area_m2,
            vertices: Buffer::from_slice(
                context,
                GrowsWith::EntryPoints.named("gloss vertices"),
                &tables.vertices,
            )?,
            shifts: Buffer::from_slice(context, GrowsWith::Cells.named("gloss shifts"), &tables.shifts)?,
            base_ranges: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("base ranges"),
                &tables.base_ranges,
            )?,
            max_vertices: tables.max_vertices,
            max_asked: 0,
            leaf_count: tables.leaf_count,
            sums: tables.sums.clone(),
            child_offsets: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("gloss child offsets"),
                &tables.child_offsets,
            )?,
            children: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("gloss children"),
                &tables.children,
            )?,
            bins: Buffer::from_slice(context, GrowsWith::Cells.named("gloss bins"), &tables.bins)?,
            path_count,
            fluxes: Buffer::storage(
                context,
                GrowsWith::Cells.named("gloss fluxes"),
                tables.bins.len() as u64 * 12,
            )?,
        })
    }

    /// Bytes of the beams of a light with `beam_count` beams at an entry point.
    pub fn beam_bytes(&self, beam_count: u32) -> u64 {
        u64::from(self.entry_count) * u64::from(beam_count) * size_of::<GlossBeam>() as u64
    }

    /// Dispatches over all vertices of clusters, per unit of each light's emission: first the
    /// vertices that are no entry points, then the entry points. Each is divided to bound the
    /// iterations of an invocation ([`MAX_LOOP_ITERATIONS`]).
    pub(super) fn dispatches<'a>(&self, due: &'a [GlossLight<'a>]) -> Vec<Dispatch<'a>> {
        let area_m2 = self.area_m2;
        let dispatch = |entry_points, lights: &'a [GlossLight<'a>], (first, end)| {
            let (beam_count, adds) = (lights[0].beam_count, u32::from(entry_points || first > 0));
            Dispatch {
                entry_points,
                span: GlossSpan { area_m2, beam_count, first, end, adds, most: self.max_asked },
                lights,
            }
        };
        let groups = due.chunks_exact(LIGHTS);
        let single = groups.remainder().chunks(1);
        let others =
            groups.chain(single).flat_map(|lights| self.windows(1).map(move |w| dispatch(false, lights, w)));
        let entry_points = due
            .chunks(1)
            .flat_map(|light| self.windows(light[0].beam_count).map(move |w| dispatch(true, light, w)));
        others.chain(entry_points).collect()
    }

    /// Ranges of vertices below a cluster, one a dispatch, for `beams` beams a vertex. The last
    /// range is unbounded: rays from pixels may read clusters of more vertices.
    fn windows(&self, beams: u32) -> impl Iterator<Item = (u32, u32)> + use<> {
        let count = (MAX_ITERATIONS / beams.max(1)).max(1);
        let last = self.max_vertices.saturating_sub(1) / count * count;
        let end = move |first| if first == last { u32::MAX } else { first + count };
        (0..=last).step_by(count as usize).map(move |first| (first, end(first)))
    }

    /// Outgoing flux of clusters in the direction bins. Fills the gloss bins of each `due` light
    /// from the vertices, sums the `bins` of all lights, weighted by the emissions, then sums large
    /// clusters level by level.
    pub fn record(
        &self,
        rec: &mut Recorder,
        materials: &Buffer,
        (contribution_ranges, contributions): (&Buffer, &Buffer),
        due: &[GlossLight<'_>],
        bins: &[(Vec3, &Buffer)],
    ) {
        let mut pass = rec.pass(Self::STEM);
        let leaf_count = self.leaf_count;
        for dispatch in self.dispatches(due) {
            let light = |place| dispatch.light(place);
            pass.dispatch(
                self.base.of(&dispatch),
                [leaf_count, 1, 1],
                &GlossBasePush { span: dispatch.span, bin_count: leaf_count },
                &[
                    ("Materials", materials),
                    ("ContributionRanges", contribution_ranges),
                    ("Contributions", contributions),
                    ("GlossVertices", &self.vertices),
                    ("GlossBeams", light(0).beams),
                    ("GlossBins", &self.bins),
                    ("BaseRanges", &self.base_ranges),
                    ("GlossShifts", &self.shifts),
                    ("FirstBounceFlux0", light(0).first_bounce),
                    ("FirstBounceFlux1", light(1).first_bounce),
                    ("FirstBounceFlux2", light(2).first_bounce),
                    ("FirstBounceFlux3", light(3).first_bounce),
                    ("LightBins0", light(0).bins),
                    ("LightBins1", light(1).bins),
                    ("LightBins2", light(2).bins),
                    ("LightBins3", light(3).bins),
                ],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        self.sum.record(&mut pass, bins, leaf_count, 1.0, &self.fluxes);
        for level in &self.sums {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.level,
                [level.len() as u32, 1, 1],
                &GlossLevelPush { first_bin: level.start, bin_count: level.len() as u32, leaf_count },
                &[
                    ("ChildOffsets", &self.child_offsets),
                    ("Children", &self.children),
                    ("GlossFluxes", &self.fluxes),
                ],
            );
        }
    }
}
