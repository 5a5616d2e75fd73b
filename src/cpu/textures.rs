//! Reference of the texture lookup, and the colours' packing.

use crate::scene::{Image, Material, Texture};
use glam::{DVec2, DVec3, IVec2, UVec3, Vec2};

/// Images of the triangles.
#[derive(Clone, Copy, Default)]
pub struct Textures<'a> {
    /// Materials with their images.
    pub materials: &'a [Material],
    /// Image coordinates at each triangle's corners; empty if no material has an image.
    pub coordinates: &'a [[Vec2; 3]],
}

/// Linear value of an sRGB code (IEC 61966-2-1).
pub fn linear(code: u8) -> f64 {
    let value = f64::from(code) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

impl Textures<'_> {
    /// Colour of a material's image at a point of a triangle; white if it has none.
    pub fn colour(&self, material: u32, triangle: u32, barycentric: DVec3) -> DVec3 {
        if self.coordinates.is_empty() {
            return DVec3::ONE;
        }
        let Some(texture) = &self.materials[material as usize].texture else { return DVec3::ONE };
        let inside = barycentric.max(DVec3::ZERO);
        let barycentric = if texture.is_atlas { inside / inside.element_sum() } else { barycentric };
        let [a, b, c] = self.coordinates[triangle as usize].map(Vec2::as_dvec2);
        sample(texture, barycentric.x * a + barycentric.y * b + barycentric.z * c)
    }
}

/// Bilinear interpolation between the middles of texels; u from the left, v from below, the image 1
/// wide and high.
pub fn sample(texture: &Texture, uv: DVec2) -> DVec3 {
    let size = DVec2::from(texture.image.size.map(f64::from));
    let place = DVec2::new(uv.x, 1.0 - uv.y);
    let is_clamped = texture.wrapping() != 0;
    let place = if is_clamped { place.clamp(DVec2::ZERO, DVec2::ONE) } else { place };
    let low = (place * size - 0.5).floor();
    let fraction = place * size - 0.5 - low;
    let texel = |across, down| {
        let place = low.as_ivec2() + IVec2::new(across, down);
        let inside = |place: i32, size: u32| match is_clamped {
            true => place.clamp(0, size as i32 - 1),
            false => place.rem_euclid(size as i32),
        };
        let Image { size: [width, height], codes } = &*texture.image;
        let [x, y] = [inside(place.x, *width), inside(place.y, *height)].map(|place| place as usize);
        DVec3::from(codes[y * *width as usize + x].map(linear))
    };
    let above = texel(0, 0).lerp(texel(1, 0), fraction.x);
    let below = texel(0, 1).lerp(texel(1, 1), fraction.x);
    above.lerp(below, fraction.y)
}

/// Square roots in 11, 11 and 10 bits; mirrors `pack_colour` in `glsl/include/colour.glsl`.
pub fn pack_colour(colour: DVec3) -> u32 {
    let roots: UVec3 = (colour.powf(0.5) * DVec3::new(2047.0, 2047.0, 1023.0)).round().as_uvec3();
    roots.x | roots.y << 11 | roots.z << 22
}

/// Reference of `unpack_colour`.
pub fn unpack_colour(packed: u32) -> DVec3 {
    let roots = [packed & 2047, packed >> 11 & 2047, packed >> 22].map(f64::from);
    (DVec3::from(roots) / DVec3::new(2047.0, 2047.0, 1023.0)).powf(2.0)
}
