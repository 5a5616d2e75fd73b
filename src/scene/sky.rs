//! The `[environment]` of a scene file: light from all directions around the scene.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use image::{ImageReader, Limits};

use super::builtin::Files;
use super::emission::Sky;
use super::environment::Environment;
use super::sun_sky::SunSky;
use super::texture::linear;
use super::value::{Node, Origin, POWER, Section};
use super::{keys, limits};
use crate::Result;
use crate::files::guarded;

/// Default maximum number of directional lights that represent the bright spots of a sky.
const SAMPLES: u32 = 64;
/// Turbidity of clear air, and albedo of the ground.
const TURBIDITY: f64 = 3.0;
const GROUND: Vec3 = Vec3::splat(0.2);

/// Factor of the sky's radiance, W/m²/sr, and its rotation about +Y, radians.
pub(super) type Placing = (Vec3, f32);

/// A sky as the scene file states it.
pub(super) struct Stated {
    pub(super) sky: Sky,
    pub(super) placing: Placing,
}

/// Reads the section. `None` if there is none.
pub(super) fn read(
    (file, root): (&Path, &Node),
    files: &Files,
    inputs: &mut Vec<PathBuf>,
) -> Result<Option<Stated>> {
    let Some(node) = root.get("environment") else { return Ok(None) };
    let section = Section::new(file, "environment", node)?;
    section.only(&keys::names("environment", None))?;
    let samples = section.integer("samples", 1..=1024)?.unwrap_or(SAMPLES);
    let environment = match (section.text("image")?, sun(&section)?) {
        (None, Some(sun)) => sun.environment(),
        (Some(name), _) => {
            let path = file.with_file_name(name);
            let fault = |why: String| section.fault_at("image", format!("{name:?} {why}"));
            // The user's image may lie anywhere, also beside a built-in scene.
            let anywhere = Files::Disk(None);
            let is_users = matches!(section.get("image"), Some(Node { origin: Origin::Flag(_), .. }));
            let files = match files {
                Files::Disk(_) | Files::Embedded if is_users => &anywhere,
                files => files,
            };
            let bytes = files.read(&path, limits::IMAGE_BYTES).map_err(fault)?;
            inputs.extend(files.on_disk(&path));
            Arc::new(guarded("image", || decode(&bytes)).map_err(fault)?)
        }
        (None, None) => Environment::constant(),
    };
    let placing = placing(&section)?;
    Ok(Some(Stated { sky: Sky::new(environment, samples), placing }))
}

fn placing(section: &Section) -> Result<Placing> {
    let radiance = section.vector("radiance", POWER)?.map_or(Vec3::ONE, |radiance| radiance.as_vec3());
    let turn = section.number("rotate", -360.0..=360.0)?.unwrap_or(0.0).to_radians() as f32;
    Ok((radiance, turn))
}

/// The sun, and the sky around it. `None` if the section states none.
fn sun(section: &Section) -> Result<Option<SunSky>> {
    let elevation = section.number("sun_elevation", 0.0..=90.0)?;
    let azimuth = section.number("sun_azimuth", -360.0..=360.0)?;
    let turbidity = section.number("turbidity", 1.0..=10.0)?;
    let ground = section.vector("ground", 0.0..=1.0)?;
    let Some(elevation) = elevation else {
        let lone = [
            ("sun_azimuth", azimuth.is_some()),
            ("turbidity", turbidity.is_some()),
            ("ground", ground.is_some()),
        ];
        return match lone.into_iter().find(|(_, is_stated)| *is_stated) {
            Some((key, _)) => Err(section.fault_at(key, "belongs to the sun: state `sun_elevation`")),
            None => Ok(None),
        };
    };
    if section.get("image").is_some() {
        return Err(section.fault_at("sun_elevation", "and `image` are two skies: state one of them"));
    }
    Ok(Some(SunSky {
        elevation,
        azimuth: azimuth.unwrap_or(0.0),
        turbidity: turbidity.unwrap_or(TURBIDITY),
        ground: ground.map_or(GROUND, |albedo| albedo.as_vec3()),
    }))
}

/// Checks the values of the section, without its image.
pub(super) fn check(section: &Section) -> Result<()> {
    section.only(&keys::names("environment", None))?;
    section.integer("samples", 1..=1024)?;
    section.text("image")?;
    sun(section)?;
    placing(section).map(|_| ())
}

/// Decodes a panorama. 8-bit images hold sRGB codes; others hold linear values.
///
/// Fails with a reason that follows the file's name.
fn decode(bytes: &[u8]) -> std::result::Result<Environment, String> {
    let fault = |error: &dyn std::fmt::Display| format!("is no readable image: {error}");
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fault(&e))?;
    let mut bounds = Limits::no_limits();
    bounds.max_alloc = Some((bytes.len() as u64).saturating_mul(limits::IMAGE_GROWTH));
    bounds.max_image_width = Some(limits::IMAGE_SIDE);
    bounds.max_image_height = Some(limits::IMAGE_SIDE);
    reader.limits(bounds);
    let image = reader.decode().map_err(|e| fault(&e))?;
    let size = [image.width(), image.height()];
    if size[0] < 4 || size[1] < 2 {
        return Err(format!("is {}×{} texels large: a panorama has 4×2 at least", size[0], size[1]));
    }
    let is_float =
        matches!(image, image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_));
    let texels: Vec<Vec3> = match is_float {
        true => image.into_rgb32f().pixels().map(|pixel| Vec3::from(pixel.0)).collect(),
        false => image.into_rgb8().pixels().map(|pixel| Vec3::from(pixel.0.map(linear))).collect(),
    };
    if let Some(index) = texels.iter().position(|texel| !texel.is_finite() || texel.min_element() < 0.0) {
        let (x, y) = (index as u32 % size[0], index as u32 / size[0]);
        return Err(format!("has no radiance at column {x}, row {y}: {}", texels[index]));
    }
    if texels.iter().all(|texel| *texel == Vec3::ZERO) {
        return Err("is black".to_owned());
    }
    Ok(Environment { size, texels })
}
