//! Writes the index of shaders that `src/gpu/shaders.rs` embeds: for each `glsl/<stem>.comp` its
//! stem, the hash of its source with the includes in place, and its binary. The binary is the
//! committed `spirv/<stem>.spv`, or, under the feature `shaderc`, one compiled here and now.
//! Nothing is ever written into the source tree.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "src/gpu/hash.rs"]
#[allow(unreachable_pub, reason = "the library publishes it")]
mod hash;

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=spirv");

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
        let source_hash = hash::fnv1a(flatten(&root.join("glsl"), source).as_bytes());
        let binary = binary(&root, &out, source, stem);
        if !cfg!(feature = "shaderc") && !manifest.contains(&format!("{stem} {source_hash} ")) {
            println!("cargo:warning=spirv/MANIFEST has another hash for glsl/{stem}.comp: run `make spirv`");
        }
        writeln!(
            index,
            "Shader {{ stem: {stem:?}, source_hash: {source_hash:?}, bytes: include_bytes!({binary:?}) }},"
        )
        .expect("a string takes any text");
    }
    index.push(']');
    fs::write(out.join("shaders.rs"), index).expect("OUT_DIR can be written");
}

/// The text of `file` with every `#include "x"` (relative to `glsl/`) replaced by that file's text.
fn flatten(glsl: &Path, file: &Path) -> String {
    let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut flat = String::with_capacity(text.len());
    for line in text.lines() {
        match line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(include) => flat.push_str(&flatten(glsl, &glsl.join(include))),
            None => flat.push_str(line),
        }
        flat.push('\n');
    }
    flat
}

#[cfg(not(feature = "shaderc"))]
fn binary(root: &Path, _out: &Path, _source: &Path, stem: &str) -> PathBuf {
    let path = root.join(format!("spirv/{stem}.spv"));
    assert!(path.exists(), "glsl/{stem}.comp has no spirv/{stem}.spv: run `make spirv`");
    path
}

/// Compiles one shader. SPIR-V 1.5, which every Vulkan 1.2 device takes; level zero, which
/// keeps all names for the reflection; no debug information, which would embed paths;
/// warnings are errors.
#[cfg(feature = "shaderc")]
fn binary(root: &Path, out: &Path, source: &Path, stem: &str) -> PathBuf {
    let glsl = root.join("glsl");
    let mut options = shaderc::CompileOptions::new().expect("the compiler has memory");
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Zero);
    options.set_warnings_as_errors();
    options.set_include_callback(|name, _, _, _| {
        let path = glsl.join(name);
        let content = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(shaderc::ResolvedInclude { resolved_name: format!("glsl/{name}"), content })
    });
    let text = fs::read_to_string(source).unwrap_or_else(|error| panic!("{}: {error}", source.display()));
    let compiled = shaderc::Compiler::new().expect("the compiler has memory").compile_into_spirv(
        &text,
        shaderc::ShaderKind::Compute,
        &format!("glsl/{stem}.comp"),
        "main",
        Some(&options),
    );
    let artifact = compiled.unwrap_or_else(|error| {
        eprintln!("{error}");
        std::process::exit(1)
    });
    let path = out.join(format!("{stem}.spv"));
    fs::write(&path, artifact.as_binary_u8()).expect("OUT_DIR can be written");
    path
}
