//! Image files: OpenEXR for linear values, PNG for display.
//!
//! Pixels are linear Rec.709, row-major from the top left. The same pixels always give
//! the same bytes.

pub mod cryptomatte;
mod exposure;
mod header;
mod layers;
mod picture;
mod read;

pub use exposure::automatic_stops;
pub use picture::Picture;
pub use read::{parse, read};

use std::borrow::Cow;
use std::io::{self, Cursor, Seek, Write};

use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, Vec2, WritableImage,
};

/// The program's name in the file's metadata.
const SOFTWARE: &str = concat!("lightpaths ", env!("CARGO_PKG_VERSION"));

/// One named group of channels of an EXR file.
#[derive(Clone, Copy, Debug)]
pub struct ExrLayer<'a> {
    /// Prefix of the channel names (`"direct"` gives `direct.R`); empty for the main layer.
    pub name: &'a str,
    /// Channel names, at most three: the stored components of `pixels`, in order.
    pub channels: &'a [&'a str],
    /// One triple per pixel.
    pub pixels: &'a [[f32; 3]],
}

/// Writes an EXR file as [`write_exr_with`], without further attributes.
///
/// # Errors
/// As [`write_exr_with`]: if `out` fails.
pub fn write_exr(out: impl Write + Seek, size: [u32; 2], layers: &[ExrLayer]) -> io::Result<()> {
    write_exr_with(out, size, layers, &[])
}

/// Writes an EXR file of 32-bit floats, losslessly compressed, with Rec.709 primaries
/// and D65 white. `attributes` are texts of its header by name.
///
/// # Errors
/// If `out` fails. Panics if a layer does not hold `size[0]·size[1]` pixels, or if
/// channel names repeat.
pub fn write_exr_with(
    mut out: impl Write + Seek,
    size: [u32; 2],
    layers: &[ExrLayer],
    attributes: &[(String, String)],
) -> io::Result<()> {
    let channels = layers.iter().flat_map(|layer| {
        assert_eq!(layer.pixels.len(), size[0] as usize * size[1] as usize, "layer {:?}", layer.name);
        layer.channels.iter().enumerate().map(|(component, channel)| {
            let samples = layer.pixels.iter().map(|pixel| pixel[component]).collect();
            AnyChannel::new(channel_name(layer.name, channel).as_ref(), FlatSamples::F32(samples))
        })
    });
    let texts = attributes.iter().map(|(name, value)| {
        // Readers take texts as UTF-8. The library's checked constructor takes Latin-1 alone.
        let value = Text::from_slice_unchecked(value.as_bytes());
        (Text::from_slice_unchecked(name.as_bytes()), AttributeValue::Text(value))
    });
    let own = LayerAttributes {
        software_name: Text::new_or_none(SOFTWARE),
        other: texts.collect(),
        ..Default::default()
    };
    // This encoding has increasing line order. Otherwise blocks land in the order in which threads
    // finish them, and the bytes differ from run to run.
    let encoding = Encoding::SMALL_LOSSLESS;
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new(Vec2(size[0] as usize, size[1] as usize), own, encoding, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.chromaticities = Some(exr::meta::attribute::Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let fault = |error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other),
    };
    if attributes.is_empty() {
        return image.write().to_buffered(out).map_err(fault);
    }
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).map_err(fault)?;
    let mut file = file.into_inner();
    header::sort_attributes(&mut file);
    out.write_all(&file)
}

fn channel_name<'a>(layer: &str, channel: &'a str) -> Cow<'a, str> {
    if layer.is_empty() { channel.into() } else { format!("{layer}.{channel}").into() }
}

/// Writes an 8-bit sRGB PNG; the fourth code of each pixel is dropped.
///
/// # Errors
/// If `out` fails. Panics if `pixels` does not hold `size[0]·size[1]` pixels.
pub fn write_png(out: impl Write, size: [u32; 2], pixels: &[[u8; 4]]) -> io::Result<()> {
    assert_eq!(pixels.len(), size[0] as usize * size[1] as usize, "pixel count");
    let bytes: Vec<u8> = pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect();
    let mut encoder = png::Encoder::new(out, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Software".to_owned(), SOFTWARE.to_owned())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};

    #[test]
    fn png_holds_the_codes_and_says_srgb() {
        let mut bytes = Vec::new();
        write_png(&mut bytes, [2, 1], &[[118, 0, 7, 255], [1, 2, 3, 255]]).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        assert_eq!(reader.info().srgb, Some(png::SrgbRenderingIntent::Perceptual));
        let mut codes = [0; 6];
        reader.next_frame(&mut codes).unwrap();
        assert_eq!(codes, [118, 0, 7, 1, 2, 3]);
    }

    #[test]
    fn exr_returns_every_bit_and_always_the_same_bytes() {
        let size = [67, 41];
        let beauty: Vec<[f32; 3]> = (0..67 * 41).map(|i| [i as f32 * 0.1, 1e-30, f32::MAX]).collect();
        let depth: Vec<[f32; 3]> = (0..67 * 41).map(|i| [i as f32, -1.0, -1.0]).collect();
        let layers = [
            ExrLayer { name: "", channels: &["R", "G", "B"], pixels: &beauty },
            ExrLayer { name: "depth", channels: &["Z"], pixels: &depth },
        ];
        let texts =
            ["a/hash", "a/manifest", "a/name", "b/hash"].map(|key| (key.to_owned(), format!("{key} é")));
        let encoded: Vec<Vec<u8>> = (0..4)
            .map(|_| {
                let mut out = Cursor::new(Vec::new());
                write_exr_with(&mut out, size, &layers, &texts).unwrap();
                out.into_inner()
            })
            .collect();
        assert!(encoded.windows(2).all(|pair| pair[0] == pair[1]));

        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&encoded[0]))
            .unwrap();
        assert_eq!(image.attributes.chromaticities.unwrap().green, Vec2(0.30, 0.60));
        for (key, text) in &texts {
            let stored = &image.layer_data.attributes.other[key.as_bytes()];
            assert_eq!(stored, &AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes())));
        }
        let channels = &image.layer_data.channel_data.list;
        let values = |name: &str| -> Vec<f32> {
            let channel = channels.iter().find(|channel| channel.name == *name).unwrap();
            channel.sample_data.values_as_f32().collect()
        };
        assert_eq!(channels.len(), 4);
        assert_eq!(values("R"), beauty.iter().map(|p| p[0]).collect::<Vec<_>>());
        assert_eq!(values("B"), vec![f32::MAX; 67 * 41]);
        assert_eq!(values("depth.Z"), depth.iter().map(|p| p[0]).collect::<Vec<_>>());
    }
}
