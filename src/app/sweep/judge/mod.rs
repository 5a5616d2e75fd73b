//! `lightpaths judge`: which stage errs, and where in the picture.

mod page;
mod regions;

use std::array::from_fn;
use std::io::Write;
use std::iter::once;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use serde::Serialize;

use super::reference::Reference;
use super::{ReferenceArgs, display, png, settings};
use crate::app::args::{DeviceArgs, SceneArgs};
use crate::app::output::{OutputFile, create_folder};
use crate::app::overlap;
use crate::app::picture::refuse_non_finite;
use crate::app::render::sampled::Budget;
use crate::error::Result;
use crate::gpu::Context;
use crate::metrics;
use crate::renderer::{Exact, Layer, Renderer, Stage};
use crate::scene::Scene;
use regions::{Blocks, Cause, Errors, Pair, Pixels};

/// Default time of both references together, seconds.
const DEFAULT_SECONDS: f32 = 60.0;

/// Number of worst blocks in the table.
const WORST: usize = 8;

/// Say which stage errs, and where in the picture
///
/// Replaces one stage at a time by its exact reference: direct light, the records that pixels read,
/// the clusters that gather rays read, and the gather rays themselves. What then goes of the error
/// against path tracing is that stage's part, for the picture and for each block of pixels. Prints
/// a table. A part below 0 means that the stage evens out the noise of another. Writes judge.svg
/// (picture, map and legend), stages.png (the map alone) and judge.json.
#[derive(Debug, Args)]
pub(in crate::app) struct Judge {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// Folder for the map and the table; created if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    reference_args: ReferenceArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// The files of the folder.
const FILES: [&str; 3] = ["judge.json", "judge.svg", "stages.png"];

/// What `judge` finds.
#[derive(Debug, Serialize)]
struct Judgement {
    scene: String,
    size: [u32; 2],
    quality: String,
    reference_spp: u32,
    /// Error of the picture, without the references' noise.
    relmse: f64,
    relmse_standard_error: f64,
    /// Light of the picture against the references, less 1.
    light: f64,
    /// A row for each [`Cause`], in order.
    stages: Vec<Row>,
    block_pixels: u32,
    worst: Vec<Worst>,
}

/// A stage, or the blocks that no stage explains.
#[derive(Debug, Serialize)]
struct Row {
    stage: &'static str,
    /// Error that remains if the stage is exact; of gather rays, if clusters are exact, too.
    relmse_without: Option<f64>,
    /// Part of the whole error that goes with the stage's. Below 0 if it evens out another's noise.
    removes: Option<f64>,
    /// Light against the references if the stage is exact, less 1.
    light_without: Option<f64>,
    /// Part of the blocks whose error the stage causes.
    blocks: f64,
    /// Part of the whole squared error in these blocks.
    error: f64,
}

/// A block with a large error.
#[derive(Debug, Serialize)]
struct Worst {
    /// Its first pixel.
    corner: [u32; 2],
    /// Relative error as a root mean square.
    rms: f64,
    stage: &'static str,
}

/// Two path-traced pictures with independent noise.
struct References([Reference; 2]);

/// Pictures of our method.
struct Pictures {
    whole: Pixels,
    indirect: Pixels,
    /// With exact records; with exact clusters; with exact gather rays and clusters.
    exact: [[Pixels; 2]; 3],
}

/// What errors are relative to: the mean of our picture and those with an exact stage.
fn scale_of(pictures: &Pictures, references: [&[[f32; 3]]; 2]) -> Pixels {
    let ours: Vec<&[[f32; 3]]> =
        once(&pictures.whole).chain(pictures.exact.iter().flatten()).map(Vec::as_slice).collect();
    let mean = |pixel: usize, c: usize| ours.iter().map(|of| of[pixel][c]).sum::<f32>() / ours.len() as f32;
    let means: Pixels = (0..pictures.whole.len()).map(|pixel| from_fn(|c| mean(pixel, c))).collect();
    metrics::error_scale(&means, references)
}

impl Judge {
    pub(in crate::app) fn run(self) -> Result<()> {
        let scene = self.scene_args.load_lit(&self.scene)?;
        overlap::refuse_in_folder(&self.output, |name| FILES.contains(&name), &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let cache = self.reference_args.folder()?;
        let context = self.device_args.open()?;
        create_folder(&self.output)?;
        let files = FILES.map(|name| OutputFile::check(&self.output.join(name)));
        let [json, svg, map] = files;
        let (json, svg, map) = (json?, svg?, map?);

        let references = self.references(&scene, &cache, &context)?;
        let pictures = self.pictures(&scene, &context)?;
        let (judgement, causes, errors) = judge(&scene, &pictures, &references);
        let blocks = Blocks::new(judgement.size);
        let map_png = png(&page::map(blocks, &causes, &errors.whole, pictures.whole.len()), judgement.size)?;
        map.write(|out| out.write_all(&map_png))?;
        let picture = png(&display(&pictures.whole), judgement.size)?;
        svg.write(|out| out.write_all(page::svg(&judgement, [&picture, &map_png]).as_bytes()))?;
        let text = serde_json::to_string_pretty(&judgement).expect("results are plain data");
        json.write(|out| writeln!(out, "{text}"))?;
        crate::app::print(&page::table(&judgement))?;
        crate::app::print_line(&format!("{}", svg.path().display()))
    }

    /// Renders two references, or reads them; each gets half of the budget.
    fn references(
        &self,
        scene: &Scene,
        cache: &std::path::Path,
        context: &Arc<Context>,
    ) -> Result<References> {
        let Budget { spp, seconds } = self.reference_args.budget(DEFAULT_SECONDS);
        let budget = Budget { spp: spp.map(|spp| spp.div_ceil(2)), seconds: seconds.map(|s| 0.5 * s) };
        let find = |number: u32| {
            let mut scene = scene.clone();
            scene.quality.seed = crate::cpu::sampling::hash_pair(scene.quality.seed, number);
            Reference::find(&scene, budget, cache, (context, &self.device_args))
        };
        Ok(References([find(1)?, find(2)?]))
    }

    fn pictures(&self, scene: &Scene, context: &Arc<Context>) -> Result<Pictures> {
        let mut renderer = Renderer::new(context, scene.clone(), self.device_args.progress().as_mut())?;
        renderer.frame()?;
        if renderer.refine()? > 0 {
            renderer.frame()?;
        }
        let whole = renderer.layer(Layer::Beauty)?;
        refuse_non_finite(scene.cameras[0].size, &whole)?;
        let indirect = renderer.layer(Layer::Indirect)?;
        let exact = |stage, said: &str| -> Result<[Pixels; 2]> {
            self.device_args.say(&format!("exact {said}"));
            let half =
                |sequence| renderer.layer_with_exact(Exact { stage, samples: 1, sequence }, Layer::Beauty);
            let first = half(0)?;
            // Exact records have no noise.
            let second = if stage == Stage::Splat { first.clone() } else { half(1)? };
            Ok([first, second])
        };
        let exact = [
            exact(Stage::Splat, "records")?,
            exact(Stage::Clusters, "clusters")?,
            exact(Stage::Gather, "gather rays and clusters")?,
        ];
        self.device_args.report_validation(context);
        Ok(Pictures { whole, indirect, exact })
    }
}

/// The judgement, and for each block the cause of its error, and the errors.
fn judge(scene: &Scene, pictures: &Pictures, references: &References) -> (Judgement, Vec<Cause>, Errors) {
    let size = scene.cameras[0].size;
    let References([a, b]) = references;
    let reference = Pair([a.picture(), b.picture()]);
    let scale = &scale_of(pictures, reference.0)[..];
    let blocks = Blocks::new(size);
    let without = |picture: Pair<'_>, reference| blocks.errors(picture, reference, scale);
    let pair = |[a, b]: &'_ [Pixels; 2]| -> Vec<f64> { without(Pair([a, b]), reference) };
    let [records, clusters, gather] = &pictures.exact;
    let errors = Errors {
        whole: without(Pair([&pictures.whole, &pictures.whole]), reference),
        // With the references' direct light, the error of indirect light remains.
        direct_exact: without(
            Pair([&pictures.indirect, &pictures.indirect]),
            Pair([a.judge().indirect, b.judge().indirect]),
        ),
        records_exact: pair(records),
        clusters_exact: pair(clusters),
        gather_exact: pair(gather),
        noise: blocks.noise(reference, scale),
    };
    let causes = errors.causes();
    let pixels = blocks.pixels();
    let whole = regions::mean(&errors.whole, &pixels);
    let light = sum(a.picture()) + sum(b.picture());
    let more = |[first, second]: [f64; 2]| (first + second) / light - 1.0;
    let direct = |reference: &Reference| sum(reference.picture()) - sum(reference.judge().indirect);
    let exact = |pictures: &[Pixels; 2]| more([sum(&pictures[0]), sum(&pictures[1])]);
    let lights = [
        more([a, b].map(|reference| direct(reference) + sum(&pictures.indirect))),
        exact(records),
        exact(clusters),
        exact(gather),
    ];
    let remaining =
        [&errors.direct_exact, &errors.records_exact, &errors.clusters_exact, &errors.gather_exact];
    let row = |(index, cause): (usize, Cause)| {
        let of_cause = |values: &dyn Fn(usize) -> f64| -> f64 {
            causes.iter().enumerate().filter(|(_, of)| **of == cause).map(|(block, _)| values(block)).sum()
        };
        Row {
            stage: cause.name(),
            relmse_without: remaining.get(index).map(|errors| regions::mean(errors, &pixels)),
            removes: errors.caused_by(cause, &pixels).map(|caused| caused / whole),
            light_without: lights.get(index).copied(),
            blocks: of_cause(&|_| 1.0) / causes.len() as f64,
            error: of_cause(&|block| errors.whole[block] * pixels[block])
                / (whole * pixels.iter().sum::<f64>()),
        }
    };
    let mut order: Vec<usize> = (0..causes.len()).filter(|&block| causes[block] != Cause::Small).collect();
    order.sort_by(|&a, &b| errors.whole[b].total_cmp(&errors.whole[a]));
    let worst = |&block: &usize| Worst {
        corner: blocks.corner(block),
        rms: errors.whole[block].sqrt(),
        stage: causes[block].name(),
    };
    let judgement = Judgement {
        scene: scene.name.clone(),
        size,
        quality: settings::arguments(&scene.quality),
        reference_spp: a.facts.spp + b.facts.spp,
        relmse: whole,
        relmse_standard_error: metrics::debiased_relmse_at(&pictures.whole, reference.0, scale)
            .standard_error,
        light: more([sum(&pictures.whole); 2]),
        stages: Cause::ALL.into_iter().enumerate().map(row).collect(),
        block_pixels: regions::SIDE,
        worst: order.iter().take(WORST).map(worst).collect(),
    };
    (judgement, causes, errors)
}

fn sum(pixels: &[[f32; 3]]) -> f64 {
    pixels.as_flattened().iter().map(|&value| f64::from(value)).sum()
}
