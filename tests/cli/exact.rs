//! `render --exact`, as scripts use it.

use super::{assert_refused, folder_with, listing, render, run};
use lightpaths::image::read;

#[test]
fn a_stage_is_exact_on_demand() {
    let folder = tempfile::tempdir().unwrap();
    render(&folder, &["-o", "whole.exr"]);
    let pixels = |name: &str| read(&folder.path().join(name), None).unwrap().pixels;
    let energy = |name: &str| pixels(name).iter().flatten().map(|&value| f64::from(value)).sum::<f64>();
    for stage in ["splat", "clusters", "gather"] {
        let name = format!("{stage}.exr");
        render(&folder, &["--exact", stage, "-o", &name]);
        assert!(pixels(&name) != pixels("whole.exr"), "{stage}");
        let ratio = energy(&name) / energy("whole.exr");
        assert!((ratio - 1.0).abs() < 0.02, "{stage}: {ratio}");
    }
}

#[test]
fn other_methods_have_no_such_stage() {
    let folder = folder_with(&[]);
    for (arguments, words) in [
        ("render --exact splat --method path -o a.exr", ["--exact", "path"]),
        ("render --exact gather --method direct -o a.exr", ["--exact", "direct"]),
        ("render --exact clusters -o a.png", ["--exact", ".exr"]),
        ("render --exact clusters --spp 4 -o a.exr", ["--spp", "lightpaths"]),
        ("render --exact everything -o a.exr", ["--exact", "everything"]),
    ] {
        assert_refused(&run(&folder, &arguments.split(' ').collect::<Vec<_>>()), 2, &words);
        assert!(listing(&folder).is_empty(), "{arguments}");
    }
}
