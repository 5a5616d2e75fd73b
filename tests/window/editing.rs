//! Edits of several lights at once, and of materials that become glossy.

use std::path::Path;
use std::process::Command;

use glam::Vec3;
use lightpaths::scene::{Light, LightKind, LoadOptions, Scene};

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::lights::Sight;
use crate::picture::{Area, changed_pixels};
use crate::scenarios::{BOX, PICTURE, READY, SIDE, SOON, changed, close, open_in, settled};
use crate::until;

const SCENE: &str = r#"
[[model]]
built_in = "box"

[camera]
position = [0.0, 1.0, 3.4]
target = [0.0, 1.0, 0.0]

[[light]]
name = "a"
group = "hall"
kind = "point"
position = [-0.4, 1.6, 0.2]
intensity = [0.8, 0.8, 0.8]

[[light]]
name = "b"
group = "hall"
kind = "spot"
position = [0.4, 1.5, 0.4]
direction = [-0.2, -1.0, -0.2]
angle = 30.0
intensity = [3.0, 2.0, 1.0]

[[light]]
name = "c"
kind = "area"
corner = [-0.2, 1.0, 0.0]
edge_u = [0.3, 0.0, 0.0]
edge_v = [0.0, 0.0, 0.3]
radiance = [4.0, 4.0, 4.0]

[[light]]
name = "d"
kind = "directional"
direction = [-0.2, -0.5, -0.8]
irradiance = [0.3, 0.3, 0.3]
"#;

/// A point right of the picture.
const fn beside(x: i32, y: i32) -> Point {
    (SIDE as i32 + x, y)
}

/// The heading of the group, which is above its lights.
const FOLD: Point = beside(36, 69);
const GROUP_BOX: Point = beside(52, 69);
const GROUP_SOLO: Point = beside(195, 69);
const GROUP_PERCENT: Point = beside(232, 69);
const GROUP_COLOUR: Point = beside(281, 69);
/// A colour in the field that the button of the colour opens.
const PICKED: Point = (500, 200);
/// Names of the lights.
const NAMES: [Point; 4] = [beside(98, 90), beside(96, 111), beside(78, 132), beside(96, 153)];
/// Buttons of the last light.
const COPY_D: Point = beside(263, 153);
/// Fields of the editor: of one chosen light, and of several.
const GROUP_FIELD: Point = beside(200, 248);
const POWER_OF_SEVERAL: Point = beside(140, 304);
/// Specular albedo of the chosen material.
const SPECULAR: Point = beside(179, 280);

struct Room<'a> {
    demo: Demo<'a>,
    folder: &'a Path,
    scene: Scene,
}

fn load(file: &Path) -> Scene {
    let options =
        LoadOptions { preset: Some("draft".into()), size: Some([SIDE; 2]), ..LoadOptions::default() };
    Scene::load(file.to_str().unwrap(), &options).unwrap()
}

fn on(lights: &[Light]) -> Vec<bool> {
    lights.iter().map(|light| light.is_on).collect()
}

fn names(lights: &[Light]) -> Vec<&str> {
    lights.iter().map(|light| light.name.as_str()).collect()
}

fn normal(kind: LightKind) -> Vec3 {
    let LightKind::Area { edge_u, edge_v, .. } = kind else { panic!("{kind:?}") };
    edge_u.cross(edge_v).normalize()
}

impl<'a> Room<'a> {
    fn open(display: &'a Display, folder: &'a Path) -> Self {
        let file = folder.join("s.toml");
        std::fs::write(&file, SCENE).unwrap();
        let demo = open_in(display, folder, "s.toml");
        // The panels move down while there is progress to show.
        demo.settled(None);
        Self { demo, folder, scene: load(&file) }
    }

    /// The lights as the window saves them.
    fn lights(&self) -> Vec<Light> {
        self.demo.settled(Some(PICTURE));
        self.saved().lights
    }

    fn saved(&self) -> Scene {
        let file = self.folder.join("s-edited.toml");
        let _ = std::fs::remove_file(&file);
        self.demo.client().tap(&[keys::CONTROL], keys::of('s'));
        until("saved scene", SOON, || file.exists().then(|| load(&file)))
    }

    /// Clicks while these keys are held.
    fn click_with(&self, held: &[u32], at: Point) {
        let client = self.demo.client();
        client.move_to(at);
        // The window has the item under the pointer a frame later.
        self.demo.wait_for_answer();
        held.iter().for_each(|key| client.key_down(*key));
        client.click(1, at);
        held.iter().rev().for_each(|key| client.key_up(*key));
        self.demo.wait_for_answer();
    }

    fn undo(&self) {
        self.demo.client().tap(&[keys::CONTROL], keys::of('z'));
        self.demo.wait_for_answer();
    }

    /// Takes one step back; the lights are then those of the file.
    fn undo_all(&self, what: &str) {
        self.undo();
        assert_eq!(self.lights(), self.scene.lights, "{what} is one step");
    }
}

/// The factor of each channel between two emissions.
fn factor(before: &Light, after: &Light) -> Vec3 {
    after.kind.emission() / before.kind.emission()
}

#[test]
fn a_group_is_switched_alone_dimmed_coloured_and_folded() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let room = Room::open(&display, folder.path());
    let (demo, own) = (&room.demo, &room.scene.lights);
    let before = settled(demo);
    demo.click(1, GROUP_BOX);
    let off = changed(demo, &before);
    assert_eq!(on(&room.lights()), [false, false, true, true]);
    room.undo();
    assert_eq!(changed_pixels(&before, &changed(demo, &off), PICTURE, 0), 0, "undone");

    demo.click(1, GROUP_SOLO);
    assert_eq!(on(&room.lights()), [true, true, false, false]);
    demo.click(1, GROUP_SOLO);
    assert_eq!(room.lights(), *own);

    let (x, y) = GROUP_PERCENT;
    demo.drag(1, GROUP_PERCENT, (x - 40, y), 10);
    let dimmed = room.lights();
    let [a, b] = [0, 1].map(|index| factor(&own[index], &dimmed[index]));
    assert!(a.x < 0.9 && a.x > 0.1 && (a - Vec3::splat(a.x)).length() < 1e-5, "{a}");
    assert!((a - b).length() < 1e-5 && dimmed[2..] == own[2..], "{b}");
    room.undo_all("dimming");

    demo.click(1, GROUP_COLOUR);
    demo.click(1, PICKED);
    // Keys of a frame take effect before its clicks.
    demo.wait_for_answer();
    demo.client().tap(&[], keys::ESCAPE);
    let coloured = room.lights();
    let [a, b] = [0, 1].map(|index| factor(&own[index], &coloured[index]));
    assert!((a.max_element() - 1.0).abs() < 1e-5 && a.min_element() < 0.8, "{a}");
    assert!((a - b).length() < 1e-5 && coloured[2..] == own[2..], "{b}");
    room.undo_all("a colour");

    // Folded, the next light stands where the first of the group was.
    demo.click(1, FOLD);
    demo.settled(None);
    demo.click(1, NAMES[0]);
    demo.wait_for_answer();
    demo.client().tap(&[], keys::DELETE);
    assert_eq!(names(&room.lights()), ["a", "b", "d"]);
    close(demo);
}

#[test]
fn several_lights_are_chosen_edited_moved_and_copied() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let room = Room::open(&display, folder.path());
    let (demo, own) = (&room.demo, &room.scene.lights);
    let tap = |key: char| demo.client().tap(&[], keys::of(key));
    demo.click(1, NAMES[0]);
    room.click_with(&[keys::SHIFT], NAMES[2]);
    tap('o');
    assert_eq!(on(&room.lights()), [false, false, false, true]);
    room.undo_all("switching");

    // A power is that of all chosen lights, and of no other one.
    room.click_with(&[keys::CONTROL], NAMES[2]);
    demo.settled(None);
    let (x, y) = POWER_OF_SEVERAL;
    demo.drag(1, POWER_OF_SEVERAL, (x + 60, y), 10);
    let brighter = room.lights();
    let [before, a, b] = [&own[0], &brighter[0], &brighter[1]].map(|light| light.power().unwrap().0);
    assert!(a > 1.1 * before && (b / a - 1.0).abs() < 1e-5, "{before} lm, {a} lm, {b} lm");
    assert_eq!(brighter[2..], own[2..]);
    room.undo_all("a power");

    demo.click(1, NAMES[0]);
    room.click_with(&[keys::CONTROL], NAMES[2]);
    let place = Sight::from_scene(&room.scene).seen(own[0].kind.position().unwrap());
    let (x, y) = (place.x.round() as i32, place.y.round() as i32);
    demo.drag(1, (x, y), (x + 40, y + 30), 6);
    let moved = room.lights();
    let [a, c] =
        [0, 2].map(|index| moved[index].kind.position().unwrap() - own[index].kind.position().unwrap());
    assert!(a.length() > 0.1 && (a - c).length() < 1e-5, "{a} and {c}");
    assert_eq!([&moved[1], &moved[3]], [&own[1], &own[3]]);
    room.undo_all("a movement");

    demo.client().tap(&[keys::CONTROL], keys::of('d'));
    let copied = room.lights();
    assert_eq!(names(&copied), ["a", "b", "c", "d", "a2", "c2"]);
    assert_eq!(copied[4].group.as_deref(), Some("hall"));
    let (low, high) = room.scene.bounds();
    for (copy, light) in [(4, 0), (5, 2)] {
        let offset = copied[copy].kind.position().unwrap() - own[light].kind.position().unwrap();
        assert!((offset - 0.05 * (high - low).length() * Vec3::X).length() < 1e-5, "{offset}");
    }
    // The copies are chosen.
    demo.client().tap(&[], keys::DELETE);
    assert_eq!(room.lights(), *own);
    // A light that is not chosen is copied by its button.
    demo.click(1, COPY_D);
    assert_eq!(names(&room.lights()), ["a", "b", "c", "d", "d2"]);
    room.undo_all("a copy");

    demo.click(1, NAMES[2]);
    demo.settled(None);
    demo.click(1, GROUP_FIELD);
    demo.wait_for_answer();
    demo.client().type_text("hall");
    demo.client().tap(&[], keys::RETURN);
    let grouped = room.lights();
    let groups: Vec<_> = grouped.iter().map(|light| light.group.as_deref()).collect();
    assert_eq!(groups, [Some("hall"), Some("hall"), Some("hall"), None]);
    room.undo_all("a group");
    close(demo);
}

#[test]
fn lights_are_aimed_at_a_point_and_put_on_a_wall() {
    const LEFT: Point = (40, 200);
    const RIGHT: Point = (370, 200);
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let room = Room::open(&display, folder.path());
    let (demo, own, sight) = (&room.demo, &room.scene.lights, Sight::from_scene(&room.scene));
    let (low, high) = room.scene.bounds();
    let size = (high - low).length();
    let is_at = |place: Vec3, pixel: Point| {
        let away = (sight.seen(place) - glam::Vec2::new(pixel.0 as f32, pixel.1 as f32)).length();
        assert!(away < 1.5, "{away} points from {pixel:?}");
    };
    demo.click(1, NAMES[1]);
    room.click_with(&[keys::SHIFT], NAMES[3]);
    room.click_with(&[keys::CONTROL, keys::SHIFT], LEFT);
    let aimed = room.lights();
    let anchor = room.scene.cameras[0].position + 0.15 * size * Vec3::NEG_Z;
    let LightKind::Spot { position, direction: spot, .. } = aimed[1].kind else { panic!() };
    let LightKind::Directional { direction: sun, .. } = aimed[3].kind else { panic!() };
    assert_eq!(Some(position), own[1].kind.position());
    let middle = aimed[2].kind.position().unwrap();
    assert!(middle.distance(own[2].kind.position().unwrap()) < 1e-5, "it turns about its middle");
    for (from, way) in [(position, spot), (middle, normal(aimed[2].kind)), (anchor, sun)] {
        let to_wall = (low.x - from.x) / way.x;
        assert!(to_wall > 0.0, "towards the wall");
        is_at(from + to_wall * way, LEFT);
    }
    assert_eq!(aimed[0], own[0], "it is not chosen");
    room.undo_all("an aim");

    demo.click(1, NAMES[2]);
    demo.client().move_to(RIGHT);
    demo.wait_for_answer();
    demo.client().tap(&[], keys::of('u'));
    let snapped = room.lights();
    assert!(normal(snapped[2].kind).distance(Vec3::NEG_X) < 1e-5, "it faces away from the wall");
    let middle = snapped[2].kind.position().unwrap();
    assert!((high.x - middle.x - 0.01 * size).abs() < 1e-4, "{middle}");
    is_at(Vec3 { x: high.x, ..middle }, RIGHT);
    room.undo_all("a light on a wall");

    // A sun has no position: a line over the picture reports it, and nothing changes.
    demo.click(1, NAMES[3]);
    demo.client().move_to(RIGHT);
    let before = demo.settled(None);
    demo.client().tap(&[], keys::of('u'));
    let after = demo.settled(None);
    let line = Area { x: 0, y: SIDE - 40, width: SIDE, height: 40 };
    assert!(changed_pixels(&before, &after, line, 9) > 1000, "a line over the picture");
    assert_eq!(room.lights(), *own);
    close(demo);
}

#[test]
fn a_diffuse_teapot_becomes_glossy_and_diffuse_again() {
    const TEAPOT: Point = (200, 360);
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let room = Room::open(&display, folder.path());
    let demo = &room.demo;
    demo.click(1, TEAPOT);
    let before = settled(demo);
    let mark = demo.mark();
    let (x, y) = SPECULAR;
    demo.drag(1, SPECULAR, (x + 60, y), 10);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let glossy = changed(demo, &before);
    let saved = room.saved();
    let teapot = saved.materials.iter().find(|material| material.name == "teapot").unwrap();
    assert!(teapot.editable && teapot.specular.x > 0.1, "{teapot:?}");
    // What is shown is what the saved scene gives.
    let file = folder.path().join("a.png");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.arg("render").arg(folder.path().join("s-edited.toml")).args(&BOX[1..]);
    let ended = command.args(["-o", file.to_str().unwrap()]).output().unwrap();
    assert!(ended.status.success(), "{ended:?}");
    let rendered = image::open(file).unwrap().into_rgb8();
    // Below the marks of the lights.
    let below = Area { y: 250, height: SIDE - 250, ..PICTURE };
    let shown = image::imageops::crop_imm(&glossy, 0, 0, SIDE, SIDE).to_image();
    assert_eq!(changed_pixels(&shown, &rendered, below, 0), 0, "the picture of the saved scene");
    let mark = demo.mark();
    room.undo();
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    assert_eq!(changed_pixels(&before, &changed(demo, &glossy), PICTURE, 0), 0, "undone");
    close(demo);
}
