//! Energy balance: what a closed sphere absorbs is what the light emits, at every level of the hierarchy.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::{Edit, Renderer};
use lightpaths::scene::{grid, hvds::Hvds, shapes, surfaces};
use lightpaths::types::Deposit;

const FLUX_W: f32 = 3.0;
const ALBEDO: f32 = 0.5;

fn sphere() -> Renderer {
    render(shapes::integrating_sphere(0.8, 3, ALBEDO, Vec3::new(0.1, -0.2, 0.3), FLUX_W), SMALL)
}

/// The hierarchy that the precomputation must have made of a scene without unreachable corners.
fn hierarchy(renderer: &Renderer) -> Hvds {
    let scene = renderer.scene();
    let sees = surfaces::sides_that_see_something(&scene.triangles);
    let surfaces: Vec<_> =
        scene.triangles.iter().zip(sees).map(|(t, sees)| surfaces::surface(t, sees)).collect();
    let (low, high) = scene.bounds();
    let cells = scene.quality.cells;
    Hvds::build(&scene.triangles, &surfaces, grid::grid(low, high, cells), cells)
}

fn read_f64(buffer: &lightpaths::gpu::Buffer) -> Vec<DVec3> {
    buffer.read::<Vec3>().unwrap().into_iter().map(Vec3::as_dvec3).collect()
}

/// Flux that all vertices deposit, summed in f64.
fn deposited(renderer: &Renderer) -> DVec3 {
    let path_flux = read_f64(renderer.stages().path_flux);
    let deposits: Vec<Deposit> = renderer.stages().deposits.read().unwrap();
    // The last one is there for vertices that no cluster holds.
    let (spare, deposits) = deposits.split_last().unwrap();
    assert_eq!(spare.throughput, Vec3::ZERO, "no vertex is outside all clusters");
    deposits.iter().map(|d| d.throughput.as_dvec3() * path_flux[d.path as usize]).sum()
}

fn assert_all_close(what: &str, value: DVec3, expected: f64, tolerance: f64) {
    value.to_array().into_iter().for_each(|channel| assert_close(what, channel, expected, tolerance));
}

#[test]
fn all_light_enters_the_paths_and_is_absorbed_in_the_end() {
    let renderer = sphere();
    let flux = f64::from(FLUX_W);
    let direct: DVec3 = read_f64(renderer.stages().path_flux).into_iter().sum();
    assert_all_close("direct flux", direct, flux, 1e-3);
    assert_all_close("deposited flux", deposited(&renderer), flux / (1.0 - f64::from(ALBEDO)), 3e-3);
    assert_silent(&context());
}

#[test]
fn parents_hold_the_sums_of_their_children_and_levels_the_whole() {
    let renderer = sphere();
    let hvds = hierarchy(&renderer);
    let flux = read_f64(renderer.stages().cluster_flux);
    let irradiance = read_f64(renderer.stages().cluster_irradiance);
    assert_eq!(flux.len(), hvds.cluster_count() as usize);
    let whole = deposited(&renderer);
    let entry_area = renderer.scene().area_m2() / f64::from(SMALL.entry_points);
    for (depth, level) in hvds.levels.iter().enumerate() {
        let clusters = level.start as usize..level.end as usize;
        let sum: DVec3 = flux[clusters.clone()].iter().sum();
        assert_all_close(&format!("level {depth}"), sum, whole.x, 1e-5);
        for cluster in clusters {
            // Nothing is divided by less than the area of an entry point.
            let area = f64::from(hvds.areas_m2[cluster]).max(entry_area);
            let stored = irradiance[cluster] * area;
            assert!(stored.abs_diff_eq(flux[cluster], 1e-6 * flux[cluster].x), "cluster {cluster}");
            if depth > 0 {
                let children =
                    hvds.first_children[cluster] as usize..hvds.first_children[cluster + 1] as usize;
                let sum: DVec3 = flux[children].iter().sum();
                assert!(
                    sum.abs_diff_eq(flux[cluster], 1e-5 * sum.x),
                    "cluster {cluster}: {sum} {}",
                    flux[cluster]
                );
            }
        }
    }
    assert_silent(&context());
}

#[test]
fn an_edited_albedo_reweights_the_paths_exactly() {
    let mut renderer = sphere();
    // Paths end with the odds of the albedo they were traced for: far above it, few carry much.
    for (albedo, tolerance) in [(0.1_f32, 2e-3), (0.3, 2e-3), (0.6, 1e-2)] {
        renderer.set_diffuse(0, Vec3::splat(albedo)).unwrap();
        renderer.frame(Edit::Material).unwrap();
        let expected = f64::from(FLUX_W) / (1.0 - f64::from(albedo));
        assert_all_close(&format!("albedo {albedo}"), deposited(&renderer), expected, tolerance);
    }
    assert_silent(&context());
}
