//! Recordings as films: the film shows the recorded states.

use std::path::Path;

use glam::{DVec3, Vec3};
use lightpaths::scene::film::{Film, Recording, Snapshot, State};
use lightpaths::scene::save::SceneText;
use lightpaths::scene::{Camera, Light, LightKind, LoadOptions, Scene};

use super::save::Dice;
use super::{CAMERA, LIGHT};

const FPS: f64 = 30.0;

/// A scene of two materials with a point light, a spot light that is off, and an area light, around
/// an offset; its folder.
fn scene(offset: f64) -> (tempfile::TempDir, String, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let corner = |x: f64, z: f64| format!("v {} {} {}\n", x + offset, 0.1 - offset, z + 0.5 * offset);
    let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| corner(x, z)).concat();
    let obj = format!("{corners}usemtl one\nf 1 2 3\nusemtl two\nf 1 3 4\n");
    std::fs::write(folder.path().join("m.obj"), obj).unwrap();
    let lights = "[[light]]\nname = \"spot\"\non = false\nkind = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0.1]\n\
                  angle = 30\nintensity = [1, 2, 3]\n[[light]]\nname = \"panel\"\nkind = \"area\"\ncorner = [0, 1, 0]\n\
                  edge_u = [1, 0, 0]\nedge_v = [0, 0, 1]\nradiance = [1, 2, 3]\n";
    let file = folder.path().join("s.toml");
    std::fs::write(&file, format!("[[model]]\nfile = \"m.obj\"\n{CAMERA}{LIGHT}{lights}")).unwrap();
    let spec = file.to_str().unwrap().to_owned();
    let scene = Scene::load(&spec, &LoadOptions::default()).unwrap();
    (folder, spec, scene)
}

/// The film of these samples, one each frame.
pub(super) fn film_of(
    spec: &str,
    base: &Scene,
    samples: &[Snapshot],
    folder: &Path,
) -> (String, Film, Scene) {
    let mut recording = Recording::new(spec, &Snapshot::from_scene(base), base.origin, FPS);
    for (frame, sample) in samples.iter().enumerate() {
        recording.add(frame as f64 / FPS, sample);
    }
    let file = folder.join("f.toml");
    let text = recording.finish(&file).unwrap();
    std::fs::write(&file, &text).unwrap();
    let loaded = Film::load(file.to_str().unwrap(), &LoadOptions::default());
    let (film, scene) = loaded.unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(film.frame_count as usize, samples.len().max(1));
    (text, film, scene)
}

#[track_caller]
fn near(wanted: Vec3, found: Vec3, tolerance: f32, what: &str) {
    assert!((wanted - found).length() <= tolerance, "{what}: {wanted} was recorded, {found} is shown");
}

fn expect_camera(wanted: &Camera, found: &Camera) {
    near(wanted.position, found.position, 1.01e-3, "camera");
    near(wanted.target, found.target, 1.01e-3, "target");
    assert!((wanted.fov_y_degrees / found.fov_y_degrees - 1.0).abs() < 1.01e-3);
}

/// A light that is off may be anywhere. Its old name does not matter if a light of another kind
/// has taken it.
fn expect_lights(wanted: &[Light], state: &State, scene: &Scene) {
    let changed = |index: usize| state.lights.iter().find(|(light, ..)| *light == index);
    let as_filmed = |(index, light): (usize, &Light)| match changed(index) {
        Some(&(_, kind, is_on)) => Light { kind, is_on, ..light.clone() },
        None => light.clone(),
    };
    let found: Vec<Light> = scene.lights.iter().enumerate().map(as_filmed).collect();
    let lit: Vec<&Light> = wanted.iter().filter(|light| light.is_on).collect();
    assert_eq!(found.iter().filter(|light| light.is_on).count(), lit.len(), "{found:?} {lit:?}");
    for light in lit {
        let samples = |kind: LightKind| if let LightKind::Area { samples, .. } = kind { samples } else { 0 };
        let is_it = |it: &&Light| {
            let is_named = it.name == light.name || it.name.starts_with(&format!("{} ", light.name));
            let is_alike = it.kind.word() == light.kind.word() && samples(it.kind) == samples(light.kind);
            it.is_on && is_named && is_alike
        };
        let found = found.iter().find(is_it).unwrap_or_else(|| panic!("{light:?} is not there")).kind;
        let emission = light.kind.emission();
        near(emission, found.emission(), 2e-3 * emission.max_element(), &light.name);
        match (light.kind, found) {
            (LightKind::Point { position: a, .. }, LightKind::Point { position: b, .. }) => {
                near(a, b, 1.01e-3, &light.name);
            }
            (
                LightKind::Spot { position: a, direction: c, angle: e, penumbra: g, .. },
                LightKind::Spot { position: b, direction: d, angle: f, penumbra: h, .. },
            ) => {
                near(a, b, 1.01e-3, &light.name);
                near(c, d, 1.01e-3, &light.name);
                assert!((e / f - 1.0).abs() < 1.01e-3 && (g - h).abs() < 1.01e-3);
            }
            (
                LightKind::Area { corner: a, edge_u: c, edge_v: e, .. },
                LightKind::Area { corner: b, edge_u: d, edge_v: f, .. },
            ) => [(a, b), (c, d), (e, f)].iter().for_each(|(a, b)| near(*a, *b, 1.01e-3, &light.name)),
            (LightKind::Directional { direction: a, .. }, LightKind::Directional { direction: b, .. }) => {
                near(a, b, 1.01e-3, &light.name);
            }
            kinds => panic!("{kinds:?}"),
        }
    }
}

fn expect_state(wanted: &Snapshot, state: &State, scene: &Scene) {
    expect_camera(&wanted.camera, &state.camera);
    expect_lights(&wanted.lights, state, scene);
    for (index, wanted) in wanted.materials.iter().enumerate() {
        let material = &scene.materials[index];
        let changed = state.materials.iter().find(|it| it.material == index);
        let found = changed.map_or((material.diffuse, material.specular, material.exponent), |it| {
            (it.diffuse, it.specular, it.exponent)
        });
        near(wanted.diffuse, found.0, 1.8e-3, "diffuse");
        near(wanted.specular, found.1, 1.8e-3, "specular");
        let is_diffuse = wanted.specular == Vec3::ZERO;
        assert!(
            is_diffuse || (wanted.exponent / found.2).ln().abs() < 1.1e-3,
            "{} {}",
            wanted.exponent,
            found.2
        );
    }
}

/// Random actions of a user in a window: one item after the other is dragged, set or left alone.
fn act(samples: &mut Vec<Snapshot>, dice: &mut Dice) {
    let mut now = samples.last().unwrap().clone();
    let [frames, light] = [1 + dice.below(25), dice.below(now.lights.len().max(1))];
    let target = dice.place();
    match dice.below(9) {
        0 => {}
        1 if !now.lights.is_empty() => now.lights[light].is_on ^= true,
        2 if now.lights.len() > 1 => drop(now.lights.remove(light)),
        3 => {
            let (kind, number) = (dice.kind(), dice.below(5));
            if now.lights.iter().all(|it| it.name != format!("new {number}")) {
                now.lights
                    .push(Light { is_on: dice.below(4) > 0, ..Light::new(format!("new {number}"), kind) });
            }
        }
        4 if !now.lights.is_empty() => now.lights[light].kind = dice.kind(),
        5 => {
            now.camera.position = target + 20.0 * Vec3::Z;
            now.camera.fov_y_degrees = 20.0 + 50.0 * dice.unit();
        }
        drag => {
            let (start, colour) = (now.clone(), dice.vector());
            for frame in 1..=frames {
                let x = frame as f32 / frames as f32;
                if drag == 6 {
                    let way = target + 20.0 * Vec3::Z - start.camera.position;
                    now.camera.position = start.camera.position + (x * x) * way + (9.0 * x).sin() * Vec3::X;
                } else if drag == 7 && !now.lights.is_empty() {
                    let kind = start.lights[light].kind;
                    let from = kind.position().unwrap_or_default();
                    let moved = kind.moved_to(from + x * (target - from));
                    now.lights[light].kind = moved.with_emission((1.0 - x) * kind.emission() + x * colour);
                } else {
                    let (from, to) = (&start.materials[0], &mut now.materials[0]);
                    to.diffuse = from.diffuse + x * (0.5 * colour - from.diffuse);
                    to.specular = from.specular + x * (0.4 * target.abs() / 4.0 - from.specular);
                    to.exponent = from.exponent + x * (100.0 * colour.x + 1.0 - from.exponent);
                }
                // The pointer does not move in every frame.
                let pause = if dice.below(5) == 0 { 2 } else { 1 };
                (0..pause).for_each(|_| samples.push(now.clone()));
            }
        }
    }
    (0..frames).for_each(|_| samples.push(now.clone()));
}

#[test]
fn films_show_what_was_recorded() {
    for seed in 0..12 {
        let mut dice = Dice(seed);
        let (folder, spec, scene) = scene([0.0, 33.3, -99_000.1][seed as usize % 3]);
        let mut first = Snapshot::from_scene(&scene);
        if seed % 2 == 1 {
            // Something had been edited before the recording began.
            first.lights[0].kind = dice.kind();
            first.lights.remove(1);
            first.materials[1].diffuse = 0.9 * dice.vector();
        }
        let mut samples = vec![first];
        (0..25).for_each(|_| act(&mut samples, &mut dice));
        let (_, film, loaded) = film_of(&spec, &scene, &samples, folder.path());
        for (frame, wanted) in (0..).zip(&samples) {
            expect_state(wanted, &film.state(frame), &loaded);
        }
    }
}

#[test]
fn what_is_left_alone_has_no_keys() {
    let (folder, spec, scene) = scene(17.1);
    let samples = vec![Snapshot::from_scene(&scene); 50];
    let (text, ..) = film_of(&spec, &scene, &samples, folder.path());
    assert_eq!(text, format!("scene = \"s.toml\"\nfps = 30.0\nduration = {:?}\n", 49.0 / FPS + 1.0 / FPS));
    let mut edited = Snapshot::from_scene(&scene);
    edited.camera.position.x += 1.0;
    edited.lights[0].is_on = false;
    edited.materials[0].exponent = 7.0;
    let (text, ..) = film_of(&spec, &scene, &vec![edited; 50], folder.path());
    assert_eq!(text.matches("[[").count(), 3, "{text}");
    assert_eq!((text.matches("position").count(), text.matches("on = false").count()), (1, 1), "{text}");
    let (text, ..) = film_of(&spec, &scene, &[], folder.path());
    assert!(!text.contains("[["), "{text}");
    let elsewhere = Recording::new("box", &Snapshot::from_scene(&scene), scene.origin, FPS);
    assert!(elsewhere.finish(Path::new("f.toml")).unwrap().starts_with("scene = \"box\"\n"));
}

#[test]
fn holds_do_not_move_and_drags_take_few_keys() {
    let (folder, spec, scene) = scene(0.0);
    let mut samples = vec![Snapshot::from_scene(&scene); 60];
    let start = samples[0].clone();
    for frame in 1..=120 {
        let mut now = start.clone();
        let angle = frame as f32 / 120.0 * 3.0;
        now.camera.position += 4.0 * Vec3::new(angle.sin(), 0.0, angle.cos() - 1.0);
        now.lights[0].kind = now.lights[0].kind.with_emission(Vec3::splat(1.0 + angle));
        now.materials[1].diffuse = Vec3::splat(0.7 - 0.1 * angle);
        samples.push(now);
    }
    let end = samples.last().unwrap().clone();
    samples.extend(vec![end; 60]);
    let (text, film, loaded) = film_of(&spec, &scene, &samples, folder.path());
    for (frame, wanted) in (0..).zip(&samples) {
        let state = film.state(frame);
        expect_state(wanted, &state, &loaded);
        if !(60..179).contains(&frame) {
            assert_eq!(state, film.state(if frame < 100 { 0 } else { 239 }), "frame {frame}");
            assert_eq!(state.camera.position, wanted.camera.position);
        }
    }
    let lists = ["camera", "light", "material"].map(|list| text.matches(&format!("[[{list}]]")).count());
    println!("{lists:?}");
    assert!(lists[0] <= 30 && lists[1] <= 30 && lists[2] <= 60, "{lists:?}");
}

#[test]
fn models_move_as_they_were_recorded() {
    let (folder, spec, scene) = scene(0.0);
    let own = SceneText::new(&spec, &LoadOptions::default(), &scene).unwrap().models();
    let first = Snapshot { models: own.clone(), ..Snapshot::from_scene(&scene) };
    let mut samples = vec![first; 40];
    for (frame, sample) in samples.iter_mut().enumerate() {
        let x = (frame as f64 - 10.0).clamp(0.0, 15.0);
        sample.models[0].translation = DVec3::new(0.02 * x, 0.0, 0.001 * x * x);
        sample.models[0].rotation = DVec3::new(0.0, if frame < 20 { 0.0 } else { 35.0 }, 0.0);
        sample.models[0].is_hidden = false;
    }
    let mut recording = Recording::new(&spec, &samples[0], scene.origin, FPS);
    for (frame, sample) in samples.iter().enumerate() {
        recording.add(frame as f64 / FPS, sample);
    }
    let file = folder.path().join("f.toml");
    let text = recording.finish(&file).unwrap();
    std::fs::write(&file, &text).unwrap();
    assert!(text.matches("[[model]]").count() < 15, "keys, not samples: {text}");
    for (frame, sample) in samples.iter().enumerate().step_by(3) {
        let (_, found) =
            Film::load_at(file.to_str().unwrap(), &LoadOptions::default(), frame as u32).unwrap();
        let set = sample.models[0].changes(0, Some(&own[0]));
        let wanted = Scene::load(&spec, &LoadOptions { set, ..LoadOptions::default() }).unwrap();
        for (wanted_corner, found_corner) in wanted
            .triangles
            .iter()
            .zip(&found.triangles)
            .flat_map(|(a, b)| a.positions.into_iter().zip(b.positions))
        {
            let [a, b] = [(wanted_corner, &wanted), (found_corner, &found)]
                .map(|(corner, scene)| corner.as_dvec3() + scene.origin);
            assert!(a.distance(b) < 4e-3, "frame {frame}: {a} was recorded, {b} is shown\n{text}");
        }
    }
    // A second model of the file could not be told from the first.
    let mut twice = samples.clone();
    twice.iter_mut().for_each(|sample| sample.models.push(own[0].clone()));
    let mut recording = Recording::new(&spec, &twice[0], scene.origin, FPS);
    twice.iter().enumerate().for_each(|(frame, sample)| recording.add(frame as f64 / FPS, sample));
    let error = recording.finish(&file).unwrap_err();
    assert!(error.to_string().contains("several models are called \"m\""), "{error}");
}
