//! Draws panels and pictures to a window.

use std::sync::Arc;

use ash::vk;
use egui::epaint::{ClippedPrimitive, textures::TexturesDelta};
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::vulkan::{create_vulkan_descriptor_set, create_vulkan_descriptor_set_layout};
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};

use super::super::{Buffer, Context, InFlight, Recorder, VkResultExt};
use super::frame::{Answer, Drawing, FRAMES, Frames};
use super::picture::{Picture, PictureId};
use super::surface::{RawSurface, Surface, WindowHandles};
use super::swapchain::{self, Swapchain};
use crate::error::{Error, Result};

/// Maximum number of pictures.
const MAX_PICTURES: u32 = 16;

/// Panels as triangles.
pub struct Painting {
    /// Primitives to draw, the backmost first.
    pub primitives: Vec<ClippedPrimitive>,
    /// Changes of the panels' own textures.
    pub textures: TexturesDelta,
    /// Pixels of the window for each unit of the primitives' coordinates.
    pub pixels_per_point: f32,
    /// Background colour, linear Rec.709.
    pub background: [f32; 3],
}

/// Whether a frame reached the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The frame was shown.
    Yes,
    /// The window has no area, is hidden, or changes its size: paint again later.
    NotNow,
}

/// What becomes of a frame that was submitted.
pub enum Verdict {
    /// It is presented.
    Present,
    /// These commands compute the picture again, and the frame is drawn with them.
    Again(Box<Recorder>),
    /// It is not presented.
    Discard,
}

/// Called with each submission that computes a picture, before it is presented.
pub type Check<'a> = &'a mut dyn FnMut(&InFlight) -> Result<Verdict>;

/// The pictures and panels of a window, and the objects that draw them.
pub struct WindowPainter {
    context: Arc<Context>,
    /// `None` only during drop.
    panels: Option<Renderer<DefaultAllocator>>,
    pictures: Vec<BoundTexture>,
    set_layout: vk::DescriptorSetLayout,
    set_pool: vk::DescriptorPool,
    sampler: vk::Sampler,
    frames: Frames,
    swapchain: Option<Swapchain>,
    is_out_of_date: bool,
    /// Format of the surface, or of the last surface if there is none.
    format: vk::SurfaceFormatKHR,
    size: [u32; 2],
    vsync: bool,
    presented: u64,
    /// The last field, because all others need it. `None` between two surfaces.
    surface: Option<Surface>,
}

/// A picture with the texture by which panels draw it.
struct BoundTexture {
    picture: Picture,
    texture: egui::TextureId,
    set: vk::DescriptorSet,
}

impl WindowPainter {
    /// Prepares to draw to a surface of `size` pixels. With `vsync`, frames wait for the screen.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(surface: Surface, size: [u32; 2], vsync: bool) -> Result<Self> {
        let context = surface.context.clone();
        let format = swapchain::format(&surface)?;
        let panels = Renderer::with_default_allocator(
            context.instance(),
            context.physical_device(),
            context.device.clone(),
            mode(format.format),
            Options { in_flight_frames: FRAMES, srgb_framebuffer: true, ..Options::default() },
        )
        .map_err(panel_error)?;
        let set_layout = create_vulkan_descriptor_set_layout(&context.device).map_err(panel_error)?;
        let sizes = [vk::DescriptorPoolSize {
            ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            descriptor_count: MAX_PICTURES,
        }];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(MAX_PICTURES).pool_sizes(&sizes);
        let set_pool =
            // SAFETY: the device and every object in the description are alive.
            unsafe { context.device.create_descriptor_pool(&info, None) }.vk("vkCreateDescriptorPool")?;
        context.set_name(set_layout, "picture");
        context.set_name(set_pool, "pictures");
        // Nearest filtering: pixels are shown as they are.
        let info = vk::SamplerCreateInfo::default()
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
        // SAFETY: the device and every object in the description are alive.
        let sampler = unsafe { context.device.create_sampler(&info, None) }.vk("vkCreateSampler")?;
        context.set_name(sampler, "pixels as they are");
        Ok(Self {
            frames: Frames::new(&context)?,
            context,
            panels: Some(panels),
            pictures: Vec::new(),
            set_layout,
            set_pool,
            sampler,
            swapchain: None,
            is_out_of_date: true,
            format,
            size,
            vsync,
            presented: 0,
            surface: Some(surface),
        })
    }

    /// Sets the size of the window, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.is_out_of_date |= self.size != size;
        self.size = size;
    }

    /// Sets whether frames wait for the screen.
    pub fn set_vsync(&mut self, vsync: bool) {
        self.is_out_of_date |= self.vsync != vsync;
        self.vsync = vsync;
    }

    /// Adds a picture of `size` pixels. Its content is undefined before [`Self::show`].
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn add_picture(&mut self, size: [u32; 2]) -> Result<PictureId> {
        let picture = Picture::new(&self.context, size)?;
        let (device, layout, pool) = (&self.context.device, self.set_layout, self.set_pool);
        let set = create_vulkan_descriptor_set(device, layout, pool, picture.image.view, self.sampler)
            .map_err(panel_error)?;
        let texture = self.panels().add_user_texture(set);
        self.pictures.push(BoundTexture { picture, texture, set });
        Ok(PictureId(self.pictures.len() - 1))
    }

    /// Sets the size of a picture; its texture stays. The content is
    /// undefined before [`Self::show`].
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn resize_picture(&mut self, id: PictureId, size: [u32; 2]) -> Result<()> {
        if self.picture_size(id) == size {
            return Ok(());
        }
        let picture = Picture::new(&self.context, size)?;
        // Frames in flight use the set and the image.
        self.context.wait_idle()?;
        let hung = &mut self.pictures[id.0];
        let image = [vk::DescriptorImageInfo {
            sampler: self.sampler,
            image_view: picture.image.view,
            image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(hung.set)
            .dst_binding(0)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .image_info(&image)];
        // SAFETY: no submission uses the set, and what it shall name is alive.
        unsafe { self.context.device.update_descriptor_sets(&write, &[]) };
        hung.picture = picture;
        Ok(())
    }

    /// Number of frames presented so far.
    pub fn presented(&self) -> u64 {
        self.presented
    }

    /// The texture by which panels draw a picture.
    pub fn texture(&self, id: PictureId) -> egui::TextureId {
        self.pictures[id.0].texture
    }

    /// The size of a picture, pixels.
    pub fn picture_size(&self, id: PictureId) -> [u32; 2] {
        self.pictures[id.0].picture.size
    }

    /// Sets the content of a picture from the next frame on: sRGB codes R, G, B, A in a buffer, row
    /// by row from the top. Panics if their number is not that of the picture's pixels.
    pub fn show(&mut self, id: PictureId, pixels: &Buffer) {
        let picture = &mut self.pictures[id.0].picture;
        let [width, height] = picture.size.map(u64::from);
        assert_eq!(pixels.bytes(), 4 * width * height, "bytes of a picture of {width}x{height} pixels");
        picture.next = Some(pixels.alias());
    }

    /// Draws a frame, in one submission with the commands that compute its picture, and presents
    /// it once `check` agrees. Does not wait for the device, except for the frame before the
    /// last. Commands are submitted even if there is no image to draw to.
    ///
    /// # Errors
    /// The device or `check` failed.
    pub fn paint(
        &mut self,
        mut painting: Painting,
        window: &dyn WindowHandles,
        commands: Option<Recorder>,
        check: Check<'_>,
    ) -> Result<Shown> {
        for texture in self.frames.begin()? {
            self.panels().free_texture(texture).map_err(panel_error)?;
        }
        self.update_textures(&mut painting.textures)?;
        let shown = match (self.acquire(window)?, commands) {
            (Some(index), commands) => self.draw(index, &painting, commands, check)?,
            (None, Some(commands)) => {
                self.run(commands, check)?;
                Shown::NotNow
            }
            (None, None) => Shown::NotNow,
        };
        self.frames.free_later(painting.textures.free.drain());
        Ok(shown)
    }

    /// Submits the commands of a picture by themselves.
    ///
    /// # Errors
    /// The device or `check` failed.
    pub fn run(&mut self, mut commands: Recorder, check: Check<'_>) -> Result<()> {
        loop {
            match check(&commands.submit()?)? {
                Verdict::Present => return Ok(()),
                Verdict::Again(again) => commands = *again,
                Verdict::Discard => {
                    self.pictures.iter_mut().for_each(|bound| bound.picture.next = None);
                    return Ok(());
                }
            }
        }
    }

    /// Acquires an image of the swapchain. `None` if there is none now.
    fn acquire(&mut self, window: &dyn WindowHandles) -> Result<Option<u32>> {
        // A swapchain may go out of date during its creation.
        for _ in 0..3 {
            if self.is_out_of_date && !self.renew_swapchain(window)? {
                return Ok(None);
            }
            let Some(swapchain) = &self.swapchain else { return Ok(None) };
            match self.frames.acquire(swapchain)? {
                Answer::Granted(index, fits) => {
                    self.is_out_of_date |= !fits;
                    return Ok(Some(index));
                }
                Answer::Busy => return Ok(None),
                Answer::OutOfDate => self.is_out_of_date = true,
                Answer::SurfaceLost => self.lose_surface()?,
            }
        }
        Ok(None)
    }

    fn draw(
        &mut self,
        index: u32,
        painting: &Painting,
        commands: Option<Recorder>,
        check: Check<'_>,
    ) -> Result<Shown> {
        let Self { context, frames, pictures, panels, swapchain, .. } = self;
        let panels = panels.as_mut().expect("taken only in drop");
        let swapchain = swapchain.as_ref().expect("it has lent an image");
        let [r, g, b] = painting.background;
        let mut drawing = Drawing { swapchain, index, background: [r, g, b, 1.0], is_again: false };
        let (computes, mut next) = (commands.is_some(), commands);
        let is_valid = loop {
            let recorder = next.take().map_or_else(|| context.record(true, |_| ()), Ok)?;
            let shown = pictures.iter().map(|bound| &bound.picture);
            let in_flight = frames.draw(recorder, &drawing, shown, |commands| {
                panels
                    .cmd_draw(commands, swapchain.extent, painting.pixels_per_point, &painting.primitives)
                    .map_err(panel_error)
            })?;
            match if computes { check(&in_flight)? } else { Verdict::Present } {
                Verdict::Present => break true,
                Verdict::Again(recorder) => (next, drawing.is_again) = (Some(*recorder), true),
                Verdict::Discard => break false,
            }
        };
        pictures.iter_mut().for_each(|bound| bound.picture.next = None);
        if !is_valid {
            // A new swapchain takes the image back.
            self.is_out_of_date = true;
            return Ok(Shown::NotNow);
        }
        self.presented += 1;
        match frames.present(swapchain, index)? {
            Answer::Granted((), fits) => {
                self.is_out_of_date |= !fits;
                return Ok(Shown::Yes);
            }
            Answer::OutOfDate | Answer::Busy => self.is_out_of_date = true,
            Answer::SurfaceLost => self.lose_surface()?,
        }
        Ok(Shown::NotNow)
    }

    /// Creates the swapchain anew. Returns false if the window has no area, or if the surface
    /// was lost again.
    fn renew_swapchain(&mut self, window: &dyn WindowHandles) -> Result<bool> {
        self.context.wait_idle()?;
        if self.surface.is_none() && !self.renew_surface(window)? {
            return Ok(false);
        }
        let old = self.swapchain.take();
        let surface = self.surface.as_ref().expect("it was renewed");
        match Swapchain::new(surface, self.format, self.size, self.vsync, old) {
            Ok(swapchain) => self.swapchain = swapchain,
            Err(error) if is_lost(&error) => {
                self.lose_surface()?;
                return Ok(false);
            }
            Err(error) => return Err(error),
        }
        self.is_out_of_date = self.swapchain.is_none();
        Ok(self.swapchain.is_some())
    }

    /// Drops a lost surface. A window has one surface at a time, so the next one is created after
    /// this one is gone.
    fn lose_surface(&mut self) -> Result<()> {
        self.context.wait_idle()?;
        self.swapchain = None;
        self.surface = None;
        self.is_out_of_date = true;
        Ok(())
    }

    /// Creates another surface, which may be on another screen. Returns false if it was
    /// lost at once.
    fn renew_surface(&mut self, window: &dyn WindowHandles) -> Result<bool> {
        let raw = RawSurface::new(self.context.vulkan_instance().clone(), window)?;
        let surface = Surface::new(raw, &self.context);
        let format = match swapchain::format(&surface) {
            Err(error) if is_lost(&error) => return Ok(false),
            format => format?,
        };
        if swapchain::drawn_format(format.format) != swapchain::drawn_format(self.format.format) {
            self.panels().set_render_mode(mode(format.format)).map_err(panel_error)?;
        }
        (self.surface, self.format) = (Some(surface), format);
        Ok(true)
    }

    /// Applies changes of the panels' textures. They are rare, and wait for the device.
    fn update_textures(&mut self, changes: &mut TexturesDelta) -> Result<()> {
        if changes.set.is_empty() {
            return Ok(());
        }
        // The upload overwrites what frames in flight may read.
        self.context.wait_idle()?;
        let panels = self.panels.as_mut().expect("taken only in drop");
        let (pool, context) = (self.frames.pool, &self.context);
        context.with_queue(|queue| {
            for (id, changes) in changes.set.drain() {
                for change in changes {
                    panels.set_texture(queue, pool, id, &change).map_err(panel_error)?;
                    context.count_commands(|counts| counts.submissions += 1);
                }
            }
            Ok(())
        })
    }

    fn panels(&mut self) -> &mut Renderer<DefaultAllocator> {
        self.panels.as_mut().expect("taken only in drop")
    }
}

impl Drop for WindowPainter {
    fn drop(&mut self) {
        let _ = self.context.wait_idle();
        drop(self.panels.take());
        self.pictures.clear();
        self.swapchain = None;
        // SAFETY: it is ours, made by this device, and no submission uses it any more.
        unsafe {
            self.context.device.destroy_sampler(self.sampler, None);
            self.context.device.destroy_descriptor_pool(self.set_pool, None);
            self.context.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The mode of drawing to a surface of this format.
fn mode(format: vk::Format) -> RenderMode {
    RenderMode::DynamicRendering(DynamicRendering {
        color_attachment_format: swapchain::drawn_format(format),
        depth_attachment_format: None,
        stencil_attachment_format: None,
    })
}

fn is_lost(error: &Error) -> bool {
    matches!(error, Error::Vulkan { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. })
}

fn panel_error(error: RendererError) -> Error {
    match error {
        RendererError::Vulkan(result) => Error::Vulkan { call: "drawing of panels", result, pass: None },
        other => Error::Usage(format!("the panels cannot be drawn: {other}")),
    }
}
