//! Reads images of any program: EXR by layer, PNG.

use std::io::Cursor;
use std::path::Path;

use super::layers::{choose, read_groups};
use super::picture::{Picture, check_size};
use crate::error::{Error, Result};
use crate::files::{self, Unread, guarded};

/// Largest file in bytes: a float for each of sixteen channels of the largest image.
const MAX_BYTES: u64 = 16 << 30;

/// Reads a PNG, or a layer of an EXR (`None`: the image itself). The content decides the
/// format, not the name.
///
/// # Errors
/// [`Error::Input`]: the file cannot be read, has another format, or lacks the layer. The message
/// then lists the existing layers.
pub fn read(path: &Path, layer: Option<&str>) -> Result<Picture> {
    let fault = |message: String| Error::input(path, message);
    let bytes = files::read(path, MAX_BYTES).map_err(|unread| match unread {
        Unread::Missing => fault("cannot be read: there is no such file".to_owned()),
        Unread::Because(why) => fault(why),
    })?;
    parse(&bytes, layer).map_err(fault)
}

/// Parses the contents of a PNG or EXR file.
///
/// # Errors
/// As [`read`]; the text follows the file's name.
pub fn parse(bytes: &[u8], layer: Option<&str>) -> std::result::Result<Picture, String> {
    if bytes.starts_with(b"\x89PNG") {
        return match layer {
            Some(layer) => Err(format!("a PNG has no layers, `{layer}` was asked for; use an EXR")),
            None => guarded("PNG", || read_png(bytes).map_err(|e| format!("is no readable PNG: {e}"))),
        };
    }
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err("is neither an EXR nor a PNG".to_owned());
    }
    guarded("EXR", || {
        let groups = read_groups(bytes).map_err(|e| format!("is no readable EXR: {e}"))?;
        choose(groups, layer, bytes.len())
    })
}

/// Reports damage at which the decoder would panic or continue silently.
fn read_png(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let say = |error: png::DecodingError| error.to_string();
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    // Unused, and a few kilobytes of them can decompress to gigabytes.
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_ignore_text_chunk(true);
    let header = decoder.read_header_info().map_err(say)?;
    let size = [header.width as usize, header.height as usize];
    // The sides are checked first, because the byte count of a larger image may overflow.
    check_size(size, 0, bytes.len())?;
    check_size(size, header.raw_bytes().saturating_mul(8), bytes.len())?;
    let mut reader = decoder.read_info().map_err(say)?;
    if let Some(palette) = reader.info().palette.as_ref().map(|palette| palette.len())
        && (palette % 3 != 0 || palette == 0 || palette > 768)
    {
        return Err(format!(
            "its palette is damaged: it has {palette} bytes, a multiple of 3 up to 768 expected"
        ));
    }
    let mut codes = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let frame = reader.next_frame(&mut codes).map_err(say)?;
    codes.truncate(frame.buffer_size());
    let samples = frame.color_type.samples();
    let triple =
        |values: &dyn Fn(usize) -> f32| if samples < 3 { [values(0); 3] } else { [0, 1, 2].map(values) };
    let display: Vec<[f32; 3]> = match frame.bit_depth {
        png::BitDepth::Sixteen => {
            let value = |code: [u8; 2]| f32::from(u16::from_be_bytes(code)) / 65_535.0;
            let pixels = codes.as_chunks().0.chunks_exact(samples);
            pixels.map(|pixel| triple(&|sample| value(pixel[sample]))).collect()
        }
        _ => {
            let pixels = codes.chunks_exact(samples);
            pixels.map(|pixel| triple(&|sample| f32::from(pixel[sample]) / 255.0)).collect()
        }
    };
    let linear = |value: f32| {
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    let pixels = display.iter().map(|pixel| pixel.map(linear)).collect();
    Ok(Picture { size: [frame.width, frame.height], origin: None, pixels, display: Some(display) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ExrLayer, write_exr, write_png};
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
        LineOrder, Vec2, WritableImage, f16,
    };

    const SIZE: [u32; 2] = [5, 3];

    fn ramp(scale: f32) -> Vec<[f32; 3]> {
        (0..15).map(|i| [scale * i as f32, 1.0, 0.25]).collect()
    }

    fn file(fill: impl FnOnce(&mut Cursor<Vec<u8>>)) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut bytes = Cursor::new(Vec::new());
        fill(&mut bytes);
        std::fs::write(file.path(), bytes.into_inner()).unwrap();
        file
    }

    #[test]
    fn our_layers_are_found_by_name() {
        let (beauty, direct, depth) = (ramp(1.0), ramp(2.0), ramp(3.0));
        let layers = [
            ExrLayer { name: "", channels: &["R", "G", "B"], pixels: &beauty },
            ExrLayer { name: "direct", channels: &["R", "G", "B"], pixels: &direct },
            ExrLayer { name: "depth", channels: &["Z"], pixels: &depth },
        ];
        let file = file(|out| write_exr(out, SIZE, &layers).unwrap());
        let read = |layer| read(file.path(), layer);
        assert_eq!(
            read(None).unwrap(),
            Picture { size: SIZE, origin: Some([0, 0]), pixels: beauty, display: None }
        );
        assert_eq!(read(Some("direct")).unwrap().pixels, direct);
        let grey: Vec<[f32; 3]> = depth.iter().map(|pixel| [pixel[0]; 3]).collect();
        assert_eq!(read(Some("depth")).unwrap().pixels, grey);
        let refusal = read(Some("specular")).unwrap_err().to_string();
        assert!(refusal.contains("`specular`") && refusal.contains("`depth`, `direct`;"), "{refusal}");
    }

    /// Half floats, prefixed names, tiles: as Blender and Mitsuba write.
    #[test]
    fn files_of_other_programs_are_read() {
        let channel =
            |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F16(vec![f16::from_f32(value); 15]));
        let names = ["R", "G", "B", "A"];
        let combined = names.iter().zip([0.5, 1.0, 2.0, 1.0]);
        let mut channels: Vec<_> =
            combined.map(|(name, value)| channel(&format!("ViewLayer.Combined.{name}"), value)).collect();
        channels.push(channel("ViewLayer.Depth.Z", 8.0));
        let encoding = Encoding {
            compression: Compression::ZIP1,
            blocks: Blocks::Tiles(Vec2(2, 2)),
            line_order: LineOrder::Increasing,
        };
        let channels = AnyChannels::sort(channels.into_iter().collect());
        let layer = Layer::new(Vec2(5, 3), LayerAttributes::named("render"), encoding, channels);
        let file = file(|out| Image::from_layer(layer).write().to_buffered(out).unwrap());
        for layer in [None, Some("Combined"), Some("ViewLayer.Combined")] {
            assert_eq!(read(file.path(), layer).unwrap().pixels, [[0.5, 1.0, 2.0]; 15], "{layer:?}");
        }
        assert_eq!(read(file.path(), Some("depth")).unwrap().pixels, [[8.0; 3]; 15]);
    }

    #[test]
    fn parts_are_layers() {
        let part = |name: &str, value: f32| {
            let list = ["R", "G", "B"].map(|c| AnyChannel::new(c, FlatSamples::F32(vec![value; 15])));
            let channels = AnyChannels::sort(list.into_iter().collect());
            Layer::new(Vec2(5, 3), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
        };
        let attributes =
            exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions(Vec2(5, 3)));
        let image = Image::from_layers(attributes, vec![part("beauty", 1.0), part("direct", 2.0)]);
        let file = file(|out| image.write().to_buffered(out).unwrap());
        assert_eq!(read(file.path(), None).unwrap().pixels, [[1.0; 3]; 15]);
        assert_eq!(read(file.path(), Some("direct")).unwrap().pixels, [[2.0; 3]; 15]);
    }

    #[test]
    fn a_png_is_linearised_and_keeps_its_codes() {
        let file = file(|out| write_png(out, [2, 1], &[[0, 128, 255, 255], [10, 11, 12, 255]]).unwrap());
        let picture = read(file.path(), None).unwrap();
        assert_eq!(picture.display.as_ref().unwrap()[0], [0.0, 128.0 / 255.0, 1.0]);
        // IEC 61966-2-1: code 128 is 0.21586; code 10 is on the linear segment.
        assert!((picture.pixels[0][1] - 0.215_861).abs() < 1e-5 && picture.pixels[0][2] == 1.0);
        assert!((picture.pixels[1][0] - 10.0 / 255.0 / 12.92).abs() < 1e-8);
        assert!(read(file.path(), Some("direct")).unwrap_err().to_string().contains("no layers"));
    }

    #[test]
    fn what_is_no_image_is_refused() {
        let text = file(|out| std::io::Write::write_all(out, b"no image").unwrap());
        assert!(read(text.path(), None).unwrap_err().to_string().contains("neither"));
        for magic in [&b"\x89PNG\r\n\x1a\nxx"[..], &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 9]] {
            let broken = file(|out| std::io::Write::write_all(out, magic).unwrap());
            assert!(read(broken.path(), None).unwrap_err().to_string().contains("is no readable"));
        }
        assert!(read(Path::new("no/such.exr"), None).unwrap_err().to_string().contains("no/such.exr"));
    }

    /// Palettes of every length: complete colours are read, and others are refused with
    /// a one-line message.
    #[test]
    fn damaged_palettes_are_named() {
        for length in 0..=770_usize {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
            encoder.set_color(png::ColorType::Indexed);
            encoder.set_palette(vec![51; length]);
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(&[0, 0]).unwrap();
            writer.finish().unwrap();
            let read = parse(&bytes, None);
            if length % 3 == 0 && (3..=768).contains(&length) {
                assert_eq!(read.unwrap().display.unwrap(), [[0.2; 3]; 2], "{length} bytes");
            } else {
                let line = read.unwrap_err();
                assert!(
                    ["alette", "PLTE"].iter().any(|word| line.contains(word)) && !line.contains('\n'),
                    "{length} bytes: {line}"
                );
            }
        }
    }
}
