//! The preview: a picture with direct light, and an even light of the sky, shown while light paths
//! are traced. Its frame is the renderer's, with fewer passes.

use super::image::{Image, IndirectLight};
use super::lights::Lights;
use super::plan::{FramePlan, Gathering, LightResults, Scan, Uploads};
use crate::error::Result;
use crate::gpu::barrier::TRANSFER_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::GrowsWith;
use crate::passes::{SceneBuffers, reflectances};
use crate::scene::mesh_edges::Mesh;
use crate::scene::{Camera, DisplayTransform, Emission, Light, Material, Scene, bvh::Bvh, surfaces};
use crate::types::View;
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::Arc;

/// A scene that can be rendered with direct light.
pub struct Preview {
    context: Arc<Context>,
    buffers: SceneBuffers,
    emission: Arc<Emission>,
    image: Image,
    /// Irradiance that direct light lacks, the same at every pixel: half of what the sky sends to a
    /// surface without surroundings.
    ambient: Buffer,
    /// The value in it.
    ambient_irradiance: Vec3,
}

impl Preview {
    /// Builds the acceleration structure and allocates a picture of the first camera's size.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene) -> Result<Self> {
        let (camera, emission) = (scene.cameras[0].clone(), scene.emission.clone());
        let buffers = scene_buffers(context, scene)?;
        let (image, ambient) = images(context, &buffers, &camera)?;
        let ambient_irradiance = Vec3::ZERO;
        Ok(Self { context: context.clone(), buffers, emission, image, ambient, ambient_irradiance })
    }

    /// Takes another surface of the same scene: models have moved. No frame may be under way.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn set_scene(&mut self, scene: Scene) -> Result<()> {
        let emission = scene.emission.clone();
        self.buffers = scene_buffers(&self.context, scene)?;
        self.emission = emission;
        Ok(())
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
        display: DisplayTransform,
    ) -> Result<()> {
        self.record(camera, lights, materials, display)?.submit()?.wait()?;
        self.end_frame()
    }

    /// Records a frame, as [`Self::frame`] renders it. The caller submits it, and calls
    /// [`Self::end_frame`] when it is done.
    ///
    /// # Errors
    /// The device lacks memory or failed, as in [`Self::frame`].
    pub fn record(
        &mut self,
        camera: &Camera,
        lights: &[Light],
        materials: &[Material],
        display: DisplayTransform,
    ) -> Result<Recorder> {
        if camera.size != self.image.size() {
            (self.image, self.ambient) = images(&self.context, &self.buffers, camera)?;
            self.ambient_irradiance = Vec3::ZERO;
        }
        (self.image.view, self.image.display_transform) = (View::from(camera), display);
        let (image, buffers) = (&self.image, &self.buffers);
        let of_scene = lights;
        let lights = Lights::new(
            &self.context,
            (lights, &self.emission, buffers.light_channels),
            [0, image.direct.point_count(), 0],
            None,
            false,
        )?;
        let sky = lights.sky_radiance();
        let irradiance = 0.5 * PI * sky.iter().sum::<Vec3>() / sky.len().max(1) as f32;
        if self.ambient_irradiance != irradiance {
            self.ambient_irradiance = irradiance;
            self.ambient.write(&vec![irradiance; image.size().iter().product::<u32>() as usize])?;
        }
        let plan = plan(&lights.traced());
        let light = IndirectLight {
            irradiance: &self.ambient,
            at_edges: &self.ambient,
            gloss: None,
            emission_scale: lights.emission_scale,
        };
        self.context.record(true, |rec| {
            lights.record_upload(rec);
            buffers.emission.record_upload(rec, of_scene);
            rec.upload(&buffers.materials, &reflectances(materials));
            rec.barrier(TRANSFER_TO_COMPUTE);
            image.record_view(rec, buffers);
            image.record_direct(rec, &plan, buffers, &lights);
            image.record_picture(rec, &plan, buffers, light);
        })
    }

    /// Checks a frame that is done.
    ///
    /// # Errors
    /// The device's loops were truncated.
    pub fn end_frame(&self) -> Result<()> {
        self.buffers.refuse_truncated_loops("preview", 0)
    }

    /// The radiance of the last frame, row by row from the top, linear Rec.709.
    ///
    /// # Errors
    /// The device failed.
    pub fn radiance(&self) -> Result<Vec<[f32; 3]>> {
        self.image.compose.radiance.read()
    }

    /// The displayed picture of the last frame: sRGB codes R, G, B, 255, row by row from the top.
    pub fn display(&self) -> &Buffer {
        &self.image.tonemap.display
    }
}

/// Builds the acceleration structure and uploads the scene.
fn scene_buffers(context: &Arc<Context>, mut scene: Scene) -> Result<SceneBuffers> {
    let bvh = Bvh::of_scene(&scene)?;
    scene.reorder(&bvh.order);
    let surfaces: Vec<_> =
        scene.triangles.iter().map(|triangle| surfaces::surface(triangle, [true; 2])).collect();
    let mesh = Mesh::of(&scene.triangles);
    SceneBuffers::new(context, &bvh, &scene, &surfaces)?.with_mesh_edges(context, &scene, &mesh)
}

/// The plan of a frame with direct light alone.
fn plan(traced: &[bool]) -> FramePlan {
    let light = |&irradiance: &bool| LightResults { irradiance, ..LightResults::default() };
    FramePlan {
        uploads: Uploads { lights: true, emission: true, materials: true },
        view: true,
        lobe_rays: false,
        pixel_batches: true,
        lights: traced.iter().map(light).collect(),
        direct_sum: true,
        scan: Scan::None,
        hierarchy: false,
        is_whole: false,
        gather: Gathering::Nothing,
        splat: false,
        gloss: false,
        compose: true,
        display: true,
    }
}

/// A picture of a camera's size without antialiasing, and its ambient irradiance: none.
fn images(context: &Arc<Context>, buffers: &SceneBuffers, camera: &Camera) -> Result<(Image, Buffer)> {
    let image = Image::new(context, buffers, View::from(camera), 0, false)?;
    let [width, height] = camera.size;
    let dark = vec![Vec3::ZERO; (width * height) as usize];
    Ok((image, Buffer::from_slice(context, GrowsWith::Pixels.named("ambient irradiance"), &dark)?))
}
