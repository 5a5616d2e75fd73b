//! Gizmos of spot, area and directional lights, dragged from where they are drawn.

use std::path::Path;

use glam::{Quat, Vec2, Vec3};
use image::RgbImage;
use lightpaths::scene::{LightKind, LoadOptions, Scene};
use lightpaths::types::View;

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::picture::changed_pixels;
use crate::scenarios::{PICTURE, SIDE, close, open_in, settled};

/// One light of each kind with a direction, and a point light so that nothing is ever black.
const SCENE: &str = r#"
[[model]]
built_in = "box"

[camera]
position = [0.0, 1.0, 3.4]
target = [0.0, 1.0, 0.0]

[[light]]
kind = "spot"
position = [0.3, 1.3, 0.3]
direction = [-0.6, -0.5, -0.3]
angle = 25.0
penumbra = 0.3
intensity = [4.0, 4.0, 4.0]

[[light]]
kind = "area"
corner = [-0.7, 1.4, -0.2]
edge_u = [0.5, 0.0, 0.0]
edge_v = [0.0, 0.4, 0.3]
radiance = [5.0, 5.0, 5.0]

[[light]]
kind = "directional"
direction = [-0.2, -0.5, -0.8]
irradiance = [2.0, 2.0, 2.0]
"#;

/// Names of the lights in the panel, from the top.
const NAMES: [Point; 3] = [(SIDE as i32 + 93, 69), (SIDE as i32 + 93, 90), (SIDE as i32 + 93, 111)];

/// Distance of gizmos from their light, points: of the aim, and of the rim of a cone.
const AIM: f32 = 110.0;
const RIM: f32 = 84.0;

/// Camera of the picture.
pub struct Sight {
    view: View,
    /// Size of the picture, points.
    side: f32,
}

impl Sight {
    pub fn from_scene(scene: &Scene) -> Self {
        Self { view: View::from(&scene.cameras[0]), side: SIDE as f32 }
    }

    /// Position of a point in the window.
    pub fn seen(&self, point: Vec3) -> Vec2 {
        let View { position, right, up, forward, .. } = self.view;
        let towards = (point - position) / (point - position).dot(forward);
        let place =
            Vec2::new(towards.dot(right) / right.length_squared(), -towards.dot(up) / up.length_squared());
        0.5 * self.side * (1.0 + place)
    }

    /// Length in metres of `points` points at a position.
    pub fn metres(&self, at: Vec3, points: f32) -> f32 {
        let depth = (at - self.view.position).dot(self.view.forward);
        points * (2.0 * self.view.up.length() * depth / self.side).min(0.5 * depth / AIM)
    }

    /// The gizmo of an aim.
    fn aim(&self, light: Vec3, direction: Vec3) -> Vec2 {
        self.seen(light + self.metres(light, AIM) * direction)
    }

    /// The gizmo on the rim of a cone.
    fn rim(&self, light: Vec3, direction: Vec3, angle: f32) -> Vec2 {
        let side = direction.cross((light - self.view.position).normalize()).normalize();
        let (sin, cos) = angle.sin_cos();
        self.seen(light + self.metres(light, RIM) * (cos * direction + sin * side))
    }
}

/// A window with the scene.
struct Room<'a> {
    demo: Demo<'a>,
    folder: &'a Path,
    scene: Scene,
    sight: Sight,
}

impl<'a> Room<'a> {
    fn open(display: &'a Display, folder: &'a Path) -> Self {
        std::fs::write(folder.join("s.toml"), SCENE).unwrap();
        let demo = open_in(display, folder, "s.toml");
        // The panels move down while there is progress to show.
        demo.settled(None);
        let scene = load(&folder.join("s.toml"));
        let sight = Sight::from_scene(&scene);
        Self { demo, folder, scene, sight }
    }

    fn light(&self, index: usize) -> LightKind {
        self.scene.lights[index].kind
    }

    /// Selects a light and drags its gizmo. Returns the light as it is saved then. The drag must
    /// change the picture, and undo must restore picture and scene.
    fn drag(&self, index: usize, from: Vec2, to: Vec2) -> LightKind {
        let client = self.demo.client();
        self.demo.click(1, NAMES[index]);
        let before = self.settled();
        self.demo.drag(1, point(from), point(to), 4);
        let after = self.settled();
        let fraction = changed_pixels(&before, &after, PICTURE, 2) as f64 / PICTURE.pixels() as f64;
        assert!(fraction > 0.1, "light {index} is_glossy elsewhere: {fraction}");
        let saved = self.saved();
        for (other, (a, b)) in saved.lights.iter().zip(&self.scene.lights).enumerate() {
            assert!(a.kind == b.kind || other == index, "light {other} stays");
        }
        client.tap(&[keys::CONTROL], keys::of('z'));
        let undone = self.settled();
        assert_eq!(changed_pixels(&before, &undone, PICTURE, 0), 0, "undone");
        let kinds = |scene: &Scene| scene.lights.iter().map(|light| light.kind).collect::<Vec<_>>();
        assert_eq!(kinds(&self.saved()), kinds(&self.scene), "undone");
        saved.lights[index].kind
    }

    /// The picture when all input is processed.
    fn settled(&self) -> RgbImage {
        settled(&self.demo)
    }

    fn saved(&self) -> Scene {
        let file = self.folder.join("s-edited.toml");
        let _ = std::fs::remove_file(&file);
        self.demo.client().tap(&[keys::CONTROL], keys::of('s'));
        crate::until("saved scene", crate::scenarios::SOON, || file.exists().then(|| load(&file)))
    }
}

fn load(file: &Path) -> Scene {
    let options =
        LoadOptions { preset: Some("draft".into()), size: Some([SIDE; 2]), ..LoadOptions::default() };
    Scene::load(file.to_str().unwrap(), &options).unwrap()
}

fn point(place: Vec2) -> Point {
    (place.x.round() as i32, place.y.round() as i32)
}

/// The pointer moves by whole pixels: half a degree of an aim, two hundredths of a length.
fn assert_near(found: Vec3, wanted: Vec3) {
    let angle = found.angle_between(wanted).to_degrees();
    assert!(angle < 1.0, "{angle}° from {wanted} to {found}");
    assert!((found.length() / wanted.length() - 1.0).abs() < 0.03, "as long: {wanted} {found}");
}

#[test]
fn spots_areas_and_suns_are_dragged_by_their_gizmos() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let room = Room::open(&display, folder.path());
    let sight = &room.sight;

    let LightKind::Spot { position, direction, angle, .. } = room.light(0) else { panic!() };
    let turned = Quat::from_rotation_z(0.5) * direction;
    let spot = room.drag(0, sight.aim(position, direction), sight.aim(position, turned));
    let LightKind::Spot { position: place, direction: found, angle: cone, .. } = spot else { panic!() };
    assert_near(found, turned);
    assert_eq!((place, cone), (position, angle), "nothing but the aim");

    let wide = 40_f32.to_radians();
    let spot = room.drag(0, sight.rim(position, direction, angle), sight.rim(position, direction, wide));
    let LightKind::Spot { position: place, direction: found, angle: cone, .. } = spot else { panic!() };
    assert!((cone - wide).to_degrees().abs() < 1.0, "{}", cone.to_degrees());
    assert_eq!((place, found), (position, direction), "nothing but the cone");

    let LightKind::Area { corner, edge_u, edge_v, .. } = room.light(1) else { panic!() };
    let area = room.drag(1, sight.seen(corner + edge_u), sight.seen(corner + 1.6 * edge_u));
    let LightKind::Area { corner: place, edge_u: u, edge_v: v, .. } = area else { panic!() };
    assert_near(u, 1.6 * edge_u);
    assert_eq!((place, v), (corner, edge_v), "nothing but the edge");

    let middle = corner + 0.5 * (edge_u + edge_v);
    let normal = edge_u.cross(edge_v).normalize();
    let turned = Quat::from_rotation_z(-0.6) * normal;
    let area = room.drag(1, sight.aim(middle, normal), sight.aim(middle, turned));
    let LightKind::Area { corner: place, edge_u: u, edge_v: v, .. } = area else { panic!() };
    assert_near(u.cross(v).normalize(), turned);
    assert!((place + 0.5 * (u + v)).distance(middle) < 1e-4, "it turns about its middle");

    // The light is drawn a little ahead of the camera.
    let LightKind::Directional { direction, .. } = room.light(2) else { panic!() };
    let (low, high) = room.scene.bounds();
    let anchor = sight.view.position + 0.15 * (high - low).length() * sight.view.forward;
    let turned = Quat::from_rotation_y(0.4) * direction;
    let sun = room.drag(2, sight.aim(anchor, direction), sight.aim(anchor, turned));
    let LightKind::Directional { direction: found, .. } = sun else { panic!() };
    assert_near(found, turned);
    close(&room.demo);
}
