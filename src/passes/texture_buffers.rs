//! The images of a scene on the device.

use crate::cpu::textures::linear;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferName, Context};
use crate::passes::GrowsWith;
use crate::scene::{Image, Material};
use crate::types::Texture;
use bytemuck::Zeroable;
use glam::Vec2;
use std::sync::Arc;

/// Bindings of shaders that look up the colour of a surface point. In a scene without images, a
/// few unused bytes.
pub struct TextureBuffers {
    /// Image coordinates, three a triangle.
    coordinates: Buffer,
    /// `Texture` of each material.
    table: Buffer,
    /// Decoded values of the 256 sRGB codes, as floats; then four bytes a texel.
    texels: Buffer,
    /// Whether there are images or panes, and so colours of rays and points.
    pub are_used: bool,
}

impl TextureBuffers {
    /// Uploads each image once; `coordinates` of the triangles in the tree's order,
    /// empty without images. `has_panes`: rays have colours without images, too.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if the images are larger than the device can bind; the
    /// device lacks memory.
    pub fn new(
        context: &Arc<Context>,
        coordinates: &[[Vec2; 3]],
        materials: &[Material],
        has_panes: bool,
    ) -> Result<Self> {
        let are_used = !coordinates.is_empty() || has_panes;
        let mut images: Vec<(&Arc<Image>, usize)> = Vec::new();
        let mut end = 256;
        let mut table: Vec<Texture> = Vec::new();
        for texture in
            materials.iter().map(|material| material.texture.as_ref().filter(|_| !coordinates.is_empty()))
        {
            table.push(texture.map_or_else(Zeroable::zeroed, |texture| {
                let known = images.iter().find(|(image, _)| Arc::ptr_eq(image, &texture.image));
                let first = known.map_or(end, |&(_, first)| first);
                if first == end {
                    images.push((&texture.image, first));
                    end += texture.image.codes.len();
                }
                let [width, height] = texture.image.size;
                Texture { first: first as u32, width, height, is_clamped: texture.wrapping() }
            }));
        }
        let limit = context.limits().storage_range_bytes;
        if are_used && 4 * end as u64 > limit {
            return Err(Error::OutOfMemory(format!(
                "the images of the materials take {} MiB, the device can bind {}; scale them, or give materials a `diffuse` in the scene file instead",
                (4 * end).div_ceil(1 << 20),
                limit >> 20
            )));
        }
        let mut texels: Vec<u32> = (0..=u8::MAX).map(|code| (linear(code) as f32).to_bits()).collect();
        for (image, _) in images {
            texels.extend(image.codes.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 0])));
        }
        if !are_used {
            (table, texels) = (vec![Texture::zeroed()], vec![0]);
        }
        let none = [[Vec2::ZERO; 3]];
        let coordinates = if coordinates.is_empty() { &none } else { coordinates };
        Ok(Self {
            coordinates: Buffer::from_slice(
                context,
                GrowsWith::Triangles.named("texture coordinates"),
                coordinates,
            )?,
            table: Buffer::from_slice(context, "textures", &table)?,
            texels: Buffer::from_slice(context, "texels", &texels)?,
            are_used,
        })
    }

    /// The specialisation constant of shaders that use images.
    pub fn constant(&self) -> (&'static str, u32) {
        has_textures(self.are_used)
    }

    /// The bindings of a shader that looks up colours: `own`, then those of the images.
    pub fn after<'a, const N: usize>(
        &'a self,
        own: [(&'static str, &'a Buffer); N],
    ) -> Vec<(&'static str, &'a Buffer)> {
        let textures =
            [("TextureCoordinates", &self.coordinates), ("Textures", &self.table), ("Texels", &self.texels)];
        own.into_iter().chain(textures).collect()
    }

    /// Allocates `count` packed colours; one unused word in scenes without images.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn colours(&self, context: &Arc<Context>, name: BufferName<'_>, count: u64) -> Result<Buffer> {
        Buffer::storage(context, name, 4 * if self.are_used { count.max(1) } else { 1 })
    }
}

/// The constant of [`TextureBuffers::constant`].
pub fn has_textures(is_true: bool) -> (&'static str, u32) {
    ("HAS_TEXTURES", u32::from(is_true))
}
