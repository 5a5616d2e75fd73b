//! Shaders are replaced while the program runs. Most tests need the feature `shaderc`:
//! `cargo test --locked --features shaderc --test reload`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::assert_silent;
use glam::Vec3;
use lightpaths::Error;
use lightpaths::gpu::shaders::Shader;
use lightpaths::gpu::{Context, ContextOptions};
use lightpaths::renderer::{Renderer, Silent};
use lightpaths::scene::{Quality, Scene, shapes};

/// A device of its own: other tests keep their shaders.
fn context() -> Arc<Context> {
    let options = ContextOptions { validation: true, hazard_check: true, ..ContextOptions::default() };
    Context::new(&options).unwrap()
}

fn scene() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    scene.cameras[0].size = [67, 45];
    scene.quality = Quality { entry_points: 500, cache_points: 50, cells: 8, ..Quality::DRAFT };
    scene
}

fn renderer(context: &Arc<Context>) -> Renderer {
    Renderer::new(context, scene(), &mut Silent).unwrap()
}

fn picture(renderer: &mut Renderer) -> Vec<u32> {
    renderer.frame().unwrap();
    renderer.display_buffer().read().unwrap()
}

/// A copy of `glsl/`.
struct Sources(tempfile::TempDir);

impl Sources {
    fn new() -> Self {
        let copy = tempfile::tempdir().unwrap();
        let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
        fs::create_dir(copy.path().join("include")).unwrap();
        for folder in ["", "include"] {
            for entry in fs::read_dir(original.join(folder)).unwrap() {
                let file = entry.unwrap().path();
                if file.is_file() {
                    fs::copy(&file, copy.path().join(folder).join(file.file_name().unwrap())).unwrap();
                }
            }
        }
        Self(copy)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn edit(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.file(name)).unwrap();
        assert_eq!(text.matches(from).count(), 1, "{name} has one {from:?}");
        fs::write(self.file(name), text.replace(from, to)).unwrap();
    }

    fn reload(&self, context: &Context) -> Result<Vec<&'static str>, Error> {
        context.reload_shaders(self.0.path())
    }
}

#[test]
fn a_shader_with_another_interface_is_refused() {
    let context = context();
    let mut renderer = renderer(&context);
    let before = picture(&mut renderer);
    let other = Shader { stem: "tonemap", ..context.shader("compose") };
    // The valid one is not replaced either.
    let why = context.replace_shaders(vec![context.shader("compose"), other]).unwrap_err().to_string();
    assert!(
        why.starts_with("glsl/tonemap.comp: bindings changed") && why.ends_with("build the program again")
    );
    assert_eq!(context.replacement_count(), 0);
    let made = context.pipelines_made();
    context.replace_shaders(vec![context.shader("compose")]).unwrap();
    assert!(context.replacement_count() == 1 && context.pipelines_made() > made, "its own binary fits");
    assert!(picture(&mut renderer) == before);
    assert_silent(&context);
}

#[test]
fn sources_as_built_reload_nothing() {
    let (context, sources) = (context(), Sources::new());
    assert_eq!(sources.reload(&context).unwrap(), [""; 0]);
    sources.edit("include/sampling.glsl", "uint hash(uint x) {", "#include \"include/sampling.glsl\"\n");
    let why = sources.reload(&context).unwrap_err().to_string();
    assert!(why.ends_with("sampling.glsl: includes itself"), "{why}");
    fs::remove_file(sources.file("include/math.glsl")).unwrap();
    let why = sources.reload(&context).unwrap_err().to_string();
    assert!(why.contains("math.glsl: No such file"), "{why}");
}

#[cfg(not(feature = "shaderc"))]
#[test]
fn a_program_without_compiler_names_the_feature() {
    use lightpaths::gpu::NO_COMPILER;

    let (context, sources) = (context(), Sources::new());
    sources.edit("tonemap.comp", "SHOULDER = 0.8", "SHOULDER = 0.7");
    let why = sources.reload(&context).unwrap_err().to_string();
    assert_eq!(why, format!("glsl/tonemap.comp: {NO_COMPILER}"));

    #[cfg(feature = "window")]
    {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_lightpaths"));
        let ended = command.args(["demo", "--shaders"]).arg(sources.0.path()).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert!(ended.status.code() == Some(2) && said.contains(NO_COMPILER), "{said}");
    }
}

#[cfg(feature = "shaderc")]
mod compiled {
    use std::collections::BTreeSet;
    use std::time::Instant;

    use lightpaths::gpu::shaders::SHADERS;
    use lightpaths::renderer::{Store, Work};

    use super::*;

    const CODES: &str = "display[index] = red | (green << 8) | (blue << 16)";
    const SWAPPED: &str = "display[index] = blue | (green << 8) | (red << 16)";

    fn swapped(code: u32) -> u32 {
        code & 0xff00_ff00 | (code & 0xff) << 16 | (code >> 16) & 0xff
    }

    #[test]
    fn the_next_frame_is_computed_by_the_new_shader() {
        let (context, sources) = (context(), Sources::new());
        let mut renderer = renderer(&context);
        let before = picture(&mut renderer);
        assert!(before.iter().any(|&code| swapped(code) != code), "the box has colours");
        // Recorded with the old shader: it stays alive until this frame is done.
        renderer.force(Work::Everything);
        let (recorder, old) = renderer.begin_frame().unwrap();

        sources.edit("tonemap.comp", CODES, SWAPPED);
        let start = Instant::now();
        assert_eq!(sources.reload(&context).unwrap(), ["tonemap"]);
        eprintln!("reload of one shader: {:?}", start.elapsed());
        let in_flight = recorder.submit().unwrap();
        let timings = in_flight.wait().unwrap();
        renderer.frame_is_valid(&old);
        renderer.end_frame(&old, timings).unwrap();
        assert!(renderer.display_buffer().read::<u32>().unwrap() == before);

        renderer.force(Work::Everything);
        let expected: Vec<u32> = before.iter().copied().map(swapped).collect();
        assert!(picture(&mut renderer) == expected);
        assert_eq!(sources.reload(&context).unwrap(), [""; 0], "reloaded once");
        sources.edit("tonemap.comp", SWAPPED, CODES);
        assert_eq!(sources.reload(&context).unwrap(), ["tonemap"]);
        renderer.force(Work::Everything);
        assert!(picture(&mut renderer) == before, "as built");
        drop((in_flight, renderer));
        assert_silent(&context);
    }

    #[test]
    fn errors_and_other_interfaces_leave_the_picture() {
        let (context, sources) = (context(), Sources::new());
        let mut renderer = renderer(&context);
        let before = picture(&mut renderer);
        let mut refused = |file: &str, from: &str, to: &str| {
            // A shader that compiles is not replaced while another one fails.
            sources.edit("tonemap.comp", CODES, SWAPPED);
            sources.edit(file, from, to);
            let why = sources.reload(&context).unwrap_err().to_string();
            renderer.force(Work::Everything);
            assert!(picture(&mut renderer) == before, "{why}");
            sources.edit(file, to, from);
            sources.edit("tonemap.comp", SWAPPED, CODES);
            assert_eq!(sources.reload(&context).unwrap(), [""; 0]);
            why
        };
        let line = |file: &str, text: &str| {
            let text = fs::read_to_string(sources.file(file)).unwrap().split(text).next().unwrap().to_owned();
            format!("glsl/{file}:{}: error: ", text.matches('\n').count() + 1)
        };
        let text = "void main() {";
        let expected = line("compose.comp", text);
        let why = refused("compose.comp", text, "void main() { unknown += 1;");
        assert!(why.starts_with(&expected), "{why} begins with {expected}");
        let text = "uint hash(uint x) {";
        let expected = line("include/sampling.glsl", text);
        let why = refused("include/sampling.glsl", text, "uint hash(uint x) { unknown += 1;");
        assert!(why.starts_with(&expected), "{why} begins with {expected}");

        for (what, from, to) in [
            ("bindings", "Display { uint display[]; }", "Displayed { uint display[]; }"),
            ("bindings", "binding = 0) readonly buffer", "binding = 0) buffer"),
            ("push constants", "float scale;", "float scale; uint more;"),
            ("structures", "uint pixel_count;\n    float scale;", "float scale;\n    uint pixel_count;"),
            (
                "specialisation constants",
                "const float SHOULDER",
                "layout(constant_id = 9) const float SHOULDER",
            ),
            ("the size of workgroups", "local_size_x = 64", "local_size_x = 32"),
        ] {
            sources.edit("tonemap.comp", from, to);
            let why = sources.reload(&context).unwrap_err().to_string();
            assert!(why.starts_with(&format!("glsl/tonemap.comp: {what} changed")), "{why}, not {what}");
            sources.edit("tonemap.comp", to, from);
        }
        assert_silent(&context);
    }

    /// Whether the shader's text, or one of its includes, has this include.
    fn includes(sources: &Sources, file: &str, wanted: &str) -> bool {
        let text = fs::read_to_string(sources.file(file)).unwrap();
        let mut named = text.lines().filter_map(|line| line.strip_prefix("#include \"")?.strip_suffix('"'));
        named.any(|name| name == wanted || includes(sources, name, wanted))
    }

    #[test]
    fn an_include_reloads_all_that_use_it() {
        let (context, sources) = (context(), Sources::new());
        for include in ["include/colour.glsl", "include/brdf.glsl"] {
            let users = SHADERS.iter().map(|shader| shader.stem);
            let users: BTreeSet<_> =
                users.filter(|stem| includes(&sources, &format!("{stem}.comp"), include)).collect();
            assert!(users.len() > 1 && users.len() < SHADERS.len(), "{include}: {users:?}");
            let text = fs::read_to_string(sources.file(include)).unwrap();
            fs::write(sources.file(include), format!("{text}// Edited.\n")).unwrap();
            let start = Instant::now();
            let reloaded: BTreeSet<_> = sources.reload(&context).unwrap().into_iter().collect();
            eprintln!("reload of {} shaders: {:?}", reloaded.len(), start.elapsed());
            assert_eq!(reloaded, users);
        }
    }

    #[test]
    fn stored_light_paths_belong_to_the_shaders_that_traced_them() {
        let (context, sources) = (context(), Sources::new());
        let folder = tempfile::tempdir().unwrap();
        let store = Store::File(folder.path().join("paths"));
        let show = || {
            let mut renderer = Renderer::cached(&context, scene(), &store, &mut Silent, &mut |_| ()).unwrap();
            picture(&mut renderer)
        };
        let before = show();
        assert!(store.miss(&context, &scene()).unwrap().is_none());
        sources.edit("entry_points.comp", "void main() {", "void main() { // Edited.");
        assert_eq!(sources.reload(&context).unwrap(), ["entry_points"]);
        assert!(Renderer::runs_before_frames("entry_points") && !Renderer::runs_before_frames("tonemap"));
        assert!(store.miss(&context, &scene()).unwrap().is_some());
        assert!(show() == before, "only a comment has changed");
        assert!(store.miss(&context, &scene()).unwrap().is_none(), "stored for the new shader");
    }
}
