//! Antialiasing: the picture of a scene with edges comes close to what many times the pixels show.

use crate::common::{assert_silent, context};
use crate::render;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{LoadOptions, Quality, Scene};

const QUALITY: Quality = Quality {
    preset: "test",
    entry_points: 20_000,
    cache_points: 6_000,
    gather_rays: 64,
    cells: 16,
    ..Quality::DRAFT
};

/// The Box with as many pixels along each edge, and samples on its edges.
fn picture(pixels: u32, edge_samples: u32) -> Renderer {
    let set = vec![format!("camera.size=[{pixels},{pixels}]")];
    let scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    render(scene, Quality { edge_samples, ..QUALITY })
}

/// Means over blocks of `factor`² pixels.
fn averaged(image: &[[f32; 3]], pixels: usize, factor: usize) -> Vec<[f32; 3]> {
    let wide = pixels * factor;
    let block = |index: usize| {
        let (x, y) = (index % pixels * factor, index / pixels * factor);
        let mut sum = [0.0_f64; 3];
        for (row, column) in (0..factor * factor).map(|i| (y + i / factor, x + i % factor)) {
            for (sum, value) in sum.iter_mut().zip(image[row * wide + column]) {
                *sum += f64::from(value);
            }
        }
        sum.map(|sum| (sum / (factor * factor) as f64) as f32)
    };
    (0..pixels * pixels).map(block).collect()
}

fn relmse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let term = |(v, r): (&f32, &f32)| {
        let (v, r) = (f64::from(*v), f64::from(*r));
        ((v - r) / (r + 0.01)).powi(2)
    };
    let values = image.as_flattened().iter().zip(reference.as_flattened());
    values.map(term).sum::<f64>() / image.as_flattened().len() as f64
}

#[test]
fn edges_come_close_to_many_times_the_pixels() {
    const PIXELS: u32 = 64;
    let large = picture(8 * PIXELS, 0);
    let [plain, smooth, fine] = [0, 16, 64].map(|samples| picture(PIXELS, samples));
    for layer in [Layer::Beauty, Layer::Direct, Layer::Indirect] {
        let reference = averaged(&large.layer(layer).unwrap(), PIXELS as usize, 8);
        let [plain, smooth, fine] =
            [&plain, &smooth, &fine].map(|renderer| relmse(&renderer.layer(layer).unwrap(), &reference));
        println!("{layer:?}: relMSE {plain:.3e} plain, {smooth:.3e} of 16 samples, {fine:.3e} of 64");
        assert!(plain >= 5.0 * smooth && smooth > fine, "{layer:?}: {plain:e}, {smooth:e}, {fine:e}");
    }
    assert_silent(&context());
}

#[test]
fn pixels_without_an_edge_keep_their_bits_and_layers_add_up() {
    let [plain, smooth] = [0, 16].map(|samples| picture(48, samples));
    let [before, after] = [&plain, &smooth].map(|renderer| renderer.layer(Layer::Beauty).unwrap());
    let counts = smooth.statistics().unwrap().counts;
    let edges = counts["edge pixels"] + counts["shadow edge pixels of all lights"];
    assert_eq!(plain.statistics().unwrap().counts["edge pixels"], 0);
    let changed = before.iter().zip(&after).filter(|(before, after)| before != after).count() as u64;
    assert!(
        changed > 48 && changed <= edges && edges < 48 * 48 * 3 / 4,
        "{changed} pixels of {edges} changed"
    );
    for renderer in [&plain, &smooth] {
        let [beauty, direct, indirect] = [Layer::Beauty, Layer::Direct, Layer::Indirect]
            .map(|layer| renderer.layer(layer).unwrap().into_flattened());
        for ((beauty, direct), indirect) in beauty.iter().zip(direct).zip(indirect) {
            assert!((beauty - direct - indirect).abs() <= 1e-5 * beauty, "{direct} + {indirect} = {beauty}");
        }
    }
    assert!(picture(48, 16).layer(Layer::Beauty).unwrap() == after, "the same bytes again");
    assert_silent(&context());
}
