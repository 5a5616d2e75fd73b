//! The camera and the lights that are chosen for a model alone.

use std::path::PathBuf;

use glam::{Vec2, Vec3};
use lightpaths::scene::{Camera, LightKind, LoadOptions, Memory, Place, Scene, Up};

use super::refused::message;

/// A model: polygons, counter-clockwise from their fronts.
#[derive(Clone, Default)]
struct Model(Vec<Vec<Vec3>>);

impl Model {
    /// A box between two corners without the faces of these numbers: -x, +x, -y, +y, -z, +z.
    fn with_box(mut self, low: [f32; 3], high: [f32; 3], is_room: bool, missing: &[usize]) -> Self {
        for face in (0..6).filter(|face| !missing.contains(face)) {
            let (axis, end) = (face / 2, face % 2);
            let corner = |u: usize, v: usize| {
                let mut corner = Vec3::ZERO;
                corner[axis] = [low, high][end][axis];
                corner[(axis + 1) % 3] = [low, high][u][(axis + 1) % 3];
                corner[(axis + 2) % 3] = [low, high][v][(axis + 2) % 3];
                corner
            };
            let mut corners = vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if (end == 1) == is_room {
                corners.reverse();
            }
            self.0.push(corners);
        }
        self
    }

    /// A sheet over the unit square of x and z; `height` gives y.
    fn sheet(cells: usize, height: impl Fn(Vec2) -> f32) -> Self {
        let corner = |x: usize, z: usize| {
            let place = Vec2::new(x as f32, z as f32) / cells as f32;
            Vec3::new(place.x, height(place), place.y)
        };
        let cell =
            |x: usize, z: usize| vec![corner(x, z), corner(x, z + 1), corner(x + 1, z + 1), corner(x + 1, z)];
        Self((0..cells * cells).map(|index| cell(index % cells, index / cells)).collect())
    }

    fn map(mut self, change: impl Fn(Vec3) -> Vec3) -> Self {
        self.0.iter_mut().flatten().for_each(|corner| *corner = change(*corner));
        self
    }

    /// The model with +Z up instead of +Y.
    fn z_up(self) -> Self {
        self.map(|p| Vec3::new(p.x, -p.z, p.y))
    }

    fn turned(self, quarters: usize) -> Self {
        (0..quarters).fold(self, |model, _| model.map(|p| Vec3::new(p.z, p.y, -p.x)))
    }

    fn inside_out(mut self) -> Self {
        self.0.iter_mut().for_each(|corners| corners.reverse());
        self
    }

    fn obj(&self) -> String {
        let line = |letter: char, words: String| format!("{letter}{words}\n");
        let corners = self.0.iter().flatten().map(|p| line('v', format!(" {} {} {}", p.x, p.y, p.z)));
        let mut next = 0;
        let faces = self.0.iter().map(|corners| {
            let first = next + 1;
            next += corners.len();
            line('f', (first..=next).map(|index| format!(" {index}")).collect())
        });
        corners.chain(faces).collect()
    }

    fn load_with(&self, options: LoadOptions) -> Scene {
        let memory = Memory::new([(PathBuf::from("m.obj"), self.obj().into_bytes())].into());
        Scene::load("m.obj", &LoadOptions { memory: Some(memory), ..options }).unwrap()
    }

    fn load(&self) -> Scene {
        self.load_with(LoadOptions::default())
    }
}

const SIZE: [f32; 3] = [5.0, 2.7, 4.0];

fn room(missing: &[usize]) -> Model {
    Model::default().with_box([0.0; 3], SIZE, true, missing)
}

fn furnished(missing: &[usize]) -> Model {
    room(missing)
        .with_box([1.0, 0.0, 1.0], [2.6, 0.75, 1.9], false, &[])
        .with_box([0.1, 0.0, 3.0], [0.6, 2.0, 3.9], false, &[])
        .with_box([3.6, 0.0, 2.4], [4.8, 0.5, 3.8], false, &[])
}

/// A car: a body, a cabin and four wheels of boxes.
fn car() -> Model {
    let mut car = Model::default().with_box([-2.0, 0.35, -0.8], [2.0, 0.9, 0.8], false, &[]).with_box(
        [-1.1, 0.9, -0.7],
        [1.2, 1.45, 0.7],
        false,
        &[],
    );
    for (x, z) in [(-1.5, -0.9), (1.0, -0.9), (-1.5, 0.8), (1.0, 0.8)] {
        car = car.with_box([x, 0.0, z], [x + 0.6, 0.6, z + 0.1], false, &[]);
    }
    car
}

/// A floor, a wall at its end at -z, and a cube between; only their fronts are seen from +z.
fn studio() -> Model {
    Model(vec![
        [[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0], [-2.0, 0.0, -2.0]].map(Vec3::from).to_vec(),
        [[-2.0, 0.0, -2.0], [2.0, 0.0, -2.0], [2.0, 3.0, -2.0], [-2.0, 3.0, -2.0]].map(Vec3::from).to_vec(),
    ])
    .with_box([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], false, &[])
}

/// The camera in the model's own coordinates, and its viewing direction.
fn seen_from(scene: &Scene) -> (Vec3, Vec3) {
    let Camera { position, target, .. } = &scene.cameras[0];
    (*position + scene.origin.as_vec3(), (*target - *position).normalize())
}

fn is_in(place: Vec3, size: [f32; 3]) -> bool {
    (0..3).all(|axis| place[axis] > 0.0 && place[axis] < size[axis])
}

#[test]
fn a_closed_room_is_seen_from_inside_by_the_light_of_a_lamp() {
    for model in [room(&[]), furnished(&[])] {
        let scene = model.load();
        let (position, forward) = seen_from(&scene);
        assert!(is_in(position, SIZE) && (1.0..1.8).contains(&position.y), "{position}");
        // Along the diagonal, not into the near wall.
        let ahead = position + 2.0 * forward;
        assert!(is_in(ahead, SIZE), "{position} towards {forward}");
        assert_eq!(scene.cameras[0].fov_y_degrees, 60.0);
        let [light] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
        let LightKind::Point { position, .. } = light.kind else { panic!("{light:?}") };
        let lamp = position + scene.origin.as_vec3();
        assert!(is_in(lamp, SIZE) && lamp.y > 1.8, "{lamp}");
        assert!(scene.warnings[0].contains("placed inside") && scene.warnings[0].contains("with +Y up"));
    }
}

#[test]
fn an_open_room_is_looked_into() {
    for (missing, axis, sign) in [(0, 0, -1.0), (1, 0, 1.0), (3, 1, 1.0), (4, 2, -1.0), (5, 2, 1.0)] {
        for model in [room(&[missing]), furnished(&[missing])] {
            let scene = model.load();
            let (position, forward) = seen_from(&scene);
            let beyond = sign * (position[axis] - 0.5 * SIZE[axis]);
            assert!(beyond > 0.5 * SIZE[axis], "{missing}: {position}");
            assert!(-sign * forward[axis] > 0.6, "{missing}: {forward}");
        }
    }
    // A camera below the ground sees no furniture.
    let (position, _) = seen_from(&furnished(&[2]).load());
    assert!(position.y > 0.0, "{position}");
}

#[test]
fn flags_decide_where_the_camera_stands() {
    let with = |place| LoadOptions { place: Some(place), ..LoadOptions::default() };
    let (outside, _) = seen_from(&furnished(&[]).load_with(with(Place::Outside)));
    assert!(!is_in(outside, SIZE), "{outside}");
    let (inside, _) = seen_from(&furnished(&[5]).load_with(with(Place::Inside)));
    assert!(is_in(inside, SIZE), "{inside}");
    let up = |up| car().load_with(LoadOptions { up: Some(up), ..LoadOptions::default() }).cameras[0].up;
    assert_eq!([up(Up::Y), up(Up::Z)], [Vec3::Y, Vec3::Z]);
    let memory = Memory::new(
        [
            (PathBuf::from("m.obj"), car().obj().into_bytes()),
            ("s.toml".into(), super::good_toml().into_bytes()),
        ]
        .into(),
    );
    for (options, flag) in [
        (with(Place::Inside), "--inside is for scenes without a camera, and s.toml has one"),
        (with(Place::Outside), "--outside"),
        (LoadOptions { up: Some(Up::Z), ..LoadOptions::default() }, "--up"),
    ] {
        let found = message(Scene::load("s.toml", &LoadOptions { memory: Some(memory.clone()), ..options }));
        assert!(found.starts_with(flag), "{found}");
    }
}

#[test]
fn objects_and_backdrops_are_seen_and_lit_from_their_front() {
    for quarters in 0..4 {
        let scene = studio().turned(quarters).load();
        let front = (0..quarters).fold(Vec3::Z, |p, _| Vec3::new(p.z, p.y, -p.x));
        let (position, forward) = seen_from(&scene);
        assert!(position.dot(front) > 2.0 && position.y > 0.0, "{quarters}: {position}");
        assert!(forward.dot(front) < -0.5, "{quarters}: {forward}");
        let [sun, sky] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
        let LightKind::Directional { direction, .. } = sun.kind else { panic!("{sun:?}") };
        assert!(direction.dot(front) < 0.0 && direction.y < 0.0, "{quarters}: {direction}");
        assert!(matches!(sky.kind, LightKind::Sky { .. }), "{sky:?}");
    }
    // A plate is not seen from its edge, nor a triangle from its back.
    for turned in 0..4 {
        let plate = Model::sheet(1, |_| 0.0).map(|p| Vec3::new(p.x, -p.z, 0.0)).turned(turned);
        let normal = (0..turned).fold(Vec3::Z, |p, _| Vec3::new(p.z, p.y, -p.x));
        assert!(seen_from(&plate.load()).1.dot(normal) < -0.85, "{turned}");
    }
}

/// Three faces of a box are seen, from above.
#[test]
fn an_object_is_seen_by_three_quarters() {
    let (_, forward) = seen_from(&Model::default().with_box([0.0; 3], [1.0; 3], false, &[]).load());
    assert!(forward.abs().min_element() > 0.3 && forward.y < 0.0, "{forward}");
}

#[test]
fn inverted_objects_look_as_if_they_were_right() {
    let right = car().load();
    let wrong = car().inside_out().load();
    assert_eq!(seen_from(&right), seen_from(&wrong));
    assert_eq!(right.lights, wrong.lights);
}

#[test]
fn up_is_found() {
    let hills =
        |p: Vec2| 0.1 * (9.0 * p.x).sin() * (7.0 * p.y).cos() + 0.05 * (23.0 * p.x + 17.0 * p.y).sin();
    let curtain = |p: Vec2| 0.05 * (40.0 * p.x).sin();
    let city = || {
        let mut city = Model::sheet(1, |_| 0.0).map(|p| 10.0 * p);
        for index in 0..25 {
            let [x, z] = [index % 5, index / 5].map(|place| 2.0 * place as f32);
            let height = 0.5 + (0.77 * index as f32).sin().abs() * 2.0;
            city = city.with_box([x, 0.0, z], [x + 1.4, height, z + 1.4], false, &[2]);
        }
        city
    };
    for (name, model) in [
        ("room", furnished(&[])),
        ("empty room", room(&[])),
        ("car", car()),
        ("terrain", Model::sheet(24, hills)),
        ("city", city()),
    ] {
        assert_eq!(model.load().cameras[0].up, Vec3::Y, "{name}");
        assert_eq!(model.z_up().load().cameras[0].up, Vec3::Z, "{name}");
    }
    // A curtain and a sign hang, and a low corridor lies.
    for (name, model) in [
        ("curtain", Model::sheet(24, curtain).z_up().map(|p| Vec3::new(p.x, p.y, p.z))),
        ("sign", Model::sheet(1, |_| 0.0).z_up()),
        ("corridor", Model::default().with_box([0.0; 3], [20.0, 2.6, 1.7], true, &[])),
        ("box", Model::default().with_box([0.0; 3], [1.0; 3], true, &[5])),
    ] {
        assert_eq!(model.load().cameras[0].up, Vec3::Y, "{name}");
    }
}

#[test]
fn the_unit_of_a_model_does_not_matter() {
    let (_, forward) = seen_from(&car().load());
    for scale in [1e-3, 1e4] {
        let scene = car().map(|p| scale * p + Vec3::splat(3.0 * scale)).load();
        assert!((seen_from(&scene).1 - forward).length() < 1e-2, "{scale}");
    }
    for scale in [0.01, 100.0] {
        let scene = furnished(&[]).map(|p| scale * p).load();
        assert!(is_in(seen_from(&scene).0 / scale, SIZE), "{scale}");
    }
}

#[test]
fn specks_that_are_far_apart_have_a_camera() {
    let speck = [Vec3::ZERO, Vec3::X, Vec3::Y];
    for apart in [1e9 * Vec3::Z, 1e6 * Vec3::X, 1e3 * Vec3::Y, 1e7 * Vec3::ONE] {
        let model = Model(vec![speck.to_vec(), speck.map(|corner| corner + apart).to_vec()]);
        let (position, forward) = seen_from(&model.load());
        assert!(position.is_finite() && forward.is_normalized(), "{apart}: {position} {forward}");
    }
}
