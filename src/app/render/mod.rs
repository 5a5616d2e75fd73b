//! `lightpaths render`: renders one image without a window.

mod lightpaths;
mod path_judge;
pub(super) mod sampled;
mod target;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::args::{CacheArgs, DeviceArgs, SceneArgs};
use super::exposure::Exposure;
use super::numbers::{parse_positive, parse_seconds, whole};
use super::output::OutputFile;
use super::{capture, overlap, picture};
use crate::error::{Error, Result};
use crate::image::ExrLayer;
use crate::reference::{PathTracer, PhotonMapper};

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
    /// Further layers of an EXR: direct, indirect, albedo, normal, depth; for the method path also
    /// variance (of the mean); for lightpaths also error (relative, 1 is 100 %, judged by paths)
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', help_heading = "Output")]
    aov: Vec<Aov>,
    /// Brightens a PNG by this many stops; auto: its mean becomes middle grey [default: 0; for a
    /// model alone: auto]
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true, value_parser = Exposure::parse, help_heading = "Output")]
    exposure: Option<Exposure>,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Aov {
    Direct,
    Indirect,
    Albedo,
    Normal,
    Depth,
    Variance,
    Error,
}

const RGB: &[&str] = &["R", "G", "B"];

/// A layer of the written image.
struct Layer {
    name: &'static str,
    channels: &'static [&'static str],
    pixels: Vec<[f32; 3]>,
}

/// The main layer, or the layer of an AOV.
fn layer(aov: Option<Aov>, pixels: Vec<[f32; 3]>) -> Layer {
    let (name, channels): (_, &[&str]) = match aov {
        None => ("", RGB),
        Some(Aov::Direct) => ("direct", RGB),
        Some(Aov::Indirect) => ("indirect", RGB),
        Some(Aov::Albedo) => ("albedo", RGB),
        Some(Aov::Normal) => ("normal", &["X", "Y", "Z"]),
        Some(Aov::Depth) => ("depth", &["Z"]),
        Some(Aov::Variance) => ("variance", RGB),
        Some(Aov::Error) => ("error", &["Y"]),
    };
    Layer { name, channels, pixels }
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

impl Method {
    fn name(self) -> String {
        self.to_possible_value().expect("no method is skipped").get_name().to_owned()
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
        // In the order of the file, without repetition.
        let aovs: Vec<Aov> =
            Aov::value_variants().iter().copied().filter(|aov| self.aov.contains(aov)).collect();
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
        if format == Format::Png {
            let pixels = &rendered.layers[0].pixels;
            let exposure = self.exposure.unwrap_or_else(|| Exposure::of_scene(&self.scene));
            let (stops, said) = exposure.stops(pixels);
            said.iter().for_each(|line| self.device_args.say(line));
            rendered.display = picture::tone_mapped(&context, pixels, stops)?;
        }
        self.device_args.report_validation(&context);
        Ok(rendered)
    }

    /// Refuses contradictory arguments before any file is read or written.
    fn check_combinations(&self, format: Format) -> Result<()> {
        let refuse = |message: String| Err(Error::Usage(message));
        for (given, flag) in [(self.spp.is_some(), "--spp"), (self.seconds.is_some(), "--seconds")] {
            if given && !matches!(self.method, Method::Path | Method::Photon) && !self.judges() {
                let method = self.method.name();
                return refuse(format!(
                    "{flag} is for --method path or photon, --aov error and --target-error; --method {method} takes no samples"
                ));
            }
        }
        for (given, flag) in [
            (self.aov.contains(&Aov::Error), "--aov error"),
            (self.target_error.is_some(), "--target-error"),
            (self.target_ms.is_some(), "--target-ms"),
        ] {
            if given && self.method != Method::Lightpaths {
                return refuse(format!("{flag} is for --method lightpaths"));
            }
        }
        if self.judges() && self.spp.is_some_and(|spp| spp < 4) {
            return refuse("an error needs at least --spp 4".to_owned());
        }
        for (given, flag) in [(self.exact.is_some(), "--exact"), (self.capture.is_some(), "--capture")] {
            if given && (self.target_error.is_some() || self.target_ms.is_some()) {
                return refuse(format!(
                    "{flag} is for one setting; first have --target-error or --target-ms find it"
                ));
            }
        }
        if self.exact.is_some() && self.method != Method::Lightpaths {
            let method = self.method.name();
            return refuse(format!(
                "--exact is for --method lightpaths; --method {method} has no such stage"
            ));
        }
        if self.no_skip && matches!(self.method, Method::Path | Method::Photon) {
            let method = self.method.name();
            return refuse(format!(
                "--no-skip is for --method lightpaths and direct; --method {method} skips nothing"
            ));
        }
        if self.capture.is_some() && matches!(self.method, Method::Path | Method::Photon) {
            let method = self.method.name();
            return refuse(format!(
                "--capture is for --method lightpaths and direct; --method {method} has no single frame"
            ));
        }
        if self.cache_args.path().is_some() && self.method != Method::Lightpaths {
            let method = self.method.name();
            return refuse(format!(
                "--cache is for --method lightpaths; --method {method} traces none that could be kept"
            ));
        }
        if self.exact.is_some() && format == Format::Png {
            return refuse("--exact needs an .exr output".to_owned());
        }
        if format == Format::Png && !self.aov.is_empty() {
            return refuse("--aov needs an .exr output; a PNG has no layers".to_owned());
        }
        if format == Format::Exr && self.exposure.is_some() {
            return refuse("--exposure is for .png outputs; an EXR holds radiance as it is".to_owned());
        }
        if self.method == Method::Direct && self.aov.contains(&Aov::Indirect) {
            return refuse("--aov indirect needs --method lightpaths, path or photon".to_owned());
        }
        if self.aov.contains(&Aov::Variance) {
            if self.method != Method::Path {
                return refuse("--aov variance needs --method path".to_owned());
            }
            if self.spp.is_some_and(|spp| spp < 4) {
                return refuse("--aov variance needs at least --spp 4".to_owned());
            }
        }
        overlap::refuse_repeated(self.outputs().chain(self.cache_args.path()))
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
            .map(|layer| ExrLayer { name: layer.name, channels: layer.channels, pixels: &layer.pixels })
            .collect();
        picture::write_exr(output, rendered.size, &layers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        render: Render,
    }

    fn refusal(arguments: &str) -> Option<String> {
        let line = Line::try_parse_from(format!("render {arguments}").split_whitespace()).unwrap();
        let format = Format::from_path(&line.render.output).unwrap();
        line.render.check_combinations(format).err().map(|error| error.to_string())
    }

    #[test]
    fn contradictions_are_refused_and_name_the_argument() {
        for (arguments, word) in [
            ("-o a.png --spp 4", "--spp"),
            ("-o a.png --seconds 2", "--seconds"),
            ("-o a.png --method direct --spp 4", "--spp"),
            ("-o a.exr --exact splat --method path", "--exact"),
            ("-o a.exr --exact gather --method direct", "--exact"),
            ("-o a.exr --no-skip --method path", "--no-skip"),
            ("-o a.png --capture c --method photon", "--capture"),
            ("-o a.exr --cache c --method direct", "--cache"),
            ("-o a.exr --cache c --method path", "--cache"),
            ("-o a.png --exact clusters", ".exr"),
            ("-o a.exr --exact clusters --spp 4", "--spp"),
            ("-o a.exr --aov variance", "--method path"),
            ("-o a.exr --method photon --aov variance", "--method path"),
            ("-o a.exr --method path --spp 3 --aov variance", "--spp 4"),
            ("-o a.png --aov depth", "--aov"),
            ("-o a.png --aov error", "--aov"),
            ("-o a.exr --method path --aov error", "--aov error"),
            ("-o a.exr --method direct --target-error 1e-3", "--target-error"),
            ("-o a.exr --method photon --target-ms 9", "--target-ms"),
            ("-o a.exr --target-error 1e-3 --spp 3", "--spp 4"),
            ("-o a.exr --target-error 1e-3 --exact splat", "--exact"),
            ("-o a.png --target-ms 5 --capture c", "--capture"),
            ("-o a.exr --target-ms 5 --spp 64", "--spp"),
            ("-o a.exr --exposure 1", "--exposure"),
            ("-o a.exr --method direct --aov direct,indirect", "indirect"),
            ("-o a.exr --stats a.exr", "two outputs"),
        ] {
            assert!(refusal(arguments).is_some_and(|line| line.contains(word)), "{arguments}");
        }
        for arguments in [
            "-o a.PNG --exposure -1.5",
            "-o a.exr --exact gather --aov indirect",
            "-o a.exr --exact gather --aov error --spp 16 --seconds 3",
            "-o a.png --target-error 1e-3 --target-ms 20 --spp 64 --cache c",
            "room -o a.exr --aov direct,indirect,albedo,normal,depth",
            "-o a.exr --method path --spp 4 --seconds 2 --aov variance",
            "-o a.exr --method photon --spp 1 --seconds 2 --aov direct,indirect,albedo,normal,depth",
        ] {
            assert_eq!(refusal(arguments), None, "{arguments}");
        }
    }

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
