//! `lightpaths render`: renders one image without a window.

mod combinations;
pub(super) mod layers;
mod lightpaths;
mod path_judge;
pub(super) mod sampled;
mod target;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::args::{CacheArgs, DeviceArgs, SceneArgs};
use super::display_args::DisplayArgs;
use super::exposure::Exposure;
use super::false_colours::{self, Quantity, Scale};
use super::numbers::{parse_positive, parse_seconds, whole};
use super::output::OutputFile;
use super::{capture, overlap, picture};
use crate::error::{Error, Result};
use crate::image::ExrLayer;
use crate::reference::{PathTracer, PhotonMapper};
use layers::{Aov, Layer, layer};

/// Render one image
///
/// PNG files are sRGB, exposed and tone mapped: exact up to 0.8, highlights roll off above. EXR
/// files hold linear radiance (W/m²/sr) in 32-bit floats, Rec.709.
#[derive(Debug, Args)]
pub(super) struct Render {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// The image to write: .exr or .png
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: PathBuf,
    /// lightpaths: direct and indirect light; direct: direct light only; path: path tracing, the
    /// reference; photon: photon mapping with final gathering
    #[arg(long, value_enum, default_value = "lightpaths", help_heading = "Method")]
    method: Method,
    /// Replaces one stage of the method lightpaths by its reference, to find the stage that errs
    /// (slow). splat: gathers at every pixel; clusters: path traces the radiance at gather hits;
    /// gather: also traces many more gather rays
    #[arg(long, value_name = "STAGE", value_enum, help_heading = "Method")]
    exact: Option<ExactStage>,
    /// Samples of each pixel, for the methods path and photon [default: 64, or what --seconds
    /// allows], and for the paths that judge the error [default: as many as it needs]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=u32::MAX, "64"), help_heading = "Method")]
    spp: Option<u32>,
    /// Ends the same samples after this time; with --spp, at whichever comes first
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = parse_seconds, help_heading = "Method")]
    seconds: Option<f32>,
    /// Chooses the settings: the coarsest whose relMSE is at most X. A few paths a pixel judge it
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = parse_positive, help_heading = "Method")]
    target_error: Option<f64>,
    /// Chooses the settings: the finest whose frame takes at most Y ms after a light has moved;
    /// with --target-error, a limit to those
    #[arg(long, value_name = "Y", allow_negative_numbers = true, value_parser = parse_positive, help_heading = "Method")]
    target_ms: Option<f64>,
    /// Further layers of an EXR: direct, indirect, albedo, normal, position, depth, alpha (fraction
    /// covered by surface), cryptomatte (mattes of objects and materials); for the method
    /// path also variance (of the mean); for lightpaths also irradiance (W/m²), lights (direct and
    /// indirect light of each, which add up to the picture) and error (relative, 1 is 100 %, judged
    /// by paths); all: the layers that cost no paths
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', help_heading = "Output")]
    aov: Vec<Aov>,
    /// Brightens a PNG by this many stops; auto: its mean becomes middle grey [default: the scene
    /// file's, or 0; for a model alone: auto]
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true, value_parser = Exposure::parse, help_heading = "Output")]
    exposure: Option<Exposure>,
    #[command(flatten)]
    display_args: DisplayArgs,
    /// Makes a PNG of illuminance (lux) or luminance (nits) as colours
    #[arg(long, value_name = "QUANTITY", value_enum, help_heading = "Output")]
    false_color: Option<Quantity>,
    /// Range of the colours, as in 1:1000; linear if it begins at 0 [default: follows the picture]
    #[arg(long, value_name = "MIN:MAX", requires = "false_color", value_parser = Scale::parse, help_heading = "Output")]
    range: Option<Scale>,
    /// Does work that cannot change the picture, too: the picture is the same to the bit
    #[arg(long, help_heading = "Method")]
    no_skip: bool,
    /// Writes times, memory and counts as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    stats: Option<PathBuf>,
    /// Captures the frame with RenderDoc, under which the program must run. The value is the
    /// beginning of the file's name
    #[arg(long, value_name = "FILE_TEMPLATE", help_heading = "Profiling")]
    capture: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Kept light paths")]
    cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    Lightpaths,
    Direct,
    Path,
    Photon,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ExactStage {
    Splat,
    Clusters,
    Gather,
}

/// The result of a method.
struct Rendered {
    size: [u32; 2],
    /// Warnings of the precomputation.
    warnings: Vec<String>,
    /// Time of a frame after a light has moved, ms, if it was asked for.
    relit_ms: Option<f64>,
    /// All layers, the main one first.
    layers: Vec<Layer>,
    /// Texts of an EXR's header, by name.
    attributes: Vec<(String, String)>,
    /// sRGB codes R, G, B, 255 of a PNG; empty for an EXR.
    display: Vec<[u8; 4]>,
    /// Summary line for the user.
    line: String,
    /// The JSON document of `--stats`.
    document: serde_json::Value,
}

impl Rendered {
    /// Adds the layer `error`, and its mean to the summary and the document.
    fn add_error(&mut self, error: path_judge::StatedError) {
        self.line = format!("{} ({} samples a pixel), {}", error.words(), error.spp, self.line);
        self.document["error"] = serde_json::to_value(&error).expect("results are plain data");
        let pixels = error.map.iter().map(|&error| [error as f32; 3]).collect();
        self.layers.push(layer(Some(Aov::Error), pixels));
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

impl Format {
    fn from_path(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::output(path, "unknown image format; end the name in .exr or .png")),
        }
    }
}

impl Render {
    pub(super) fn run(self) -> Result<()> {
        let format = Format::from_path(&self.output)?;
        self.check_combinations(format)?;
        let output = OutputFile::check(&self.output)?;
        let stats = self.stats.as_deref().map(OutputFile::check).transpose()?;
        self.capture.as_deref().map_or(Ok(()), capture::check_template)?;

        let rendered = self.render(format)?;
        Self::write_image(&rendered, format, &output)?;
        if let Some(stats) = stats {
            let text = format!("{:#}\n", rendered.document);
            stats.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
        }
        let ([width, height], line) = (rendered.size, rendered.line);
        super::print_line(&format!("{}: {width}x{height}, {line}", output.path().display()))
    }

    fn render(&self, format: Format) -> Result<Rendered> {
        let scene = self.scene_args.load(&self.scene)?;
        overlap::refuse_inputs(self.outputs(), &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let store = self.cache_args.store()?;
        let context = self.device_args.open()?;
        let picture_keys = scene.picture;
        let aovs = self.aovs();
        let mut rendered = match self.method {
            Method::Path | Method::Photon => {
                let mut progress = self.device_args.progress();
                let progress = progress.as_mut();
                let budget = sampled::Budget { spp: self.spp, seconds: self.seconds };
                let method = self.method.name();
                if self.method == Method::Path {
                    let renderer = PathTracer::new(&context, scene, progress)?;
                    sampled::render(renderer, &method, budget, &aovs, progress)
                } else {
                    let renderer = PhotonMapper::new(&context, scene, progress)?;
                    sampled::render(renderer, &method, budget, &aovs, progress)
                }
            }
            Method::Lightpaths | Method::Direct => {
                let with_indirect = self.method == Method::Lightpaths;
                let wants_error = aovs.contains(&Aov::Error);
                let judged = wants_error.then(|| scene.clone());
                let job = lightpaths::Job {
                    with_indirect,
                    aovs: &aovs,
                    exact: self.exact,
                    no_skip: self.no_skip,
                    times_passes: self.stats.is_some() || self.capture.is_some(),
                    capture: self.capture.as_deref(),
                    store: store.as_ref(),
                    relit_frames: 0,
                };
                let budget = sampled::Budget { spp: self.spp, seconds: self.seconds };
                let target = target::Target { error: self.target_error, ms: self.target_ms };
                let rendered = match target {
                    target::Target { error: None, ms: None } => {
                        lightpaths::render(&context, scene, &job, &self.device_args)
                    }
                    _ => target::render(&context, &scene, &job, (target, budget), &self.device_args),
                };
                match judged {
                    Some(scene) => rendered.and_then(|mut rendered| {
                        let mut judge =
                            path_judge::PathJudge::new(&context, scene, budget, &self.device_args)?;
                        rendered.add_error(judge.judge(&rendered.layers[0].pixels, path_judge::Wanted::Map)?);
                        Ok(rendered)
                    }),
                    None => rendered,
                }
            }
        }?;
        rendered.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        if let Some(quantity) = self.false_color {
            let source = match quantity {
                Quantity::Nits => &rendered.layers[0],
                Quantity::Lux => &rendered.layers[1],
            };
            let values = false_colours::values(&source.pixels);
            let scale = self.range.unwrap_or_else(|| Scale::of(&values));
            self.device_args.say(&format!("false colours: {}", scale.words(quantity)));
            rendered.display = values.iter().map(|&value| scale.colour(value)).collect();
        } else if format == Format::Png {
            let pixels = &rendered.layers[0].pixels;
            let exposure = self.exposure.unwrap_or_else(|| Exposure::of_scene(&self.scene, &picture_keys));
            let (stops, said) = exposure.stops(pixels);
            said.iter().for_each(|line| self.device_args.say(line));
            let display = self.display_args.transform(stops, &picture_keys);
            rendered.display = picture::tone_mapped(&context, pixels, &display)?;
        }
        self.device_args.report_validation(&context);
        Ok(rendered)
    }

    /// Layers of the file.
    fn aovs(&self) -> Vec<Aov> {
        let of_lightpaths = matches!(self.method, Method::Lightpaths | Method::Direct);
        if self.false_color == Some(Quantity::Lux) {
            return vec![Aov::Irradiance];
        }
        Aov::in_order(&self.aov, of_lightpaths, self.method != Method::Direct)
    }

    /// Whether paths judge the error.
    fn judges(&self) -> bool {
        self.aov.contains(&Aov::Error) || self.target_error.is_some()
    }

    fn outputs(&self) -> impl Iterator<Item = &Path> {
        [Some(&*self.output), self.stats.as_deref()].into_iter().flatten()
    }

    fn write_image(rendered: &Rendered, format: Format, output: &OutputFile) -> Result<()> {
        if format == Format::Png {
            return picture::write_png(output, rendered.size, &rendered.layers[0].pixels, &rendered.display);
        }
        let layers: Vec<ExrLayer> = rendered
            .layers
            .iter()
            .map(|layer| ExrLayer { name: &layer.name, channels: layer.channels, pixels: &layer.pixels })
            .collect();
        picture::write_exr(output, rendered.size, &layers, &rendered.attributes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    /// Simulates a faulty method: one pixel of a layer is NaN.
    #[test]
    fn a_picture_that_is_not_finite_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        for (format, odd_layer) in [(Format::Png, 0), (Format::Exr, 0), (Format::Exr, 1)] {
            let path = folder.path().join("a");
            std::fs::write(&path, "old").unwrap();
            let output = OutputFile::check(&path).unwrap();
            let mut rendered = Rendered {
                size: [4, 3],
                warnings: Vec::new(),
                relit_ms: None,
                layers: vec![layer(None, vec![[1.0; 3]; 12]), layer(Some(Aov::Indirect), vec![[1.0; 3]; 12])],
                attributes: Vec::new(),
                display: vec![[255; 4]; 12],
                line: String::new(),
                document: serde_json::Value::Null,
            };
            rendered.layers[odd_layer].pixels[6][1] = f32::NAN;
            let error = Render::write_image(&rendered, format, &output).unwrap_err();
            assert_eq!(error.exit_code(), 4);
            let line = error.to_string();
            assert!(line.contains("1 pixel of the picture") && line.contains("(2, 1)"), "{line}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
            rendered.layers[odd_layer].pixels[6][1] = 1.0;
            Render::write_image(&rendered, format, &output).unwrap();
            assert_ne!(std::fs::read(&path).unwrap(), b"old");
        }
    }
}
