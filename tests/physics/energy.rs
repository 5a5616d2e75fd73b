//! Energy balance: a closed sphere absorbs the power that the light emits, at every level
//! of the hierarchy.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::{DVec3, Vec3};
use lightpaths::passes::frame::hvds::ClusterFlux;
use lightpaths::renderer::Renderer;
use lightpaths::scene::{grid, hvds::Hvds, shapes, surfaces};
use lightpaths::types::{Contribution, ContributionRange, NO_CLUSTER};
use std::ops::Range;

const FLUX_W: f32 = 3.0;
const ALBEDO: f32 = 0.5;

fn sphere() -> Renderer {
    render(shapes::integrating_sphere(0.8, 3, ALBEDO, Vec3::new(0.1, -0.2, 0.3), FLUX_W), SMALL)
}

/// The hierarchy that the precomputation builds of a scene without unreachable corners.
fn hierarchy(renderer: &Renderer) -> Hvds {
    let scene = renderer.scene();
    let sees = surfaces::sides_that_see_something(&scene.triangles);
    let surfaces: Vec<_> =
        scene.triangles.iter().zip(sees).map(|(t, sees)| surfaces::surface(t, sees)).collect();
    let (low, high) = scene.bounds();
    // The finest level is finer than the requested cells.
    let cells = 2 * scene.quality.cells;
    Hvds::build(&scene.triangles, &surfaces, grid::grid(low, high, cells))
}

/// Flux of the contributions of all vertices, summed in f64.
fn contributed(renderer: &Renderer) -> DVec3 {
    let path_flux = renderer.path_flux().unwrap();
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    // The last contribution is for vertices outside all clusters.
    let (spare, contributions) = contributions.split_last().unwrap();
    assert_eq!(spare.throughput, Vec3::ZERO, "no vertex is outside all clusters");
    let flux = |d: &Contribution| d.throughput.as_dvec3() * path_flux[d.path() as usize].as_dvec3();
    renderer.stages().emission_scale.as_dvec3() * contributions.iter().map(flux).sum::<DVec3>()
}

/// Direct and indirect flux of the clusters' contributions, whatever their accessibility.
fn received(renderer: &Renderer) -> [DVec3; 2] {
    let path_flux = renderer.path_flux().unwrap();
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    let runs: Vec<ContributionRange> = renderer.stages().contribution_ranges.read().unwrap();
    assert!(runs.iter().any(|run| run.is_unweighted == 1), "something is near something");
    let flux = |d: &Contribution| d.throughput.as_dvec3() * path_flux[d.path() as usize].as_dvec3();
    let sum = |range: Range<u32>| -> DVec3 {
        contributions[range.start as usize..range.end as usize].iter().map(flux).sum()
    };
    let own = runs.iter().filter(|run| run.is_unweighted == 0);
    let emission_scale = renderer.stages().emission_scale.as_dvec3();
    let [direct, indirect]: [fn(&ContributionRange) -> Range<u32>; 2] =
        [|run| run.first..run.first_other, |run| run.first_other..run.end];
    [
        emission_scale * own.clone().map(|run| sum(direct(run))).sum::<DVec3>(),
        emission_scale * own.map(|run| sum(indirect(run))).sum::<DVec3>(),
    ]
}

/// Direct and indirect flux of all clusters.
fn cluster_flux(renderer: &Renderer) -> Vec<[DVec3; 2]> {
    let flux: Vec<ClusterFlux> = renderer.stages().cluster_flux.read().unwrap();
    let emission_scale = renderer.stages().emission_scale;
    flux.into_iter()
        .map(|flux| [flux.direct, flux.indirect].map(|part| (emission_scale * part).as_dvec3()))
        .collect()
}

/// Direct and indirect flux of the coarsest level.
fn held(renderer: &Renderer, hvds: &Hvds) -> [DVec3; 2] {
    let roots = hvds.levels.last().unwrap();
    let flux = cluster_flux(renderer);
    [0, 1].map(|part: usize| flux[roots.start as usize..].iter().map(|flux| flux[part]).sum())
}

fn assert_all_close(what: &str, value: DVec3, expected: f64, tolerance: f64) {
    value.to_array().into_iter().for_each(|channel| assert_close(what, channel, expected, tolerance));
}

#[test]
fn all_light_enters_the_paths_and_is_absorbed_in_the_end() {
    let renderer = sphere();
    let [flux, albedo] = [FLUX_W, ALBEDO].map(f64::from);
    let [direct, indirect] = held(&renderer, &hierarchy(&renderer));
    assert_all_close("direct flux", direct, flux, 1e-3);
    assert_all_close("indirect flux", indirect, flux * albedo / (1.0 - albedo), 6e-3);
    assert_all_close("contributed flux", contributed(&renderer), flux / (1.0 - albedo), 3e-3);
    assert_silent(&context());
}

/// In a wedge, entry points are denser where it is lower: their areas must still add up.
#[test]
fn unequally_dense_entry_points_take_in_all_light() {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.2, 1.0), ALBEDO);
    for position in scene.triangles.iter_mut().flat_map(|triangle| &mut triangle.positions) {
        position.y *= position.x + 0.55;
    }
    for triangle in &mut scene.triangles {
        triangle.normals = [triangle.geometric_normal(); 3];
    }
    let renderer = render(scene, SMALL);
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    let heaviest = contributions.iter().map(|contribution| contribution.throughput.x).fold(0.0, f32::max);
    assert!(heaviest > 1.5, "densities vary: {heaviest}");
    let flux = 4.0 * std::f64::consts::PI;
    let [direct, indirect] = received(&renderer);
    println!("direct {:.5}, indirect {:.5} of {flux:.5} W", direct.x, indirect.x);
    assert_all_close("direct flux", direct, flux, 5e-3);
    assert_all_close("indirect flux", indirect, flux, 1e-2);
    assert_silent(&context());
}

#[test]
fn parents_hold_the_sums_of_their_children_and_levels_the_whole() {
    let renderer = sphere();
    let hvds = hierarchy(&renderer);
    let flux = cluster_flux(&renderer);
    let mut irradiance: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    irradiance.iter_mut().for_each(|irradiance| *irradiance *= renderer.stages().emission_scale);
    assert_eq!(flux.len(), hvds.cluster_count() as usize);
    let whole = contributed(&renderer);
    let entry_area = (renderer.scene().area_m2() / f64::from(SMALL.entry_points)) as f32;
    let area = |cluster: usize| {
        let is_root = hvds.parents[cluster] == NO_CLUSTER;
        match hvds.areas_m2[cluster].max(if is_root { entry_area } else { 0.0 }) {
            // Without an area, the irradiance does not count.
            0.0 => f64::INFINITY,
            area_m2 => f64::from(area_m2),
        }
    };
    let root = hvds.levels.last().unwrap().clone().map(|cluster| cluster as usize);
    let everywhere =
        root.clone().map(|cluster| flux[cluster][1]).sum::<DVec3>() / root.map(area).sum::<f64>();
    let (mut borrowing, mut lent_by_records) = (0, 0);
    for (depth, level) in hvds.levels.iter().enumerate() {
        let clusters = level.start as usize..level.end as usize;
        let sum: DVec3 = flux[clusters.clone()].iter().map(|[direct, indirect]| *direct + *indirect).sum();
        assert_all_close(&format!("level {depth}"), sum, whole.x, 1e-5);
        for cluster in clusters {
            // A root cluster's flux is divided by at least the area of an entry point; indirect
            // light may be that of a cluster around it.
            let irradiance = irradiance[cluster].as_dvec3();
            let mut source = cluster;
            let stored = |source: usize| flux[cluster][0] / area(cluster) + flux[source][1] / area(source);
            while !irradiance.abs_diff_eq(stored(source), 2e-6 * irradiance.x) {
                if hvds.parents[source] == NO_CLUSTER {
                    // Then the cluster is small, near others, and has the irradiance of a record,
                    // which is the same everywhere here.
                    let lent = irradiance - flux[cluster][0] / area(cluster);
                    assert!(depth < 2, "cluster {cluster} of level {depth}: {irradiance} of no source");
                    assert!(lent.abs_diff_eq(everywhere, 0.1 * everywhere.x), "{lent} where {everywhere} is");
                    lent_by_records += 1;
                    break;
                }
                source = hvds.parents[source] as usize;
            }
            borrowing += usize::from(source != cluster);
            if depth > 0 {
                let children = hvds.children_of(cluster as u32).iter().map(|&child| flux[child as usize]);
                for part in [0, 1] {
                    let sum: DVec3 = children.clone().map(|flux| flux[part]).sum();
                    assert!(
                        sum.abs_diff_eq(flux[cluster][part], 1e-5 * sum.x),
                        "cluster {cluster}: {sum} {}",
                        flux[cluster][part]
                    );
                }
            }
        }
    }
    // 50 000 vertices on some thousands of clusters: the smallest have too few of them.
    println!("{borrowing} of {} clusters borrow, {lent_by_records} from records", flux.len());
    assert!(lent_by_records > 0);
    assert!(borrowing > 0 && borrowing < flux.len());
    assert_silent(&context());
}

#[test]
fn an_edited_albedo_reweights_the_paths_exactly() {
    let mut renderer = sphere();
    // Paths end with the probability of the albedo at tracing: far above it, few paths
    // carry much flux.
    for (albedo, tolerance) in [(0.1_f32, 2e-3), (0.3, 2e-3), (0.6, 1e-2)] {
        renderer.set_diffuse(0, Vec3::splat(albedo)).unwrap();
        renderer.frame().unwrap();
        let expected = f64::from(FLUX_W) / (1.0 - f64::from(albedo));
        assert_all_close(&format!("albedo {albedo}"), contributed(&renderer), expected, tolerance);
    }
    assert_silent(&context());
}
