//! The reference of a sweep: a path-traced picture in two halves, cached on disk.

use std::path::Path;
use std::sync::Arc;

use super::cache::{self, Kept};
use super::results::{Judge, ReferenceFacts};
use crate::app::args::DeviceArgs;
use crate::app::picture::refuse_non_finite;
use crate::app::render::sampled::{Budget, spend};
use crate::error::Result;
use crate::gpu::Context;
use crate::metrics;
use crate::reference::{PathTracer, Progressive};
use crate::scene::{DisplayTransform, Scene};

/// A reference with its derived pictures.
pub(super) struct Reference {
    size: [u32; 2],
    pub(super) facts: ReferenceFacts,
    flip: metrics::Flip,
    halves: [Vec<[f32; 3]>; 2],
    mean: Vec<[f32; 3]>,
    /// The picture that errors are relative to, once set.
    scale: Option<Vec<[f32; 3]>>,
    indirect: Vec<[f32; 3]>,
}

impl Reference {
    /// Reads the reference for this scene and budget from `folder`, or renders
    /// and caches it.
    pub(super) fn find(
        scene: &Scene,
        budget: Budget,
        folder: &Path,
        (context, device_args): (&Arc<Context>, &DeviceArgs),
    ) -> Result<Self> {
        let size = scene.cameras[0].size;
        let file = folder.join(cache::file_name(scene, &format!("{budget:?}")));
        match cache::read(&file, size) {
            Ok(Some(kept)) => {
                device_args.say(&format!("reference: {} samples a pixel from the cache", kept.spp));
                return Ok(Self::new(size, kept, true));
            }
            Ok(None) => {}
            Err(reason) => {
                device_args.warn(&format!("the reference {} {reason}; it is made anew", file.display()));
            }
        }
        let kept = render(scene, budget, context, device_args)?;
        // A cache that cannot be written costs time, not results.
        if let Err(error) = cache::write(&file, size, &kept) {
            device_args.warn(&format!("the reference is not kept: {error}"));
        }
        let reference = Self::new(size, kept, false);
        let ReferenceFacts { spp, seconds, noise_relmse, .. } = reference.facts;
        device_args.say(&format!(
            "reference: {spp} samples a pixel in {seconds:.1} s, noise {noise_relmse:.1e} relMSE"
        ));
        Ok(reference)
    }

    fn new(size: [u32; 2], kept: Kept, from_cache: bool) -> Self {
        let Kept { spp, seconds, images: [a, b, _, indirect] } = kept;
        let mean: Vec<[f32; 3]> =
            a.iter().zip(&b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        let shown = crate::app::compare::displayed(&mean, &DisplayTransform::default());
        let flip = metrics::Flip::new(&shown, size, metrics::PIXELS_PER_DEGREE);
        let noise_relmse = metrics::half_noise([&a, &b]);
        let facts = ReferenceFacts { method: "path tracing", spp, seconds, noise_relmse, from_cache };
        Self { size, facts, flip, halves: [a, b], mean, scale: None, indirect }
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The mean of the halves.
    pub(super) fn picture(&self) -> &[[f32; 3]] {
        &self.mean
    }

    /// Sets the picture that errors are relative to. It is close to the reference, but free
    /// of its noise.
    pub(super) fn set_scale(&mut self, picture: Vec<[f32; 3]>) {
        self.scale = Some(picture);
    }

    pub(super) fn judge(&self) -> Judge<'_> {
        Judge {
            flip: &self.flip,
            halves: [&self.halves[0], &self.halves[1]],
            mean: &self.mean,
            scale: self.scale.as_deref(),
            indirect: &self.indirect,
        }
    }
}

fn render(scene: &Scene, budget: Budget, context: &Arc<Context>, device_args: &DeviceArgs) -> Result<Kept> {
    device_args.say("reference: path tracing");
    let mut progress = device_args.progress();
    let mut tracer = PathTracer::new(context, scene.clone(), progress.as_mut())?;
    let seconds = spend(&mut tracer, budget, progress.as_mut())?;
    progress.finish();
    // Halves of equal size, so that their mean is the mean of all samples.
    if tracer.samples() % 2 == 1 {
        tracer.add_samples(1)?;
    }
    let picture = tracer.picture()?;
    let [a, b] = tracer.halves()?;
    device_args.report_validation(context);
    for image in [&a, &b, &picture.direct, &picture.indirect] {
        refuse_non_finite(picture.size, image)?;
    }
    Ok(Kept { spp: tracer.samples(), seconds, images: [a, b, picture.direct, picture.indirect] })
}
