//! Layers of EXR files, cropped and padded from the data window to the display window.

use std::fmt;
use std::io::Cursor;

use exr::prelude::{ReadChannels, ReadLayers, Vec2};

use super::picture::{Picture, check_size};

/// Layers that stand for the whole image if the file has several and no layer is requested, best
/// first. The empty name is channels without a prefix.
const MAIN_LAYERS: [&str; 4] = ["", "combined", "rgba", "beauty"];

/// Names of the three components, in lower case, in order of preference. A layer of one
/// component is grey.
const COMPONENTS: [[&str; 3]; 4] =
    [["r", "g", "b"], ["red", "green", "blue"], ["x", "y", "z"], ["u", "v", "w"]];

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Window {
    /// Upper left pixel.
    origin: [i64; 2],
    /// Width and height.
    size: [usize; 2],
}

impl Window {
    /// Copies pixels of this window into another one; the rest is black.
    fn place(self, pixels: &[[f32; 3]], within: Self) -> Vec<[f32; 3]> {
        let mut placed = vec![[0.0; 3]; within.size[0] * within.size[1]];
        for (row, placed) in placed.chunks_exact_mut(within.size[0]).enumerate() {
            let y = row as i64 + within.origin[1] - self.origin[1];
            let Some(row) = usize::try_from(y).ok().filter(|&y| y < self.size[1]) else { continue };
            let row = &pixels[row * self.size[0]..][..self.size[0]];
            let x = within.origin[0] - self.origin[0];
            let (from, to) = (x.max(0) as usize, (-x).max(0) as usize);
            let count = row.len().saturating_sub(from).min(placed.len().saturating_sub(to));
            if count > 0 {
                placed[to..to + count].copy_from_slice(&row[from..from + count]);
            }
        }
        placed
    }

    fn meets(self, other: Self) -> bool {
        (0..2).all(|axis| {
            let end = |window: Self| window.origin[axis] + window.size[axis] as i64;
            self.origin[axis] < end(other) && other.origin[axis] < end(self)
        })
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y], [width, height]) = (self.origin, self.size);
        write!(f, "{width}×{height} pixels at ({x}, {y})")
    }
}

/// The layers of a file.
pub(super) struct Groups {
    /// The display window, which all layers share.
    display: Window,
    groups: Vec<Group>,
}

/// A named group of channels.
struct Group {
    name: String,
    /// The data window of the file.
    data: Window,
    /// Name of each component in lower case, and its values.
    channels: Vec<(String, Vec<f32>)>,
}

pub(super) fn read_groups(bytes: &[u8]) -> Result<Groups, String> {
    let say = |error: exr::error::Error| error.to_string();
    let about = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(say)?;
    let mut decoded_bytes = 0_usize;
    for header in &about.headers {
        // All layers are in memory at once.
        let [width, height] = [header.layer_size.0, header.layer_size.1];
        let own = width.saturating_mul(height).saturating_mul(header.channels.bytes_per_pixel);
        decoded_bytes = decoded_bytes.saturating_add(own);
        check_size([width, height], decoded_bytes, bytes.len())?;
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    // Single-threaded, so that the caller can catch the decoder's panics.
    let reader = reader.all_layers().all_attributes().non_parallel();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(say)?;
    let window = |origin: Vec2<i32>, size: Vec2<usize>| Window {
        origin: [origin.0, origin.1].map(i64::from),
        size: [size.0, size.1],
    };
    let display = image.attributes.display_window;
    let display = window(display.position, display.size);
    let is_single = image.layer_data.len() == 1;
    let mut groups: Vec<Group> = Vec::new();
    for layer in &image.layer_data {
        let data = window(layer.attributes.layer_position, layer.size);
        // Parts have their own names; some programs repeat them in the channels.
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
            match groups.iter_mut().find(|group| group.name == name && group.data == data) {
                Some(group) => group.channels.push(channel),
                None => groups.push(Group { name, data, channels: vec![channel] }),
            }
        }
    }
    Ok(Groups { display, groups })
}

impl Group {
    /// Whether `wanted` names this group: its full name, or the last components of it.
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

/// Selects the requested layer, or the main one. Refuses a size that the file's bytes cannot hold.
pub(super) fn choose(
    Groups { display, groups }: Groups,
    layer: Option<&str>,
    file_bytes: usize,
) -> Result<Picture, String> {
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
            Some(pixels) => show(display, group.data, pixels, file_bytes),
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

/// The pixels of the display window.
fn show(
    display: Window,
    data: Window,
    mut pixels: Vec<[f32; 3]>,
    file_bytes: usize,
) -> Result<Picture, String> {
    if display != data {
        if !display.meets(data) {
            return Err(format!(
                "shows nothing: its data window, {data}, lies outside of its display window, {display}"
            ));
        }
        let decoded_bytes =
            display.size[0].saturating_mul(display.size[1]).saturating_mul(size_of::<[f32; 3]>());
        check_size(display.size, decoded_bytes, file_bytes)
            .map_err(|what| format!("its display window: {what}"))?;
        pixels = data.place(&pixels, display);
    }
    let size = display.size.map(|side| side as u32);
    Ok(Picture { size, origin: Some(display.origin.map(|place| place as i32)), pixels, display: None })
}

#[cfg(test)]
mod tests {
    use super::super::read::parse;
    use super::*;
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
        LayerAttributes, WritableImage,
    };

    /// A file of one value in its data window.
    fn file(display: ([i32; 2], [usize; 2]), data: ([i32; 2], [usize; 2]), value: f32) -> Vec<u8> {
        let ([x, y], [width, height]) = data;
        let channel = |name: &str| AnyChannel::new(name, FlatSamples::F32(vec![value; width * height]));
        let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
        let attributes = LayerAttributes { layer_position: Vec2(x, y), ..LayerAttributes::default() };
        let layer = Layer::new(Vec2(width, height), attributes, Encoding::FAST_LOSSLESS, channels);
        let ([x, y], [width, height]) = display;
        let bounds = IntegerBounds::new(Vec2(x, y), Vec2(width, height));
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layers(ImageAttributes::new(bounds), vec![layer])
            .write()
            .to_buffered(&mut bytes)
            .unwrap();
        bytes.into_inner()
    }

    #[test]
    fn pixels_lie_where_the_data_window_says() {
        let display = ([2, -1], [7, 5]);
        for data in [
            ([2, -1], [7, 5]),
            ([3, 0], [2, 3]),
            ([-4, -6], [9, 7]),
            ([6, 2], [40, 1]),
            ([-5, -5], [30, 30]),
            ([8, 3], [1, 1]),
        ] {
            let picture = parse(&file(display, data, 0.5), None).unwrap();
            assert_eq!((picture.size, picture.origin), ([7, 5], Some([2, -1])), "{data:?}");
            for (index, pixel) in picture.pixels.iter().enumerate() {
                let place = [2 + index as i32 % 7, -1 + index as i32 / 7];
                let within =
                    (0..2).all(|axis| (0..data.1[axis] as i32).contains(&(place[axis] - data.0[axis])));
                assert_eq!(*pixel, [if within { 0.5 } else { 0.0 }; 3], "{data:?} at {place:?}");
            }
        }
    }

    #[test]
    fn windows_that_do_not_meet_and_those_too_large_are_refused() {
        for origin in [[9, 0], [-3, 0], [0, 5], [0, -2]] {
            let line = parse(&file(([0, 0], [9, 5]), (origin, [3, 2]), 1.0), None).unwrap_err();
            assert!(line.contains("outside of its display window, 9×5 pixels at (0, 0)"), "{line}");
        }
        let line = parse(&file(([0, 0], [16_000, 16_000]), ([0, 0], [3, 2]), 1.0), None).unwrap_err();
        assert!(line.contains("cannot hold 16000×16000"), "{line}");
        let line = parse(&file(([0, 0], [1 << 20, 1]), ([0, 0], [3, 2]), 1.0), None).unwrap_err();
        assert!(line.contains("1048576×1"), "{line}");
    }
}
