//! The preview: a picture with direct light only, shown while light paths are traced.

use super::lights::Lights;
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER};
use crate::gpu::{Buffer, Context};
use crate::passes::frame::{
    antialias::Antialias,
    compose::{Compose, Irradiances},
    direct::Direct,
    pixel_colours::PixelColours,
    primary::Primary,
    tonemap::Tonemap,
};
use crate::passes::{SceneBuffers, reflectances};
use crate::scene::{Camera, Light, Material, Scene, bvh::Bvh, surfaces};
use crate::types::View;
use glam::Vec3;
use std::sync::Arc;

/// A scene that can be rendered with direct light.
pub struct Preview {
    context: Arc<Context>,
    buffers: SceneBuffers,
    image: Image,
}

/// Buffers that depend on the size of the picture.
struct Image {
    size: [u32; 2],
    primary: Primary,
    antialias: Antialias,
    direct: Direct,
    pixel_colours: PixelColours,
    compose: Compose,
    tonemap: Tonemap,
    /// Indirect irradiance, zero at every pixel.
    indirect: Buffer,
}

impl Preview {
    /// Builds the acceleration structure and allocates a picture of the first camera's size.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, mut scene: Scene) -> Result<Self> {
        let bvh = Bvh::build(&scene.triangles)?;
        scene.reorder(&bvh.order);
        let surfaces: Vec<_> =
            scene.triangles.iter().map(|triangle| surfaces::surface(triangle, [true; 2])).collect();
        let (triangles, coordinates) = (&scene.triangles, &scene.texture_coordinates);
        let buffers = SceneBuffers::new(context, &bvh, triangles, &surfaces, coordinates, &scene.materials)?;
        let image = Image::new(context, &buffers, scene.cameras[0].size)?;
        Ok(Self { context: context.clone(), buffers, image })
    }

    /// Renders the view of a camera, with these lights and materials of the scene. The picture has
    /// the camera's size.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn frame(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        materials: &[Material],
        exposure_stops: f32,
    ) -> Result<()> {
        if camera.size != self.image.size {
            self.image = Image::new(&self.context, &self.buffers, camera.size)?;
        }
        self.buffers.materials.write(&reflectances(materials))?;
        let (image, view) = (&self.image, View::from(camera));
        let lights = Lights::new(&self.context, lights, [0, image.direct.point_count(), 0], None)?;
        self.context.run(|rec| {
            let pixels = &image.primary.pixels;
            image.primary.record(rec, &self.buffers, &view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            image.direct.record_batches(rec, &self.buffers, pixels);
            rec.barrier(COMPUTE_TO_COMPUTE);
            image.antialias.record(rec, &self.buffers, &view, pixels);
            rec.barrier(COMPUTE_TO_INDIRECT);
            if self.buffers.textures.are_used {
                image.pixel_colours.record(rec, &self.buffers, &view, pixels, Some(&image.antialias));
            }
            let mut pass = rec.pass(Direct::STEM);
            for (place, (light, irradiance)) in lights.stale_irradiance().into_iter().enumerate() {
                if place > 0 {
                    pass.barrier(COMPUTE_TO_TRANSFER);
                }
                image.direct.record(&mut pass, &self.buffers, light, pixels, irradiance);
            }
            pass.barrier(COMPUTE_TO_COMPUTE);
            drop(pass);
            image.direct.record_sum(rec, &image.antialias, &lights.irradiances());
            rec.barrier(COMPUTE_TO_COMPUTE);
            image.compose.record(rec, &self.buffers, image.irradiances(lights.emission_scale), [1.0, 0.0]);
            rec.barrier(COMPUTE_TO_COMPUTE);
            image.tonemap.record(rec, &image.compose.radiance, exposure_stops);
        })?;
        self.buffers.refuse_truncated_loops("preview", 0)
    }

    /// The displayed picture of the last frame: sRGB codes R, G, B, 255, row by row from the top.
    pub fn display(&self) -> &Buffer {
        &self.image.tonemap.display
    }
}

impl Image {
    fn new(context: &Arc<Context>, buffers: &SceneBuffers, size: [u32; 2]) -> Result<Self> {
        let pixels = size[0] * size[1];
        let antialias = Antialias::new(context, size, 0)?;
        let slots = antialias.capacity.slots;
        Ok(Self {
            size,
            primary: Primary::new(context, pixels)?,
            direct: Direct::new(context, size, slots)?,
            pixel_colours: PixelColours::new(context, buffers, pixels, slots)?,
            antialias,
            compose: Compose::new(context, buffers, size, false)?,
            tonemap: Tonemap::new(context, pixels)?,
            indirect: Buffer::from_slice(context, "no indirect light", &vec![Vec3::ZERO; pixels as usize])?,
        })
    }

    fn irradiances(&self, emission_scale: Vec3) -> Irradiances<'_> {
        Irradiances {
            pixels: &self.primary.pixels,
            direct: &self.direct.irradiance,
            indirect: &self.indirect,
            gloss: None,
            antialias: &self.antialias,
            colours: &self.pixel_colours,
            emission_scale,
        }
    }
}
