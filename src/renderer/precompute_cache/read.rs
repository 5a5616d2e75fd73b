//! Restores the precomputation from a file. Results that follow quickly from the scene
//! are computed again.

use super::checks;
use super::contents::Contents;
use crate::cache_file::{CacheMiss, File, Key};
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::gloss::base_ranges;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::passes::precompute::rays::Rays;
use crate::passes::precompute::visibility::{narrow_cavities, sides};
use crate::passes::{ClusterTables, SceneBuffers};
use crate::renderer::Statistics;
use crate::renderer::enclosures::{Enclosures, lost_lights};
use crate::renderer::precompute::Precomputed;
use crate::renderer::quality_warnings::{blurred, outgoing_directions, uncovered, undersampled, wide_cells};
use crate::scene::directions::Directions;
use crate::scene::host_bvh::HostBvh;
use crate::scene::mesh_edges::Mesh;
use crate::scene::{Scene, bvh::Bvh, grid, solids::Solids, surfaces};
use crate::types::{ROUNDED, Surface};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Contents of a file after the checks against the scene.
pub(super) struct Checked {
    contents: Contents,
    /// Surfaces in BVH order.
    surfaces: Vec<Surface>,
    bvh: Bvh,
}

impl Checked {
    /// Reads the light paths of a scene from a file, or returns the reason why it cannot be
    /// used. The device is not used.
    ///
    /// # Errors
    /// The scene itself cannot be traced.
    pub(super) fn read(
        scene: &Scene,
        file: &Path,
        key: &Key,
    ) -> Result<std::result::Result<Self, CacheMiss>> {
        let bytes = match File::bytes(file) {
            Ok(bytes) => bytes,
            Err(miss) => return Ok(Err(miss)),
        };
        let file = match File::parse(&bytes, key) {
            Ok(file) => file,
            Err(miss) => return Ok(Err(miss)),
        };
        Self::from_file(scene, &file)
    }

    /// Checks the contents of a file against a scene, without comparing their key.
    pub(super) fn from_file(scene: &Scene, file: &File) -> Result<std::result::Result<Self, CacheMiss>> {
        let bvh = Bvh::of_scene(scene)?;
        let (low, high) = scene.bounds();
        let finest = grid::finest_cells(scene.quality.cells);
        let grid = grid::Cells::new(low, high, finest, &scene.cell_sizes).grid;
        Ok(Contents::read(file, grid).and_then(|mut contents| {
            checks::check(&mut contents, scene, &bvh.order)?;
            let surfaces = surfaces_of(&contents, scene, &bvh.order)?;
            Ok(Self { contents, surfaces, bvh })
        }))
    }

    /// Builds the precomputation from the contents and reorders the scene's triangles to BVH order.
    /// `start` is when reading began.
    pub(super) fn build(
        self,
        context: &Arc<Context>,
        scene: &mut Scene,
        start: Instant,
    ) -> Result<Precomputed> {
        scene.reorder(&self.bvh.order);
        build(context, scene, self, start)
    }
}

/// Surfaces in BVH order.
fn surfaces_of(
    contents: &Contents,
    scene: &Scene,
    order: &[u32],
) -> std::result::Result<Vec<Surface>, CacheMiss> {
    let mut all = Vec::with_capacity(order.len());
    for (&triangle, &sides) in order.iter().zip(&contents.sides) {
        let mut surface = surfaces::surface(&scene.triangles[triangle as usize], [false; 2]);
        checks::sides(&surface, sides)?;
        surface.sides = sides | surface.sides & ROUNDED;
        all.push(surface);
    }
    Ok(all)
}

fn build(context: &Arc<Context>, scene: &mut Scene, checked: Checked, start: Instant) -> Result<Precomputed> {
    let Checked { contents, surfaces, bvh } = checked;
    let numbers = contents.numbers;
    let quality = scene.quality.clone();
    let hemisphere = Hemisphere::new(quality.gather_rays);
    let packing = contents.packing(scene)?;
    let mesh = Mesh::of(&scene.triangles);
    let buffers = SceneBuffers::new(context, &bvh, scene, &surfaces)?
        .with_mesh_edges(context, scene, &mesh)?
        .with_silhouettes(context, &bvh, scene, &mesh)?;
    let rays = Rays::new(context)?;
    let solids = Solids::of_scene(scene);
    warn(scene, &contents, &solids, (&rays, &buffers))?;

    let hvds = contents.hvds;
    let cluster_tables = ClusterTables::new(&hvds, &contents.effective_entry_points);
    let mut gloss = contents.gloss;
    let mut clusters = None;
    if let Some(gloss) = &mut gloss {
        gloss.base_ranges = base_ranges(&hvds);
        clusters = Some(cluster_tables.upload(context)?);
    }
    let cache_points =
        Buffer::from_slice(context, GrowsWith::GatherRays.named("cache points"), &contents.cache_points)?;
    let merged_rays = MergedRays::of_lists(context, &contents.merged_rays, hemisphere)?;
    let groups = sides::Enclosures::of_numbers(&scene.triangles, &contents.closed);
    let took = start.elapsed().as_secs_f64();
    Ok(Precomputed {
        surfaces,
        hvds,
        shown_m2: contents.shown_m2,
        area_m2: (numbers.all_area_m2 / f64::from(quality.entry_points.max(1))) as f32,
        all_area_m2: numbers.all_area_m2,
        entry_points: contents.entry_points,
        paths: contents.paths,
        point_count: contents.cache_points.len() as u32,
        cache_points,
        is_covering: numbers.is_covering != 0,
        clearance: numbers.clearance,
        neighbourhoods: contents.neighbourhoods,
        merged_rays,
        gloss,
        hemisphere,
        packing,
        cluster_tables,
        clusters,
        enclosures: Enclosures {
            tree: (!groups.is_empty()).then(|| HostBvh::new(&bvh, scene)),
            solids,
            groups,
            rays,
            order: bvh.order,
            is_due: false,
            holds_both: false,
        },
        near_clusters: contents.near_clusters,
        near_patches: contents.near_patches,
        narrow_count: numbers.narrow_count,
        narrow_patches: numbers.narrow_patches,
        statistics: Statistics {
            precompute_s: took,
            precompute_stages: vec![("stored light paths".to_owned(), took)],
            counts: contents.counts,
            skipped: contents.skipped,
            ..Statistics::default()
        },
        buffers,
    })
}

/// Adds the precomputation's warnings about lights and materials, in its order. Lights may
/// have moved since.
fn warn(
    scene: &mut Scene,
    contents: &Contents,
    solids: &Solids,
    (rays, buffers): (&Rays, &SceneBuffers),
) -> Result<()> {
    let quality = scene.quality.clone();
    let (low, high) = scene.bounds();
    let lost: Vec<String> = lost_lights(solids, &scene.lights).collect();
    scene.warnings.extend(lost);
    let gaps = narrow_cavities::find(rays, buffers, &scene.lights)?;
    let finest = contents.hvds.grid.cell_size() as f32;
    let hemisphere = Hemisphere::new(quality.gather_rays);
    let [resolved, _] = narrow_cavities::resolved(scene.span_m(), finest, hemisphere);
    let requested = grid::Cells::new(low, high, quality.cells, &scene.cell_sizes);
    let cell_size = requested.grid.cell_size() as f32;
    let all_area_m2 = contents.numbers.all_area_m2;
    let told: Vec<String> = undersampled(scene, &gaps, resolved, all_area_m2, cell_size).collect();
    scene.warnings.extend(told);
    scene.warnings.extend(wide_cells(contents.numbers.clearance, &contents.hvds.grid, quality.cells));
    if contents.numbers.is_covering == 0 {
        scene.warnings.push(uncovered(quality.cache_points));
    }
    if !contents.cache_points.is_empty() {
        let outgoing = outgoing_directions(&scene.materials, Directions::new(quality.directions));
        let told: Vec<String> = blurred(&scene.materials, outgoing).collect();
        scene.warnings.extend(told);
    }
    Ok(())
}
