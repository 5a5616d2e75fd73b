//! What each measure against leaks and hidden surface buys: the errors without it over those with
//! it, and its cost.

use crate::common::context;
use crate::dark_sides::{self, Sides};
use crate::prepare;
use glam::Vec3;
use lightpaths::metrics::debiased_relmse;
use lightpaths::reference::{PathTracer, Progressive};
use lightpaths::renderer::{Exact, Layer, Renderer, Silent, Stage};
use lightpaths::scene::{LightKind, LoadOptions, Measure, Measures, Quality, Scene, Triangle, shapes};
use lightpaths::types::{CachePoint, Record};
use std::path::Path;

/// A scene and how its error is measured.
enum Case {
    /// relMSE of indirect light against two path-traced pictures, whose noise is removed.
    Picture { name: String, scene: Scene, halves: [Vec<[f32; 3]>; 2] },
    /// Mean squared relative error of records beside a screen and on the wall that it faces. The
    /// reference is path-traced radiance along the same gather rays.
    Records { name: String, scene: Scene },
    /// The same for all records, against a closed form, W/m².
    Uniform { name: &'static str, scene: Scene, irradiance: f64 },
    /// Light on a dark side over that on the lit side.
    Leak(Sides),
}

/// Result of one renderer.
#[derive(Clone, Copy)]
struct Cost {
    error: f64,
    /// Mean of the measured light over that of the reference. NaN on dark sides.
    light: f64,
    /// Processor time of precomputation and first frame, seconds.
    seconds: f64,
    megabytes: f64,
}

impl Case {
    fn picture(name: &str, mut scene: Scene, samples: u32) -> Self {
        let camera = &mut scene.cameras[0];
        let scale = (f64::from(PIXELS) / camera.size.iter().map(|&n| f64::from(n)).product::<f64>()).sqrt();
        camera.size = camera.size.map(|pixels| (f64::from(pixels) * scale).round().max(1.0) as u32);
        let half = |seed| {
            let mut scene = scene.clone();
            scene.quality.seed = seed;
            let mut tracer = PathTracer::new(&context(), scene, &mut Silent).unwrap();
            tracer.add_samples(samples).unwrap();
            tracer.picture().unwrap().indirect
        };
        Self::Picture { name: name.to_owned(), halves: [half(1), half(2)], scene }
    }

    fn name(&self) -> &str {
        match self {
            Self::Picture { name, .. } | Self::Records { name, .. } => name,
            Self::Uniform { name, .. } => name,
            Self::Leak(sides) => sides.name,
        }
    }

    fn cost(&self, quality: Quality) -> Cost {
        let (scene, quality) = match self {
            Self::Picture { scene, .. } => (scene, quality),
            Self::Records { scene, .. } | Self::Uniform { scene, .. } => {
                (scene, Quality { cache_points: RECORDS, ..quality })
            }
            Self::Leak(sides) => (&sides.scene, Quality { edge_samples: 0, ..quality }),
        };
        context().reset_memory_peak();
        let before = processor_seconds();
        let mut renderer = prepare(scene.clone(), quality);
        renderer.set_skipping(!matches!(self, Self::Records { .. } | Self::Uniform { .. }));
        renderer.frame().unwrap();
        let seconds = processor_seconds() - before;
        let megabytes = renderer.statistics().unwrap().peak_memory_bytes as f64 / 1e6;
        let [error, light] = self.measure(&mut renderer);
        Cost { error, light, seconds, megabytes }
    }

    /// Error and mean light over the reference's.
    fn measure(&self, renderer: &mut Renderer) -> [f64; 2] {
        match self {
            Self::Picture { halves: [a, b], .. } => {
                let picture = renderer.layer(Layer::Indirect).unwrap();
                let sum = |layer: &[[f32; 3]]| layer.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
                [debiased_relmse(&picture, [a, b]), 2.0 * sum(&picture) / (sum(a) + sum(b))]
            }
            Self::Records { .. } => {
                let exact = Exact { stage: Stage::Clusters, samples: 16, sequence: 0 };
                let exact = renderer.exact_irradiance(exact).unwrap();
                let scale = f64::from(renderer.stages().emission_scale.x);
                let is_outside = |point: &CachePoint| {
                    point.normal.x.abs() < 0.1 || point.normal.x < -0.9 && point.position.x > 0.9
                };
                records_error(renderer, is_outside, |index| scale * f64::from(exact[index].x))
            }
            Self::Uniform { irradiance, .. } => records_error(renderer, |_| true, |_| *irradiance),
            Self::Leak(sides) => [dark_sides::leak_of(sides, renderer), f64::NAN],
        }
    }
}

/// Mean squared relative error of the gathered irradiance of records, and its sum over the expected
/// one.
fn records_error(
    renderer: &Renderer,
    is_meant: impl Fn(&CachePoint) -> bool,
    expected: impl Fn(usize) -> f64,
) -> [f64; 2] {
    let stages = renderer.stages();
    let records: Vec<Record> = stages.gathered.read().unwrap();
    let scale = f64::from(stages.emission_scale.x);
    let points: Vec<CachePoint> = stages.cache_points.read().unwrap();
    let both = records.iter().zip(&points).enumerate().filter(|(_, (_, point))| is_meant(point));
    let both: Vec<[f64; 2]> =
        both.map(|(index, (record, _))| [scale * f64::from(record.irradiance.x), expected(index)]).collect();
    let squares = both.iter().map(|[found, expected]| (found / expected - 1.0).powi(2));
    let sum = |kind: usize| both.iter().map(|pair| pair[kind]).sum::<f64>();
    [squares.sum::<f64>() / both.len() as f64, sum(0) / sum(1)]
}

/// Records that are held against a reference.
const RECORDS: u32 = 2_000;
/// Pixels of a picture, about.
const PIXELS: u32 = 128 * 96;

/// Processor time of this process, the device's threads included, in seconds.
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let ticks = text.rsplit(')').next().unwrap().split_whitespace().skip(11).take(2);
    ticks.map(|ticks| ticks.parse::<f64>().unwrap()).sum::<f64>() / 100.0
}

/// A cube of 2 m with a slab of 2 cm sunk into its floor, or `gap` metres above it.
fn slab(gap: Option<f32>) -> Scene {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    let up = gap.map_or(-1.0, |gap| gap - 0.99);
    let slab = shapes::closed_box(Vec3::new(1.9, 0.02, 1.9), 0.5).triangles;
    scene.triangles.extend(slab.into_iter().map(
        |Triangle { positions: [a, b, c], normals, material, .. }| {
            let positions = [a, c, b].map(|corner| corner + up * Vec3::Y);
            Triangle { positions, normals: normals.map(|normal| -normal), material, object: 0 }
        },
    ));
    scene
}

/// A closed cube of 2 m with a closed box of 5 cm, whose walls have no thickness. A second light is
/// in the box.
fn lamp_in_a_box() -> Scene {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    let place = Vec3::new(-0.4, -0.3, -0.4);
    let mut inner = shapes::closed_box(Vec3::new(0.05, 0.4, 0.4), 0.5).triangles;
    inner.iter_mut().flat_map(|triangle| &mut triangle.positions).for_each(|corner| *corner += place);
    scene.triangles.extend(inner);
    let mut lamp = scene.lights[0].clone();
    lamp.name = "lamp".to_owned();
    lamp.kind = LightKind::Point { position: place, intensity: Vec3::splat(10.0) };
    scene.lights.push(lamp);
    scene
}

/// A sphere whose light is `distance` metres off the wall. A path tracer rarely finds the bright
/// spot there.
fn lamp_at_a_wall(distance: f32) -> Case {
    let (radius, albedo, flux) = (1.0, 0.5, 10.0);
    let place = (radius - distance) * Vec3::new(0.48, 0.6, 0.64);
    let scene = shapes::integrating_sphere(radius, 4, albedo, place, flux);
    let irradiance = f64::from(flux) / scene.area_m2() * f64::from(albedo / (1.0 - albedo));
    Case::Uniform { name: "lamp at a wall", scene, irradiance }
}

/// Calls a function for each chosen case.
fn for_each_case(mut of_case: impl FnMut(Case)) {
    let samples = std::env::var("LIGHTPATHS_SAMPLES").map_or(128, |samples| samples.parse().unwrap());
    let chosen = std::env::var("LIGHTPATHS_CASES").unwrap_or_default();
    let is_chosen = |name: &str| chosen.is_empty() || chosen.split(',').any(|chosen| chosen == name);
    let built_in = |name: &'static str| (name, Scene::load(name, &LoadOptions::default()).unwrap());
    let scenes: [(&str, &dyn Fn() -> Scene); 6] = [
        ("box", &|| built_in("box").1),
        ("atrium", &|| built_in("atrium").1),
        ("room", &|| built_in("room").1),
        ("slab in a floor", &|| slab(None)),
        ("slab on a floor", &|| slab(Some(0.0005))),
        ("lamp in a box", &lamp_in_a_box),
    ];
    for (name, scene) in scenes.into_iter().filter(|(name, _)| is_chosen(name)) {
        of_case(Case::picture(name, scene(), samples));
    }
    if is_chosen("lamp at a wall") {
        of_case(lamp_at_a_wall(0.01));
    }
    let gaps = [2, 4, 10, 20, 30].map(|gap| (format!("screen at {gap} cm"), 0.01 * gap as f32));
    for (name, gap) in gaps {
        if is_chosen(&name) {
            of_case(Case::Records { name, scene: shapes::hidden_light(0.8, gap, 0.5) });
        }
    }
    let sides = dark_sides::scenes().into_iter().filter(|sides| is_chosen(sides.name));
    sides.map(Case::Leak).for_each(&mut of_case);
    for file in std::env::var("LIGHTPATHS_SCENES").unwrap_or_default().split(':').filter(|f| !f.is_empty()) {
        let name = Path::new(file).file_stem().unwrap().to_string_lossy();
        let scene = Scene::load(file, &LoadOptions::default()).unwrap();
        of_case(Case::picture(&name, scene, samples));
    }
}

/// The ablation of `docs/visibility.md`, as tab-separated values: case, measure that is left out,
/// error, mean light over the reference's, processor seconds, megabytes. The environment selects
/// cases (`LIGHTPATHS_CASES`, names with commas), further scene files (`LIGHTPATHS_SCENES`, with
/// colons), `LIGHTPATHS_MEASURES`, `_PRESET`, `_GAP_ROUNDS`, `_GATHER_RAYS`, `_CELLS`, and the
/// samples of references (`_SAMPLES`).
#[test]
#[ignore = "measures: make ablation"]
fn what_each_measure_buys() {
    let variable = |name: &str| std::env::var(name).ok();
    let preset = variable("LIGHTPATHS_PRESET").unwrap_or("draft".to_owned());
    let mut quality = Quality::preset(&preset).unwrap();
    let overrides = [
        ("LIGHTPATHS_GAP_ROUNDS", &mut quality.gap_rounds),
        ("LIGHTPATHS_GATHER_RAYS", &mut quality.gather_rays),
        ("LIGHTPATHS_CELLS", &mut quality.cells),
    ];
    for (name, value) in overrides {
        *value = variable(name).map_or(*value, |text| text.parse().unwrap());
    }
    let measures = variable("LIGHTPATHS_MEASURES");
    for_each_case(|case| {
        let left_out = Measure::ALL.map(Measures::only);
        let names = Measure::ALL.map(|measure| format!("{measure:?}"));
        let rows = [("none".to_owned(), Measures::NONE)].into_iter().chain(names.into_iter().zip(left_out));
        let rows = rows.filter(|(name, _)| measures.as_ref().is_none_or(|chosen| chosen.contains(name)));
        for (name, left_out) in rows {
            let Cost { error, light, seconds, megabytes } =
                case.cost(Quality { left_out, ..quality.clone() });
            println!("{}\t{name}\t{error:.4e}\t{light:.4}\t{seconds:.2}\t{megabytes:.1}", case.name());
        }
    });
}

/// Without each of these measures, the error of a small scene is at least `ratio` times as large.
#[test]
fn a_measure_that_is_left_out_is_missed() {
    let wide = Quality { gather_rays: 16, cells: 16, ..Quality::DRAFT };
    let wall = || lamp_at_a_wall(0.01);
    let screen =
        || Case::Records { name: "screen at 2 cm".to_owned(), scene: shapes::hidden_light(0.8, 0.02, 0.5) };
    let dark = |name| move || Case::Leak(dark_sides::scenes().into_iter().find(|s| s.name == name).unwrap());
    let (corner, thin_wall, leg) = (dark("corner"), dark("thin wall"), dark("table leg"));
    let quad = dark("one-sided quad");
    let cases: [(Measure, &dyn Fn() -> Case, Quality, f64); 8] = [
        (Measure::SplitPlanes, &corner, Quality::DRAFT, 10.0),
        (Measure::InconsistentClusters, &quad, Quality::DRAFT, 10.0),
        (Measure::OccluderPlanes, &corner, Quality::DRAFT, 3.0),
        (Measure::DenserEntryPoints, &thin_wall, Quality::DRAFT, 1.5),
        (Measure::NearClusters, &leg, Quality::DRAFT, 2.0),
        (Measure::StackedSurfaces, &screen, wide.clone(), 10.0),
        (Measure::NarrowCavities, &screen, wide, 3.0),
        (Measure::NearLights, &wall, Quality::DRAFT, 5.0),
    ];
    for (measure, case, quality, ratio) in cases {
        let case = case();
        let [with, without] = [Measures::NONE, Measures::only(measure)]
            .map(|left_out| case.cost(Quality { left_out, ..quality.clone() }).error);
        println!("{measure:?}, {}: error {with:.2e}, without {without:.2e}", case.name());
        assert!(without > ratio * with, "{measure:?}, {}: {without} without, {with} with", case.name());
    }
}
