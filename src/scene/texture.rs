//! Images that provide the diffuse albedo of materials.

use std::borrow::Borrow;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::alpha::Alpha;
use super::containers;
use super::limits::{IMAGE_GROWTH, IMAGE_SIDE, JPEG_SCANS, WEBP_BYTES};
use super::value::printable;
use crate::types::CLAMPED_TO_TRIANGLE;

/// An image of sRGB codes.
#[derive(Clone, PartialEq)]
pub struct Image {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Red, green, blue, row by row from the top.
    pub codes: Vec<[u8; 3]>,
}

/// The image of a material. [`super::Scene::texture_coordinates`] has its mapping to triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Factor of the material's diffuse albedo.
    pub image: Arc<Image>,
    /// Whether the outermost texels continue outside of the image; otherwise it repeats.
    pub is_clamped: bool,
    /// Whether each triangle has texels of its own, as vertex colours do. Beyond the triangle its
    /// nearest colour continues.
    pub is_atlas: bool,
}

impl Texture {
    /// What continues beyond the edges, as the device stores it: [`crate::types::Texture`].
    pub fn wrapping(&self) -> u32 {
        if self.is_atlas { CLAMPED_TO_TRIANGLE } else { u32::from(self.is_clamped) }
    }
}

/// Prints a hash of the contents, since all texels would be too long.
impl fmt::Debug for Image {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let mut hasher = DefaultHasher::new();
        self.codes.hash(&mut hasher);
        let [width, height] = self.size;
        write!(formatter, "Image({width}×{height} {:016x})", hasher.finish())
    }
}

/// A decoded image file.
#[derive(Clone)]
pub(super) struct Decoded {
    pub(super) image: Arc<Image>,
    /// Its alpha channel. `None` if all of it is opaque.
    pub(super) alpha: Option<Arc<Alpha>>,
    /// Whether values above 1, which only images of floats have, were taken as 1.
    pub(super) is_bounded: bool,
    /// A fault of the image; the text follows the file's name.
    pub(super) damage: Option<String>,
}

/// The note on [`Decoded::is_bounded`].
pub(super) const BOUNDED: &str =
    "values above 1 of images are taken as 1, and scaled with their material to the largest albedo";

/// Known formats that are not decoded.
const NOT_READ: [(ImageFormat, &str); 2] = [(ImageFormat::Dds, "a DDS"), (ImageFormat::Avif, "an AVIF")];

impl Image {
    /// The largest value of each channel, linear.
    pub fn brightest(&self) -> Vec3 {
        let mut most = [0_u8; 3];
        for code in &self.codes {
            most = std::array::from_fn(|channel| most[channel].max(code[channel]));
            if most == [u8::MAX; 3] {
                break;
            }
        }
        most.map(linear).into()
    }

    /// The colour of a surface that emits as the image shows. `None` if the image is dark but for
    /// small parts of it, which no mean describes.
    pub(super) fn emission(&self) -> Option<Vec3> {
        const MIN_MEAN: f32 = 0.25;
        let mean = self.mean();
        (mean.max_element() >= MIN_MEAN * self.brightest().max_element()).then_some(mean)
    }

    /// The mean of all texels, linear.
    pub fn mean(&self) -> Vec3 {
        let table: Vec<f64> = (0..=u8::MAX).map(|code| f64::from(linear(code))).collect();
        let count = self.codes.len().max(1) as f64;
        let sum =
            |channel: usize| self.codes.iter().map(|code| table[usize::from(code[channel])]).sum::<f64>();
        Vec3::from_array([0, 1, 2].map(|channel| (sum(channel) / count) as f32))
    }

    /// Decodes the first picture of a file to 8-bit colour, upright as its EXIF data states. The
    /// contents decide the format, except for TGA, which the extension of `name` identifies.
    ///
    /// Fails with a reason that follows the file's name. An image of more than `most` texels, or
    /// more than its file can hold, fails before memory is allocated.
    pub(super) fn decode(name: &Path, bytes: &[u8], most: u64) -> Result<Decoded, String> {
        use ImageFormat::{Bmp, Gif, Hdr, Jpeg, OpenExr, Png, Tga, Tiff, WebP};
        let has_ending = |ending| name.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending));
        let guess = image::guess_format(bytes).ok();
        let format = match guess {
            Some(format @ (Png | Jpeg | Bmp | Gif | WebP | Tiff | Hdr | OpenExr)) => format,
            _ if has_ending("tga") => Tga,
            _ => {
                let known = NOT_READ.iter().find(|(format, _)| Some(*format) == guess);
                let what = known.map(|(_, what)| format!("is {what} image, which is not read: "));
                let formats = "is no PNG, JPEG, WebP, TIFF, TGA, BMP, GIF, HDR or EXR: convert it";
                return Err(what.unwrap_or_default() + formats);
            }
        };
        let fault = |error| format!("is no readable {format:?}: {}", printable(&format!("{error}")));
        let mut damage = None;
        let essential = if format == Png { containers::png_pixels(bytes) } else { bytes.into() };
        if format == Jpeg {
            let about = containers::jpeg(bytes);
            if about.scans > JPEG_SCANS {
                let scans = about.scans;
                return Err(format!("has {scans} scans, {JPEG_SCANS} at most are decoded: save it anew"));
            }
            let cut = "is damaged: it ends early, and the decoder filled in the rest: save it anew";
            damage = (!about.has_end).then(|| cut.to_owned());
        }
        let mut reader = ImageReader::with_format(Cursor::new(&*essential), format);
        // Sizes are checked here, so that messages can advise the user.
        let floor = if format == WebP { WEBP_BYTES } else { 0 };
        let max_bytes = (bytes.len() as u64).saturating_mul(IMAGE_GROWTH).max(floor);
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(max_bytes);
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(fault)?;
        check_size(decoder.dimensions().into(), most)?;
        if decoder.total_bytes() > max_bytes {
            let (width, height) = decoder.dimensions();
            let length = bytes.len();
            return Err(format!("is damaged: {length} bytes cannot hold {width}×{height} texels"));
        }
        // Damaged EXIF data leaves the image as it is stored.
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let mut decoded = DynamicImage::from_decoder(decoder).map_err(fault)?;
        decoded.apply_orientation(orientation);
        let size = [decoded.width(), decoded.height()];
        let alpha = Alpha::of(&decoded);
        let (codes, is_bounded) = colours(decoded);
        Ok(Decoded { image: Arc::new(Self { size, codes }), alpha, is_bounded, damage })
    }
}

/// The value of an sRGB code, 0..=1.
pub(super) fn linear(code: u8) -> f32 {
    match f32::from(code) / 255.0 {
        value if value <= 0.040_45 => value / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    }
}

/// The sRGB code nearest to a linear value. Values outside of 0..=1 get the nearest code of all.
pub(super) fn code(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// Three codes per texel, and whether values above 1 were bounded. `image` itself converts grey
/// images through floats, which took half of the loading time.
fn colours(image: DynamicImage) -> (Vec<[u8; 3]>, bool) {
    let codes = match image {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(|grey| [grey; 3]).collect(),
        DynamicImage::ImageLumaA8(image) => {
            image.into_raw().as_chunks().0.iter().map(|&[grey, _]| [grey; 3]).collect()
        }
        DynamicImage::ImageRgba8(image) => {
            image.into_raw().as_chunks().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
        }
        DynamicImage::ImageRgb32F(image) => return linear_colours(image.as_raw().as_chunks().0),
        DynamicImage::ImageRgba32F(image) => {
            return linear_colours(image.as_raw().as_chunks().0.iter().map(|[r, g, b, _]| [*r, *g, *b]));
        }
        other => other.into_rgb8().into_raw().as_chunks().0.to_vec(),
    };
    (codes, false)
}

/// The codes of linear floats, and whether any is above 1.
fn linear_colours(texels: impl IntoIterator<Item = impl Borrow<[f32; 3]>>) -> (Vec<[u8; 3]>, bool) {
    let mut is_bounded = false;
    let codes = texels.into_iter().map(|texel| {
        let texel = texel.borrow();
        is_bounded |= texel.iter().any(|&value| value > 1.0);
        texel.map(code)
    });
    let codes = codes.collect();
    (codes, is_bounded)
}

/// Refuses sizes before memory is allocated. Fails with a reason that follows the file's name.
fn check_size([width, height]: [u32; 2], most: u64) -> Result<(), String> {
    if width.max(height) > IMAGE_SIDE || width.min(height) == 0 {
        return Err(format!(
            "is {width}×{height} texels large, 1 to {IMAGE_SIDE} either way can be used: scale it"
        ));
    }
    if u64::from(width) * u64::from(height) > most {
        return Err(format!(
            "is {width}×{height} texels large, and the scene's images may have {most} more at most: scale them"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_and_transparent_images_become_what_image_makes_of_them() {
        let images: [DynamicImage; 4] = [
            image::GrayImage::from_fn(256, 1, |x, _| image::Luma([x as u8])).into(),
            image::GrayAlphaImage::from_fn(256, 2, |x, y| image::LumaA([x as u8, 200 * y as u8])).into(),
            image::RgbaImage::from_fn(256, 2, |x, y| image::Rgba([x as u8, !(x as u8), 7, 200 * y as u8]))
                .into(),
            image::RgbImage::from_fn(256, 1, |x, _| image::Rgb([x as u8, 3, !(x as u8)])).into(),
        ];
        for image in images {
            let expected = image.clone().into_rgb8().into_raw();
            assert_eq!(colours(image).0.as_flattened(), expected);
        }
    }

    #[test]
    fn codes_of_linear_values_are_the_nearest() {
        for value in 0..=u8::MAX {
            assert_eq!(code(linear(value)), value);
        }
        let outside = [-1.0, f32::NEG_INFINITY, f32::NAN, 1.5, f32::INFINITY];
        assert_eq!(outside.map(code), [0, 0, 0, 255, 255]);
    }
}
