//! `lightpaths film`: renders an animation frame by frame.

mod frame_range;
mod video;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};

use super::args::{CacheArgs, DeviceArgs, SceneArgs, device_label};
use super::display_args::DisplayArgs;
use super::exposure::parse_fixed;
use super::output::{OutputFile, create_folder};
use super::{overlap, picture};
use crate::error::{Error, Result};
use crate::image::ExrLayer;
use crate::renderer::{Kept, Layer, Renderer, Silent};
use crate::scene::{Scene, film};
use frame_range::FrameRange;
use video::Video;

/// Render a film: a scene that changes in time, as numbered frames and, with ffmpeg, a video
///
/// Frames are DIR/frame-00000.png and so on; existing files are replaced. A frame is the same
/// to the bit whichever frames are rendered with it, so several machines can render one film
/// into one folder.
#[derive(Debug, Args)]
pub(super) struct Film {
    /// A .toml film file (docs/films.md), or a built-in film
    #[arg(default_value = "box")]
    film: String,
    /// Folder for the frames; created if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Renders frames A, A+1, …, B-1 only; also A.., ..B and a single number [default: all]
    #[arg(long, value_name = "A..B", value_parser = frame_range::parse)]
    frames: Option<FrameRange>,
    /// Format of the frames: png is exposed and tone mapped, exr holds linear radiance
    #[arg(long, value_enum, default_value = "png")]
    format: Format,
    /// What ffmpeg makes of a whole film's PNG frames [default: mp4]
    #[arg(long, value_enum)]
    video: Option<Video>,
    /// Brightens PNG frames by this many stops [default: 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_fixed)]
    exposure: Option<f32>,
    #[command(flatten)]
    display_args: DisplayArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Kept light paths")]
    cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Png,
    Exr,
}

impl Film {
    pub(super) fn run(self) -> Result<()> {
        if self.format == Format::Exr && self.exposure.is_some() {
            let message = "--exposure is for --format png; an EXR holds radiance as it is";
            return Err(Error::Usage(message.to_owned()));
        }
        if let (Format::Exr, Some(flag)) = (self.format, self.display_args.given()) {
            return Err(Error::Usage(format!("{flag} is for --format png; an EXR holds radiance as it is")));
        }
        if self.format == Format::Exr && self.video.is_some_and(|video| video != Video::None) {
            let message = "--video needs --format png; an EXR is not ready to be looked at";
            return Err(Error::Usage(message.to_owned()));
        }
        let options = self.scene_args.options();
        let (mut film, mut scene) = film::Film::load(&self.film, &options)?;
        // Light paths of every place of a model would push all others out of the folder.
        let store = self.cache_args.store()?.filter(|_| !film.moves_models());
        let camera_stands = film.camera_stands();
        let range = self.frames.unwrap_or_default().of(film.frame_count)?;
        self.refuse_inputs(&film, &scene, &range)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let context = self.device_args.open()?;
        create_folder(&self.output)?;
        OutputFile::check(&self.frame_path(range.start, &film))?;

        let stops = self.exposure.or(scene.picture.exposure).unwrap_or(0.0);
        let transform = self.display_args.transform(stops, &scene.picture);
        // Earlier frames may have opened enclosures, which then stay open until a model moves.
        let first = film.first_with_models_of(range.start);
        if film.moves_models() {
            (film, scene) = film::Film::load_at(&self.film, &options, first)?;
        }
        let mut kept = Kept::default();
        let mut renderer = match film.moves_models() {
            true => self.device_args.renderer_keeping(&context, scene, &mut kept)?,
            false => self.device_args.renderer_from(store.as_ref(), &context, scene)?,
        };
        renderer.set_display_transform(transform);
        renderer.set_serialised(false);
        let start = Instant::now();
        let (mut times_ms, mut precompute_s) = (Vec::new(), renderer.precompute_s());
        let mut progress = self.device_args.progress();
        progress.stage("frames", u64::from(range.end - range.start));
        for frame in first..range.end {
            if frame > first && film.first_with_models_of(frame) == frame {
                let scene;
                (film, scene) = film::Film::load_at(&self.film, &options, frame)?;
                // Two renderers may not fit the device.
                drop(renderer);
                renderer = Renderer::new_keeping(&context, scene, &mut kept, &mut Silent)?;
                renderer.set_display_transform(transform);
                renderer.set_serialised(false);
                precompute_s += renderer.precompute_s();
            }
            renderer.set_state(&film.state(frame))?;
            renderer.open_enclosures(&mut Silent)?;
            if frame < range.start {
                continue;
            }
            let mut frame_ms = renderer.frame()?.frame_ms;
            // In a moving view, each frame would have to trace its own.
            if camera_stands && renderer.refine()? > 0 {
                frame_ms += renderer.frame()?.frame_ms;
            }
            times_ms.push(frame_ms);
            self.write(&renderer, &self.frame_path(frame, &film))?;
            progress.advance(u64::from(frame + 1 - range.start));
        }
        progress.finish();
        self.device_args.report_validation(&context);
        let [width, height] = renderer.size();
        super::print_line(&format!(
            "{}: frames {} to {} of {}, {width}x{height}, precompute {:.2} s, {}, {:.2} s with writing, {}",
            self.output.display(),
            range.start,
            range.end - 1,
            film.frame_count,
            precompute_s,
            summary(times_ms),
            start.elapsed().as_secs_f64(),
            device_label(&context),
        ))?;
        self.make_video(&film, range.len() == film.frame_count as usize)
    }

    /// Refuses frames and a video that would replace an input.
    fn refuse_inputs(&self, film: &film::Film, scene: &Scene, range: &Range<u32>) -> Result<()> {
        let video = self.job(film).map(|job| job.file_name());
        let is_frame = |name: &str| {
            let number = name.split(['-', '.']).nth(1).and_then(|number| number.parse().ok());
            number.is_some_and(|frame| range.contains(&frame) && self.frame_name(frame, film) == name)
        };
        let is_written = |name: &str| is_frame(name) || video.as_deref() == Some(name);
        let inputs = scene.inputs.iter().map(PathBuf::as_path).chain(self.cache_args.path());
        overlap::refuse_in_folder(&self.output, is_written, &inputs.collect::<Vec<_>>())
    }

    fn frame_name(&self, frame: u32, film: &film::Film) -> String {
        let extension = if self.format == Format::Png { "png" } else { "exr" };
        let digits = video::digits(film.frame_count);
        format!("frame-{frame:0digits$}.{extension}")
    }

    fn frame_path(&self, frame: u32, film: &film::Film) -> PathBuf {
        self.output.join(self.frame_name(frame, film))
    }

    fn write(&self, renderer: &Renderer, path: &Path) -> Result<()> {
        let (size, output) = (renderer.size(), OutputFile::check(path)?);
        let pixels = renderer.layer(Layer::Beauty)?;
        match self.format {
            Format::Png => picture::write_png(&output, size, &pixels, &renderer.display()?),
            Format::Exr => {
                let layer = ExrLayer { name: "", channels: &["R", "G", "B"], pixels: &pixels };
                picture::write_exr(&output, size, &[layer], &[])
            }
        }
    }

    /// The video to encode. `None` if only frames are wanted.
    fn job<'a>(&'a self, film: &'a film::Film) -> Option<video::Job<'a>> {
        let video = self.video.unwrap_or(Video::Mp4);
        let is_wanted = video != Video::None && self.format == Format::Png;
        is_wanted.then_some(video::Job { folder: &self.output, film, video })
    }

    /// Encodes the video of a complete film. If the user did not request a video, a failure is
    /// only a warning.
    fn make_video(&self, film: &film::Film, is_whole: bool) -> Result<()> {
        let Some(job) = self.job(film) else { return Ok(()) };
        if !is_whole {
            self.device_args.say(&format!("for a video, once all frames are there: {}", job.typed()));
            return Ok(());
        }
        match job.encode() {
            Ok(Some(path)) => super::print_line(&format!("{}", path.display())),
            Ok(None) => {
                let typed = job.typed();
                self.device_args.say(&format!("no video, ffmpeg is not installed; once it is: {typed}"));
                Ok(())
            }
            Err(error) if self.video.is_none() => {
                self.device_args.warn(&format!("no video: {error}"));
                Ok(())
            }
            Err(error) => Err(error),
        }
    }
}

/// Summary of frame times for a reader; needs at least one time.
fn summary(mut times_ms: Vec<f64>) -> String {
    times_ms.sort_by(f64::total_cmp);
    let quantile = |fraction: f64| times_ms[(fraction * (times_ms.len() - 1) as f64).round() as usize];
    format!(
        "frame {:.1} ms in the median, nine in ten within {:.1} ms, longest {:.1} ms",
        quantile(0.5),
        quantile(0.9),
        quantile(1.0)
    )
}
