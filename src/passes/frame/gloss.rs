//! Glossy surfaces: their first reflection at entry points, and the outgoing flux of clusters in
//! the direction bins that are read. [Yue §1, §2] Scenes without glossy surfaces skip it. In:
//! lights, contributions. Out: for each light the outgoing flux of gloss bins, per unit emission;
//! flux of gloss bins (W).
//!
//! The results are linear in the lights and kept for each light: a change of colour
//! visits no vertex.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, MAX_LOOP_ITERATIONS, PassScope, Pipeline, Recorder};
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
        /// Entry points in glossy clusters; their lobes come first.
        pub lobe_count: u32,
        /// Beams of each entry point.
        pub beam_count: u32,
        /// First vertex, of entry points and of others.
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
    /// Push constants of `gloss_lobes`.
    pub struct GlossLobesPush {
        /// Vertices that are entry points; they come first.
        pub entry_count: u32,
        /// Number of vertices of both kinds.
        pub vertex_count: u32,
        /// Mean area of an entry point.
        pub area_m2: f32,
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
pub const LAYOUTS: &[Layout] = &[
    GlossBeam::LAYOUT,
    GlossSpan::LAYOUT,
    GlossLobesPush::LAYOUT,
    GlossBasePush::LAYOUT,
    GlossLevelPush::LAYOUT,
];

/// Iterations of each loop over a cluster's vertices and their beams in one dispatch: entry points
/// have one, other vertices another. A sample of a pixel visits four clusters.
const MAX_ITERATIONS: u32 = 1 << 12;
const _: () = assert!(2 * 4 * MAX_ITERATIONS < MAX_LOOP_ITERATIONS);

/// Exponent above which a lobe is so sharp that few vertices of a cluster contribute in one
/// direction. All vertices are then needed.
const BROAD: f32 = 100.0;

/// Fraction of the reflected light up to which an error of the lobe's light is small beside
/// the diffuse light.
pub const LITTLE: f32 = 0.4;

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

/// The kernels of a pass over the vertices of clusters: for lights with several beams at an entry
/// point, and with one.
pub(super) struct VertexKernels([Pipeline; 2]);

impl VertexKernels {
    pub(super) fn new(context: &Arc<Context>, shader: &'static str) -> Result<Self> {
        let kernel = |has_one| Pipeline::new(context, shader, &[("HAS_ONE_BEAM", has_one)]);
        Ok(Self([kernel(0)?, kernel(1)?]))
    }

    pub(super) fn of(&self, light: &GlossLight<'_>) -> &Pipeline {
        &self.0[usize::from(light.beam_count == 1)]
    }
}

/// The pipelines, the tables, and the light that they hold.
pub struct Gloss {
    /// For lights of one point sample, and of several.
    pub(super) trace: [Pipeline; 2],
    pub(super) reflect: Pipeline,
    lobe: Pipeline,
    base: VertexKernels,
    pub(super) copy: LightSum,
    pub(super) sum: LightSum,
    level: Pipeline,
    pub(super) entries: Buffer,
    pub(super) entry_count: u32,
    pub(super) area_m2: f32,
    /// A `GlossVertex` for each vertex in a glossy cluster, entry points first.
    vertices: Buffer,
    vertex_count: u32,
    /// Index of each of these entry points among the glossy ones.
    entry_indices: Buffer,
    entry_vertex_count: u32,
    /// Unit mirror direction of each other vertex, and a spare number.
    mirrors: Buffer,
    /// For each base cluster its first entry point and its first other vertex, and the end.
    vertex_offsets: Buffer,
    /// Lobe of each vertex for the light of the last dispatch: flux at its peak, exponent.
    lobes: Buffer,
    /// Range of base clusters below each cluster.
    base_ranges: Buffer,
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
        let table =
            |name, words: &[u32]| Buffer::from_slice(context, GrowsWith::EntryPoints.named(name), words);
        let beams = |traces| Pipeline::new(context, Self::BEAMS_STEM, &[("TRACES", traces)]);
        Ok(Self {
            trace: [beams(0)?, beams(1)?],
            reflect: Pipeline::new(context, Self::ENTRIES_STEM, &[scene.textures.constant()])?,
            lobe: Pipeline::new(context, "gloss_lobes", &[])?,
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
            vertices: table("gloss vertices", bytemuck::cast_slice(&tables.vertices))?,
            vertex_count: tables.vertices.len() as u32,
            entry_indices: table("glossy entry points", &tables.entry_indices)?,
            entry_vertex_count: tables.entry_indices.len() as u32,
            mirrors: table("gloss mirrors", bytemuck::cast_slice(&tables.mirrors))?,
            vertex_offsets: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("gloss vertex offsets"),
                &tables.vertex_offsets,
            )?,
            lobes: Buffer::storage(
                context,
                GrowsWith::EntryPoints.named("gloss lobes"),
                16 * tables.vertices.len().max(1) as u64,
            )?,
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

    /// The vertices of each dispatch over all vertices of clusters for a light. They are divided to
    /// bound the iterations of an invocation ([`MAX_LOOP_ITERATIONS`]).
    pub(super) fn spans(&self, light: &GlossLight<'_>) -> impl Iterator<Item = GlossSpan> + use<> {
        let (lobe_count, most, beam_count) = (self.entry_vertex_count, self.max_asked, light.beam_count);
        let span = move |(first, end)| {
            let adds = u32::from(first > 0);
            GlossSpan { lobe_count, beam_count, first, end, adds, most }
        };
        self.windows(beam_count).map(span)
    }

    /// Computes the lobes of all vertices for a light. The caller records a barrier to the
    /// dispatches that read them.
    pub(super) fn record_lobes(
        &self,
        pass: &mut PassScope<'_>,
        materials: &Buffer,
        contributions: &Buffer,
        light: &GlossLight<'_>,
    ) {
        pass.dispatch(
            &self.lobe,
            [self.vertex_count, 1, 1],
            &GlossLobesPush {
                entry_count: self.entry_vertex_count,
                vertex_count: self.vertex_count,
                area_m2: self.area_m2,
            },
            &[
                ("Materials", materials),
                ("Contributions", contributions),
                ("GlossVertices", &self.vertices),
                ("FirstBounceFlux", light.first_bounce),
                ("GlossLobes", &self.lobes),
            ],
        );
    }

    /// The buffers from which kernels compute the flux of vertices for a light.
    pub(super) fn lobe_buffers<'a>(&'a self, light: &GlossLight<'a>) -> [(&'static str, &'a Buffer); 6] {
        [
            ("GlossLobes", &self.lobes),
            ("GlossMirrors", &self.mirrors),
            ("GlossBeams", light.beams),
            ("EntryIndices", &self.entry_indices),
            ("BaseRanges", &self.base_ranges),
            ("VertexOffsets", &self.vertex_offsets),
        ]
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
        contributions: &Buffer,
        due: &[GlossLight<'_>],
        bins: &[(Vec3, &Buffer)],
    ) {
        let mut pass = rec.pass(Self::STEM);
        let leaf_count = self.leaf_count;
        for light in due {
            self.record_lobes(&mut pass, materials, contributions, light);
            pass.barrier(COMPUTE_TO_COMPUTE);
            for span in self.spans(light) {
                let mut buffers = self.lobe_buffers(light).to_vec();
                buffers.extend([("GlossBins", &self.bins), ("LightBins", light.bins)]);
                pass.dispatch(
                    self.base.of(light),
                    [leaf_count, 1, 1],
                    &GlossBasePush { span, bin_count: leaf_count },
                    &buffers,
                );
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
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
