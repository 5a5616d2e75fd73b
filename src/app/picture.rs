//! Writes rendered pictures for all commands, and refuses values that are not finite.

use std::sync::Arc;

use super::output::OutputFile;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::image::{self, ExrLayer};
use crate::passes::GrowsWith;
use crate::passes::frame::tonemap::Tonemap;
use crate::scene::DisplayTransform;

/// The layer that is infinite where a camera ray leaves the scene.
const DEPTH: &str = "depth";

/// Refuses a picture with infinite or NaN values.
///
/// # Errors
/// [`Error::NotFinite`].
pub(super) fn refuse_non_finite(size: [u32; 2], pixels: &[[f32; 3]]) -> Result<()> {
    refuse(size, "", pixels, |value| value.is_finite())
}

fn refuse(size: [u32; 2], layer: &str, pixels: &[[f32; 3]], is_good: impl Fn(f32) -> bool) -> Result<()> {
    let is_bad = |pixel: &[f32; 3]| pixel.iter().any(|&value| !is_good(value));
    let Some(first) = pixels.iter().position(is_bad) else { return Ok(()) };
    let count = pixels[first..].iter().filter(|pixel| is_bad(pixel)).count();
    let width = size[0] as usize;
    Err(Error::NotFinite {
        layer: layer.to_owned(),
        count,
        first: [first % width, first / width],
        value: pixels[first],
    })
}

/// The sRGB codes of a picture, by the kernel that frames use.
///
/// # Errors
/// The device lacks memory or failed.
pub(super) fn tone_mapped(
    context: &Arc<Context>,
    pixels: &[[f32; 3]],
    display: &DisplayTransform,
) -> Result<Vec<[u8; 4]>> {
    let tonemap = Tonemap::new(context, pixels.len() as u32)?;
    let radiance = Buffer::from_slice(context, GrowsWith::Pixels.named("radiance"), pixels)?;
    context.run(|rec| tonemap.record(rec, &radiance, display))?;
    tonemap.display.read()
}

/// Writes a PNG of sRGB codes; `radiance` is their linear source.
///
/// # Errors
/// [`Error::NotFinite`]: an existing file is unchanged. [`Error::Output`].
pub(super) fn write_png(
    output: &OutputFile,
    size: [u32; 2],
    radiance: &[[f32; 3]],
    codes: &[[u8; 4]],
) -> Result<()> {
    refuse_non_finite(size, radiance)?;
    output.write(|out| image::write_png(out, size, codes))
}

/// Writes an EXR.
///
/// # Errors
/// As [`write_png`].
pub(super) fn write_exr(output: &OutputFile, size: [u32; 2], layers: &[ExrLayer]) -> Result<()> {
    for &ExrLayer { name, pixels, .. } in layers {
        let may_be_infinite = name == DEPTH;
        let is_good = |value: f32| value.is_finite() || may_be_infinite && value == f32::INFINITY;
        refuse(size, name, pixels, is_good)?;
    }
    output.write(|out| image::write_exr(out, size, layers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn no_picture_with_an_odd_pixel_is_written_and_what_was_there_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "old").unwrap();
        let output = OutputFile::check(&path).unwrap();
        let size = [3, 2];
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for channel in 0..3 {
                let mut pixels = [[0.5; 3]; 6];
                (pixels[4][channel], pixels[5][channel]) = (odd, odd);
                let layer = |name, pixels| ExrLayer { name, channels: &["R", "G", "B"], pixels };
                let good = [[0.5; 3]; 6];
                for refusal in [
                    write_png(&output, size, &pixels, &[[0; 4]; 6]),
                    write_exr(&output, size, &[layer("", &pixels)]),
                    write_exr(&output, size, &[layer("", &good), layer("direct", &pixels)]),
                ] {
                    let refusal = refusal.unwrap_err();
                    assert_eq!(refusal.exit_code(), 4);
                    let line = refusal.to_string();
                    assert!(line.contains("2 pixels") && line.contains("(1, 1)"), "{line}");
                }
            }
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn depth_alone_may_be_infinite_and_is_a_number() {
        let folder = tempfile::tempdir().unwrap();
        let output = OutputFile::check(&folder.path().join("a")).unwrap();
        let write = |value: f32| {
            let layer = ExrLayer { name: "depth", channels: &["Z"], pixels: &[[value; 3]] };
            write_exr(&output, [1, 1], &[layer])
        };
        write(f32::INFINITY).unwrap();
        assert!(write(f32::NAN).is_err() && write(f32::NEG_INFINITY).is_err());
    }
}
