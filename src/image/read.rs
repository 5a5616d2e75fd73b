//! Reads images that this or another program wrote: EXR by layer, PNG.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers};

use crate::error::{Error, Result};
use crate::files::{self, Unread};

/// An image, or one layer of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear values, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
    /// The sRGB values as the file has them, 0..=1, where it is a display image (a PNG).
    pub display: Option<Vec<[f32; 3]>>,
}

/// Bytes of a file at most: a float for each of sixteen channels of the largest image.
const MOST_BYTES: u64 = 16 << 30;
/// Width and height at most, pixels: what we write ourselves.
const MOST_SIDE: usize = 16_384;
/// Bytes that an image has when decoded for each byte of its file, at most: zlib's best is 1032, and grey PNGs of one bit a pixel grow
/// eightfold.
const MOST_GROWTH: usize = 8256;

/// Layers that stand for the whole image where a file has several and none is asked for, best first. Empty: channels without a prefix.
const MAIN_LAYERS: [&str; 4] = ["", "combined", "rgba", "beauty"];

/// Names of the three components, in lower case, in order of preference; a layer of one component is grey.
const COMPONENTS: [[&str; 3]; 4] =
    [["r", "g", "b"], ["red", "green", "blue"], ["x", "y", "z"], ["u", "v", "w"]];

/// Reads a PNG, or of an EXR the layer of that name (none: the image itself). The content decides which it is, not the name.
///
/// # Errors
/// [`Error::Input`]: the file cannot be read, is neither, or has no such layer; the message then names those that there are.
pub fn read(path: &Path, layer: Option<&str>) -> Result<Picture> {
    let fault = |message: String| Error::input(path, message);
    let bytes = files::read(path, MOST_BYTES).map_err(|unread| match unread {
        Unread::Missing => fault("cannot be read: there is no such file".to_owned()),
        Unread::Because(why) => fault(why),
    })?;
    parse(&bytes, layer).map_err(fault)
}

/// Reads the contents of such a file.
///
/// # Errors
/// As [`read`], in words that follow the file's name.
pub fn parse(bytes: &[u8], layer: Option<&str>) -> std::result::Result<Picture, String> {
    if bytes.starts_with(b"\x89PNG") {
        return match layer {
            Some(layer) => Err(format!("a PNG has no layers, `{layer}` was asked for; use an EXR")),
            None => read_png(bytes).map_err(|e| format!("is no readable PNG: {e}")),
        };
    }
    if !bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err("is neither an EXR nor a PNG".to_owned());
    }
    let groups = read_groups(bytes).map_err(|e| format!("is no readable EXR: {e}"))?;
    choose(groups, layer)
}

/// A named group of channels.
struct Group {
    name: String,
    size: [u32; 2],
    /// Name of the component in lower case, and its values.
    channels: Vec<(String, Vec<f32>)>,
}

/// Refuses sizes beyond what images have, and those that so many bytes cannot hold, before there is memory for them.
fn check_size(
    [width, height]: [usize; 2],
    pixel_bytes: usize,
    file_bytes: usize,
) -> std::result::Result<(), String> {
    if width.min(height) == 0 || width.max(height) > MOST_SIDE {
        return Err(format!("it is {width}×{height} pixels large, 1 to {MOST_SIDE} either way expected"));
    }
    if (width * height).saturating_mul(pixel_bytes) > file_bytes.saturating_mul(MOST_GROWTH) {
        return Err(format!("{file_bytes} bytes cannot hold {width}×{height} pixels"));
    }
    Ok(())
}

fn read_groups(bytes: &[u8]) -> std::result::Result<Vec<Group>, String> {
    let say = |error: exr::error::Error| error.to_string();
    let about = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(say)?;
    let mut pixel_bytes = 0;
    for header in &about.headers {
        // Layers are held together.
        pixel_bytes += header.channels.bytes_per_pixel;
        let size = [header.layer_size.0, header.layer_size.1];
        check_size(size, pixel_bytes, bytes.len())?;
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let image = reader.all_layers().all_attributes().from_buffered(Cursor::new(bytes)).map_err(say)?;
    let is_single = image.layer_data.len() == 1;
    let mut groups: Vec<Group> = Vec::new();
    for layer in &image.layer_data {
        let size = [layer.size.0 as u32, layer.size.1 as u32];
        // Parts carry names of their own; some programs repeat them in the channels.
        let part = layer.attributes.layer_name.as_ref().filter(|_| !is_single).map(ToString::to_string);
        for channel in &layer.channel_data.list {
            let full = channel.name.to_string();
            let (prefix, component) = full.rsplit_once('.').unwrap_or(("", &full));
            let name = match &part {
                Some(part) if prefix.is_empty() => part.clone(),
                Some(part) if !prefix.starts_with(part.as_str()) => format!("{part}.{prefix}"),
                _ => prefix.to_owned(),
            };
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            let channel = (component.to_lowercase(), values);
            match groups.iter_mut().find(|group| group.name == name && group.size == size) {
                Some(group) => group.channels.push(channel),
                None => groups.push(Group { name, size, channels: vec![channel] }),
            }
        }
    }
    Ok(groups)
}

impl Group {
    /// Whether a user who asks for `wanted` means this group: its name, or the last parts of it.
    fn answers(&self, wanted: &str) -> bool {
        let (name, wanted) = (self.name.to_lowercase(), wanted.to_lowercase());
        name == wanted || name.ends_with(&format!(".{wanted}"))
    }

    fn pixels(&self) -> Option<Vec<[f32; 3]>> {
        let values = |name: &str| self.channels.iter().find(|(n, _)| n == name).map(|(_, values)| values);
        for [a, b, c] in COMPONENTS {
            if let (Some(a), Some(b), Some(c)) = (values(a), values(b), values(c)) {
                return Some((0..a.len()).map(|i| [a[i], b[i], c[i]]).collect());
            }
        }
        let mut colors = self.channels.iter().filter(|(name, _)| name != "a");
        match (colors.next(), colors.next()) {
            (Some((_, values)), None) => Some(values.iter().map(|&value| [value; 3]).collect()),
            _ => None,
        }
    }
}

fn choose(groups: Vec<Group>, layer: Option<&str>) -> std::result::Result<Picture, String> {
    let exact = |wanted: &str| groups.iter().find(|group| group.name == wanted);
    let found: Vec<&Group> = match layer {
        Some(wanted) => match exact(wanted) {
            Some(group) => vec![group],
            None => groups.iter().filter(|group| group.answers(wanted)).collect(),
        },
        None if groups.len() == 1 => groups.iter().collect(),
        None => {
            let mut by_name = MAIN_LAYERS.iter().map(|name| -> Vec<&Group> {
                groups.iter().filter(|group| group.answers(name) && group.pixels().is_some()).collect()
            });
            by_name.find(|found| !found.is_empty()).unwrap_or_default()
        }
    };
    let names = groups.iter().map(|group| match group.name.as_str() {
        "" => "(no name)".to_owned(),
        name => format!("`{name}`"),
    });
    let names = names.collect::<Vec<_>>().join(", ");
    let asked = layer.map_or("an image without a layer name".to_owned(), |layer| format!("layer `{layer}`"));
    match found.as_slice() {
        [] => Err(format!("{asked} was expected, found the layers {names}; name one")),
        [group] => match group.pixels() {
            Some(pixels) => Ok(Picture { size: group.size, pixels, display: None }),
            None => {
                let channels: Vec<&str> = group.channels.iter().map(|(name, _)| name.as_str()).collect();
                Err(format!(
                    "{asked}: R, G and B or one channel were expected, found {}",
                    channels.join(", ")
                ))
            }
        },
        _ => Err(format!("{asked} is ambiguous among {names}; give more of its name")),
    }
}

fn read_png(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let say = |error: png::DecodingError| error.to_string();
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(say)?;
    let (width, height) = reader.info().size();
    check_size([width as usize, height as usize], 1, bytes.len())?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let frame = reader.next_frame(&mut bytes).map_err(say)?;
    bytes.truncate(frame.buffer_size());
    let values: Vec<f32> = match frame.bit_depth {
        png::BitDepth::Sixteen => {
            let codes = bytes.as_chunks::<2>().0;
            codes.iter().map(|&code| f32::from(u16::from_be_bytes(code)) / 65_535.0).collect()
        }
        _ => bytes.iter().map(|&code| f32::from(code) / 255.0).collect(),
    };
    let samples = frame.color_type.samples();
    let display: Vec<[f32; 3]> = values
        .chunks_exact(samples)
        .map(|pixel| if samples < 3 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] })
        .collect();
    let linear = |value: f32| {
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    let pixels = display.iter().map(|pixel| pixel.map(linear)).collect();
    Ok(Picture { size: [frame.width, frame.height], pixels, display: Some(display) })
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
        assert_eq!(read(None).unwrap(), Picture { size: SIZE, pixels: beauty, display: None });
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
        // IEC 61966-2-1: code 128 is 0.21586; code 10 lies on the straight part.
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
}
