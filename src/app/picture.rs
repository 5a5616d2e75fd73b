//! Writes rendered pictures for all commands, and refuses values that are not finite.

use std::sync::Arc;

use super::output::OutputFile;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::image::{self, ExrLayer};
use crate::passes::GrowsWith;
use crate::passes::frame::tonemap::Tonemap;
use crate::scene::DisplayTransform;

/// Refuses a picture with infinite or NaN values.
///
/// # Errors
/// [`Error::NotFinite`].
pub(super) fn refuse_non_finite(size: [u32; 2], pixels: &[[f32; 3]]) -> Result<()> {
    refuse(size, "", pixels)
}

fn refuse(size: [u32; 2], layer: &str, pixels: &[[f32; 3]]) -> Result<()> {
    let is_bad = |pixel: &[f32; 3]| pixel.iter().any(|value| !value.is_finite());
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

/// Writes an EXR with these texts in its header, by name.
///
/// # Errors
/// The pixels are not finite, or the file cannot be written.
pub(super) fn write_exr(
    output: &OutputFile,
    size: [u32; 2],
    layers: &[ExrLayer],
    attributes: &[(String, String)],
) -> Result<()> {
    layers.iter().try_for_each(|layer| refuse(size, layer.name, layer.pixels))?;
    output.write(|out| image::write_exr_with(out, size, layers, attributes))
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
                    write_exr(&output, size, &[layer("", &pixels)], &[]),
                    write_exr(&output, size, &[layer("", &good), layer("direct", &pixels)], &[]),
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
}
