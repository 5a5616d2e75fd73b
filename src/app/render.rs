//! `lightpaths render`: one image, headless.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::args::{DeviceArgs, SceneArgs, device_label, parse_finite, refuse_same_output};
use super::output::OutputFile;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::image::{ExrLayer, write_exr, write_png};
use crate::renderer::{Edit, FrameReport, Layer, Renderer, Statistics};

/// Render one image
///
/// PNG files are sRGB, exposed and tone mapped: exact up to 0.8, highlights roll off above. EXR files hold linear
/// radiance (W/m²/sr) in 32-bit floats, Rec.709.
#[derive(Debug, Args)]
pub(super) struct Render {
    /// A .toml scene file, an .obj, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// The image to write: .exr or .png
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// lightpaths: direct and indirect light; direct: direct light only
    #[arg(long, value_enum, default_value = "lightpaths")]
    method: Method,
    /// Further layers of an EXR: direct, indirect, albedo, normal, depth
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Brightens a PNG by this many stops [default: 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_finite)]
    exposure: Option<f32>,
    /// Writes times, memory and counts as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    #[arg(long, hide = true)]
    spp: Option<u32>,
    #[arg(long, hide = true)]
    seconds: Option<f32>,
    #[command(flatten)]
    scene_args: SceneArgs,
    #[command(flatten)]
    device_args: DeviceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    Lightpaths,
    Direct,
    #[value(hide = true)]
    Path,
    #[value(hide = true)]
    Photon,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Aov {
    Direct,
    Indirect,
    Albedo,
    Normal,
    Depth,
}

impl Aov {
    /// Layer name in the file, channel names, and where the values come from.
    fn description(self) -> (&'static str, &'static [&'static str], Layer) {
        match self {
            Self::Direct => ("direct", RGB, Layer::Direct),
            Self::Indirect => ("indirect", RGB, Layer::Indirect),
            Self::Albedo => ("albedo", RGB, Layer::Albedo),
            Self::Normal => ("normal", &["X", "Y", "Z"], Layer::Normal),
            Self::Depth => ("depth", &["Z"], Layer::Depth),
        }
    }
}

const RGB: &[&str] = &["R", "G", "B"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

impl Format {
    fn of(path: &Path) -> Result<Self> {
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
        let format = Format::of(&self.output)?;
        self.check_combinations(format)?;
        let output = OutputFile::check(&self.output)?;
        let stats = self.stats.as_deref().map(OutputFile::check).transpose()?;

        let mut scene = self.scene_args.load(&self.scene)?;
        if self.method == Method::Direct {
            // Without paths and records there is nothing to precompute, and no indirect light.
            (scene.quality.entry_points, scene.quality.cache_points) = (0, 0);
        }
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let context = self.device_args.open()?;
        let mut renderer = Renderer::new(&context, scene, self.device_args.progress().as_mut())?;
        renderer.set_exposure(self.exposure.unwrap_or(0.0));
        let frame = renderer.frame(Edit::Everything)?;
        self.device_args.report_validation(&context);

        self.write_image(&renderer, format, &output)?;
        let statistics = renderer.statistics()?;
        if let Some(stats) = stats {
            let text = format!("{:#}\n", document(&context, &renderer, &frame, &statistics));
            stats.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
        }
        let ([width, height], seconds) = (renderer.size(), statistics.precompute_s);
        super::print(&format!(
            "{}: {width}x{height}, precompute {seconds:.2} s, frame {:.1} ms, {}\n",
            output.path().display(),
            frame.frame_ms,
            device_label(&context),
        ))
    }

    /// Refuses arguments that contradict each other, before anything is read or written.
    fn check_combinations(&self, format: Format) -> Result<()> {
        let refuse = |message: String| Err(Error::Usage(message));
        if let Method::Path | Method::Photon = self.method {
            let method = self.method.to_possible_value().expect("no method is skipped");
            return refuse(format!(
                "--method {} is not in this version; use lightpaths or direct",
                method.get_name()
            ));
        }
        for (given, flag) in [(self.spp.is_some(), "--spp"), (self.seconds.is_some(), "--seconds")] {
            if given {
                return refuse(format!("{flag} is for the sampling methods path and photon; leave it out"));
            }
        }
        if format == Format::Png && !self.aov.is_empty() {
            return refuse("--aov needs an .exr output; a PNG has no layers".to_owned());
        }
        if format == Format::Exr && self.exposure.is_some() {
            return refuse("--exposure is for .png outputs; an EXR holds radiance as it is".to_owned());
        }
        if self.method == Method::Direct && self.aov.contains(&Aov::Indirect) {
            return refuse("--aov indirect needs --method lightpaths".to_owned());
        }
        refuse_same_output(Some(&self.output), self.stats.as_deref())
    }

    fn write_image(&self, renderer: &Renderer, format: Format, output: &OutputFile) -> Result<()> {
        let beauty = renderer.layer(Layer::Beauty)?;
        let odd = beauty.iter().flatten().filter(|value| !value.is_finite()).count();
        if odd > 0 {
            self.device_args.warn(&format!("{odd} values of the image are not finite"));
        }
        let size = renderer.size();
        if format == Format::Png {
            let display = renderer.display()?;
            return output.write(|out| write_png(out, size, &display));
        }
        let mut aovs = Vec::new();
        for aov in Aov::value_variants().iter().filter(|aov| self.aov.contains(aov)) {
            let (name, channels, layer) = aov.description();
            aovs.push((name, channels, renderer.layer(layer)?));
        }
        let mut layers = vec![ExrLayer { name: "", channels: RGB, pixels: &beauty }];
        layers.extend(aovs.iter().map(|(name, channels, pixels)| ExrLayer { name, channels, pixels }));
        output.write(|out| write_exr(out, size, &layers))
    }
}

/// What `--stats` writes.
fn document(
    context: &Context,
    renderer: &Renderer,
    frame: &FrameReport,
    made: &Statistics,
) -> serde_json::Value {
    let passes = frame.passes.iter().map(|pass| {
        serde_json::json!({
            "name": pass.name, "ms": pass.ms, "overlapped": pass.overlapped,
            "bytes": frame.bytes.get(pass.name), "rays": frame.rays.get(pass.name),
        })
    });
    serde_json::json!({
        "device": {"name": context.name(), "driver": context.driver()},
        "scene": renderer.scene().name,
        "triangles": renderer.scene().triangles.len(),
        "size": renderer.size(),
        "quality": renderer.scene().quality,
        "renderer": made,
        "frame": {"ms": frame.frame_ms, "passes": passes.collect::<Vec<_>>()},
    })
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
        let format = Format::of(&line.render.output).unwrap();
        line.render.check_combinations(format).err().map(|error| error.to_string())
    }

    #[test]
    fn contradictions_are_refused_and_name_the_argument() {
        for (arguments, word) in [
            ("-o a.png --method path", "path"),
            ("-o a.png --method photon", "photon"),
            ("-o a.png --spp 4", "--spp"),
            ("-o a.png --seconds 2", "--seconds"),
            ("-o a.png --aov depth", "--aov"),
            ("-o a.exr --exposure 1", "--exposure"),
            ("-o a.exr --method direct --aov direct,indirect", "indirect"),
            ("-o a.exr --stats a.exr", "two outputs"),
        ] {
            assert!(refusal(arguments).is_some_and(|line| line.contains(word)), "{arguments}");
        }
        for arguments in
            ["-o a.PNG --exposure -1.5", "room -o a.exr --aov direct,indirect,albedo,normal,depth"]
        {
            assert_eq!(refusal(arguments), None, "{arguments}");
        }
    }
}
