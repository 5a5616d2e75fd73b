//! Replaces shaders while the program runs.

use std::path::Path;

use rayon::prelude::*;

#[cfg(feature = "shaderc")]
use super::glsl::compile;
use super::shaders::{SHADERS, Shader};
use super::spirv::{self, Module};
use super::{Context, glsl, hash};
use crate::error::{Error, Result};

/// Why a program without the feature `shaderc` reloads no shader.
pub const NO_COMPILER: &str =
    "this program contains no shader compiler: build it with `cargo build --release --features shaderc`";

#[doc(hidden)]
impl Context {
    /// The shader with this stem that pipelines are compiled from: the embedded one, or the one
    /// that has replaced it. Panics if there is none.
    pub fn shader(&self, stem: &str) -> Shader {
        self.pipelines.shader(stem)
    }

    /// Number of calls of [`Self::replace_shaders`] that have replaced some.
    pub fn replacement_count(&self) -> u32 {
        self.pipelines.replacement_count()
    }

    /// Replaces shaders in all pipelines. Recordings that exist keep the old code; results that
    /// earlier submissions have computed stay.
    ///
    /// # Errors
    /// [`Error::Usage`] if a shader declares another interface than the one that it replaces; the
    /// device failed. All pipelines then stay.
    pub fn replace_shaders(&self, shaders: Vec<Shader>) -> Result<()> {
        if shaders.is_empty() {
            return Ok(());
        }
        for shader in &shaders {
            let [old, new] =
                [&self.shader(shader.stem), shader].map(|shader| spirv::reflect(&shader.words()));
            if let Some(what) = difference(&old, &new) {
                return Err(Error::Usage(format!(
                    "glsl/{}.comp: {what} changed, which the host code depends on: build the program again",
                    shader.stem
                )));
            }
        }
        self.pipelines.replace((&self.device, &self.names, &self.optional), shaders)
    }

    /// Compiles the shaders of a folder whose sources, includes in place, differ from the sources
    /// of the current ones, and replaces these. Returns their stems.
    ///
    /// # Errors
    /// A source cannot be read or compiled, with file and line; the program has no compiler; and as
    /// [`Self::replace_shaders`]. All pipelines then stay.
    pub fn reload_shaders(&self, folder: &Path) -> Result<Vec<&'static str>> {
        let mut changed = Vec::new();
        for Shader { stem, .. } in SHADERS {
            let source = glsl::flatten(folder, stem);
            let source_hash = hash::fnv1a(source.map_err(Error::Usage)?.as_bytes());
            if source_hash != self.shader(stem).source_hash {
                changed.push((*stem, source_hash));
            }
        }
        let compiled = changed.par_iter().with_max_len(1).map(|(stem, source_hash)| {
            let bytes = compile(folder, stem).map_err(Error::Usage)?;
            Ok(Shader { stem, source_hash: source_hash.clone().into(), bytes: bytes.into() })
        });
        // All are compiled, so that the first failure in the order of stems is the same each time.
        let compiled: Vec<Result<Shader>> = compiled.collect();
        self.replace_shaders(compiled.into_iter().collect::<Result<_>>()?)?;
        Ok(changed.into_iter().map(|(stem, _)| stem).collect())
    }
}

#[cfg(not(feature = "shaderc"))]
fn compile(_: &Path, stem: &str) -> std::result::Result<Vec<u8>, String> {
    Err(format!("glsl/{stem}.comp: {NO_COMPILER}"))
}

/// The first difference between two interfaces that host code would have to follow.
fn difference(old: &Module, new: &Module) -> Option<&'static str> {
    // Types have no fixed order.
    let has_same_structures = old.structures.len() == new.structures.len()
        && old.structures.iter().all(|structure| new.structures.contains(structure));
    let differs = [
        ("bindings", old.bindings != new.bindings),
        ("push constants", old.push != new.push),
        ("specialisation constants", old.constants != new.constants),
        ("structures", !has_same_structures),
        ("the size of workgroups", old.local_size != new.local_size),
        ("the use of the number of workgroups", old.has_workgroup_count != new.has_workgroup_count),
        // The device is opened without further features.
        ("capabilities", new.capabilities.iter().any(|capability| !old.capabilities.contains(capability))),
    ];
    differs.into_iter().find(|(_, differs)| *differs).map(|(what, _)| what)
}
