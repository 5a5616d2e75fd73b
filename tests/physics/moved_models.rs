//! A movable crate moves in a room. Random decisions are named by place, so the picture changes
//! where the crate's light does, and the noise elsewhere stays. What a move cannot change is kept,
//! and every picture equals that of a cold start.

use std::collections::{BTreeMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::common::{assert_silent, context};
use glam::{Quat, Vec3};
use lightpaths::cpu::sampling::hash;
use lightpaths::renderer::{Kept, Layer, Progress, Renderer, Silent};
use lightpaths::scene::{LightKind, Material, Quality, Scene, Triangle, shapes};
use lightpaths::types::CachePoint;

/// Half the edge of the crate, metres.
const HALF: f32 = 0.2;
/// Cache points further from the crate than this are far from it, metres.
const FAR: f32 = 2.0;

/// The crate's triangles.
fn crate_at(middle: Vec3) -> impl Iterator<Item = Triangle> {
    [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z].into_iter().flat_map(move |normal| {
        let u = normal.any_orthogonal_vector();
        let v = normal.cross(u);
        let corner = |a: f32, b: f32| middle + HALF * (normal + a * u + b * v);
        let [p, q, r, s] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[p, q, r], [p, r, s]].map(|positions| Triangle {
            positions,
            normals: [normal; 3],
            material: 1,
            object: 0,
        })
    })
}

/// A room of 6×2.5×4 m with the crate on its floor.
fn room(middle: Vec3, seed: u32) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(6.0, 2.5, 4.0), 0.6);
    let wood = Material { diffuse: Vec3::new(0.5, 0.3, 0.1), ..scene.materials[0].clone() };
    scene.materials.push(wood);
    scene.triangles.extend(crate_at(middle));
    let position = Vec3::new(0.4, 0.5, 0.3);
    scene.lights[0].kind = LightKind::Point { position, intensity: Vec3::ONE };
    scene.cameras[0].size = [48, 48];
    scene.model_is_movable = vec![true];
    scene.quality = Quality { seed, ..Quality::DRAFT };
    scene
}

/// Indirect light, and the cache points.
fn render(middle: Vec3, seed: u32) -> (Vec<f64>, Vec<CachePoint>) {
    let mut renderer = Renderer::new(&context(), room(middle, seed), &mut Silent).unwrap();
    renderer.frame().unwrap();
    let layer = renderer.layer(Layer::Indirect).unwrap();
    let light = layer.iter().map(|pixel| f64::from(pixel[0] + pixel[1] + pixel[2])).collect();
    (light, renderer.cache_points().unwrap())
}

/// Mean of the squared difference over the squared mean.
fn change(a: &[f64], b: &[f64]) -> f64 {
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    a.iter().zip(b).map(|(a, b)| ((a - b) / mean).powi(2)).sum::<f64>() / a.len() as f64
}

#[test]
fn noise_stays_where_nothing_moves() {
    let middle = Vec3::new(-2.2, -1.05, -1.1);
    let (still, before) = render(middle, 1);
    let (moved, after) = render(middle + 0.01 * Vec3::X, 1);
    let (other, _) = render(middle, 2);
    // A cache point's place, and the random stream of its gather rays.
    let name = |point: &CachePoint| {
        let [x, y, z] = point.position.to_array().map(f32::to_bits);
        [x, y, z, point.stream]
    };
    let far = |point: &&CachePoint| point.position.distance(middle) > FAR;
    let names: HashSet<_> = after.iter().map(name).collect();
    let all = before.iter().filter(far).count();
    let kept = before.iter().filter(far).filter(|point| names.contains(&name(point))).count();
    let [by_move, by_seed] = [&moved, &other].map(|picture| change(&still, picture));
    println!("{kept} of {all} points are kept; change {by_move:.2e}, by a seed {by_seed:.2e}");
    assert!(all > 1000 && kept == all, "{kept} of {all} far points are kept");
    assert!(by_move > 0.0 && by_move * 10.0 < by_seed, "{by_move:.2e}, by a seed {by_seed:.2e}");
    assert_silent(&context());
}

/// The room with two crates that can move. Each stands somewhere, turned by an angle, or is hidden.
#[derive(Clone)]
struct Stage {
    crates: [Option<(Vec3, f32)>; 2],
    lamp: Vec3,
    wood: f32,
}

impl Stage {
    fn scene(&self) -> Scene {
        let mut scene = room(Vec3::ZERO, 1);
        let walls = scene.triangles.len() - crate_at(Vec3::ZERO).count();
        scene.triangles.truncate(walls);
        for (object, place) in (1..).zip(&self.crates) {
            let Some((middle, angle)) = *place else { continue };
            let turn = Quat::from_rotation_y(angle);
            scene.triangles.extend(crate_at(Vec3::ZERO).map(|triangle| Triangle {
                positions: triangle.positions.map(|corner| middle + turn * corner),
                normals: triangle.normals.map(|normal| turn * normal),
                object,
                ..triangle
            }));
        }
        scene.objects = ["walls", "first crate", "second crate"].map(str::to_owned).to_vec();
        scene.model_objects = vec![0..1, 1..2, 2..3];
        scene.model_is_movable = vec![false, true, true];
        scene.lights[0].kind = LightKind::Point { position: self.lamp, intensity: Vec3::ONE };
        scene.materials[1].diffuse = Vec3::new(self.wood, 0.3, 0.1);
        let small =
            Quality { entry_points: 4000, cache_points: 500, gather_rays: 64, cells: 24, ..Quality::DRAFT };
        scene.quality = Quality { seed: 1, ..small };
        scene
    }

    /// One of several edits. Most are moves.
    fn change(&mut self, number: u32) {
        let random = |i: u32| hash(hash(number) ^ i) as f32 / u32::MAX as f32;
        let which = usize::from(random(1) < 0.3);
        let step = 0.3 * Vec3::new(random(2) - 0.5, 0.0, random(3) - 0.5);
        let home = Vec3::new([-2.0, 1.5][which], -1.05, 0.5);
        let place = &mut self.crates[which];
        match (hash(number) % 8, *place) {
            (0, _) => self.lamp += 0.5 * step,
            (1, _) => self.wood = 0.2 + 0.6 * random(4),
            (2, Some(_)) => *place = None,
            (_, Some((middle, angle))) => *place = Some((middle + step, angle + random(5))),
            // Standing on the floor, or a little in it or in the other crate.
            (_, None) => *place = Some((home + 0.1 * Vec3::new(random(6), -random(7), random(8)), 0.0)),
        }
    }
}

fn picture(mut renderer: Renderer) -> Vec<[u32; 3]> {
    renderer.frame().unwrap();
    renderer.layer(Layer::Beauty).unwrap().iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// Stops a precomputation where a stage begins, as a window does that has something newer to trace.
struct StopAt(&'static str);

impl Progress for StopAt {
    fn stage(&mut self, name: &str, _: u64) {
        if name == self.0 {
            resume_unwind(Box::new(()));
        }
    }

    fn advance(&mut self, _: u64) {}

    fn finish(&mut self) {}
}

/// Changes the stage `count` times, one after another.
fn check_changes(count: u32) {
    let crates = [Some((Vec3::new(-2.0, -1.05, 0.5), 0.3)), None];
    let mut stage = Stage { crates, lamp: Vec3::new(0.4, 0.5, 0.3), wood: 0.5 };
    let mut kept = Kept::default();
    let (mut counts, mut stopped) = (BTreeMap::<String, [u64; 2]>::new(), 0);
    for number in 0..count {
        stage.change(number);
        if number % 5 == 4 {
            // Another change comes before its light paths are there.
            let at =
                StopAt(["cells", "light paths", "cache points", "gather rays", "merged rays"][stopped % 5]);
            let traced = AssertUnwindSafe(|| {
                drop(Renderer::new_keeping(&context(), stage.scene(), &mut kept, &mut { at }));
            });
            assert!(catch_unwind(traced).is_err(), "it is stopped");
            stopped += 1;
            continue;
        }
        let renderer = Renderer::new_keeping(&context(), stage.scene(), &mut kept, &mut Silent).unwrap();
        for (kind, [some, all]) in renderer.statistics().unwrap().kept {
            let count = counts.entry(kind).or_default();
            *count = [count[0] + some, count[1] + all];
        }
        let cold = Renderer::new(&context(), stage.scene(), &mut Silent).unwrap();
        assert!(picture(renderer) == picture(cold), "change {number} differs from a cold start");
    }
    println!("kept, and all: {counts:?}");
    assert_eq!(counts.len(), 5);
    for (kind, [kept, all]) in counts {
        assert!(5 * kept > all && kept < all, "{kind}: {kept} of {all}");
    }
    assert_silent(&context());
}

#[test]
fn moves_equal_cold_starts() {
    check_changes(30);
}

/// The walls can move, too: there is one tree, and no hit is kept.
#[test]
fn moves_among_movable_walls_equal_cold_starts() {
    let crates = [Some((Vec3::new(-2.0, -1.05, 0.5), 0.3)), None];
    let mut stage = Stage { crates, lamp: Vec3::new(0.4, 0.5, 0.3), wood: 0.5 };
    let mut kept = Kept::default();
    let mut results = 0;
    for x in [0.0, 0.1, 0.2] {
        stage.crates[0] = Some((Vec3::new(x - 2.0, -1.05, 0.5), 0.3));
        let scene = || Scene { model_is_movable: vec![true; 3], ..stage.scene() };
        let renderer = Renderer::new_keeping(&context(), scene(), &mut kept, &mut Silent).unwrap();
        let counts = renderer.statistics().unwrap().kept;
        assert_eq!(counts.len(), 3, "{counts:?}");
        results += counts.values().map(|[kept, _]| kept).sum::<u64>();
        let cold = Renderer::new(&context(), scene(), &mut Silent).unwrap();
        assert!(picture(renderer) == picture(cold), "{x}");
    }
    assert!(results > 1000, "{results} results are kept");
}

/// Takes minutes.
#[test]
#[ignore = "the same with more moves"]
fn many_moves_equal_cold_starts() {
    check_changes(500);
}
