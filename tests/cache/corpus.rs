//! The light paths for fuzzing readers: small, of a scene with every feature, and valid
//! for this program.

use crate::common::context;
use lightpaths::renderer::{Renderer, Silent};
use std::path::Path;

#[allow(unreachable_pub, dead_code, reason = "the library of the fuzzing package")]
#[path = "../../fuzz/src/lib.rs"]
mod readers;

#[test]
fn the_corpus_holds_light_paths() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/cache/good");
    if std::env::var_os("LIGHTPATHS_BLESS").is_some() {
        Renderer::store(&context(), readers::stored_scene(), &file, &mut Silent).unwrap();
    }
    let bytes = std::fs::read(&file).unwrap();
    let is_taken = lightpaths::renderer::miss_reason(&bytes, &readers::stored_scene()).unwrap();
    assert_eq!(is_taken, None, "run: LIGHTPATHS_BLESS=1 cargo test --test stored the_corpus");
    assert!(bytes.len() < 1 << 20, "{} bytes", bytes.len());
}
