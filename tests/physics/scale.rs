//! Small things on large grounds: light that cells of one size would carry through walls.

use crate::common::{assert_silent, context};
use crate::{assert_close, render};
use lightpaths::reference::{PathTracer, Progressive};
use lightpaths::renderer::{Layer, Silent};
use lightpaths::scene::{LoadOptions, Quality, Scene};
use std::fmt::Write;
use std::fs;

/// Irradiance of the sun on the ground, W/m²: it stands at 45°.
const SUN: f64 = 10.0;

/// Appends a closed box to a model.
fn add_box(model: &mut String, count: &mut u32, low: [f32; 3], high: [f32; 3]) {
    for corner in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|axis| [low, high][corner >> axis & 1][axis]);
        writeln!(model, "v {x} {y} {z}").unwrap();
    }
    for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        let [a, b, c, d] = face.map(|corner| *count + corner);
        writeln!(model, "f {a} {b} {c} {d}").unwrap();
    }
    *count += 8;
}

/// A hut of 4×3×4 m with walls of 0.2 m on a ground of that width, with or without a doorway to the
/// sun. The camera is inside.
fn hut(ground_m: f32, has_door: bool) -> Scene {
    let (mut model, mut count) = ("mtllib m.mtl\nusemtl white\n".to_owned(), 0);
    let (out, inside) = (2.0, 1.8);
    add_box(&mut model, &mut count, [-out, 2.8, -out], [out, 3.0, out]);
    add_box(&mut model, &mut count, [-out, 0.0, -out], [-inside, 2.8, out]);
    add_box(&mut model, &mut count, [inside, 0.0, -out], [out, 2.8, out]);
    add_box(&mut model, &mut count, [-inside, 0.0, -out], [inside, 2.8, -inside]);
    let front: &[[f32; 4]] = match has_door {
        true => &[[-inside, 0.0, -0.5, 2.8], [0.5, 0.0, inside, 2.8], [-0.5, 2.0, 0.5, 2.8]],
        false => &[[-inside, 0.0, inside, 2.8]],
    };
    for &[left, bottom, right, top] in front {
        add_box(&mut model, &mut count, [left, bottom, inside], [right, top, out]);
    }
    let g = 0.5 * ground_m;
    write!(model, "usemtl ground\nv {} 0 {g}\nv {g} 0 {g}\nv {g} 0 {}\nv {} 0 {}\n", -g, -g, -g, -g).unwrap();
    writeln!(model, "f -4 -3 -2 -1").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("m.obj", &model);
    write("m.mtl", "newmtl white\nKd .7 .7 .7\nnewmtl ground\nKd .5 .5 .5\n");
    let irradiance = SUN * 2.0f64.sqrt();
    write(
        "hut.toml",
        &format!(
            "[[model]]\nfile = \"m.obj\"\n[camera]\nposition = [1.4, 1.9, 1.5]\ntarget = [-0.6, 0.5, -1.2]\n\
             fov_y = 65\nsize = [32, 24]\n[[light]]\nname = \"sun\"\nkind = \"directional\"\n\
             direction = [-0.2, -0.7071, -0.678]\nirradiance = [{irradiance}, {irradiance}, {irradiance}]\n"
        ),
    );
    let file = folder.path().join("hut.toml");
    let scene = Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(scene.cell_sizes.regions.is_empty(), ground_m < 50.0);
    scene
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64
}

const FEW: Quality = Quality {
    entry_points: 200_000,
    cache_points: 4_000,
    gather_rays: 144,
    cells: 32,
    edge_samples: 0,
    ..Quality::DRAFT
};

#[test]
fn no_light_comes_into_a_closed_hut_on_a_large_ground() {
    for ground_m in [200.0, 1_000.0] {
        let found = render(hut(ground_m, false), FEW).layer(Layer::Beauty).unwrap();
        let lit = SUN * 0.5 / std::f64::consts::PI;
        assert!(mean(&found) <= 1e-3 * lit, "{} of {lit} on {ground_m} m", mean(&found));
    }
    assert_silent(&context());
}

#[test]
fn a_hut_on_a_large_ground_is_as_bright_as_it_is() {
    let mut tracer = PathTracer::new(&context(), hut(200.0, true), &mut Silent).unwrap();
    tracer.add_samples(2_048).unwrap();
    let exact = mean(&tracer.picture().unwrap().beauty);
    for ground_m in [200.0, 1_000.0] {
        let found = render(hut(ground_m, true), FEW).layer(Layer::Beauty).unwrap();
        assert_close(&format!("on {ground_m} m"), mean(&found), exact, 0.03);
    }
    assert_silent(&context());
}
