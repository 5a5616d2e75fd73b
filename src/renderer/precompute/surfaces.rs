//! First step: the acceleration structure, and the sides of triangles that light can reach.

use crate::cpu::math::ClearDistance;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::passes::SceneBuffers;
use crate::passes::precompute::geometry::Geometry;
use crate::passes::precompute::visibility::sides;
use crate::passes::precompute::{Progress, begin_stage, rays::Rays};
use crate::renderer::enclosures::{Enclosures, lost_lights};
use crate::renderer::statistics::Watch;
use crate::scene::mesh_edges::Mesh;
use crate::scene::{Measure, Scene, bvh::Bvh, host_bvh::HostBvh, hvds::Hvds, solids::Solids, surfaces};
use crate::types::Surface;
use std::sync::Arc;

/// The scene on the device, and what rays over its surface have found.
pub(super) struct Reachable {
    pub(super) bvh: Bvh,
    pub(super) solids: Solids,
    pub(super) rays: Rays,
    pub(super) buffers: SceneBuffers,
    /// Attributes of each triangle; sides that light cannot reach are inactive.
    pub(super) surfaces: Vec<Surface>,
    pub(super) groups: sides::Enclosures,
    /// Whether each side sees some surface.
    sees: Vec<[bool; 2]>,
    /// Diagonal of the scene, metres.
    pub(super) scene_size: f32,
    /// Offset of ray origins from surfaces.
    pub(super) clear_distance: ClearDistance,
}

impl Reachable {
    /// Builds the tree, reorders the scene's triangles to its order, and finds the sides.
    pub(super) fn new(
        context: &Arc<Context>,
        scene: &mut Scene,
        progress: &mut dyn Progress,
        watch: &mut Watch,
    ) -> Result<Self> {
        begin_stage(progress, "acceleration structure", 1)?;
        let bvh = Bvh::of_scene(scene)?;
        scene.reorder(&bvh.order);
        watch.lap("acceleration structure");

        begin_stage(progress, "surfaces", 1)?;
        let of_scene = || match scene.quality.takes(Measure::Solids) {
            true => Solids::of_scene(scene),
            false => Solids::none(),
        };
        let (solids, sees) = rayon::join(of_scene, || surfaces::sides_that_see_something(&scene.triangles));
        let warnings: Vec<String> = lost_lights(&solids, &scene.lights).collect();
        scene.warnings.extend(warnings);
        let rays = Rays::new(context)?;
        // A side that sees the sky alone receives its light.
        let is_active = |sees: [bool; 2]| sees.map(|sees| sees || scene.emission.sky.is_some());
        let pairs = scene.triangles.iter().zip(&sees);
        let mut surfaces: Vec<Surface> =
            pairs.map(|(triangle, sees)| surfaces::surface(triangle, is_active(*sees))).collect();
        let mesh = Mesh::of(&scene.triangles);
        let buffers = SceneBuffers::new(context, &bvh, scene, &surfaces)?
            .with_mesh_edges(context, scene, &mesh)?
            .with_silhouettes(context, &bvh, scene, &mesh)?;
        let clear_distance = ClearDistance::new(&bvh.nodes[0], &scene.cell_sizes);
        let groups =
            sides::deactivate_unreachable(&rays, &buffers, scene, &solids, clear_distance, &mut surfaces)?;
        buffers.surfaces.followed().write(&surfaces)?;
        if surfaces.is_empty() {
            return Err(Error::Usage("the scene has no triangle".into()));
        }
        watch.lap("surfaces");
        let (low, high) = scene.bounds();
        let scene_size = (high - low).length();
        Ok(Self { bvh, solids, rays, buffers, surfaces, groups, sees, scene_size, clear_distance })
    }

    /// Whether a side reflects light to some surface.
    pub(super) fn reflects(&self, side: u32) -> bool {
        self.sees[side as usize / 2][side as usize % 2]
    }

    /// The geometry on which cache points are placed.
    pub(super) fn geometry<'a>(&'a self, scene: &'a Scene, hvds: &'a Hvds) -> Geometry<'a> {
        Geometry {
            triangles: &scene.triangles,
            opacity: &scene.opacity,
            surfaces: &self.surfaces,
            hvds,
            naming: scene.naming(),
            names: Geometry::names_of(hvds, scene.naming()),
            scene_size: self.scene_size,
            cell_sizes: &scene.cell_sizes,
            solids: &self.solids,
            clear_distance: self.clear_distance,
        }
    }

    /// Tracer and scene, as steps that trace rays take them.
    pub(super) fn tracer(&self) -> (&Rays, &SceneBuffers) {
        (&self.rays, &self.buffers)
    }

    /// The results that frames and queries read.
    pub(super) fn finish(self, scene: &Scene) -> (SceneBuffers, Vec<Surface>, Enclosures) {
        let tree = (!self.groups.is_empty()).then(|| HostBvh::new(&self.bvh, scene));
        let enclosures = Enclosures {
            solids: self.solids,
            groups: self.groups,
            rays: self.rays,
            order: self.bvh.order,
            tree,
            is_due: false,
            holds_both: false,
        };
        (self.buffers, self.surfaces, enclosures)
    }
}
