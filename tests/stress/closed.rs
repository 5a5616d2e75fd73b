//! Enclosures: after the camera or a light enters and leaves one, the picture is that of
//! a cold start.

use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::{prepare, the_box};
use glam::Vec3;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, Quality, Scene, Triangle, shapes};

const SMALL: Quality = Quality {
    preset: "test",
    entry_points: 2_000,
    cache_points: 300,
    gather_rays: 32,
    cells: 16,
    ..Quality::DRAFT
};

/// Centres of two chambers beside the Box.
const BLOCK: Vec3 = Vec3::new(3.0, 0.0, 0.0);
const CELL: Vec3 = Vec3::new(-3.0, 0.0, 0.0);

/// The Box without its teapot and without its front, with a solid block and a chamber. The chamber
/// is a surface wound inwards, in a shell with a hole in its corner, so it is no watertight solid.
fn scene() -> Scene {
    let mut scene = the_box(&["camera.size=[40,30]".to_owned()]);
    let teapot = scene.materials.iter().position(|material| material.name == "teapot").unwrap();
    scene.triangles.retain(|triangle| triangle.material as usize != teapot);
    let mut add = |size: f32, middle: Vec3, turn: bool, count: usize| {
        let chamber = shapes::closed_box(Vec3::splat(size), 0.5);
        scene.triangles.extend(chamber.triangles.iter().take(count).map(|triangle| {
            let [a, b, c] = triangle.positions.map(|corner| corner + middle);
            let positions = if turn { [a, c, b] } else { [a, b, c] };
            let normals = if turn { triangle.normals.map(|normal| -normal) } else { triangle.normals };
            Triangle { positions, normals, material: 0, object: 0 }
        }));
    };
    add(1.0, BLOCK, true, 12);
    add(1.0, CELL, false, 12);
    add(1.1, CELL, true, 11);
    scene
}

/// Exposure of the displayed picture, stops.
const EXPOSURE: f32 = 2.0;

fn look_from(renderer: &mut Renderer, middle: Vec3) {
    renderer.move_camera(middle + 0.3 * Vec3::Z, middle);
}

/// A renderer that starts with the state of another, after its first frame.
fn cold(other: &Renderer, places: &[Vec3]) -> Renderer {
    let mut scene = scene();
    scene.lights.clone_from(&other.scene().lights);
    scene.cameras.clone_from(&other.scene().cameras);
    scene.interior_viewpoints = places.to_vec();
    let mut renderer = prepare(scene, SMALL);
    renderer.set_exposure(EXPOSURE);
    (0..other.scene().lights.len()).for_each(|light| {
        renderer.switch_light(light, other.light_is_on(light)).unwrap();
    });
    renderer.frame().unwrap();
    renderer
}

/// Renders a frame, after another precomputation if the last edit needs one.
fn frame(renderer: &mut Renderer) {
    let is_due = renderer.needs_precompute();
    if is_due {
        assert!(renderer.frame().unwrap().needs_precompute, "a frame does not precompute");
        let indirect = renderer.layer(Layer::Indirect).unwrap();
        assert!(indirect.iter().all(|pixel| *pixel == [0.0; 3]), "no light path is there yet");
    }
    assert_eq!(renderer.open_enclosures(&mut Silent).unwrap(), is_due);
    assert!(!renderer.frame().unwrap().needs_precompute);
}

fn brightest(renderer: &Renderer, layer: Layer) -> f32 {
    renderer.layer(layer).unwrap().into_iter().flatten().fold(0.0, f32::max)
}

#[test]
fn light_and_camera_enter_enclosures_as_if_they_had_always_been_there() {
    let mut scene = scene();
    // A light that stays outside and is off.
    let kind = LightKind::Point { position: Vec3::new(0.0, 0.5, 0.0), intensity: Vec3::ONE };
    scene.lights.push(Light::new("behind", kind));
    let start = scene.cameras[0].clone();
    let mut edited = prepare(scene, SMALL);
    edited.switch_light(1, false).unwrap();
    edited.set_exposure(EXPOSURE);
    frame(&mut edited);
    let outside = bits(&edited);
    let home = edited.scene().lights[0].kind.position().unwrap();

    for (count, middle) in [(1, BLOCK), (2, CELL)] {
        // Only the light enters: it is not visible, and the enclosure stays closed.
        edited.move_light(0, middle).unwrap();
        frame(&mut edited);
        assert_eq!(
            (brightest(&edited, Layer::Beauty), edited.scene().interior_viewpoints.len()),
            (0.0, count - 1)
        );
        let alone = cold(&edited, &edited.scene().interior_viewpoints);
        assert!(bits(&edited) == bits(&alone), "light in {middle}");
        let is_told = |warning: &String| warning.starts_with("light `lamp` is inside a closed surface");
        // The warning is only for solids; an open surface may let light through.
        assert_eq!(alone.scene().warnings.iter().any(is_told), middle == BLOCK);
        // Only the camera enters: the picture is dark.
        edited.move_light(0, home).unwrap();
        look_from(&mut edited, middle);
        frame(&mut edited);
        assert_eq!(
            (brightest(&edited, Layer::Beauty), edited.scene().interior_viewpoints.len()),
            (0.0, count - 1)
        );
        assert!(
            bits(&edited) == bits(&cold(&edited, &edited.scene().interior_viewpoints)),
            "camera in {middle}"
        );
        // Camera and light are in different enclosures.
        edited.move_light(0, -middle).unwrap();
        frame(&mut edited);
        assert_eq!(
            (brightest(&edited, Layer::Beauty), edited.scene().interior_viewpoints.len()),
            (0.0, count - 1)
        );
        // Both are in one enclosure. The light enters last in one case, the camera in the other.
        if middle == CELL {
            edited.set_camera(&start);
            edited.move_light(0, middle).unwrap();
            frame(&mut edited);
            assert_eq!(edited.scene().interior_viewpoints.len(), count - 1);
            look_from(&mut edited, middle);
        } else {
            edited.move_light(0, middle).unwrap();
        }
        frame(&mut edited);
        assert_eq!(edited.scene().interior_viewpoints.len(), count);
        assert!(brightest(&edited, Layer::Direct) > 0.1 && brightest(&edited, Layer::Indirect) > 0.01);
        let before = &edited.scene().interior_viewpoints[..count - 1];
        let other = cold(&edited, before);
        assert!(bits(&edited) == bits(&other), "both in {middle}");
        assert!(edited.display().unwrap() == other.display().unwrap(), "the exposure stays");
        assert!(!edited.light_is_on(1));
        // After both leave, the enclosure stays open.
        edited.move_light(0, home).unwrap();
        edited.set_camera(&start);
        frame(&mut edited);
        assert_eq!(edited.scene().interior_viewpoints.len(), count);
        assert!(
            bits(&edited) == bits(&cold(&edited, &edited.scene().interior_viewpoints)),
            "out of {middle}"
        );
    }
    assert!(bits(&edited) != outside, "the inside of places takes no budget");
    assert_silent(&context());
}

/// A run that skips the frames of a film's other shares.
#[test]
fn frames_left_out_open_enclosures_as_well() {
    let places = [Vec3::new(0.0, 0.5, 0.0), BLOCK, Vec3::new(0.1, 0.5, 0.0)];
    let show = |is_left_out: bool| {
        let mut renderer = prepare(scene(), SMALL);
        let camera = renderer.scene().cameras[0].clone();
        for (index, &place) in places.iter().enumerate() {
            renderer.move_light(0, place).unwrap();
            if place == BLOCK {
                look_from(&mut renderer, place);
            } else {
                renderer.set_camera(&camera);
            }
            if is_left_out && index < 2 {
                renderer.open_enclosures(&mut Silent).unwrap();
            } else {
                frame(&mut renderer);
            }
        }
        assert_eq!(renderer.scene().interior_viewpoints.len(), 1);
        bits(&renderer)
    };
    assert!(show(true) == show(false));
    assert_silent(&context());
}
