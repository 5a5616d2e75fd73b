//! Reads and compiles GLSL, shared by the build script and the reload of shaders.

use std::fs;
use std::path::Path;

/// Includes within each other, at most. More are a circle.
const MAX_DEPTH: u32 = 32;

/// The text of `STEM.comp` of the folder `glsl`, with every `#include "x"` (relative to the folder)
/// replaced by that file's text. Its hash identifies a source.
///
/// # Errors
/// A file that cannot be read, and why.
pub(super) fn flatten(glsl: &Path, stem: &str) -> Result<String, String> {
    flatten_file(glsl, &glsl.join(format!("{stem}.comp")), 0)
}

fn flatten_file(glsl: &Path, file: &Path, depth: u32) -> Result<String, String> {
    if depth > MAX_DEPTH {
        return Err(format!("{}: includes itself", file.display()));
    }
    let text = read(file)?;
    let mut flat = String::with_capacity(text.len());
    for line in text.lines() {
        match line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(include) => flat.push_str(&flatten_file(glsl, &glsl.join(include), depth + 1)?),
            None => flat.push_str(line),
        }
        flat.push('\n');
    }
    Ok(flat)
}

/// Compiles `STEM.comp` of the folder `glsl` to SPIR-V 1.5, which every Vulkan 1.2 device takes.
/// Level zero keeps all names for the reflection. Debug information would embed paths, so there is
/// none. Warnings are errors.
///
/// # Errors
/// The compiler's messages, each with file and line.
#[cfg(feature = "shaderc")]
pub(super) fn compile(glsl: &Path, stem: &str) -> Result<Vec<u8>, String> {
    let mut options = shaderc::CompileOptions::new().map_err(|error| error.to_string())?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Zero);
    options.set_warnings_as_errors();
    options.set_include_callback(|name, _, _, _| {
        let content = read(&glsl.join(name))?;
        Ok(shaderc::ResolvedInclude { resolved_name: format!("glsl/{name}"), content })
    });
    let text = read(&glsl.join(format!("{stem}.comp")))?;
    let compiler = shaderc::Compiler::new().map_err(|error| error.to_string())?;
    let name = format!("glsl/{stem}.comp");
    match compiler.compile_into_spirv(&text, shaderc::ShaderKind::Compute, &name, "main", Some(&options)) {
        Ok(artifact) => Ok(artifact.as_binary_u8().to_vec()),
        Err(shaderc::Error::CompilationError(_, messages)) => Err(messages.trim_end().to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

fn read(file: &Path) -> Result<String, String> {
    fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))
}
