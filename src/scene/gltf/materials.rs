//! Materials of a glTF file, as a diffuse albedo and a Phong lobe.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, Vec3};
use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::{Info, WrappingMode};
use gltf::{Document, Texture};

use super::super::alpha::Alpha;
use super::super::cutouts::{CUT_AT_HALF, Coverage, Cutout};
use super::super::limits::IMAGE_BYTES;
use super::super::material::{Material, Sides};
use super::super::material_names::{NO_MATERIAL, shown};
use super::super::metallic::Metallic;
use super::super::mtl::{EMISSION_BY_MEAN, EMISSION_LEFT_OUT};
use super::super::reading::Reading;
use super::super::texture::{self, Image};
use super::super::transparency::{IS_PANE, PANE};
use super::super::value::printable;
use super::buffers::{Buffers, bytes_of, file_of};

/// How a glTF material maps to one of ours.
pub(super) struct Mapping {
    pub(super) material: u32,
    /// Set of texture coordinates of its image. `None` if it has no image.
    pub(super) set: Option<u32>,
    /// Whether the image is the scene file's.
    pub(super) is_given: bool,
    offset: DVec2,
    rotation: f64,
    scale: DVec2,
}

impl Mapping {
    /// Our texture coordinates: v is measured from the lower edge of the image, and in glTF from
    /// the upper one.
    pub(super) fn place(&self, uv: DVec2) -> DVec2 {
        let (sin, cos) = self.rotation.sin_cos();
        let scaled = self.scale * uv;
        let turned = DVec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
        let placed = turned + self.offset;
        DVec2::new(placed.x, 1.0 - placed.y)
    }
}

/// All materials of a file.
pub(super) struct Materials {
    pub(super) all: Vec<Material>,
    /// Where each of them is surface.
    pub(super) coverages: Vec<Coverage>,
    /// By index in the file; [`usize::MAX`] is the default material.
    pub(super) mappings: HashMap<usize, Mapping>,
}

/// Reads images, each once.
struct Images<'a, 'b> {
    reading: &'a mut Reading<'b>,
    path: &'a Path,
    buffers: &'a Buffers,
    /// By index in the file. `None` if an image cannot be used.
    read: HashMap<usize, Option<Picture>>,
}

/// An image with its alpha channel. `None`: all of it is opaque.
type Picture = (Arc<Image>, Option<Arc<Alpha>>);

impl Materials {
    /// Reads the materials, and notes what is not read. A failure's reason follows the file's name.
    pub(super) fn read(
        reading: &mut Reading,
        path: &Path,
        document: &Document,
        buffers: &Buffers,
    ) -> Result<Self, String> {
        let mut materials = Self { all: Vec::new(), coverages: Vec::new(), mappings: HashMap::new() };
        let mut images = Images { reading, path, buffers, read: HashMap::new() };
        let is_bare = |primitive: gltf::Primitive| primitive.material().index().is_none();
        if document.meshes().flat_map(|mesh| mesh.primitives()).any(is_bare) {
            // glTF's own default is a white metal, which no exporter means.
            let mut mapping = Mapping::plain(materials.all.len() as u32);
            if images.reading.gives_image(NO_MATERIAL) {
                (mapping.set, mapping.is_given) = (Some(0), true);
            }
            materials.mappings.insert(usize::MAX, mapping);
            materials.all.push(Material::neutral(NO_MATERIAL));
            materials.coverages.push(Coverage::Full);
        }
        for material in document.materials() {
            let Some(index) = material.index() else { continue };
            let (read, coverage, mut mapping) = images.material(&material, index);
            mapping.material = materials.all.len() as u32;
            if mapping.set.is_none() && images.reading.gives_image(&read.name) {
                (mapping.set, mapping.is_given) = (Some(0), true);
            }
            materials.all.push(read);
            materials.coverages.push(coverage);
            materials.mappings.insert(index, mapping);
        }
        Ok(materials)
    }
}

impl Mapping {
    fn plain(material: u32) -> Self {
        Self { material, set: None, is_given: false, offset: DVec2::ZERO, rotation: 0.0, scale: DVec2::ONE }
    }

    fn of(info: &Info) -> Self {
        let mut mapping = Self { set: Some(info.tex_coord()), ..Self::plain(0) };
        if let Some(transform) = info.texture_transform() {
            mapping.set = Some(transform.tex_coord().unwrap_or(info.tex_coord()));
            mapping.offset = DVec2::from(transform.offset().map(f64::from));
            mapping.scale = DVec2::from(transform.scale().map(f64::from));
            mapping.rotation = f64::from(transform.rotation());
        }
        mapping
    }
}

/// The image of a material, its alpha channel, and its place.
type Mapped<'i> = (texture::Texture, Option<Arc<Alpha>>, Info<'i>);

impl Images<'_, '_> {
    fn material(&mut self, material: &gltf::Material, index: usize) -> (Material, Coverage, Mapping) {
        let name = material.name().filter(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("material {index}"), printable);
        self.note_unread(material, &name);
        let surface = material.pbr_metallic_roughness();
        let [r, g, b, _] = surface.base_color_factor();
        let base = Vec3::new(r, g, b).clamp(Vec3::ZERO, Vec3::ONE);
        let texture = surface.base_color_texture().and_then(|info| self.texture(&info, &name));
        let coverage = self.coverage(material, texture.as_ref(), &name);
        // An image of roughness and metalness counts by its mean.
        let (mut metal, mut roughness) = (surface.metallic_factor(), surface.roughness_factor());
        if let Some(info) = surface.metallic_roughness_texture() {
            self.note_named("images of metalness and roughness count by their mean", &name);
            if let Some((image, _)) = self.image(&info.texture(), &name) {
                let [_, rough, metallic] = mean(&image);
                (metal, roughness) = (metal * metallic, roughness * rough);
            }
        }
        let (metal, roughness) = (metal.clamp(0.0, 1.0), roughness.clamp(0.0, 1.0));
        let image = texture.as_ref().map_or(Vec3::ONE, |(texture, ..)| texture.image.mean());
        let mut read = Material {
            emission: self.emission(material, &name),
            emitting_sides: Some(if material.double_sided() { Sides::Both } else { Sides::Front }),
            ..Material::neutral(&name)
        };
        let mapping = texture.as_ref().map_or_else(|| Mapping::plain(0), |(.., info)| Mapping::of(info));
        read.texture = texture.map(|(texture, ..)| texture);
        if material.unlit() {
            read.diffuse = base;
            return (read, coverage, mapping);
        }
        Metallic { base, image, metal, roughness }.apply(&mut read);
        (read, coverage, mapping)
    }

    /// Where a material is surface.
    fn coverage(&mut self, material: &gltf::Material, texture: Option<&Mapped>, name: &str) -> Coverage {
        let opacity = f64::from(material.pbr_metallic_roughness().base_color_factor()[3]);
        let alpha = texture.and_then(|(texture, alpha, _)| Some((alpha.clone()?, texture.is_clamped)));
        let cutout =
            |(alpha, is_clamped), cutoff: f64| Coverage::Cutout(Cutout { alpha, is_clamped, cutoff });
        match (material.alpha_mode(), alpha) {
            (AlphaMode::Opaque, _) => self.transmission(material, name),
            (AlphaMode::Mask, alpha) => {
                let cutoff = f64::from(material.alpha_cutoff().unwrap_or(0.5));
                match alpha {
                    Some(alpha) if opacity > 0.0 => cutout(alpha, cutoff / opacity),
                    _ if opacity >= cutoff => Coverage::Full,
                    _ => self.hidden(name),
                }
            }
            (AlphaMode::Blend, _) if opacity <= 0.0 => self.hidden(name),
            (AlphaMode::Blend, Some(alpha)) => {
                self.note_named(CUT_AT_HALF, name);
                cutout(alpha, 0.5)
            }
            (AlphaMode::Blend, None) if opacity < PANE => {
                self.note_named(IS_PANE, name);
                Coverage::Pane(Vec3::splat(1.0 - opacity as f32))
            }
            (AlphaMode::Blend, None) => {
                let what = format!("transparency is passed over: surfaces are opaque (opacity {opacity})");
                self.note_named(&what, name);
                Coverage::Full
            }
        }
    }

    /// A pane of the base colour if most of the light passes.
    fn transmission(&mut self, material: &gltf::Material, name: &str) -> Coverage {
        let factor = material.transmission().map_or(0.0, |found| found.transmission_factor());
        if f64::from(factor) > 1.0 - PANE {
            self.note_named("transmission makes thin panes, which let light pass and reflect nothing", name);
            let [red, green, blue, _] = material.pbr_metallic_roughness().base_color_factor();
            return Coverage::Pane(factor * Vec3::new(red, green, blue));
        }
        if factor > 0.0 {
            let what = format!("transmission is passed over: surfaces are opaque (transmission {factor})");
            self.note_named(&what, name);
        }
        Coverage::Full
    }

    fn hidden(&mut self, name: &str) -> Coverage {
        self.note_named("surfaces of opacity 0 are left out", name);
        Coverage::Hidden
    }

    /// Emitted radiance of a material.
    fn emission(&mut self, material: &gltf::Material, name: &str) -> Vec3 {
        let factor = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        if factor == Vec3::ZERO {
            return factor;
        }
        let Some(info) = material.emissive_texture() else { return factor };
        let Some((image, _)) = self.image(&info.texture(), name) else { return factor };
        let colour = image.emission();
        self.note_named(if colour.is_some() { EMISSION_BY_MEAN } else { EMISSION_LEFT_OUT }, name);
        factor * colour.unwrap_or(Vec3::ZERO)
    }

    fn note_unread(&mut self, material: &gltf::Material, name: &str) {
        if material.normal_texture().is_some() {
            self.note_named("normal maps are passed over", name);
        }
    }

    fn note_named(&mut self, what: &str, name: &str) {
        let path = self.path;
        self.reading.notes.add_named(what, name, || shown(path));
    }

    /// The image of a material, and its mapping. `None` if it cannot be used.
    fn texture<'i>(&mut self, info: &Info<'i>, name: &str) -> Option<Mapped<'i>> {
        let sampler = info.texture().sampler();
        let modes = [sampler.wrap_s(), sampler.wrap_t()];
        if modes.contains(&WrappingMode::MirroredRepeat) || modes[0] != modes[1] {
            self.note_named("images that are mirrored, or repeat along one side, repeat", name);
        }
        let is_clamped = modes == [WrappingMode::ClampToEdge; 2];
        let (image, alpha) = self.image(&info.texture(), name)?;
        Some((texture::Texture { image, is_clamped, is_atlas: false }, alpha, info.clone()))
    }

    fn image(&mut self, texture: &Texture, name: &str) -> Option<Picture> {
        let Some(source) = texture.source() else {
            self.note_named("images of a format that an extension defines are left out", name);
            return None;
        };
        let index = source.index();
        if let Some(read) = self.read.get(&index) {
            return read.clone();
        }
        let read = match self.decode(source.source()) {
            Ok(decoded) => {
                if decoded.is_bounded {
                    self.note_named(texture::BOUNDED, name);
                }
                if let Some(damage) = decoded.damage {
                    self.note_named(&format!("images that are not whole: image {index} {damage}"), name);
                }
                Some((decoded.image, decoded.alpha))
            }
            Err(why) => {
                self.note_named("images that cannot be used are left out", &format!("image {index} {why}"));
                None
            }
        };
        self.read.insert(index, read.clone());
        read
    }

    fn decode(&mut self, source: Source) -> Result<texture::Decoded, String> {
        match source {
            Source::View { view, .. } => {
                let bytes = self.buffers.view(&view)?;
                self.reading.decode(Path::new("image"), bytes)
            }
            Source::Uri { uri, .. } if uri.starts_with("data:") => {
                let bytes = bytes_of(self.reading, self.path, uri, IMAGE_BYTES)?;
                self.reading.decode(Path::new("image"), &bytes)
            }
            Source::Uri { uri, .. } => {
                let file = file_of(self.reading, self.path, uri)?;
                self.reading.image(&file)
            }
        }
    }
}

/// Mean of each channel's codes, 0..=1.
fn mean(image: &Image) -> [f32; 3] {
    let count = image.codes.len().max(1) as f64;
    let sum = |channel: usize| image.codes.iter().map(|code| f64::from(code[channel])).sum::<f64>();
    std::array::from_fn(|channel| (sum(channel) / (255.0 * count)) as f32)
}
