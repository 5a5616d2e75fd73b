//! Animation: the state of a scene at a frame, and refused films.

use glam::Vec3;
use lightpaths::Error;
use lightpaths::scene::film::{Film, State, builtin};
use lightpaths::scene::{LightKind, LoadOptions, Scene};

use super::{SQUARE, close, good_toml};

/// One second of a film of the scene with one light, four frames.
const HEAD: &str = "scene = \"s.toml\"\nfps = 4\nduration = 1.0\n";
const PANEL: &str = "[[light]]\nname = \"panel\"\ntime = 0.5\nkind = \"area\"\ncorner = [0, 1, 0]\nedge_u = [1, 0, 0]\n\
                     edge_v = [0, 0, 1]\nradiance = [4, 2, 1]\nsamples = 7\n";

fn load(film: &str) -> lightpaths::Result<(Film, Scene)> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("s.toml", good_toml().as_str()), ("m.obj", SQUARE), ("f.toml", film)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    Film::load(folder.path().join("f.toml").to_str().unwrap(), &LoadOptions::default())
}

/// The states of all frames.
fn states(film: &str) -> (Vec<State>, Scene) {
    let (film, scene) = load(&format!("{HEAD}{film}")).unwrap();
    ((0..film.frame_count).map(|frame| film.state(frame)).collect(), scene)
}

#[track_caller]
fn refuses(film: &str, expected: &str) {
    let error = load(film).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let text = error.to_string();
    let found = match &error {
        Error::Input { file, .. } => text.replace(&format!("{}/", file.parent().unwrap().display()), ""),
        _ => text,
    };
    assert!(found.contains(expected) && !found.contains('\n'), "expected {expected:?}, found {found:?}");
}

#[test]
fn built_in_films_load_and_stay_in_bounds() {
    assert!(builtin::names().contains(&"box"));
    for name in builtin::names() {
        let (film, scene) = Film::load(name, &LoadOptions::default()).unwrap();
        assert_eq!(film.name, name);
        let (low, high) = scene.bounds();
        let reach = 1.5 * (high - low).length();
        for frame in 0..film.frame_count {
            let position = film.state(frame).camera.position;
            assert!(position.distance(0.5 * (low + high)) < reach, "{name}, frame {frame}: {position}");
        }
    }
}

#[test]
fn the_box_film_does_what_the_paper_describes() {
    let (film, scene) = Film::load("box", &LoadOptions::default()).unwrap();
    let at = |seconds: f64| film.state((seconds * film.fps) as u32);
    let material = |state: &State, name: &str| {
        let found = state.materials.iter().find(|it| scene.materials[it.material].name == name);
        *found.unwrap()
    };
    let light = |state: &State, name: &str| {
        let found = state.lights.iter().find(|(index, ..)| scene.lights[*index].name == name);
        *found.unwrap()
    };
    let (first, glossy, both, last) = (at(0.0), at(16.0), at(31.0), at(40.0));
    assert!(first.camera.position != at(5.0).camera.position && at(11.0).camera != at(18.0).camera);
    assert_eq!(material(&first, "teapot").specular, Vec3::ZERO);
    assert_eq!(material(&glossy, "teapot").exponent, 40.0);
    assert!(material(&glossy, "teapot").specular.min_element() > 0.3);
    assert!(light(&first, "lamp").1.position() != light(&at(25.0), "lamp").1.position());
    assert!(light(&first, "lamp").2 && !light(&first, "panel").2);
    assert!(light(&both, "lamp").2 && light(&both, "panel").2);
    assert!(!light(&last, "lamp").2 && light(&last, "panel").2);
    let LightKind::Area { edge_u, edge_v, samples: 10, .. } = light(&last, "panel").1 else {
        panic!("an area light of ten samples")
    };
    assert!(edge_u.cross(edge_v).normalize().x < -0.99, "it faces the left wall");
    assert!(
        light(&last, "panel").1.position().unwrap().z != light(&at(38.0), "panel").1.position().unwrap().z
    );
    assert!(scene.materials.iter().all(|it| it.editable == ["green", "teapot"].contains(&it.name.as_str())));
}

#[test]
fn keys_hold_before_the_first_and_after_the_last() {
    let (states, scene) = states(
        "[[camera]]\ntime = 0.75\nposition = [0, 3, 1]\nfov_y = 60\n[[camera]]\ntime = 0.25\nposition = [0, 1, 3]\nfov_y = 20\n",
    );
    let origin = scene.origin.as_vec3();
    let places = states.iter().map(|state| state.camera.position + origin).collect::<Vec<_>>();
    let expected = [[0.0, 1.0, 3.0], [0.0, 1.0, 3.0], [0.0, 2.0, 2.0], [0.0, 3.0, 1.0]];
    assert!(places.iter().zip(expected).all(|(a, b)| close(*a, Vec3::from(b))), "{places:?}");
    assert_eq!(states.iter().map(|it| it.camera.fov_y_degrees).collect::<Vec<_>>(), [20.0, 20.0, 40.0, 60.0]);
    assert!(states.iter().all(|state| close(state.camera.target + origin, Vec3::ZERO)), "the scene's");
}

#[test]
fn a_camera_stands_if_all_frames_show_one_view() {
    let stands = |film: &str| load(&format!("{HEAD}{film}")).unwrap().0.camera_stands();
    let key = |time: f32, x: f32| format!("[[camera]]\ntime = {time}\nposition = [{x}, 1, 3]\n");
    assert!(stands("") && stands(&key(0.5, 1.0)) && stands(&(key(0.0, 1.0) + &key(0.5, 1.0))));
    // The last frame shows 0.75 s.
    assert!(stands(&(key(0.75, 1.0) + &key(2.0, 0.0))));
    assert!(!stands(&(key(0.5, 1.0) + &key(2.0, 0.0))));
}

#[test]
fn lights_come_fade_and_go() {
    let panel = PANEL.replace("samples", "group = \"hall\"\nsamples");
    let (states, scene) = states(&format!(
        "[[light]]\nname = \"lamp\"\ntime = 0.0\non = false\nfade = 1.0\n{panel}[[light]]\nname = \"panel\"\ntime = 0.75\non = false\n"
    ));
    assert_eq!(scene.lights.iter().map(|light| light.name.as_str()).collect::<Vec<_>>(), ["lamp", "panel"]);
    assert_eq!(scene.lights[1].group.as_deref(), Some("hall"));
    let on = |light: usize| states.iter().map(|state| state.lights[light].2).collect::<Vec<_>>();
    assert_eq!((on(0), on(1)), (vec![true; 4], vec![false, false, true, false]));
    let lamp = states.iter().map(|state| state.lights[0].1.emission().x).collect::<Vec<_>>();
    assert_eq!(lamp, [1.0, 0.84375, 0.5, 0.15625], "1 - 3x² + 2x³");
    let LightKind::Area { radiance, samples: 7, .. } = states[2].lights[1].1 else {
        panic!("{:?}", states[2])
    };
    assert_eq!(radiance, Vec3::new(4.0, 2.0, 1.0));
}

#[test]
fn materials_jump_and_fade_and_are_editable() {
    let change = "[[material]]\nname = \"default\"\n";
    let (states, scene) = states(&format!(
        "{change}time = 0.25\ndiffuse = [0.1, 0.2, 0.3]\n{change}time = 0.5\nfade = 0.5\nspecular = [0.4, 0.4, 0.4]\nexponent = 20\n"
    ));
    assert!(scene.materials[0].editable);
    let of = |frame: usize| states[frame].materials[0];
    assert_eq!([0, 1, 3].map(|frame| of(frame).diffuse.x), [0.7, 0.1, 0.1]);
    assert_eq!([1, 2, 3].map(|frame| of(frame).specular.x), [0.0, 0.0, 0.2]);
    assert_eq!(of(3).exponent, 20.0, "a lobe that comes has its sharpness from the start");
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let with = |more: &str| format!("{HEAD}{more}");
    refuses("fps = 4\n", "f.toml:1: scene: the key is missing");
    refuses("scene = \"s.toml\"\nspeed = 4\n", "f.toml:2: speed: unknown key");
    refuses("scene = \"boks\"\n", "f.toml:1: scene: unknown built-in scene `boks`: did you mean `box`?");
    refuses("scene = \"t.toml\"\n", "f.toml:1: scene: ");
    refuses("scene = \"s.toml\"\nfps = 0\n", "f.toml:2: fps: 0.0 is out of range");
    refuses("scene = \"s.toml\"\n", "f.toml:1: duration: 0 s at 24 frames a second are 0 frames");
    refuses(&with("camera = 3\n"), "f.toml:4: camera: must be a list of tables: write [[camera]]");
    refuses(&with("[[camera]]\nposition = [0, 1, 2]\n"), "f.toml:4: camera.0: the key `time` is missing");
    refuses(&with("[[camera]]\ntime = -1\n"), "f.toml:5: camera.0.time: -1.0 is out of range");
    refuses(
        &with("[[camera]]\ntime = 1\nposition = [0, 1]\n"),
        "f.toml:6: camera.0.position: a list of three",
    );
    refuses(&with("[[camera]]\ntime = 1\nup = [0, 1, 0]\n"), "f.toml:6: camera.0.up: unknown key");
    let key = "[[camera]]\ntime = 1\nposition = [0, 1, 2]\n";
    refuses(&with(&format!("{key}{key}")), "f.toml:9: camera.1.position: there is another key of it at 1 s");
    refuses(
        &with("[[camera]]\ntime = 0\nposition = [0, 5, 0]\n"),
        "frame 0 (0.000 s): the camera looks straight up or down",
    );
    let lamp = "[[light]]\nname = \"lamp\"\ntime = 1\n";
    refuses(
        &with("[[light]]\nname = \"lump\"\ntime = 1\n"),
        "f.toml:5: light.lump.name: unknown light `lump`",
    );
    refuses(&with(&format!("{lamp}radiance = [1, 1, 1]\n")), "f.toml:7: light.lamp.radiance: unknown key");
    refuses(&with(&format!("{lamp}kind = \"point\"\n")), "f.toml:7: light.lamp.kind: the scene has a light");
    refuses(&with(&format!("{lamp}fade = 1\n")), "f.toml:7: light.lamp.fade: belongs to `on`");
    refuses(&with(&format!("{lamp}on = 1\n")), "f.toml:7: light.lamp.on: true or false was expected");
    refuses(&with(&PANEL.replace("radiance = [4, 2, 1]\n", "")), "f.toml:4: light.panel: the key `radiance`");
    refuses(&with(&PANEL.replace("[0, 0, 1]", "[2, 0, 0]")), "f.toml:10: light.panel.edge_v: ");
    refuses(
        &with(&format!("{PANEL}{}", PANEL.replace("0.5", "0.7"))),
        "f.toml:16: light.panel.kind: belongs to",
    );
    let turned =
        PANEL.replace("kind = \"area\"\n", "").replace("0.5", "0.8").replace("[1, 0, 0]", "[-1, 0, 0]");
    let turned = turned.replace("samples = 7\n", "").replace("[0, 0, 1]", "[0, 0, -1]");
    assert!(load(&with(&format!("{PANEL}{turned}"))).is_ok(), "half-way is between two frames");
    let turned = turned.replace("0.8", "1.0");
    refuses(&with(&format!("{PANEL}{turned}")), "frame 3 (0.750 s): the edges of light `panel` are zero");
    let diffuse = "[[material]]\nname = \"default\"\ntime = 1\n";
    refuses(&with(&diffuse.replace("default", "glass")), "f.toml:5: material.glass.name: unknown material");
    refuses(
        &with(&format!("{diffuse}diffuse = [2, 0, 0]\n")),
        "f.toml:7: material.default.diffuse: 2.0 is out",
    );
    refuses(
        &with(&format!("{diffuse}{diffuse}")),
        "f.toml:9: material.default.time: there is another change",
    );
    refuses(
        &with(&format!("{diffuse}specular = [0.5, 0, 0]\n")),
        "f.toml:4: material.default: diffuse and specular",
    );
    let error = Film::load("bax", &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("unknown built-in film `bax`: did you mean `box`?"), "{error}");
}

const TURNING: &str = "[[model]]\nname = \"m\"\ntime = 0.25\nrotate = [0, 0, 0]\n\
                       [[model]]\nname = \"m\"\ntime = 0.5\nrotate = [0, 0, 370]\n\
                       [[model]]\nname = \"m\"\ntime = 0.75\nhidden = false\ntranslate = [0, 0, 1]\n";

#[test]
fn models_are_where_their_keys_put_them() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{HEAD}{TURNING}");
    for (name, text) in [("s.toml", good_toml().as_str()), ("m.obj", SQUARE), ("f.toml", &text)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let at = |frame| Film::load_at(&path("f.toml"), &LoadOptions::default(), frame).unwrap();
    let cold = |set: &[&str]| {
        let set = set.iter().map(|change| (*change).to_owned()).collect();
        Scene::load(&path("s.toml"), &LoadOptions { set, ..LoadOptions::default() }).unwrap()
    };
    let corners = |scene: &Scene| -> Vec<_> {
        let world = |place: Vec3| place.as_dvec3() + scene.origin;
        scene.triangles.iter().map(|triangle| triangle.positions.map(world)).collect()
    };
    let turned = ["model.0.translate=[0.0, 0.0, 1.0]", "model.0.rotate=[0.0, 0.0, 10.0]"];
    for (frame, set) in [(0, &["model.0.translate=[0.0, 0.0, 1.0]"][..]), (2, &turned), (3, &turned)] {
        assert_eq!(corners(&at(frame).1), corners(&cold(set)), "frame {frame}");
    }
    let film = at(0).0;
    assert!(film.moves_models());
    assert_eq!([0, 1, 2, 3].map(|frame| film.first_with_models_of(frame)), [0, 0, 2, 2]);
    let (still, _) = load(HEAD).unwrap();
    assert!(!still.moves_models() && still.first_with_models_of(3) == 0);
}

#[test]
fn models_are_named_by_key_or_file_and_faults_say_where() {
    let model = |lines: &str| format!("{HEAD}[[model]]\ntime = 0\n{lines}\n");
    load(&model("name = \"m\"\nhidden = false")).unwrap();
    refuses(&model("name = \"n\"\nhidden = true"), "unknown model `n`: did you mean `m`?");
    refuses(&model("name = \"m\"\nscale = 2"), "scale");
    refuses(&model("name = \"m\"\nrotate = [0, 0, 1e6]"), "rotate");
    refuses(&model("name = \"m\"\nhidden = true"), "no triangle is left");
    let twice = model("name = \"m\"\nhidden = false");
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{}\n[[model]]\nfile = \"m.obj\"\n", good_toml());
    for (name, text) in [("s.toml", &*scene), ("m.obj", SQUARE), ("f.toml", &*twice)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let load = || Film::load(folder.path().join("f.toml").to_str().unwrap(), &LoadOptions::default());
    assert!(load().unwrap_err().to_string().contains("several models of the scene are called \"m\""));
    let named = scene.replacen("[[model]]", "[[model]]\nname = \"other\"", 1);
    std::fs::write(folder.path().join("s.toml"), named).unwrap();
    load().unwrap();
    let matrix = "matrix = [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]";
    let scene = good_toml().replacen("[[model]]", &format!("[[model]]\n{matrix}"), 1);
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    std::fs::write(folder.path().join("f.toml"), model("name = \"m\"\nrotate = [0, 0, 1]")).unwrap();
    assert!(load().unwrap_err().to_string().contains("states a matrix"));
}
