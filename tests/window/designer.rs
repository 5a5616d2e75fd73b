//! A designer's hour: a glTF room is lit by luminaires, measured, compared, saved and opened again.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use image::RgbImage;
use lightpaths::scene::meter::MeterShape;
use lightpaths::scene::{LightKind, LoadOptions, Scene};

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels};
use crate::scenarios::{READY, SOON, close};

/// Luminous flux of the downlight: 300 cd · cos²θ over the hemisphere.
const LUMENS: f64 = 200.0 * std::f64::consts::PI;

/// The downlight's photometric file.
fn luminaire() -> String {
    let angles: Vec<f64> = (0..=18).map(|step| 5.0 * f64::from(step)).collect();
    let mut text =
        format!("IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 1 {} 1 1 2 0 0 0\n1 1 10\n", angles.len());
    for angle in &angles {
        let _ = write!(text, "{angle} ");
    }
    text += "\n0\n";
    for angle in &angles {
        let _ = write!(text, "{:.3} ", 300.0 * angle.to_radians().cos().powi(2));
    }
    text + "\n"
}

/// Triangles of a box's faces, seen from inside or from outside.
fn faces(low: [f32; 3], high: [f32; 3], from_inside: bool) -> Vec<[f32; 3]> {
    let corner =
        |index: usize| [0, 1, 2].map(|axis| if index >> axis & 1 == 0 { low[axis] } else { high[axis] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut points = Vec::new();
    for mut quad in quads {
        if from_inside {
            quad.reverse();
        }
        let [a, b, c, d] = quad.map(corner);
        points.extend([a, b, c, a, c, d]);
    }
    points
}

/// A room of 4 × 2.8 × 3 m with a desk 0.75 m high, and a camera: binary glTF.
fn room() -> Vec<u8> {
    let shell = faces([-2.0, 0.0, -1.5], [2.0, 2.8, 1.5], true);
    let desk = faces([-0.7, 0.71, -0.9], [0.7, 0.75, -0.2], false);
    let counts = [shell.len(), desk.len()];
    let bytes: Vec<u8> = shell.iter().chain(&desk).flatten().flat_map(|value| value.to_le_bytes()).collect();
    let bounds = [([-2.0, 0.0, -1.5], [2.0, 2.8, 1.5]), ([-0.7, 0.71, -0.9], [0.7, 0.75, -0.2])];
    let (mut views, mut accessors, mut meshes, mut first) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (index, (count, (low, high))) in counts.into_iter().zip(bounds).enumerate() {
        let length = 12 * count;
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{first},\"byteLength\":{length}}}"));
        accessors.push(format!(
            "{{\"bufferView\":{index},\"componentType\":5126,\"count\":{count},\"type\":\"VEC3\",\
             \"min\":{low:?},\"max\":{high:?}}}"
        ));
        meshes.push(format!(
            "{{\"primitives\":[{{\"attributes\":{{\"POSITION\":{index}}},\"material\":{index}}}]}}"
        ));
        first += length;
    }
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0,1,2]}}],\
         \"nodes\":[{{\"mesh\":0,\"name\":\"shell\"}},{{\"mesh\":1,\"name\":\"desk\"}},\
         {{\"camera\":0,\"translation\":[0,1.5,1.4]}}],\
         \"cameras\":[{{\"type\":\"perspective\",\"perspective\":{{\"yfov\":1.1,\"znear\":0.01}}}}],\
         \"materials\":[{{\"name\":\"walls\",\"pbrMetallicRoughness\":{{\"baseColorFactor\":[0.7,0.7,0.7,1],\
         \"metallicFactor\":0,\"roughnessFactor\":1}}}},{{\"name\":\"desk\",\"pbrMetallicRoughness\":\
         {{\"baseColorFactor\":[0.5,0.35,0.2,1],\"metallicFactor\":0,\"roughnessFactor\":1}}}}],\
         \"meshes\":[{}],\"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{}}}]}}",
        meshes.join(","),
        accessors.join(","),
        views.join(","),
        bytes.len()
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let word = |value: usize| (value as u32).to_le_bytes();
    let mut file = b"glTF".to_vec();
    file.extend([word(2), word(12 + 8 + json.len() + 8 + bytes.len()), word(json.len())].concat());
    file.extend(b"JSON".iter().chain(json.as_bytes()));
    file.extend(word(bytes.len()));
    file.extend(b"BIN\0".iter().chain(&bytes));
    file
}

/// Where the panels have what the designer clicks, in a window of 950 × 800 points.
const LUMINAIRE: Point = (815, 111);
const ADD_LUMINAIRE: Point = (893, 111);
const GROUP: Point = (830, 185);
const CEILING: Point = (733, 90);
const CEILING_PERCENT: Point = (871, 90);
const KELVIN: Point = (848, 367);
const METERS: Point = (700, 692);
const ADD_PLANE: Point = (718, 713);
/// The desk and places on the ceiling in the picture.
const DESK: Point = (320, 650);
const PLACES: [Point; 6] = [(200, 40), (320, 40), (440, 40), (200, 20), (320, 20), (440, 20)];
/// A part of the picture without marks and handles.
const WALL: Area = Area { x: 0, y: 230, width: 500, height: 350 };
const ROOM: Area = Area { x: 0, y: 0, width: 640, height: 800 };

/// The designer, and how many inputs each action took: clicks, keys with their modifiers, and
/// fields that are filled, each as one.
struct Designer<'a> {
    demo: Demo<'a>,
    inputs: usize,
    done: Vec<(&'static str, usize)>,
}

impl Designer<'_> {
    fn click(&mut self, at: Point) {
        self.demo.click(1, at);
        self.demo.wait_for_answer();
        self.inputs += 1;
    }

    fn key(&mut self, held: &[u32], key: char) {
        self.demo.client().tap(held, keys::of(key));
        self.demo.wait_for_answer();
        self.inputs += 1;
    }

    /// Clicks a field and fills it.
    fn fill(&mut self, at: Point, text: &str) {
        self.click(at);
        self.demo.client().type_text(text);
        self.demo.client().tap(&[], keys::RETURN);
        self.demo.wait_for_answer();
        self.inputs += 1;
    }

    /// Ends an action, and keeps a picture of the window if `LIGHTPATHS_HOUR` names a folder.
    fn done(&mut self, action: &'static str) -> RgbImage {
        self.demo.client().move_to((630, 790));
        let window = self.demo.settled(Some(ROOM));
        if let Some(folder) = std::env::var_os("LIGHTPATHS_HOUR") {
            let name = format!("{:02}.png", self.done.len() + 1);
            window.save(Path::new(&folder).join(name)).unwrap();
        }
        self.done.push((action, std::mem::take(&mut self.inputs)));
        window
    }

    fn saved(&mut self, folder: &Path) -> Scene {
        let mark = self.demo.mark();
        self.key(&[keys::CONTROL], 's');
        self.demo.wait_for_line_since(mark, "lightpaths: saved room-edited.toml", SOON);
        let file = folder.join("room-edited.toml");
        Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap()
    }
}

pub fn open<'a>(display: &'a Display, folder: &Path, scene: &str) -> Demo<'a> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["demo", scene, "--size", "640x800", "--preset", "draft", "--validation"]);
    for setting in ["entry_points=5000", "cache_points=500", "gather_rays=36", "cells=16", "edge_samples=0"] {
        command.args(["--set", &format!("quality.{setting}")]);
    }
    command.current_dir(folder);
    let demo = Demo::run(Some(display), command);
    demo.wait_for_line("lightpaths: ready", READY);
    demo
}

#[test]
fn an_hour_of_a_designer() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    std::fs::write(folder.path().join("room.glb"), room()).unwrap();
    std::fs::write(folder.path().join("down.ies"), luminaire()).unwrap();
    let demo = open(&display, folder.path(), "room.glb");
    // The room is opened: Ctrl+O, the file, Return.
    let mut designer = Designer { demo, inputs: 3, done: Vec::new() };
    let dark = designer.done("load a glTF room");

    designer.fill(LUMINAIRE, "down.ies");
    designer.click(ADD_LUMINAIRE);
    designer.fill(GROUP, "ceiling");
    for (number, place) in PLACES.into_iter().enumerate() {
        if number > 0 {
            designer.key(&[keys::CONTROL], 'd');
        }
        designer.demo.client().move_to(place);
        designer.key(&[], 'u');
    }
    let lit = designer.done("six luminaires on the ceiling");
    assert!(changed_pixels(&dark, &lit, ROOM, 2) > 10_000, "they give light");

    designer.click(CEILING);
    designer.fill(KELVIN, "3000");
    let warm = designer.done("their colour temperature");
    assert!(changed_pixels(&lit, &warm, ROOM, 2) > 10_000, "warm light");

    designer.demo.client().move_to(DESK);
    designer.demo.wait_for_answer();
    let held = [keys::CONTROL, keys::SHIFT];
    held.iter().for_each(|key| designer.demo.client().key_down(*key));
    designer.demo.client().click(1, DESK);
    held.iter().for_each(|key| designer.demo.client().key_up(*key));
    designer.demo.wait_for_answer();
    designer.inputs += 1;
    designer.done("aim them at the desk");

    designer.fill(CEILING_PERCENT, "60");
    let dimmed = designer.done("dim the group");

    designer.click(DESK);
    designer.click(METERS);
    let mark = designer.demo.mark();
    designer.click(ADD_PLANE);
    designer.demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    designer.done("measure the desk");

    designer.key(&[], '8');
    let colours = designer.done("false colours");
    assert!(changed_pixels(&dimmed, &colours, ROOM, 2) > 10_000, "colours");

    designer.key(&[], '1');
    designer.key(&[], 'n');
    designer.fill(CEILING_PERCENT, "90");
    designer.key(&[], 'b');
    designer.done("compare two versions");
    designer.key(&[], 'b');
    designer.inputs = 0;

    let mark = designer.demo.mark();
    designer.key(&[keys::CONTROL], 'l');
    let line = designer.demo.wait_for_line_since(mark, "lightpaths: saved room-edited-lights-001.exr", SOON);
    assert!(line.ends_with("with 14 layers of lights"), "{line}");
    designer.done("export layers");

    let scene = designer.saved(folder.path());
    let last = designer.done("save");
    let lights = scene.lights.iter().filter(|light| light.group.as_deref() == Some("ceiling"));
    let lights: Vec<_> = lights.collect();
    assert_eq!((scene.lights.len(), lights.len()), (7, 6));
    for light in &lights {
        let (amount, _) = light.power().unwrap();
        // The colour temperature keeps the luminous power.
        assert!((amount / (0.9 * LUMENS) - 1.0).abs() < 0.01, "{}: {amount} of {LUMENS} lm", light.name);
        assert!((light.kind.kelvin() - 3000.0).abs() < 5.0, "{}: {} K", light.name, light.kind.kelvin());
        let LightKind::Spot { position, direction, .. } = light.kind else { panic!("a spot") };
        let position = position.as_dvec3() + scene.origin;
        let met = position + direction.as_dvec3() * ((0.75 - position.y) / f64::from(direction.y));
        assert!(met.x.abs() < 0.05 && (-0.9..-0.2).contains(&met.z), "{}: aims at {met}", light.name);
        assert!((2.7..2.8).contains(&position.y), "{}: at {position}", light.name);
    }
    assert!(matches!(scene.meters[..], [ref meter] if matches!(meter.shape, MeterShape::Plane { .. })));

    close(&designer.demo);
    designer.demo = open(&display, folder.path(), "room-edited.toml");
    designer.inputs = 3;
    let again = designer.done("open it again");
    assert_eq!(changed_pixels(&last, &again, WALL, 0), 0, "the picture is what it was");
    close(&designer.demo);
    for (action, inputs) in &designer.done {
        println!("{inputs:3}  {action}");
    }
}
