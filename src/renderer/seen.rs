//! A few rays sample what the first camera sees. They test whether the settings resolve it, and
//! which light paths reach it.

use super::Renderer;
use super::precompute::Precomputed;
use super::quality_warnings::{self, FEWEST};
use crate::cpu::brdf::luminance;
use crate::error::Result;
use crate::passes::precompute::rays::{RayAnswer, RayQuery};
use crate::scene::Scene;
use crate::types::{NO_CLUSTER, View};
use glam::Vec3;
use std::collections::HashSet;
use std::f32::consts::TAU;

/// Number of camera rays, across and down.
const RAYS: [u32; 2] = [32, 24];
/// Rays from each hit of a camera ray, spread over the hemisphere.
const AROUND: u32 = 16;
/// Maximum number of levels from a base cluster to the cluster that stands for the surroundings of
/// a point. That cluster is as wide as the spacing of rays at the point.
const LEVELS: u32 = 3;
/// Maximum number of lights that are tested: the first active ones.
const LIGHTS: usize = 16;
/// A light below this fraction of all light is not tested.
const SLIGHT: f64 = 0.02;

/// Surface that the camera sees.
pub(super) struct Seen {
    /// Clusters up to [`LEVELS`] above the base, one for each hit.
    clusters: HashSet<u32>,
    /// Clearances of the hits, metres, in ascending order.
    clearances: Vec<f32>,
}

impl Seen {
    /// Traces the rays.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn new(scene: &Scene, made: &Precomputed) -> Result<Self> {
        let view = View::from(&scene.cameras[0]);
        let queries: Vec<RayQuery> = camera_rays(&view).collect();
        let answers = made.enclosures.rays.trace(&made.buffers, &queries)?;
        // Spacing of two rays at a distance of one metre.
        let spacing = 2.0 * view.right.length() / RAYS[0] as f32;
        let clear = 1e-5 * (scene.bounds().1 - scene.bounds().0).length();
        let (mut clusters, mut around) = (HashSet::new(), Vec::new());
        for (query, answer) in queries.iter().zip(&answers).filter(|(_, answer)| answer.t >= 0.0) {
            let (surface, is_back) = (&made.surfaces[answer.side as usize / 2], answer.side % 2 == 1);
            let (position, normal) = (query.origin + answer.t * query.direction, surface.normal_of(is_back));
            let cell = made.hvds.cell_at(position, normal);
            let Some(cluster) = made.hvds.base_cluster(cell, surface.side_code(is_back), position) else {
                continue;
            };
            let levels = (answer.t * spacing / made.hvds.cell_size_of(cluster))
                .log2()
                .ceil()
                .clamp(0.0, LEVELS as f32) as usize;
            clusters.extend(above(made, cluster).take(1 + levels).last());
            around.extend(hemisphere(position + clear * normal, normal));
        }
        let answers = made.enclosures.rays.trace(&made.buffers, &around)?;
        let nearest = |answers: &[RayAnswer]| {
            let met = answers.iter().filter(|answer| answer.t >= 0.0).map(|answer| answer.t);
            met.fold(f32::INFINITY, f32::min)
        };
        let mut clearances: Vec<f32> = answers.chunks_exact(AROUND as usize).map(nearest).collect();
        clearances.sort_by(f32::total_cmp);
        Ok(Self { clusters, clearances })
    }

    /// Median clearance of the hits, metres. Infinite if there are none.
    pub(super) fn clearance(&self) -> f64 {
        self.clearances
            .get(self.clearances.len() / 2)
            .map_or(f64::INFINITY, |&clearance| f64::from(clearance))
    }

    /// For each light path, whether it brings light to a visible cluster after at
    /// least one reflection.
    pub(super) fn paths(&self, made: &Precomputed) -> Vec<bool> {
        let mut reach = vec![false; made.entry_points.len()];
        for (cluster, runs) in (0..).zip(made.paths.contribution_offsets.windows(3).step_by(2)) {
            let mut around = above(made, cluster).take(1 + LEVELS as usize);
            if around.any(|cluster| self.clusters.contains(&cluster)) {
                let contributions = &made.paths.contributions[runs[1] as usize..runs[2] as usize];
                contributions.iter().for_each(|contribution| reach[contribution.path() as usize] = true);
            }
        }
        reach
    }
}

/// For each light path, whether it brings light to a cluster that the first camera sees. Adds a
/// warning if the settings do not resolve these clusters. Empty if there are no paths.
pub(super) fn paths_to_view(scene: &mut Scene, made: &Precomputed) -> Result<Vec<bool>> {
    if made.entry_points.is_empty() {
        return Ok(Vec::new());
    }
    let seen = Seen::new(scene, made)?;
    // One warning will do.
    if quality_warnings::wide_cells(made.clearance, &made.hvds.grid, scene.quality.cells).is_none() {
        scene.warnings.extend(quality_warnings::wide_cells_in_view(
            seen.clearance(),
            &made.hvds.grid,
            scene.quality.cells,
        ));
    }
    Ok(seen.paths(made))
}

/// Rays through the centres of equal rectangles of the picture, row by row.
fn camera_rays(view: &View) -> impl Iterator<Item = RayQuery> {
    let [columns, rows] = RAYS;
    let middle = |place: u32, count: u32| (place as f32 + 0.5) / count as f32 * 2.0 - 1.0;
    (0..columns * rows).map(move |index| {
        let (x, y) = (middle(index % columns, columns), middle(index / columns, rows));
        RayQuery { origin: view.position, direction: view.forward + x * view.right - y * view.up }
    })
}

/// A base cluster and its ancestors, from the finest level up.
fn above(made: &Precomputed, cluster: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(cluster), |&cluster| {
        Some(made.hvds.parents[cluster as usize]).filter(|&parent| parent != NO_CLUSTER)
    })
}

/// Rays over the hemisphere above a surface, with unit directions.
fn hemisphere(origin: Vec3, normal: Vec3) -> impl Iterator<Item = RayQuery> {
    /// Fraction of a turn between neighbours along the spiral; it keeps them apart.
    const GOLDEN: f32 = 0.381_966;
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (0..AROUND).map(move |index| {
        let height = (index as f32 + 0.5) / AROUND as f32;
        let (sine, cosine) = (TAU * GOLDEN * index as f32).sin_cos();
        let across = (1.0 - height * height).sqrt();
        RayQuery { origin, direction: height * normal + across * (cosine * tangent + sine * bitangent) }
    })
}

#[doc(hidden)]
impl Renderer {
    /// Warns of lights that few light paths carry to the visible clusters. `reach` marks paths
    /// as [`Seen::paths`] does.
    pub(super) fn warn_of_few_paths(&mut self, reach: &[bool]) -> Result<()> {
        if reach.is_empty() {
            return Ok(());
        }
        let mut plan = self.plan();
        // The first active lights alone.
        let traced = plan.lights.iter_mut().filter(|light| light.factors).skip(LIGHTS);
        traced.for_each(|light| light.factors = false);
        self.lights.prepare_near(&plan, &mut self.transport.near_lights)?;
        let lights = self.lights.planned_factors(&plan);
        self.context.run(|rec| {
            self.record_uploads(rec, &plan);
            self.transport.record_factors(rec, &plan, &self.world.buffers, &self.lights);
        })?;
        self.world.buffers.refuse_truncated_loops("form factors", 0)?;
        let mut reaching = Vec::new();
        for (light, factors) in lights {
            // One channel stands for the others.
            if light.channel.is_some_and(|channel| channel > 0) {
                continue;
            }
            let index = self.lights.of_scene(light);
            let factors: Vec<f32> = factors.read_range(0, reach.len())?;
            let brings = factors.iter().zip(self.transport.form_factors.weights()).zip(reach);
            let brings = brings.map(|((factor, weight), reaches)| match reaches {
                true => f64::from(factor * weight),
                false => 0.0,
            });
            let (sum, squares) =
                brings.fold((0.0, 0.0), |(sum, squares), flux| (sum + flux, squares + flux * flux));
            let flux = sum * luminance(self.world.scene.lights[index].kind.emission());
            reaching.push((index, flux, sum * sum / squares));
        }
        let all: f64 = reaching.iter().map(|(_, flux, _)| flux).sum();
        let few = reaching.into_iter().filter(|(_, flux, count)| *count < FEWEST && *flux > SLIGHT * all);
        let warnings: Vec<String> = few
            .map(|(light, _, count)| quality_warnings::few_paths(&self.world.scene, light, count))
            .collect();
        self.world.scene.warnings.extend(warnings);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn camera_rays_are_spread_evenly_over_the_picture() {
        let camera = Camera {
            name: String::new(),
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::new(-1.0, 1.5, 0.5),
            up: Vec3::Y,
            fov_y_degrees: 50.0,
            size: [80, 60],
        };
        let view = View::from(&camera);
        let place = |ray: &RayQuery| {
            let from_axis = ray.direction - view.forward;
            [
                from_axis.dot(view.right) / view.right.length_squared(),
                from_axis.dot(view.up) / view.up.length_squared(),
            ]
        };
        let places: Vec<[f32; 2]> = camera_rays(&view).map(|ray| place(&ray)).collect();
        for (axis, count) in RAYS.into_iter().enumerate() {
            let mut along: Vec<f32> = places.iter().map(|place| place[axis]).collect();
            along.sort_by(f32::total_cmp);
            along.dedup_by(|a, b| (*a - *b).abs() < 1e-4);
            assert_eq!(along.len(), count as usize);
            // The centres of equal intervals of -1 … 1.
            for (index, middle) in along.iter().enumerate() {
                assert!(
                    (middle - ((2 * index + 1) as f32 / count as f32 - 1.0)).abs() < 1e-4,
                    "{axis}: {along:?}"
                );
            }
        }
    }
}
