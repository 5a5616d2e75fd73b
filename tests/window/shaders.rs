//! Shaders are reloaded while the window is open.

use std::fs;
use std::path::Path;
use std::time::Instant;

use crate::display::Display;
use crate::picture::changed_pixels;
use crate::scenarios::{PICTURE, READY, SOON, changed, close, open_with, settled};

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let file = entry.unwrap().path();
        let target = to.join(file.file_name().unwrap());
        if file.is_dir() {
            copy(&file, &target);
        } else {
            fs::copy(&file, &target).unwrap();
        }
    }
}

fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert_eq!(text.matches(from).count(), 1, "{} has one {from:?}", file.display());
    fs::write(file, text.replace(from, to)).unwrap();
}

#[test]
fn an_edited_shader_shows_at_once_and_a_broken_one_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl"), folder.path());
    let display = Display::start();
    let demo = open_with(&display, &["--shaders", folder.path().to_str().unwrap()]);
    let before = settled(&demo);
    let tonemap = folder.path().join("tonemap.comp");

    let (mark, start) = (demo.mark(), Instant::now());
    edit(&tonemap, "red | (green << 8) | (blue << 16)", "blue | (green << 8) | (red << 16)");
    let after = demo.wait_for_change(&before, PICTURE, SOON);
    eprintln!("from the change of the file to the new picture: {:?}", start.elapsed());
    demo.wait_for_line_since(mark, "lightpaths: shaders reloaded: tonemap", SOON);
    let [old, new] = [&before, &after].map(|picture| picture.get_pixel(40, 300).0);
    assert_eq!([old[2], old[1], old[0]], new, "red and blue");

    let mark = demo.mark();
    let after = settled(&demo);
    edit(&tonemap, "void main() {", "void main() { unknown += 1;");
    demo.wait_for_line_since(mark, "lightpaths: shaders not reloaded: glsl/tonemap.comp:", SOON);
    // The alarm stands at the lower edge.
    let top = crate::picture::Area { height: PICTURE.height / 2, ..PICTURE };
    assert_eq!(changed_pixels(&after, &settled(&demo), top, 0), 0, "the old pipelines stay");
    edit(&tonemap, "void main() { unknown += 1;", "void main() {");

    let mark = demo.mark();
    edit(&folder.path().join("light_paths.comp"), "void main() {", "void main() {  // Edited.");
    let traced = "lightpaths: shaders reloaded: light_paths; light paths are traced again";
    demo.wait_for_line_since(mark, traced, SOON);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    edit(&tonemap, "blue | (green << 8) | (red << 16)", "red | (green << 8) | (blue << 16)");
    changed(&demo, &after);
    close(&demo);
}
