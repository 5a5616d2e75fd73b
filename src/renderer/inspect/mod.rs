//! Queries about a pixel or a point, for the window. Frames do not depend on them. A query costs
//! only when it is made and changes nothing.

mod clusters;
mod paths;
mod rays;

pub use clusters::ClusterAt;
pub use paths::PathPoint;
pub use rays::GatherRaySegment;

use super::Renderer;
use crate::cpu::math::ClearDistance;
use crate::cpu::rays::Geometry;
use crate::cpu::textures::Textures;
use crate::error::Result;
use crate::passes::frame::splat::{SplatWeight, WeightRange};
use crate::types::{CachePoint, NO_SIDE, Node, PixelSurface};
use glam::Vec3;

/// Cosine below which two normals belong to different surfaces.
const ALIKE: f32 = 0.5;

/// The surface that the central ray of a pixel meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAt {
    /// Point on the surface.
    pub position: Vec3,
    /// Unit shading normal on the visible side.
    pub normal: Vec3,
    /// Distance from the camera's plane, metres.
    pub depth_m: f32,
    /// Index into the scene's triangles in the renderer's order ([`Renderer::scene`]).
    pub triangle: u32,
    /// Whether the ray meets the back side.
    pub is_back: bool,
    /// Index into the scene's materials.
    pub material: usize,
}

/// A record that a pixel uses, with its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordWeight {
    /// Index of the record and of its cache point.
    pub record: u32,
    /// Weight of the record, 0..=1; the weights of a pixel sum to 1.
    pub fraction: f32,
}

#[doc(hidden)]
impl Renderer {
    /// The surface that a pixel of the last frame shows; pixels count from the top left corner.
    /// `None` outside the picture, if the ray left the scene, or before the first frame of this
    /// size. The depth is the distance from the current camera. Reads one pixel.
    ///
    /// # Errors
    /// The device failed.
    pub fn surface_at(&self, pixel: [u32; 2]) -> Result<Option<SurfaceAt>> {
        let Some(index) = self.pixel_index(pixel) else { return Ok(None) };
        let found = self.image.primary.pixels.read_range::<PixelSurface>(index, 1)?[0];
        if found.side == NO_SIDE {
            return Ok(None);
        }
        let triangle = found.side / 2;
        Ok(Some(SurfaceAt {
            position: found.position,
            normal: found.normal,
            depth_m: (found.position - self.image.view.position).dot(self.image.view.forward),
            triangle,
            is_back: found.side % 2 == 1,
            material: self.world.surfaces[triangle as usize].material as usize,
        }))
    }

    /// The records that a pixel of the last frame uses. Empty if [`Self::surface_at`] finds
    /// nothing. An uncovered pixel uses the relaxed records that reach it, or the nearest one.
    ///
    /// # Errors
    /// The device failed.
    pub fn records_at(&self, pixel: [u32; 2]) -> Result<Vec<RecordWeight>> {
        let Some(index) = self.pixel_index(pixel) else { return Ok(Vec::new()) };
        let [ranges, weights] = self.splat.lists();
        let range = ranges.read_range::<WeightRange>(index, 1)?[0];
        let weights: Vec<SplatWeight> =
            weights.read_range(range.first as usize, (range.end - range.first) as usize)?;
        // Weights of uncovered pixels are negative.
        let sum: f32 = weights.iter().map(|weight| weight.weight).sum();
        let fraction =
            |found: &SplatWeight| RecordWeight { record: found.record, fraction: found.weight / sum };
        Ok(weights.iter().map(fraction).collect())
    }

    /// All cache points, in the order of their records.
    ///
    /// # Errors
    /// The device failed.
    pub fn cache_points(&self) -> Result<Vec<CachePoint>> {
        self.transport.gather.cache_points.read()
    }

    /// The cache point nearest to `position` on a surface with unit normal `normal`. A point with a
    /// different normal is returned only if no other exists. `None` if there are no cache points.
    /// Reads all of them.
    ///
    /// # Errors
    /// The device failed.
    pub fn nearest_cache_point(&self, position: Vec3, normal: Vec3) -> Result<Option<u32>> {
        let points = self.cache_points()?;
        let distance = |point: &CachePoint| {
            let is_other = point.normal.dot(normal) < ALIKE;
            (is_other, point.position.distance_squared(position))
        };
        let distances = (0..).zip(points.iter().map(distance));
        let nearest = distances.min_by(|(_, a), (_, b)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Ok(nearest.map(|(index, _)| index))
    }

    /// Index of a pixel in lists. `None` outside the picture, or before the first frame.
    fn pixel_index(&self, [x, y]: [u32; 2]) -> Option<usize> {
        let [width, height] = self.size();
        (x < width && y < height && self.has_picture()).then_some((y * width + x) as usize)
    }

    /// Whether a frame of this size has been rendered.
    fn has_picture(&self) -> bool {
        !self.dirty.changes.size
    }

    /// The scene as the reference implementation reads it.
    fn geometry(&self) -> Result<Geometry<'_>> {
        let root = self.world.buffers.nodes.followed().read_range::<Node>(0, 1)?[0];
        Ok(Geometry {
            triangles: &self.world.scene.triangles,
            surfaces: &self.world.surfaces,
            textures: Textures {
                materials: &self.world.scene.materials,
                coordinates: &self.world.scene.texture_coordinates,
            },
            opacity: &self.world.scene.opacity,
            clear_distance: ClearDistance::new(&root, &self.world.scene.cell_sizes),
        })
    }
}
