//! Contradictory arguments of `render`.

use clap::ValueEnum;

use super::layers::Aov;
use super::{Format, Method, Render};
use crate::app::false_colours::Quantity;
use crate::app::overlap;
use crate::error::{Error, Result};

impl Method {
    pub(super) fn name(self) -> String {
        self.to_possible_value().expect("no method is skipped").get_name().to_owned()
    }
}

impl Render {
    /// Refuses contradictory arguments before any file is read or written.
    pub(super) fn check_combinations(&self, format: Format) -> Result<()> {
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
        if self.false_color.is_some() {
            if format == Format::Exr {
                return refuse("--false-color is for .png outputs; --aov irradiance has values".to_owned());
            }
            if self.exposure.is_some() {
                return refuse(
                    "--exposure and --false-color exclude each other: --range sets its colours".to_owned(),
                );
            }
            if let Some(flag) = self.display_args.given() {
                return refuse(format!("{flag} and --false-color exclude each other"));
            }
        }
        let wants_lux = self.false_color == Some(Quantity::Lux);
        for (given, flag) in
            [(wants_lux, "--false-color lux"), (self.aov.contains(&Aov::Irradiance), "--aov irradiance")]
        {
            if given && !matches!(self.method, Method::Lightpaths | Method::Direct) {
                return refuse(format!("{flag} is for --method lightpaths and direct"));
            }
        }
        if self.aov.contains(&Aov::Lights) {
            if !matches!(self.method, Method::Lightpaths | Method::Direct) {
                return refuse("--aov lights is for --method lightpaths and direct".to_owned());
            }
            if self.exact.is_some() {
                return refuse("--exact replaces a stage of the picture, not of --aov lights".to_owned());
            }
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
        if let (Format::Exr, Some(flag)) = (format, self.display_args.given()) {
            return refuse(format!("{flag} is for .png outputs; an EXR holds radiance as it is"));
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
            ("-o a.exr --false-color lux", ".png"),
            ("-o a.png --false-color nits --exposure 1", "--exposure"),
            ("-o a.png --method path --false-color lux", "--false-color lux"),
            ("-o a.exr --method photon --aov irradiance", "--aov irradiance"),
            ("-o a.png --aov all", "--aov"),
            ("-o a.png --aov lights", "--aov"),
            ("-o a.exr --method path --aov lights", "--aov lights"),
            ("-o a.exr --exact splat --aov lights", "--exact"),
            ("-o a.exr --method direct --target-error 1e-3", "--target-error"),
            ("-o a.exr --method photon --target-ms 9", "--target-ms"),
            ("-o a.exr --target-error 1e-3 --spp 3", "--spp 4"),
            ("-o a.exr --target-error 1e-3 --exact splat", "--exact"),
            ("-o a.png --target-ms 5 --capture c", "--capture"),
            ("-o a.exr --target-ms 5 --spp 64", "--spp"),
            ("-o a.exr --exposure 1", "--exposure"),
            ("-o a.exr --tone agx", "--tone"),
            ("-o a.exr --white-balance 2700", "--white-balance"),
            ("-o a.exr --tint -5", "--tint"),
            ("-o a.png --false-color nits --tone none", "--tone"),
            ("-o a.exr --method direct --aov direct,indirect", "indirect"),
            ("-o a.exr --stats a.exr", "two outputs"),
        ] {
            assert!(refusal(arguments).is_some_and(|line| line.contains(word)), "{arguments}");
        }
        for arguments in [
            "-o a.PNG --exposure -1.5",
            "-o a.png --exposure auto --tone agx --white-balance 2700 --tint -5",
            "-o a.exr --exact gather --aov indirect",
            "-o a.exr --method direct --aov direct,lights",
            "-o a.exr --method path --aov all",
            "-o a.png --method path --false-color nits --range 0:500",
            "-o a.exr --exact gather --aov error --spp 16 --seconds 3",
            "-o a.png --target-error 1e-3 --target-ms 20 --spp 64 --cache c",
            "room -o a.exr --aov direct,indirect,albedo,normal,depth",
            "-o a.exr --method path --spp 4 --seconds 2 --aov variance",
            "-o a.exr --method photon --spp 1 --seconds 2 --aov direct,indirect,albedo,normal,depth",
        ] {
            assert_eq!(refusal(arguments), None, "{arguments}");
        }
    }
}
