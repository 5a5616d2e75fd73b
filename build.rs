//! Writes the index of shaders that `src/gpu/shaders.rs` embeds: for each `glsl/<stem>.comp` its
//! stem, the hash of its source with the includes in place, and its binary. The binary is the
//! committed `spirv/<stem>.spv`, or, under the feature `shaderc`, one compiled here and now.
//! Nothing is ever written into the source tree. Names the commit and the features for `--version`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

#[path = "src/gpu/glsl.rs"]
mod glsl;
#[path = "src/gpu/hash.rs"]
#[allow(unreachable_pub, reason = "the library publishes it")]
mod hash;

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=spirv");
    println!("cargo:rustc-env=LIGHTPATHS_COMMIT={}", commit(&root));
    let features = [("window", cfg!(feature = "window")), ("shaderc", cfg!(feature = "shaderc"))];
    let on: Vec<&str> = features.iter().filter(|feature| feature.1).map(|feature| feature.0).collect();
    let on = if on.is_empty() { "none".to_owned() } else { on.join(" ") };
    println!("cargo:rustc-env=LIGHTPATHS_FEATURES={on}");

    let mut sources: Vec<PathBuf> = fs::read_dir(root.join("glsl"))
        .expect("glsl/ is part of the package")
        .map(|entry| entry.expect("glsl/ can be listed").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "comp"))
        .collect();
    sources.sort();

    let manifest = fs::read_to_string(root.join("spirv/MANIFEST")).unwrap_or_default();
    let mut index = String::from("&[\n");
    for source in &sources {
        let stem = source.file_stem().and_then(|stem| stem.to_str()).expect("stems are plain ASCII");
        let flat = glsl::flatten(&root.join("glsl"), stem).unwrap_or_else(|error| panic!("{error}"));
        let source_hash = hash::fnv1a(flat.as_bytes());
        let binary = binary(&root, &out, stem);
        if !cfg!(feature = "shaderc") && !manifest.contains(&format!("{stem} {source_hash} ")) {
            println!("cargo:warning=spirv/MANIFEST has another hash for glsl/{stem}.comp: run `make spirv`");
        }
        writeln!(index, "Shader::embedded({stem:?}, {source_hash:?}, include_bytes!({binary:?})),")
            .expect("a string takes any text");
    }
    index.push(']');
    fs::write(out.join("shaders.rs"), index).expect("OUT_DIR can be written");
}

/// The commit of a checkout, in brackets after a blank. Empty without one, and in other builds than
/// those for release, which a commit would make stale.
fn commit(root: &Path) -> String {
    let git = root.join(".git");
    if env::var("PROFILE").as_deref() != Ok("release") || !git.exists() {
        return String::new();
    }
    let ask = |arguments: &[&str]| {
        let output = Command::new("git").arg("-C").arg(root).args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    if let Some(log) = ask(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={}", root.join(log).display());
    }
    ask(&["rev-parse", "--short", "HEAD"]).map_or_else(String::new, |commit| format!(" ({commit})"))
}

#[cfg(not(feature = "shaderc"))]
fn binary(root: &Path, _out: &Path, stem: &str) -> PathBuf {
    let path = root.join(format!("spirv/{stem}.spv"));
    assert!(path.exists(), "glsl/{stem}.comp has no spirv/{stem}.spv: run `make spirv`");
    path
}

/// Compiles one shader.
#[cfg(feature = "shaderc")]
fn binary(root: &Path, out: &Path, stem: &str) -> PathBuf {
    let binary = glsl::compile(&root.join("glsl"), stem).unwrap_or_else(|messages| {
        eprintln!("{messages}");
        std::process::exit(1)
    });
    let path = out.join(format!("{stem}.spv"));
    fs::write(&path, binary).expect("OUT_DIR can be written");
    path
}
