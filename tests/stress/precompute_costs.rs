//! The cost of a precomputation without a clock: submissions, pipelines, and bytes that the host
//! receives.

use lightpaths::gpu::{CommandCounts, Context, ContextOptions};
use lightpaths::renderer::{Renderer, Silent};
use lightpaths::scene::{LoadOptions, Scene};

/// Precomputes a scene on a device of its own. Returns its counts, and the number of pipelines that
/// it and the first frame compile.
fn counts(name: &str, set: &[&str]) -> (CommandCounts, u32) {
    let context = Context::new(&ContextOptions::default()).unwrap();
    let set = set.iter().map(|&change| change.to_owned()).collect();
    let scene = Scene::load(name, &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
    let precomputation = context.command_counts();
    renderer.frame().unwrap();
    println!("{name}: {precomputation:?}, {} pipelines", context.pipelines_made());
    (precomputation, context.pipelines_made())
}

/// Dispatches adapt to the time that they take, so counts vary with the load of the machine. A
/// quiet one takes 155.
#[test]
fn a_small_precomputation_has_few_submissions_and_pipelines() {
    let set = ["quality.entry_points=20000", "quality.cache_points=4000", "quality.gather_rays=64"];
    let (precomputation, pipelines) = counts("box", &set);
    assert!(precomputation.submissions <= 300, "{precomputation:?}");
    assert!(pipelines <= MAX_PIPELINES, "{pipelines}");
}

/// Pipelines of a diffuse scene with one light, with those of its first frame.
const MAX_PIPELINES: u32 = 56;

#[test]
#[ignore = "full size: make stress"]
fn a_precomputation_has_few_submissions() {
    for name in ["box", "atrium", "room"] {
        let (precomputation, pipelines) = counts(name, &[]);
        assert!(precomputation.submissions <= 400, "{name}: {precomputation:?}");
        assert!(pipelines <= MAX_PIPELINES, "{name}: {pipelines}");
    }
}
