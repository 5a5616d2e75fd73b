//! Images that provide the diffuse albedo of materials.

use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::alpha::Alpha;
use super::containers;
use super::limits::{IMAGE_GROWTH, IMAGE_SIDE, JPEG_SCANS};
use super::value::printable;

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
pub(super) struct Decoded {
    pub(super) image: Arc<Image>,
    /// Its alpha channel. `None` if all of it is opaque.
    pub(super) alpha: Option<Arc<Alpha>>,
    /// A fault of the image; the text follows the file's name.
    pub(super) damage: Option<String>,
}

/// Known formats that are not decoded: a small file can expand greatly, or hold several images.
const NOT_READ: [(ImageFormat, &str); 6] = [
    (ImageFormat::WebP, "a WebP"),
    (ImageFormat::Tiff, "a TIFF"),
    (ImageFormat::Dds, "a DDS"),
    (ImageFormat::Hdr, "a Radiance HDR"),
    (ImageFormat::OpenExr, "an OpenEXR"),
    (ImageFormat::Avif, "an AVIF"),
];

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

    /// The mean of all texels, linear.
    pub(super) fn mean(&self) -> Vec3 {
        let table: Vec<f64> = (0..=u8::MAX).map(|code| f64::from(linear(code))).collect();
        let count = self.codes.len().max(1) as f64;
        let sum =
            |channel: usize| self.codes.iter().map(|code| table[usize::from(code[channel])]).sum::<f64>();
        Vec3::from_array([0, 1, 2].map(|channel| (sum(channel) / count) as f32))
    }

    /// Decodes a PNG, JPEG, BMP, GIF (its first picture) or TGA to 8-bit colour. The contents
    /// decide the format, except for TGA, which the extension of `name` identifies.
    ///
    /// Fails with a reason that follows the file's name. An image of more than `most` texels, or
    /// more than its file can hold, fails before memory is allocated.
    pub(super) fn decode(name: &Path, bytes: &[u8], most: u64) -> Result<Decoded, String> {
        use ImageFormat::{Bmp, Gif, Jpeg, Png, Tga};
        let has_ending = |ending| name.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending));
        let guess = image::guess_format(bytes).ok();
        let format = match guess {
            Some(format @ (Png | Jpeg | Bmp | Gif)) => format,
            _ if has_ending("tga") => Tga,
            _ => {
                let known = NOT_READ.iter().find(|(format, _)| Some(*format) == guess);
                let what = known.map(|(_, what)| format!("is {what} image, which is not read: "));
                return Err(what.unwrap_or_default() + "is no PNG, JPEG, BMP, GIF or TGA: convert it");
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
        let max_bytes = (bytes.len() as u64).saturating_mul(IMAGE_GROWTH);
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(max_bytes);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(fault)?;
        let (width, height) = decoder.dimensions();
        check_size([width, height], decoder.total_bytes(), bytes.len(), most)?;
        let decoded = DynamicImage::from_decoder(decoder).map_err(fault)?;
        let alpha = Alpha::of(&decoded);
        let codes = colours(decoded);
        Ok(Decoded { image: Arc::new(Self { size: [width, height], codes }), alpha, damage })
    }
}

/// The value of an sRGB code, 0..=1.
pub(super) fn linear(code: u8) -> f32 {
    match f32::from(code) / 255.0 {
        value if value <= 0.040_45 => value / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    }
}

/// Three codes per texel. `image` itself converts grey images through floats, which took half of
/// the loading time.
fn colours(image: DynamicImage) -> Vec<[u8; 3]> {
    match image {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(|grey| [grey; 3]).collect(),
        DynamicImage::ImageLumaA8(image) => {
            image.into_raw().as_chunks().0.iter().map(|&[grey, _]| [grey; 3]).collect()
        }
        DynamicImage::ImageRgba8(image) => {
            image.into_raw().as_chunks().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
        }
        other => other.into_rgb8().into_raw().as_chunks().0.to_vec(),
    }
}

/// Refuses sizes before memory is allocated. Fails with a reason that follows the file's name.
fn check_size(
    [width, height]: [u32; 2],
    decoded_bytes: u64,
    file_bytes: usize,
    most: u64,
) -> Result<(), String> {
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
    if decoded_bytes > (file_bytes as u64).saturating_mul(IMAGE_GROWTH) {
        return Err(format!("is damaged: {file_bytes} bytes cannot hold {width}×{height} texels"));
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
            assert_eq!(colours(image).as_flattened(), expected);
        }
    }
}
