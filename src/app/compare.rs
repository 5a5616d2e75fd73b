//! `lightpaths compare`: error metrics of an image against a reference.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::display_args::DisplayArgs;
use super::exposure::Exposure;
use super::numbers::parse_bound;
use super::output::OutputFile;
use super::{heatmap, overlap};
use crate::cpu::tonemap::display_values;
use crate::error::{Error, Result};
use crate::image::{self, Picture, write_png};
use crate::metrics::{self, Comparison, PIXELS_PER_DEGREE, ZTest};
use crate::scene::{DisplayTransform, PictureKeys};

/// Compare an image with a reference
///
/// relMSE is the mean of (v-r)²/(r+0.01)² over pixels and channels, SMAPE the mean of
/// |v-r|/((|v|+|r|)/2), FLIP the mean of LDR-FLIP at 67 pixels a degree. FLIP judges what is
/// displayed: an EXR is exposed and tone mapped as `render` does for a PNG, but not dithered, a PNG
/// is taken as it is. The other figures are of linear values. EXR files are compared in their
/// display window: pixels lie where the data window says, and all others are black.
#[derive(Debug, Args)]
pub(super) struct Compare {
    /// The image to judge: .exr or .png
    image: PathBuf,
    /// The image that it should be
    reference: PathBuf,
    /// Prints the figures as JSON
    #[arg(long)]
    json: bool,
    /// Writes a picture of the differences
    #[arg(long, value_name = "FILE.png")]
    heatmap: Option<PathBuf>,
    /// What the heat map shows: FLIP from 0 to 1, or the relative error on a logarithmic
    /// scale [default: flip]
    #[arg(long, value_enum, requires = "heatmap")]
    heatmap_of: Option<HeatmapOf>,
    /// Exits with code 1 if relMSE is above this
    #[arg(long, value_name = "X", value_parser = parse_bound)]
    max_relmse: Option<f64>,
    /// Layer of both EXR files [default: the image itself]
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Layer of the reference, where it differs from --layer
    #[arg(long, value_name = "NAME")]
    reference_layer: Option<String>,
    /// Brightens EXR files by this many stops for FLIP; auto: the mean of the reference, or else of
    /// the image, becomes middle grey [default: 0]
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true, value_parser = Exposure::parse)]
    exposure: Option<Exposure>,
    #[command(flatten)]
    display_args: DisplayArgs,
    /// Sets the difference of each value in relation to the noise that both images state
    #[arg(long)]
    z_test: bool,
    /// Layer of the image that holds the variance of its values [default: variance]
    #[arg(long, value_name = "NAME", requires = "z_test")]
    variance_layer: Option<String>,
    /// Layer of the reference that does, where it differs from --variance-layer
    #[arg(long, value_name = "NAME", requires = "z_test")]
    reference_variance_layer: Option<String>,
}

/// What a heat map can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum HeatmapOf {
    Flip,
    Relative,
}

impl Compare {
    pub(super) fn run(self) -> Result<()> {
        overlap::refuse_inputs(self.heatmap.as_deref(), &[&self.image, &self.reference])?;
        let heatmap = self.heatmap.as_deref().map(OutputFile::check).transpose()?;
        let reference_layer = self.reference_layer.as_deref().or(self.layer.as_deref());
        let image = read_finite(&self.image, self.layer.as_deref())?;
        let reference = read_finite(&self.reference, reference_layer)?;
        same_window((&self.image, &image), (&self.reference, &reference))?;

        // A PNG is taken as it is.
        let exposed = [&reference, &image].into_iter().find(|picture| picture.display.is_none());
        let exposure = self.exposure.unwrap_or(Exposure::Stops(0.0));
        let (stops, said) = exposed.map_or((0.0, None), |picture| exposure.stops(&picture.pixels));
        said.iter().for_each(|line| super::note(&format!("lightpaths: {line}")));
        let shown_as = self.display_args.transform(stops, &PictureKeys::default());
        let [shown, shown_reference] = [&image, &reference].map(|picture| display(picture, &shown_as));
        let flip = metrics::flip_map(&shown, &shown_reference, image.size, PIXELS_PER_DEGREE);
        let (v, r) = (&image.pixels, &reference.pixels);
        let comparison = Comparison {
            relmse: metrics::relmse(v, r),
            rmse: metrics::rmse(v, r),
            smape: metrics::smape(v, r),
            flip: flip.iter().sum::<f64>() / flip.len() as f64,
            energy_ratio: metrics::energy_ratio(v, r),
        };
        let z_test = self.z_test.then(|| self.z_test(&image, &reference)).transpose()?;

        let mut scale = None;
        if let Some(heatmap) = heatmap {
            let colors = match self.heatmap_of.unwrap_or(HeatmapOf::Flip) {
                HeatmapOf::Flip => {
                    scale = Some(heatmap::FLIP_SCALE);
                    heatmap::of_flip(&flip)
                }
                HeatmapOf::Relative => {
                    scale = Some(heatmap::RELATIVE_SCALE);
                    heatmap::of_relative_error(&metrics::relative_error_map(v, r))
                }
            };
            heatmap.write(|out| write_png(out, image.size, &colors))?;
        }
        let text =
            if self.json { json(&comparison, z_test.as_ref()) } else { text(&comparison, z_test.as_ref()) };
        super::print(&text)?;
        if let Some(scale) = scale {
            super::note(&format!("lightpaths: heat map: {scale}"));
        }
        match self.max_relmse {
            Some(bound) if comparison.relmse > bound => Err(Error::Comparison(format!(
                "relMSE {:.4e} is above the bound {bound:e} (--max-relmse)",
                comparison.relmse
            ))),
            _ => Ok(()),
        }
    }

    fn z_test(&self, image: &Picture, reference: &Picture) -> Result<ZTest> {
        let layer = self.variance_layer.as_deref().unwrap_or("variance");
        let reference_layer = self.reference_variance_layer.as_deref().unwrap_or(layer);
        let read = |path: &Path, size: [u32; 2], layer: &str| {
            let variance = read_finite(path, Some(layer))?;
            if variance.size != size {
                let ([w, h], [vw, vh]) = (size, variance.size);
                return Err(Error::input(path, format!("is {w}x{h} pixels, its layer `{layer}` {vw}x{vh}")));
            }
            match variance.pixels.iter().flatten().any(|&value| value < 0.0) {
                true => Err(Error::input(path, format!("layer `{layer}` holds negative variances"))),
                false => Ok(variance.pixels),
            }
        };
        let variance = read(&self.image, image.size, layer)?;
        let reference_variance = read(&self.reference, reference.size, reference_layer)?;
        Ok(metrics::z_test(&image.pixels, &reference.pixels, [&variance, &reference_variance]))
    }
}

fn read_finite(path: &Path, layer: Option<&str>) -> Result<Picture> {
    let picture = image::read(path, layer)?;
    match metrics::first_non_finite(&picture.pixels) {
        None => Ok(picture),
        Some(index) => {
            let (x, y) = (index % picture.size[0] as usize, index / picture.size[0] as usize);
            let [r, g, b] = picture.pixels[index];
            Err(Error::input(
                path,
                format!(
                    "pixel ({x}, {y}) from the top left is not finite: {r}, {g}, {b}; mend the image first"
                ),
            ))
        }
    }
}

/// Refuses pictures with different windows.
fn same_window((image, a): (&Path, &Picture), (reference, b): (&Path, &Picture)) -> Result<()> {
    let ([w, h], [rw, rh]) = (a.size, b.size);
    let reference = reference.display();
    if [w, h] != [rw, rh] {
        let message = format!("is {w}x{h} pixels, but {reference} is {rw}x{rh}; render both at one size");
        return Err(Error::input(image, message));
    }
    match (a.origin, b.origin) {
        (Some([x, y]), Some([rx, ry])) if [x, y] != [rx, ry] => {
            let message = format!(
                "has its display window at ({x}, {y}), but {reference} has it at ({rx}, {ry}); write both with one display window"
            );
            Err(Error::input(image, message))
        }
        _ => Ok(()),
    }
}

/// The displayed sRGB values, 0..=1.
fn display(picture: &Picture, shown_as: &DisplayTransform) -> Vec<[f32; 3]> {
    match &picture.display {
        Some(display) => display.clone(),
        None => displayed(&picture.pixels, shown_as),
    }
}

/// The displayed sRGB values of linear values, 0..=1.
pub(super) fn displayed(pixels: &[[f32; 3]], shown_as: &DisplayTransform) -> Vec<[f32; 3]> {
    let constants = shown_as.constants();
    let codes = pixels.iter().map(|pixel| display_values(&constants, *pixel));
    codes.map(|codes| codes.map(|code| f32::from(code) / 255.0)).collect()
}

fn text(comparison: &Comparison, z_test: Option<&ZTest>) -> String {
    let Comparison { relmse, rmse, smape, flip, energy_ratio } = comparison;
    let mut text = format!(
        "relMSE        {relmse:.4e}\nRMSE          {rmse:.4e}\nSMAPE         {smape:.4e}\nFLIP          {flip:.4e}\n\
         energy ratio  {energy_ratio:.6}\n"
    );
    if let Some(ZTest { mean, rms, fraction_above_3, count, differ_without_noise }) = z_test {
        text += &format!(
            "z mean        {mean:.4}\nz rms         {rms:.4}\n|z| > 3       {:.4} % of {count} values\n\
             no noise      {differ_without_noise} values that differ\n",
            100.0 * fraction_above_3,
        );
    }
    text
}

/// The figures in the documented order, further ones after them.
fn json(comparison: &Comparison, z_test: Option<&ZTest>) -> String {
    let number = |value: f64| serde_json::Value::from(value).to_string();
    let Comparison { relmse, rmse, smape, flip, energy_ratio } = *comparison;
    let mut figures = vec![
        ("relmse", number(relmse)),
        ("rmse", number(rmse)),
        ("smape", number(smape)),
        ("flip", number(flip)),
        ("energy_ratio", number(energy_ratio)),
    ];
    if let Some(z) = z_test {
        figures.extend([
            ("z_mean", number(z.mean)),
            ("z_rms", number(z.rms)),
            ("z_fraction_above_3", number(z.fraction_above_3)),
            ("z_count", z.count.to_string()),
            ("z_differ_without_noise", z.differ_without_noise.to_string()),
        ]);
    }
    let figures: Vec<String> = figures.iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
    format!("{{{}}}\n", figures.join(", "))
}
