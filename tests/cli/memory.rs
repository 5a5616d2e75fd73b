//! New memory of the device holds what its last user left. No picture depends on it.

use crate::{folder_with, lightpaths, stderr};
use std::fmt::Write as _;
use std::fs;

const SCENE: &str = "[[model]]\nfile = \"leaves.obj\"\n[camera]\nposition = [0, 0, 0.9]\ntarget = [0, 0, 0]\n\
fov_y = 70.0\nsize = [48, 36]\n[[light]]\nkind = \"point\"\nposition = [0.5, 0.7, 0.6]\nintensity = [1, 1, 1]\n";

/// Lobes that take the light of records, and lobes that take rays.
const MATERIALS: &str = "newmtl wall\nKd 0.6 0.6 0.6\nnewmtl broad\nKd 0.2 0.2 0.2\nKs 0.3 0.3 0.3\nNs 4\n\
newmtl sharp\nKd 0.1 0.1 0.1\nKs 0.6 0.6 0.6\nNs 300\n";

/// A closed box with 6000 leaves narrower than a pixel, so that most pixels show more kinds of
/// surface than they have fragments. One leaf in twelve has a sharp lobe.
fn leaves() -> String {
    let mut text = "mtllib leaves.mtl\nusemtl wall\n".to_owned();
    for corner in 0..8 {
        let along = |axis: u32| 2 * (corner >> axis & 1) - 1;
        writeln!(text, "v {} {} {}", along(0), along(1), along(2)).unwrap();
    }
    text += "f 1 2 4 3\nf 6 5 7 8\nf 5 1 3 7\nf 2 6 8 4\nf 5 6 2 1\nf 3 4 8 7\n";
    let mut state = 1_u32;
    let mut random = |reach: f32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        reach * (2.0 * (state >> 8) as f32 / (1 << 24) as f32 - 1.0)
    };
    for leaf in 0..6000 {
        let middle = [random(0.6), random(0.6), random(0.18) - 0.3];
        writeln!(text, "usemtl {}", if leaf % 12 == 0 { "sharp" } else { "broad" }).unwrap();
        for _ in 0..3 {
            let [x, y, z] = middle.map(|along| along + random(0.02));
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        text += "f -3 -2 -1\n";
    }
    text
}

/// Mesa's device takes its memory of the C library, which fills it as this variable says. Other
/// devices and libraries ignore it.
#[test]
fn a_picture_does_not_depend_on_what_memory_held() {
    let folder = folder_with(&[("leaves.toml", SCENE), ("leaves.mtl", MATERIALS), ("leaves.obj", &leaves())]);
    let pictures = ["85", "170"].map(|filling| {
        let picture = format!("{filling}.exr");
        let mut command =
            lightpaths(&folder, &["render", "leaves.toml", "--preset", "draft", "-o", &picture]);
        let output = command.env("MALLOC_PERTURB_", filling).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(folder.path().join(picture)).unwrap()
    });
    assert!(pictures[0] == pictures[1]);
}
