//! Images as files: OpenEXR for numbers, PNG for eyes.
//!
//! Pixels are linear Rec.709, row-major from the top left. The same pixels always give the same bytes.

use std::borrow::Cow;
use std::io::{self, Seek, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, Vec2, WritableImage,
};

/// What wrote the file, as its metadata say.
const SOFTWARE: &str = concat!("lightpaths ", env!("CARGO_PKG_VERSION"));

/// Below this display value the tone map is the identity; above it, highlights roll off.
const SHOULDER: f32 = 0.8;

/// One named group of channels of an EXR file.
#[derive(Clone, Copy, Debug)]
pub struct ExrLayer<'a> {
    /// Prefix of the channel names (`"direct"` gives `direct.R`); empty for the main layer.
    pub name: &'a str,
    /// Channel names, at most three: which components of `pixels` are kept, in order.
    pub channels: &'a [&'a str],
    /// One triple per pixel.
    pub pixels: &'a [[f32; 3]],
}

/// Writes an EXR file of 32-bit floats, losslessly compressed, with Rec.709 primaries and D65 white.
///
/// # Errors
/// When `out` fails. Every layer must hold `size[0]·size[1]` pixels and channel names must differ; both panic.
pub fn write_exr(out: impl Write + Seek, size: [u32; 2], layers: &[ExrLayer]) -> io::Result<()> {
    let channels = layers.iter().flat_map(|layer| {
        assert_eq!(layer.pixels.len(), size[0] as usize * size[1] as usize, "layer {:?}", layer.name);
        layer.channels.iter().enumerate().map(|(component, channel)| {
            let samples = layer.pixels.iter().map(|pixel| pixel[component]).collect();
            AnyChannel::new(channel_name(layer.name, channel).as_ref(), FlatSamples::F32(samples))
        })
    });
    let attributes = LayerAttributes { software_name: Text::new_or_none(SOFTWARE), ..Default::default() };
    // Increasing line order, which this encoding has, matters: without it blocks land in the order in which
    // threads finish them, and the bytes differ from run to run.
    let encoding = Encoding::SMALL_LOSSLESS;
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new(Vec2(size[0] as usize, size[1] as usize), attributes, encoding, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.chromaticities = Some(exr::meta::attribute::Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    image.write().to_buffered(out).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other),
    })
}

fn channel_name<'a>(layer: &str, channel: &'a str) -> Cow<'a, str> {
    if layer.is_empty() { channel.into() } else { format!("{layer}.{channel}").into() }
}

/// Writes an 8-bit sRGB PNG of `pixels` scaled by 2^`exposure_stops` and tone mapped by [`display_value`].
///
/// # Errors
/// When `out` fails. `pixels` must hold `size[0]·size[1]` pixels, else this panics.
pub fn write_png(
    out: impl Write,
    size: [u32; 2],
    pixels: &[[f32; 3]],
    exposure_stops: f32,
) -> io::Result<()> {
    assert_eq!(pixels.len(), size[0] as usize * size[1] as usize, "pixel count");
    let scale = exposure_stops.exp2();
    let bytes: Vec<u8> = pixels.iter().flatten().map(|&v| display_value(scale * v)).collect();
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

/// The 8-bit sRGB code of a linear value: the exact sRGB curve up to 0.8, so that mid-grey and everything a
/// diffuse surface shows stay where sRGB puts them; above it a shoulder of continuous slope that reaches white
/// only at infinity, so that highlights keep their shape. Negative values and NaN give 0.
pub fn display_value(linear: f32) -> u8 {
    let toned = if linear > SHOULDER {
        let beyond = (linear - SHOULDER) / (1.0 - SHOULDER);
        1.0 - (1.0 - SHOULDER) / (1.0 + beyond)
    } else {
        linear
    };
    // The cast saturates, and takes NaN to 0.
    (255.0 * srgb_from_linear(toned) + 0.5) as u8
}

/// The sRGB transfer function (IEC 61966-2-1).
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};
    use std::io::Cursor;

    #[test]
    fn greys_stay_where_srgb_puts_them() {
        // Codes of the IEC 61966-2-1 curve: 0.18 gives 117.6, 0.5 gives 187.5, 0.0031308 gives 10.3.
        for (linear, code) in [(0.0, 0), (0.003_130_8, 10), (0.18, 118), (0.5, 188), (0.8, 231)] {
            assert_eq!(display_value(linear), code, "{linear}");
        }
    }

    #[test]
    fn highlights_roll_off_monotonically_and_odd_values_are_safe() {
        let codes: Vec<u8> = (0..4000).map(|i| display_value(i as f32 * 0.01)).collect();
        assert!(codes.is_sorted());
        assert!(display_value(1.0) < display_value(2.0) && display_value(2.0) < display_value(8.0));
        let slope = |v: f32| (f32::from(display_value(v + 0.05)) - f32::from(display_value(v - 0.05))) / 0.1;
        assert!((slope(0.7) - slope(0.82)).abs() < 40.0, "the shoulder starts without a kink");
        assert_eq!([f32::NAN, -1.0, f32::NEG_INFINITY].map(display_value), [0; 3]);
        assert_eq!([f32::INFINITY, f32::MAX].map(display_value), [255; 2]);
    }

    #[test]
    fn png_holds_the_exposed_pixels_and_says_srgb() {
        let pixels = [[0.09, 0.0, 0.5], [0.045, 0.09, 1e9]];
        let mut bytes = Vec::new();
        write_png(&mut bytes, [2, 1], &pixels, 1.0).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        assert_eq!(reader.info().srgb, Some(png::SrgbRenderingIntent::Perceptual));
        let mut codes = [0; 6];
        reader.next_frame(&mut codes).unwrap();
        assert_eq!(codes, [118, 0, display_value(1.0), display_value(0.09), 118, 255]);
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
        let encoded: Vec<Vec<u8>> = (0..4)
            .map(|_| {
                let mut out = Cursor::new(Vec::new());
                write_exr(&mut out, size, &layers).unwrap();
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
