//! Interpenetrating solids: interior surface does not count as surface. And very small clusters.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::Vec3;
use lightpaths::passes::frame::hvds::ClusterFlux;
use lightpaths::renderer::{Exact, Layer, Stage};
use lightpaths::scene::{Quality, Scene, Triangle, shapes};
use lightpaths::types::Record;

/// A cube of 2 m seen from inside, with a slab of 2 cm sunk into its floor to half its height.
/// Nearly all of the floor is interior, in the same cells as the slab's top.
fn tiled_room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    let slab = shapes::closed_box(Vec3::new(1.9, 0.02, 1.9), 0.5).triangles;
    scene.triangles.extend(slab.into_iter().map(
        |Triangle { positions: [a, b, c], normals, material, .. }| {
            let positions = [a, c, b].map(|corner| corner - Vec3::Y);
            Triangle { positions, normals: normals.map(|normal| -normal), material, object: 0 }
        },
    ));
    scene
}

/// The same with another slab inside the first: surface under both sees the outer side of the
/// inner slab first.
fn nested_room() -> Scene {
    let mut scene = tiled_room();
    let inner = shapes::closed_box(Vec3::new(1.88, 0.004, 1.88), 0.5).triangles;
    scene.triangles.extend(inner.into_iter().map(
        |Triangle { positions: [a, b, c], normals, material, .. }| {
            let positions = [a, c, b].map(|corner| corner - 0.994 * Vec3::Y);
            Triangle { positions, normals: normals.map(|normal| -normal), material, object: 0 }
        },
    ));
    scene
}

/// A slab over the floor with a gap, metres: the floor under it is not in a solid.
fn covered_room(gap: f32) -> Scene {
    let mut scene = tiled_room();
    for corner in scene.triangles[12..].iter_mut().flat_map(|triangle| &mut triangle.positions) {
        corner.y += 0.01 + gap;
    }
    scene
}

/// Relative error of the irradiance of all records.
fn error(scene: Scene, quality: Quality) -> f32 {
    let renderer = render(scene, quality);
    let exact = Exact { stage: Stage::Clusters, samples: 4, sequence: 0 };
    let expected: f32 = renderer.exact_irradiance(exact).unwrap().iter().map(|exact| exact.x).sum();
    let records: Vec<Record> = renderer.stages().gathered.read().unwrap();
    let found: f32 = records.iter().map(|record| record.irradiance.x).sum();
    found / expected - 1.0
}

#[test]
fn what_is_inside_a_solid_takes_no_light_away() {
    // Cells have few entry points: their paths must not decide whether a cell is read.
    let rooms = [
        ("one slab", tiled_room(), 16),
        ("nested", nested_room(), 16),
        ("small cells", tiled_room(), 64),
        ("a gap", covered_room(5e-4), 16),
    ];
    for (name, scene, cells) in rooms {
        let error = error(scene, Quality { entry_points: 100_000, cells, ..SMALL });
        println!("{name}: irradiance of all records {:+.2} %", 100.0 * error);
        assert!(error.abs() < 0.015, "{name}: {error}");
    }
    assert_silent(&context());
}

/// Records on a floor do not count for the top of a slab that covers it.
#[test]
fn what_is_covered_does_not_speak_for_what_covers_it() {
    // The gap is too wide for its floor to count as covered. There are enough records to resolve
    // the corner around the slab.
    let mut scene = covered_room(0.012);
    scene.cameras[0].target = Vec3::new(0.0, -1.0, 0.2);
    let renderer =
        render(scene, Quality { entry_points: 100_000, cache_points: 1_600, gather_rays: 144, ..SMALL });
    let energy =
        |pixels: Vec<[f32; 3]>| pixels.as_flattened().iter().map(|value| f64::from(*value)).sum::<f64>();
    let splatted = energy(renderer.layer(Layer::Indirect).unwrap());
    let gathered = energy(renderer.layer_gathered_at_pixels(Layer::Indirect).unwrap());
    println!("splatted {:+.2} % off what is gathered at pixels", 100.0 * (splatted / gathered - 1.0));
    assert_close("indirect light", splatted, gathered, 0.02);
    assert_silent(&context());
}

/// Clusters hold all light, even if they are small beside the area of an entry point.
#[test]
fn irradiance_times_area_is_the_flux_of_every_cluster() {
    let scene = shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.0);
    let renderer = render(scene, Quality { entry_points: 2_000, cells: 64, ..SMALL });
    let stages = renderer.stages();
    let irradiance: Vec<Vec3> = stages.cluster_irradiance.read().unwrap();
    let flux: Vec<ClusterFlux> = stages.cluster_flux.read().unwrap();
    let inverse_areas: Vec<f32> = stages.inverse_areas.read().unwrap();
    let mut lit = 0;
    for (cluster, flux) in flux.iter().enumerate() {
        let [found, inverse] = [irradiance[cluster].x, inverse_areas[cluster]].map(f64::from);
        // A cluster with flux has an area.
        if flux.direct.x > 0.0 {
            lit += 1;
            assert_close(&format!("flux of cluster {cluster}"), found / inverse, flux.direct.x.into(), 1e-5);
        }
    }
    assert!(lit > 2_000, "{lit} clusters hold light");
    assert_silent(&context());
}
