//! Compiled shaders. `build.rs` documents where the embedded binaries come from.

use std::borrow::Cow;

/// One compiled compute shader.
#[derive(Clone, Debug)]
pub struct Shader {
    /// Name of the file, the binary, the pass and the timing.
    pub stem: &'static str,
    /// Hash of the GLSL source with its includes. `spirv/MANIFEST` holds the hash of
    /// the compiled source.
    pub source_hash: Cow<'static, str>,
    /// The SPIR-V module, little endian.
    pub bytes: Cow<'static, [u8]>,
}

/// Every embedded shader, by stem in alphabetical order.
pub const SHADERS: &[Shader] = include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

impl Shader {
    const fn embedded(stem: &'static str, source_hash: &'static str, bytes: &'static [u8]) -> Self {
        Self { stem, source_hash: Cow::Borrowed(source_hash), bytes: Cow::Borrowed(bytes) }
    }

    /// The embedded shader with this stem. Panics if there is none.
    pub fn named(stem: &str) -> &'static Self {
        SHADERS
            .iter()
            .find(|shader| shader.stem == stem)
            .unwrap_or_else(|| panic!("there is no glsl/{stem}.comp"))
    }

    /// The module as SPIR-V words.
    pub fn words(&self) -> Vec<u32> {
        let (words, rest) = self.bytes.as_chunks::<4>();
        assert!(rest.is_empty(), "`{}`: SPIR-V is made of whole words", self.stem);
        words.iter().map(|&word| u32::from_le_bytes(word)).collect()
    }
}
