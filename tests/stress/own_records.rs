//! Own records: pixels whose records disagree gather for themselves. The picture follows from the
//! scene alone, as without them.

use crate::common::edits::{TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;
use lightpaths::renderer::{Exact, Layer, Renderer, Stage};
use lightpaths::scene::{Quality, Scene};

const REFINED: Quality = Quality { record_error: 0.15, ..TINY };

/// Renders the view with its own records. Returns their number.
fn refine(renderer: &mut Renderer) -> u32 {
    renderer.frame().unwrap();
    let count = renderer.refine().unwrap();
    renderer.frame().unwrap();
    count
}

fn refined(scene: &Scene) -> Renderer {
    let mut renderer = prepare(scene.clone(), REFINED);
    assert!(refine(&mut renderer) > 0);
    renderer
}

/// Number of pixels whose indirect light differs.
fn changed(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

#[test]
fn only_pixels_whose_records_disagree_change() {
    for may_be_glossy in [false, true] {
        let mut renderer = prepare(scene(may_be_glossy), REFINED);
        // Before the first frame there is no view.
        assert_eq!(renderer.refine().unwrap(), 0);
        renderer.frame().unwrap();
        let plain = renderer.layer(Layer::Indirect).unwrap();
        assert!(
            bits(&renderer) == bits(&refined_by(&scene(may_be_glossy), 1.0).0),
            "the first frame has none"
        );
        let mut before = 0;
        for error in [0.4, 0.15, 0.05] {
            let (other, count) = refined_by(&scene(may_be_glossy), error);
            let changed = changed(&plain, &other.layer(Layer::Indirect).unwrap());
            println!("glossy {may_be_glossy}, {error}: {count} own records, {changed} pixels");
            // Several edge points may be in one pixel.
            assert!(count >= before && changed <= count as usize && (count > 0) == (changed > 0));
            before = count;
        }
        assert!(before > 0);
    }
    assert_silent(&context());
}

fn refined_by(scene: &Scene, record_error: f32) -> (Renderer, u32) {
    let mut renderer = prepare(scene.clone(), Quality { record_error, ..TINY });
    let count = refine(&mut renderer);
    (renderer, count)
}

#[test]
fn an_edited_picture_is_that_of_a_cold_start() {
    for may_be_glossy in [false, true] {
        let mut scene = scene(may_be_glossy);
        let mut renderer = refined(&scene);
        let place = Vec3::new(0.3, 0.5, -0.2);
        renderer.move_light(0, place).unwrap();
        scene.lights[0].kind = scene.lights[0].kind.moved_to(place);
        if may_be_glossy {
            let teapot = scene.materials.iter().position(|material| material.editable).unwrap();
            let (diffuse, specular) = (Vec3::new(0.3, 0.1, 0.2), Vec3::splat(0.4));
            renderer.set_material(teapot, diffuse, specular, 9.0).unwrap();
            let material = &mut scene.materials[teapot];
            (material.diffuse, material.specular, material.exponent) = (diffuse, specular, 9.0);
        }
        renderer.frame().unwrap();
        assert!(bits(&renderer) == bits(&refined(&scene)), "glossy {may_be_glossy}: edited");
        assert!(renderer.is_current());

        // A look at stages leaves the picture, and so do further frames.
        let expected = bits(&renderer);
        let exact = Exact { stage: Stage::Gather, samples: 1, sequence: 0 };
        renderer.layer_with_exact(exact, Layer::Indirect).unwrap();
        renderer.layer_gathered_at_pixels(Layer::Indirect).unwrap();
        renderer.frame().unwrap();
        assert!(bits(&renderer) == expected, "glossy {may_be_glossy}: looked at");
        // They are traced once a view.
        assert!(renderer.refine().unwrap() > 0 && renderer.is_current());

        // A view without own records, then one with its own.
        scene.cameras[0].position += Vec3::new(0.1, 0.0, -0.3);
        renderer.set_camera(&scene.cameras[0]);
        renderer.frame().unwrap();
        let mut plain = prepare(scene.clone(), TINY);
        plain.frame().unwrap();
        assert!(bits(&renderer) == bits(&plain), "glossy {may_be_glossy}: moved");
        refine(&mut renderer);
        assert!(bits(&renderer) == bits(&refined(&scene)), "glossy {may_be_glossy}: moved and refined");
        scene.cameras[0].size = [33, 41];
        renderer.resize([33, 41]).unwrap();
        refine(&mut renderer);
        assert!(bits(&renderer) == bits(&refined(&scene)), "glossy {may_be_glossy}: resized");
    }
    assert_silent(&context());
}

/// Gathers at all pixels have other rays than own records. Both have noise, and at the pixels in
/// question it is less than the error of the records.
#[test]
fn own_records_are_closer_to_a_gather_at_their_pixels() {
    let quality = Quality { cache_points: 300, gather_rays: 576, entry_points: 50_000, cells: 16, ..TINY };
    let indirect = |record_error| {
        let mut renderer = prepare(scene(false), Quality { record_error, ..quality.clone() });
        refine(&mut renderer);
        let gathered = renderer.layer_gathered_at_pixels(Layer::Indirect).unwrap();
        (renderer.layer(Layer::Indirect).unwrap(), gathered)
    };
    let ((plain, gathered), (refined, _)) = (indirect(1.0), indirect(0.15));
    let (mut before, mut after) = (0.0, 0.0);
    for (pixel, gathered) in gathered.iter().enumerate().filter(|&(pixel, _)| plain[pixel] != refined[pixel])
    {
        let off = |found: [f32; 3]| -> f32 { found.iter().zip(gathered).map(|(a, b)| (a - b).powi(2)).sum() };
        before += off(plain[pixel]);
        after += off(refined[pixel]);
    }
    println!("{before:.3e} to {after:.3e}");
    assert!(after < 0.25 * before, "{before} to {after}");
    assert_silent(&context());
}

/// The budget of cache points bounds the number of own records.
#[test]
fn there_are_no_more_own_records_than_cache_points() {
    let few = Quality { record_error: 0.01, cache_points: 150, ..TINY };
    let mut renderer = prepare(scene(false), few);
    assert_eq!(refine(&mut renderer), 150);
    // Without cache points there is nothing that could disagree.
    let mut renderer = prepare(scene(false), Quality { entry_points: 0, cache_points: 0, ..REFINED });
    assert_eq!(refine(&mut renderer), 0);
    assert_silent(&context());
}
