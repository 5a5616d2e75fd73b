//! What the renderer knows about a place: for eyes. No frame has any of it; a question costs what
//! it takes to answer, and leaves everything as it was.

mod clusters;
mod paths;
mod rays;

pub use clusters::ClusterAt;
pub use paths::PathPoint;
pub use rays::GatherRaySegment;

use super::Renderer;
use crate::cpu::math::clear_distance;
use crate::cpu::rays::Geometry;
use crate::cpu::textures::Textures;
use crate::error::Result;
use crate::passes::frame::splat::{SplatWeight, WeightRun};
use crate::types::{CachePoint, NO_SIDE, Node, PixelSurface};
use glam::Vec3;

/// Normals further apart than this, as a cosine, are those of different surfaces.
const ALIKE: f32 = 0.5;

/// What the central ray of a pixel found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAt {
    /// Point on the surface.
    pub position: Vec3,
    /// Unit shading normal on the visible side.
    pub normal: Vec3,
    /// Distance from the camera's plane, metres.
    pub depth_m: f32,
    /// Index into the scene's triangles as the renderer has them ([`Renderer::scene`]).
    pub triangle: u32,
    /// Whether its back is seen.
    pub is_back: bool,
    /// Index into the scene's materials.
    pub material: usize,
}

/// A record that serves a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordShare {
    /// Index of the record, and of its cache point.
    pub record: u32,
    /// What it contributes, 0..=1; a pixel's shares sum to 1.
    pub share: f32,
}

impl Renderer {
    /// What a pixel of the last frame shows, counted from the top left corner; none outside the
    /// picture, where the ray left the scene, and before the first frame of this size. Depth is
    /// that from the camera as it is set. Reads one pixel.
    ///
    /// # Errors
    /// The device failed.
    pub fn surface_at(&self, pixel: [u32; 2]) -> Result<Option<SurfaceAt>> {
        let Some(index) = self.pixel_index(pixel) else { return Ok(None) };
        let found = self.primary.pixels.read_range::<PixelSurface>(index, 1)?[0];
        if found.side == NO_SIDE {
            return Ok(None);
        }
        let triangle = found.side / 2;
        Ok(Some(SurfaceAt {
            position: found.position,
            normal: found.normal,
            depth_m: (found.position - self.view.position).dot(self.view.forward),
            triangle,
            is_back: found.side % 2 == 1,
            material: self.surfaces[triangle as usize].material as usize,
        }))
    }

    /// The records that serve a pixel of the last frame; none where [`Self::surface_at`] finds
    /// nothing. Where no record covers the pixel, relaxed ones that reach it, or the nearest one.
    ///
    /// # Errors
    /// The device failed.
    pub fn records_at(&self, pixel: [u32; 2]) -> Result<Vec<RecordShare>> {
        let Some(index) = self.pixel_index(pixel) else { return Ok(Vec::new()) };
        let [runs, weights] = self.splat.lists();
        let run = runs.read_range::<WeightRun>(index, 1)?[0];
        let weights: Vec<SplatWeight> =
            weights.read_range(run.first as usize, (run.end - run.first) as usize)?;
        // Negative where none covers the pixel.
        let sum: f32 = weights.iter().map(|weight| weight.weight).sum();
        let share = |found: &SplatWeight| RecordShare { record: found.record, share: found.weight / sum };
        Ok(weights.iter().map(share).collect())
    }

    /// The cache point nearest to a place on a surface with that unit normal; one whose normal is
    /// another's only if there is no other. None where there are no cache points. Reads them all.
    ///
    /// # Errors
    /// The device failed.
    pub fn nearest_cache_point(&self, position: Vec3, normal: Vec3) -> Result<Option<u32>> {
        let points: Vec<CachePoint> = self.gather.cache_points.read()?;
        let distance = |point: &CachePoint| {
            let is_other = point.normal.dot(normal) < ALIKE;
            (is_other, point.position.distance_squared(position))
        };
        let distances = (0..).zip(points.iter().map(distance));
        let nearest = distances.min_by(|(_, a), (_, b)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Ok(nearest.map(|(index, _)| index))
    }

    /// Where a pixel stands in lists; none outside the picture, and before there is one.
    fn pixel_index(&self, [x, y]: [u32; 2]) -> Option<usize> {
        let [width, height] = self.size();
        (x < width && y < height && self.has_picture()).then_some((y * width + x) as usize)
    }

    /// Whether a frame has been made in this size.
    fn has_picture(&self) -> bool {
        !self.changes.size
    }

    /// The scene as the references take it.
    fn geometry(&self) -> Result<Geometry<'_>> {
        let root = self.buffers.nodes.followed().read_range::<Node>(0, 1)?[0];
        Ok(Geometry {
            triangles: &self.scene.triangles,
            surfaces: &self.surfaces,
            textures: Textures {
                materials: &self.scene.materials,
                coordinates: &self.scene.texture_coordinates,
            },
            clear_distance: clear_distance(&root),
        })
    }
}
