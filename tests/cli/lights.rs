//! Lights of every kind, and work that frames skip.

use super::{folder_with, json, run};

/// A room under a spot light, an area light and a directional light.
const SCENE: &str = r#"
[[model]]
file = "room.obj"
[camera]
position = [0.0, 1.0, 1.9]
target = [0.0, 0.8, 0.0]
fov_y = 60.0
size = [24, 16]
[[light]]
kind = "spot"
position = [0.2, 1.6, 0.2]
direction = [0.0, -1.0, 0.1]
intensity = [3.0, 2.0, 1.0]
angle = 40.0
penumbra = 0.5
[[light]]
kind = "area"
corner = [-0.5, 1.9, -0.5]
edge_u = [0.5, 0.0, 0.0]
edge_v = [0.0, 0.0, 0.4]
radiance = [4.0, 4.0, 4.0]
[[light]]
kind = "directional"
direction = [0.1, -0.5, -1.0]
irradiance = [0.5, 0.6, 0.7]
[quality]
entry_points = 3000
cache_points = 400
gather_rays = 64
cells = 8
"#;

/// A floor, a wall at the back and a ceiling, open towards the camera.
const MODEL: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
                     f 4 3 2 1\nf 1 2 6 5\nf 5 6 7 8\n";

#[test]
fn leaving_work_out_changes_no_bit() {
    let folder = folder_with(&[("room.toml", SCENE), ("room.obj", MODEL)]);
    let render = |name: &str, flag: &[&str]| {
        let arguments = ["render", "room.toml", "--aov", "direct,indirect", "--stats", "s.json", "-o", name];
        let output = run(&folder, &[&arguments, flag].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read(folder.path().join(name)).unwrap()
    };
    let whole = render("whole.exr", &["--no-skip"]);
    assert!(render("lean.exr", &[]) == whole);
    let skipped = &json(&folder, "s.json")["renderer"]["skipped"];
    let what = "shadow rays of entry points that face away from a light or stand outside its cone";
    let fraction = skipped[what].as_f64().unwrap();
    assert!((0.1..0.9).contains(&fraction), "{fraction}");
    assert_eq!(skipped["lights that are off or black"], 0.0);
}
