//! References on disk: one file each, written atomically and checked when read.

use std::fmt::{self, Write as _};
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::app::output::OutputFile;
use crate::error::{Error, Result};
use crate::files::{self, Unread};
use crate::gpu::hash::fnv1a;
use crate::gpu::shaders::Shader;
use crate::scene::{Scene, Triangle};

/// Version of the file format and of the rendering of references. The shader's hash is
/// a separate key.
const FORMAT: u32 = 1;

/// Longest header line.
const MAX_HEADER_BYTES: u64 = 4096;

/// Images of a reference in file order: two independent halves, then direct and indirect light.
pub(super) type Images = [Vec<[f32; 3]>; 4];

/// A cached reference.
#[derive(Debug, PartialEq)]
pub(super) struct Kept {
    pub(super) spp: u32,
    pub(super) seconds: f64,
    pub(super) images: Images,
}

/// First line of the file.
#[derive(Debug, Serialize, Deserialize)]
struct Header {
    format: u32,
    size: [u32; 2],
    spp: u32,
    seconds: f64,
    /// FNV-1a of the image data.
    hash: String,
}

/// The default folder of cached files.
pub(super) fn default_folder() -> Result<PathBuf> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = |folder: &str| variable("HOME").map(|home| home.join(folder));
    let base = if cfg!(windows) {
        variable("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        home("Library/Caches")
    } else {
        variable("XDG_CACHE_HOME").filter(|path| path.is_absolute()).or_else(|| home(".cache"))
    };
    base.map(|base| base.join("lightpaths")).ok_or_else(|| {
        Error::Usage("there is no home folder to keep the reference in; pass --cache DIR".to_owned())
    })
}

/// File name of the reference of a scene seen by its first camera. It depends on everything that
/// changes the picture.
pub(super) fn file_name(scene: &Scene, budget: &str) -> String {
    let mut key = Key(0xcbf2_9ce4_8422_2325);
    let Scene {
        triangles,
        texture_coordinates,
        cell_sizes,
        opacity,
        panes,
        materials,
        objects: _,
        picture: _,
        lights,
        emission,
        meters: _,
        cameras,
        interior_viewpoints: _,
        origin: _,
        quality,
        draft: _,
        name: _,
        inputs: _,
        warnings: _,
        model_objects: _,
        model_boxes: _,
        model_is_movable: _,
    } = scene;
    let shader = Shader::named("path_trace");
    write!(key, "{FORMAT} {} {} {budget} {}", shader.source_hash, fnv1a(&shader.bytes), quality.seed)
        .and_then(|()| {
            write!(
                key,
                "{materials:?} {texture_coordinates:?} {opacity:?} {panes:?} {cell_sizes:?} {lights:?} {:?}",
                cameras[0]
            )
        })
        .and_then(|()| match &emission.sky {
            Some(sky) => write!(key, "{:?}", sky.environment.texels),
            None => Ok(()),
        })
        .and_then(|()| {
            triangles.iter().try_for_each(|triangle| {
                let Triangle { positions, normals, material, object: _ } = triangle;
                write!(
                    key,
                    "Triangle {{ positions: {positions:?}, normals: {normals:?}, material: {material:?} }}"
                )
            })
        })
        .expect("a hash takes everything");
    format!("{:016x}.reference", key.0)
}

/// FNV-1a over text; floats are written with all their digits.
struct Key(u64);

impl fmt::Write for Key {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let step = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        self.0 = text.as_bytes().iter().fold(self.0, step);
        Ok(())
    }
}

/// The reference in `file`. `None` if there is no such file.
///
/// # Errors
/// Why the file is unusable; the text follows the file's name.
pub(super) fn read(file: &Path, size: [u32; 2]) -> std::result::Result<Option<Kept>, String> {
    let pixels = size[0] as usize * size[1] as usize;
    let payload_bytes = 4 * 12 * pixels;
    let bytes = match files::read(file, payload_bytes as u64 + MAX_HEADER_BYTES) {
        Ok(bytes) => bytes,
        Err(Unread::Missing) => return Ok(None),
        Err(Unread::Because(why)) => return Err(why),
    };
    let end = bytes.iter().position(|&byte| byte == b'\n').ok_or("has no header")?;
    let (header, payload) = (&bytes[..end], &bytes[end + 1..]);
    let header: Header = serde_json::from_slice(header).map_err(|_| "has a damaged header")?;
    if header.format != FORMAT || header.size != size {
        return Err("is of another form or size".to_owned());
    }
    if payload.len() != payload_bytes {
        return Err(format!("holds {} bytes of pixels, not {payload_bytes}", payload.len()));
    }
    if fnv1a(payload) != header.hash {
        return Err("is damaged: its hash is not that of its pixels".to_owned());
    }
    let values: Vec<f32> =
        payload.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    if values.iter().any(|value| !value.is_finite()) {
        return Err("holds values that are not finite".to_owned());
    }
    let triples = values.as_chunks::<3>().0;
    let images = std::array::from_fn(|image| triples[image * pixels..(image + 1) * pixels].to_vec());
    Ok(Some(Kept { spp: header.spp, seconds: header.seconds, images }))
}

/// Writes a reference, and creates the folders above it.
pub(super) fn write(file: &Path, size: [u32; 2], kept: &Kept) -> Result<()> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)
            .map_err(|error| Error::output(folder, format!("cannot be created: {}", error.kind())))?;
    }
    let values = kept.images.iter().flatten().flatten();
    let payload: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
    let (spp, seconds) = (kept.spp, kept.seconds);
    let header = Header { format: FORMAT, size, spp, seconds, hash: fnv1a(&payload) };
    OutputFile::check(file)?.write(|out| {
        writeln!(out, "{}", serde_json::json!(header))?;
        out.write_all(&payload)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Image, LightKind, LoadOptions, Texture};
    use glam::{Vec2, Vec3};
    use std::sync::Arc;

    const SIZE: [u32; 2] = [3, 2];

    fn kept() -> Kept {
        let image = |start: u32| (0..6).map(|i| [(start + i) as f32 * 0.1, 1e-30, f32::MAX]).collect();
        Kept { spp: 8, seconds: 0.1 + 0.2, images: [image(0), image(6), image(12), image(18)] }
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a/b/c.reference");
        assert_eq!(read(&file, SIZE), Ok(None));
        write(&file, SIZE, &kept()).unwrap();
        assert_eq!(read(&file, SIZE), Ok(Some(kept())));
        assert!(read(&file, [2, 3]).is_err());
        assert_eq!(fs::read_dir(file.parent().unwrap()).unwrap().count(), 1, "nothing is left behind");
    }

    #[test]
    fn damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("c.reference");
        write(&file, SIZE, &kept()).unwrap();
        let whole = fs::read(&file).unwrap();
        for (case, bytes) in [
            ("empty", vec![]),
            ("header only", whole[..20].to_vec()),
            ("cut", whole[..whole.len() - 1].to_vec()),
            ("longer", [&whole[..], b"x"].concat()),
            ("a flipped bit", {
                let mut bytes = whole.clone();
                *bytes.last_mut().unwrap() ^= 1;
                bytes
            }),
        ] {
            fs::write(&file, bytes).unwrap();
            assert!(read(&file, SIZE).is_err(), "{case}");
        }
    }

    #[test]
    fn whatever_changes_the_picture_changes_the_name() {
        let scene = Scene::load("box", &LoadOptions::default()).unwrap();
        let name = file_name(&scene, "spp 8");
        assert_eq!(name, file_name(&scene.clone(), "spp 8"));
        let mut others = vec![file_name(&scene, "spp 9")];
        let mut changed = |change: &dyn Fn(&mut Scene)| {
            let mut scene = scene.clone();
            change(&mut scene);
            others.push(file_name(&scene, "spp 8"));
        };
        changed(&|scene| scene.triangles[7].positions[1].y += 1e-6);
        changed(&|scene| scene.materials[0].diffuse.x *= 0.999);
        let image = |code| {
            let image = Image { size: [1, 1], codes: vec![[code; 3]] };
            Some(Texture { image: Arc::new(image), is_clamped: false, is_atlas: false })
        };
        changed(&|scene| scene.materials[0].texture = image(1));
        changed(&|scene| scene.materials[0].texture = image(2));
        changed(&|scene| scene.texture_coordinates = vec![[Vec2::ZERO; 3]]);
        changed(&|scene| scene.cameras[0].size[0] += 1);
        changed(&|scene| scene.quality.seed += 1);
        changed(&|scene| {
            if let LightKind::Point { intensity, .. } = &mut scene.lights[0].kind {
                *intensity += Vec3::X;
            }
        });
        others.sort();
        others.dedup();
        assert_eq!(others.len(), 9);
        assert!(!others.contains(&name));
        let mut renamed = scene.clone();
        renamed.quality.entry_points += 1;
        assert_eq!(file_name(&renamed, "spp 8"), name, "our settings do not touch the reference");
    }
}
