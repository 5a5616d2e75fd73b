//! Antialiasing: the picture of a scene with edges is close to a downscaled picture with many
//! times the pixels.

use crate::common::{assert_silent, context};
use crate::render;
use lightpaths::renderer::{Layer, Renderer, Work};
use lightpaths::scene::{LoadOptions, Quality, Scene};
use std::collections::BTreeMap;
use std::sync::LazyLock;

fn quality() -> Quality {
    Quality {
        preset: "test",
        entry_points: 20_000,
        cache_points: 2_000,
        gather_rays: 64,
        cells: 16,
        ..Quality::DRAFT
    }
}

/// The Box with `pixels` pixels along each edge, and samples of edge pixels.
fn picture(pixels: u32, edge_samples: u32) -> Renderer {
    let set = vec![format!("camera.size=[{pixels},{pixels}]")];
    let scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    render(scene, Quality { edge_samples, ..quality() })
}

const PIXELS: u32 = 64;
const LAYERS: [Layer; 3] = [Layer::Beauty, Layer::Direct, Layer::Indirect];

/// The layers of [`LAYERS`].
type Layers = [Vec<[f32; 3]>; 3];

/// The pictures of both tests, from two precomputations.
struct Pictures {
    /// Eight times the pixels along each edge, no samples of edge pixels.
    large: Layers,
    plain: Layers,
    smooth: Layers,
    fine: Layers,
    /// As `smooth`, rendered after other numbers of samples.
    again: Layers,
    plain_counts: BTreeMap<String, u64>,
    smooth_counts: BTreeMap<String, u64>,
}

static PICTURES: LazyLock<Pictures> = LazyLock::new(|| {
    let layers = |renderer: &Renderer| LAYERS.map(|layer| renderer.layer(layer).unwrap());
    let counts = |renderer: &Renderer| renderer.statistics().unwrap().counts;
    let mut renderer = picture(PIXELS, 0);
    let (plain, plain_counts) = (layers(&renderer), counts(&renderer));
    renderer.resize([8 * PIXELS; 2]).unwrap();
    renderer.frame().unwrap();
    let large = layers(&renderer);
    let mut renderer = picture(PIXELS, 16);
    let (smooth, smooth_counts) = (layers(&renderer), counts(&renderer));
    let [fine, again] = [64, 16].map(|samples| {
        renderer.set_edge_samples(samples).unwrap();
        renderer.force(Work::Everything);
        renderer.frame().unwrap();
        layers(&renderer)
    });
    Pictures { large, plain, smooth, fine, again, plain_counts, smooth_counts }
});

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
    let Pictures { large, plain, smooth, fine, .. } = &*PICTURES;
    for (index, layer) in LAYERS.into_iter().enumerate() {
        let reference = averaged(&large[index], PIXELS as usize, 8);
        let [plain, smooth, fine] = [plain, smooth, fine].map(|layers| relmse(&layers[index], &reference));
        println!("{layer:?}: relMSE {plain:.3e} plain, {smooth:.3e} of 16 samples, {fine:.3e} of 64");
        assert!(plain >= 5.0 * smooth && smooth > fine, "{layer:?}: {plain:e}, {smooth:e}, {fine:e}");
    }
    assert_silent(&context());
}

#[test]
fn pixels_without_an_edge_keep_their_bits_and_layers_add_up() {
    let Pictures { plain, smooth, again, plain_counts, smooth_counts, .. } = &*PICTURES;
    let edges = smooth_counts["edge pixels"] + smooth_counts["shadow edge pixels of all lights"];
    assert_eq!(plain_counts["edge pixels"], 0);
    let changed = plain[0].iter().zip(&smooth[0]).filter(|(before, after)| before != after).count() as u64;
    assert!(
        changed > u64::from(PIXELS) && changed <= edges && edges < u64::from(PIXELS * PIXELS * 3 / 4),
        "{changed} pixels of {edges} changed"
    );
    for layers in [plain, smooth] {
        let [beauty, direct, indirect] = layers.each_ref().map(|layer| layer.as_flattened());
        for ((beauty, direct), indirect) in beauty.iter().zip(direct).zip(indirect) {
            assert!((beauty - direct - indirect).abs() <= 1e-5 * beauty, "{direct} + {indirect} = {beauty}");
        }
    }
    assert!(again == smooth, "the same bytes again");
    assert_silent(&context());
}
