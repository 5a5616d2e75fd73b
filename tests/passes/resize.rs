//! A resized picture has the same bits, and takes the same memory, as after a cold start
//! at that size.

use crate::common::{assert_silent, context};
use crate::world::{glossy, textured};
use glam::Vec3;
use lightpaths::Error;
use lightpaths::gpu::Context;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, Quality, Scene, shapes};
use std::time::Instant;

/// A room with a hole, two materials and two lights, one of them large.
fn scene() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    scene.quality =
        Quality { entry_points: 3_000, cache_points: 300, gather_rays: 64, cells: 8, ..Quality::DRAFT };
    scene.triangles.truncate(scene.triangles.len() - 2);
    scene.materials.push(scene.materials[0].clone());
    scene.triangles.iter_mut().skip(1).step_by(3).for_each(|triangle| triangle.material = 1);
    let (edge_u, edge_v) = (Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2));
    let corner = Vec3::new(0.1, 0.3, 0.1);
    let kind = LightKind::Area { corner, edge_u, edge_v, radiance: Vec3::new(1.0, 2.0, 3.0), samples: 20 };
    scene.lights.push(Light::new("large", kind));
    scene
}

fn cold(mut scene: Scene, size: [u32; 2]) -> Renderer {
    scene.cameras[0].size = size;
    Renderer::new(&context(), scene, &mut Silent).unwrap()
}

/// All image layers of a frame, as words.
fn bits(renderer: &Renderer) -> Vec<u32> {
    let layers = [Layer::Beauty, Layer::Direct, Layer::Indirect, Layer::Albedo, Layer::Normal, Layer::Depth];
    let layers = layers.iter().flat_map(|layer| renderer.layer(*layer).unwrap());
    let mut words: Vec<u32> = layers.flat_map(|pixel| pixel.map(f32::to_bits)).collect();
    words.extend(renderer.display().unwrap().into_iter().map(u32::from_le_bytes));
    words
}

fn memory() -> u64 {
    context().memory().current_bytes
}

#[test]
fn a_picture_of_another_size_is_that_of_a_cold_start() {
    for (what, scene) in
        [("diffuse", scene()), ("textured", textured(scene())), ("glossy", textured(glossy(scene())))]
    {
        let [small, odd] = [[40, 32], [67, 29]];
        let before = memory();
        let mut other = cold(scene.clone(), odd);
        other.frame().unwrap();
        let at_odd = bits(&other);
        drop(other);
        assert_eq!(memory(), before);

        let mut renderer = cold(scene.clone(), small);
        // The table of lights keeps its capacity.
        let third = Light::new("third", renderer.scene().lights[0].kind);
        renderer.add_light(third.clone()).unwrap();
        renderer.remove_light(2).unwrap();
        renderer.frame().unwrap();
        let (at_small, taken) = (bits(&renderer), memory());
        // The size changes after an edit that is not rendered yet.
        let light = renderer.scene().lights[0].kind;
        renderer.set_light(0, light.with_emission(Vec3::new(3.0, 1.0, 2.0))).unwrap();
        let start = Instant::now();
        renderer.resize(odd).unwrap();
        println!("{what}: resized in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
        assert_eq!((renderer.size(), renderer.scene().cameras[0].size), (odd, odd));
        renderer.frame().unwrap();
        renderer.set_light(0, light).unwrap();
        renderer.frame().unwrap();
        assert!(bits(&renderer) == at_odd, "{what}: {odd:?} as a cold start has it");
        // A later light has buffers of this size; a light that was off is traced when it
        // is switched on.
        renderer.add_light(third.clone()).unwrap();
        renderer.frame().unwrap();
        if what == "glossy" {
            let lights = [scene.lights.clone(), vec![third]].concat();
            let mut other = cold(Scene { lights, ..scene }, odd);
            other.frame().unwrap();
            assert!(bits(&renderer) == bits(&other), "a light added at {odd:?}");
        }
        renderer.switch_light(1, false).unwrap();
        renderer.resize(small).unwrap();
        renderer.frame().unwrap();
        renderer.switch_light(1, true).unwrap();
        renderer.remove_light(2).unwrap();
        renderer.frame().unwrap();
        assert!(bits(&renderer) == at_small, "{what}: {small:?} as it was");
        assert_eq!(memory(), taken, "{what}");
        renderer.resize(small).unwrap();
        assert!(renderer.frame().unwrap().passes.iter().all(|pass| pass.name != "primary"), "{what}");
    }
    assert_silent(&context());
}

/// If no light is active, only the resize makes the sum over lights stale.
#[test]
fn a_larger_picture_without_light_is_black() {
    let mut renderer = cold(scene(), [16, 16]);
    renderer.frame().unwrap();
    (0..2).for_each(|light| renderer.switch_light(light, false).unwrap());
    renderer.frame().unwrap();
    // The memory of an earlier picture.
    renderer.resize([97, 31]).unwrap();
    let report = renderer.frame().unwrap();
    assert!(report.passes.iter().any(|pass| pass.name == "direct_sum"));
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    renderer.set_edge_samples(4).unwrap();
    let report = renderer.frame().unwrap();
    assert!(report.passes.iter().any(|pass| pass.name == "direct_sum"));
    assert_silent(&context());
}

#[test]
fn a_size_that_cannot_be_changes_nothing() {
    let mut renderer = cold(scene(), [64, 48]);
    renderer.frame().unwrap();
    let (expected, taken) = (bits(&renderer), memory());
    let binds = context().limits().storage_range_bytes;
    // The device refuses the larger size if it exceeds a binding.
    for size in [[0, 48], [64, 0], [16385, 1], [16384, 16384]] {
        if size == [16384, 16384] && binds >= 40 << 28 {
            continue;
        }
        match (size, renderer.resize(size)) {
            ([16384, 16384], Err(Error::OutOfMemory(_))) | (_, Err(Error::Usage(_))) => {}
            (_, found) => panic!("{size:?}: {found:?}"),
        }
        assert_eq!((renderer.size(), memory()), ([64, 48], taken));
        assert!(renderer.frame().unwrap().passes.iter().all(|pass| pass.name != "primary"));
        assert!(bits(&renderer) == expected);
    }
    assert_silent(&context());
}

/// A window precomputes in one thread and draws in another.
#[test]
fn renderers_can_be_handed_to_another_thread() {
    fn is_send<T: Send>() {}
    fn is_sync<T: Sync>() {}
    is_send::<Renderer>();
    is_sync::<Context>();
    let scene = scene();
    let made = std::thread::spawn(move || cold(scene, [64, 48]));
    let mut renderer = made.join().unwrap();
    renderer.frame().unwrap();
    assert!(bits(&renderer).iter().any(|word| *word != 0));
    assert_silent(&context());
}
