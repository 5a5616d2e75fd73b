//! A scene on the device as the reference renderers see it: all sides of all triangles, all
//! lights, one camera.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::passes::frame::antialias::{Antialias, COVERAGE, MAX_SAMPLES, SeenFragments};
use crate::passes::frame::coverage::Coverage;
use crate::passes::frame::{pixel_colours::PixelColours, primary::Primary};
use crate::passes::{LightTable, LitScene, SceneBuffers};
use crate::scene::{Scene, bvh::Bvh, surfaces};
use crate::types::{NO_SIDE, PixelSurface, Surface, View};
use glam::Vec3;
use std::sync::Arc;

/// A scene with the buffers that ray tracing passes bind.
pub struct TracedScene {
    /// Device that traces the scene.
    pub context: Arc<Context>,
    /// The scene without the lights that are off, with its triangles in BVH order.
    pub scene: Scene,
    /// Surfaces in the same order.
    pub surfaces: Vec<Surface>,
    /// Geometry and materials on the device.
    pub buffers: SceneBuffers,
    /// Table of all lights: a row for each, then their parts.
    pub light_sources: LightTable,
    /// The lights on the device.
    pub lights: Buffer,
    /// The scene's first camera.
    pub view: View,
}

/// Image layers of the hits of each pixel's central ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FirstHits {
    /// Diffuse albedo; zero where the ray left the scene.
    pub albedo: Vec<[f32; 3]>,
    /// Unit shading normal on the visible side; zero where the ray left the scene.
    pub normal: Vec<[f32; 3]>,
    /// Place of the surface, recentred world space, metres; zero where the ray left the scene.
    pub position: Vec<[f32; 3]>,
    /// Distance along the viewing direction, metres, three times; infinite where the ray
    /// left the scene.
    pub depth: Vec<[f32; 3]>,
}

impl TracedScene {
    /// Builds the acceleration structure and uploads everything.
    ///
    /// # Errors
    /// [`Error::Usage`] for a scene without triangles; the device lacks memory or failed.
    pub fn new(context: &Arc<Context>, mut scene: Scene) -> Result<Self> {
        if scene.triangles.is_empty() {
            return Err(Error::Usage("the scene has no triangle".into()));
        }
        scene.lights.retain(|light| light.is_on);
        let bvh = Bvh::build(&scene.triangles)?;
        scene.reorder(&bvh.order);
        let surfaces: Vec<Surface> =
            scene.triangles.iter().map(|triangle| surfaces::surface(triangle, [true; 2])).collect();
        let light_sources = LightTable::for_paths(&scene.lights, &scene.emission);
        let buffers = SceneBuffers::new(context, &bvh, &scene, &surfaces)?;
        context.run(|rec| buffers.emission.record_upload(rec, &scene.lights))?;
        Ok(Self {
            context: context.clone(),
            buffers,
            lights: Buffer::from_slice(context, "lights", &light_sources.bytes())?,
            view: View::from(&scene.cameras[0]),
            surfaces,
            light_sources,
            scene,
        })
    }

    /// The buffers that passes bind.
    pub fn lit(&self) -> LitScene<'_> {
        LitScene { buffers: &self.buffers, lights: &self.lights, light_count: self.light_count() }
    }

    /// Number of lights.
    pub fn light_count(&self) -> u32 {
        self.scene.lights.len() as u32
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// Pixels of the image.
    pub fn pixel_count(&self) -> u32 {
        self.view.width * self.view.height
    }

    /// Finds the sides that each pixel shows, as antialiasing does.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn coverage(&self) -> Result<Coverage> {
        let primary = Primary::new(&self.context, self.pixel_count())?;
        let antialias = Antialias::new(&self.context, self.size(), MAX_SAMPLES / COVERAGE)?;
        self.context.run(|rec| primary.record(rec, &self.buffers, &self.view))?;
        self.context.run(|rec| antialias.record(rec, &self.buffers, &self.view, &primary.pixels))?;
        Coverage::read(SeenFragments { pixels: &primary.pixels, antialias: &antialias })
    }

    /// Traces the central ray of each pixel.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn first_hits(&self) -> Result<FirstHits> {
        let primary = Primary::new(&self.context, self.pixel_count())?;
        let colours = PixelColours::new(&self.context, &self.buffers, self.pixel_count(), 0)?;
        self.context.run(|rec| primary.record(rec, &self.buffers, &self.view))?;
        self.context.run(|rec| colours.record(rec, &self.buffers, &self.view, &primary.pixels, None))?;
        let pixels: Vec<PixelSurface> = primary.pixels.read()?;
        let depth = |pixel: &PixelSurface| match pixel.side {
            NO_SIDE => [f32::INFINITY; 3],
            _ => Vec3::splat((pixel.position - self.view.position).dot(self.view.forward)).to_array(),
        };
        Ok(FirstHits {
            albedo: colours.albedos(&pixels, &self.surfaces, &self.scene.materials)?,
            normal: pixels.iter().map(|pixel| pixel.normal.to_array()).collect(),
            position: pixels.iter().map(|pixel| pixel.position.to_array()).collect(),
            depth: pixels.iter().map(depth).collect(),
        })
    }
}
