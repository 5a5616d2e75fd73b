//! Snapshots: pictures with the edits that gave them.

use egui::{ColorImage, TextureHandle, TextureId, TextureOptions};

use super::document::Document;
use super::view_request::ViewRequest;
use crate::error::{Error, Result};
use crate::scene::Camera;

/// Most snapshots, and most bytes of all their pictures.
const COUNT_MAX: usize = 24;
const BYTES_MAX: usize = 1 << 30;
/// Width of a small picture, pixels: sharp at twice the system's scale.
const SMALL: u32 = 260;

/// A picture and its edits.
pub(super) struct Snapshot {
    pub(super) id: u64,
    pub(super) name: String,
    /// Its document, camera and display transform.
    pub(super) shown: ViewRequest,
    pub(super) size: [u32; 2],
    /// Direct and indirect light, W/m²/sr.
    pub(super) radiance: Vec<[f32; 3]>,
    /// sRGB codes R, G, B, 255, as it was shown.
    pub(super) codes: Vec<[u8; 4]>,
    texture: Option<TextureHandle>,
}

/// All snapshots, the newest last.
#[derive(Default)]
pub(super) struct Snapshots {
    pub(super) list: Vec<Snapshot>,
    /// Number of snapshots so far.
    count: u64,
}

/// Bytes of a snapshot of that many pixels.
fn bytes(pixels: usize) -> usize {
    pixels * (size_of::<[f32; 3]>() + size_of::<[u8; 4]>())
}

impl Snapshot {
    /// The texture of its small picture.
    pub(super) fn texture(&mut self, context: &egui::Context) -> TextureId {
        let (codes, size) = (&self.codes, self.size);
        let load = || {
            let (small, pixels) = scaled(codes, size, SMALL);
            let bytes: Vec<u8> = pixels.into_flattened();
            let image = ColorImage::from_rgba_unmultiplied(small.map(|side| side as usize), &bytes);
            context.load_texture("snapshot", image, TextureOptions::LINEAR)
        };
        self.texture.get_or_insert_with(load).id()
    }
}

impl Snapshots {
    /// Refuses another snapshot of that many pixels if there are too many.
    ///
    /// # Errors
    /// The limit, as one line.
    pub(super) fn refuse_excess(&self, pixels: usize) -> Result<()> {
        let kept: usize = self.list.iter().map(|snapshot| bytes(snapshot.codes.len())).sum();
        let why = if self.list.len() >= COUNT_MAX {
            format!("there are {COUNT_MAX} snapshots")
        } else if kept + bytes(pixels) > BYTES_MAX {
            format!("snapshots take {} MiB of memory at most", BYTES_MAX >> 20)
        } else {
            return Ok(());
        };
        Err(Error::Usage(format!("not kept: {why}; remove one first")))
    }

    /// Keeps a picture. Returns its name.
    pub(super) fn keep(
        &mut self,
        shown: ViewRequest,
        size: [u32; 2],
        radiance: Vec<[f32; 3]>,
        codes: Vec<[u8; 4]>,
    ) -> String {
        let id = self.count;
        self.count += 1;
        let name = format!("Snapshot {}", self.count);
        self.list.push(Snapshot { id, name: name.clone(), shown, size, radiance, codes, texture: None });
        name
    }

    /// The snapshot with that identifier.
    pub(super) fn get(&self, id: u64) -> Option<&Snapshot> {
        self.list.iter().find(|snapshot| snapshot.id == id)
    }

    /// The snapshot that was kept last.
    pub(super) fn newest(&self) -> Option<&Snapshot> {
        self.list.last()
    }

    /// Converts all edits to another version of the scene.
    pub(super) fn rebase(
        &mut self,
        document: impl Fn(&Document) -> Document,
        camera: impl Fn(&Camera) -> Camera,
    ) {
        for Snapshot { shown, .. } in &mut self.list {
            (shown.document, shown.camera) = (document(&shown.document), camera(&shown.camera));
        }
    }
}

/// A picture of that width at most, with its size: sRGB codes R, G, B, 255.
pub(super) fn scaled(codes: &[[u8; 4]], size: [u32; 2], width: u32) -> ([u32; 2], Vec<[u8; 4]>) {
    let [from_width, from_height] = size;
    if from_width <= width {
        return (size, codes.to_vec());
    }
    let height = ((from_height * width) as f32 / from_width as f32).round().max(1.0) as u32;
    let bytes = codes.as_flattened().to_vec();
    let image = ::image::RgbaImage::from_raw(from_width, from_height, bytes).expect("four codes a pixel");
    let filter = ::image::imageops::FilterType::Triangle;
    let small = ::image::imageops::resize(&image, width, height, filter).into_raw();
    ([width, height], small.as_chunks::<4>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{DisplayTransform, LoadOptions, Scene};

    fn shown() -> ViewRequest {
        let scene = Scene::load("box", &LoadOptions::default()).unwrap();
        ViewRequest {
            document: Document::from_scene(&scene, Vec::new()),
            camera: scene.cameras[0].clone(),
            display: DisplayTransform::default(),
            weights: [1.0; 2],
        }
    }

    #[test]
    fn too_many_snapshots_are_refused() {
        let (mut snapshots, shown) = (Snapshots::default(), shown());
        for number in 1..=COUNT_MAX {
            snapshots.refuse_excess(1).unwrap();
            let name = snapshots.keep(shown.clone(), [1, 1], vec![[0.0; 3]], vec![[0; 4]]);
            assert_eq!(name, format!("Snapshot {number}"));
        }
        assert!(snapshots.refuse_excess(1).is_err_and(|error| error.to_string().contains("24 snapshots")));
        snapshots.list.remove(3);
        snapshots.refuse_excess(1).unwrap();
        // Numbers are not used again.
        snapshots.keep(shown, [1, 1], vec![[0.0; 3]], vec![[0; 4]]);
        assert_eq!(snapshots.newest().map(|newest| newest.id), Some(24));
        // 16 bytes a pixel.
        let few = Snapshots::default();
        few.refuse_excess(BYTES_MAX / 16).unwrap();
        assert!(
            few.refuse_excess(BYTES_MAX / 16 + 1).is_err_and(|error| error.to_string().contains("1024 MiB"))
        );
    }

    #[test]
    fn small_pictures_keep_shape_and_mean() {
        let codes: Vec<[u8; 4]> = (0..600 * 300).map(|pixel| [(pixel % 600 / 3) as u8, 9, 0, 255]).collect();
        let (size, small) = scaled(&codes, [600, 300], 100);
        assert_eq!((size, small.len()), ([100, 50], 5000));
        let mean =
            |codes: &[[u8; 4]]| codes.iter().map(|code| f64::from(code[0])).sum::<f64>() / codes.len() as f64;
        assert!((mean(&small) - mean(&codes)).abs() < 1.0);
        assert!(small.iter().all(|code| code[1..] == [9, 0, 255]));
        assert_eq!(scaled(&codes, [600, 300], 600), ([600, 300], codes.clone()));
    }
}
