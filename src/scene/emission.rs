//! Surfaces and directions behind lights of the kinds `Surface` and `Sky`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec3, Vec3};

use super::emitters::{self, Emitter};
use super::environment::{Beam, Cell, Environment};
use super::material::Sides;
use super::{Light, LightKind, Material, Triangle};

/// What emits besides the lights of a scene file.
#[derive(Clone, Debug, Default)]
pub struct Emission {
    /// Emitting surface by material.
    pub surfaces: BTreeMap<u32, Emitter>,
    /// Light from outside of the scene.
    pub sky: Option<Sky>,
}

/// Side of the octahedral table of a sky with an image.
const TABLE_SIDE: u32 = 64;

/// An environment, prepared as a light.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Radiance by direction.
    pub environment: Arc<Environment>,
    /// Its cells, which path and photon tracing sample.
    pub cells: Vec<Cell>,
    /// The radiance without bright spots. Rays that leave the scene bring it in.
    pub smooth: Environment,
    /// Its cells, as many as of the whole sky.
    pub smooth_cells: Vec<Cell>,
    /// Side of the octahedral table of `smooth` in frames.
    pub side: u32,
    /// Directional lights that represent the bright spots.
    pub beams: Vec<Beam>,
    /// The last table and its rotation: most edits of lights do not turn the sky.
    last_table: Arc<Mutex<Option<(f32, Table)>>>,
}

/// Radiance of each cell of an octahedral table.
type Table = Arc<Vec<DVec3>>;

impl Sky {
    /// Prepares an environment, with at most `samples` directional lights for bright spots.
    pub fn new(environment: Arc<Environment>, samples: u32) -> Self {
        let (smooth, bright) = environment.divided();
        Self {
            cells: environment.cells().0,
            side: if smooth.is_constant() { 1 } else { TABLE_SIDE },
            smooth_cells: smooth.cells().0,
            smooth,
            last_table: Arc::default(),
            beams: bright.map_or_else(Vec::new, |bright| bright.beams(samples as usize)),
            environment,
        }
    }

    /// Radiance of each cell of the octahedral table, with the sky rotated by `turn` radians.
    pub fn table(&self, turn: f32) -> Table {
        let mut last = self.last_table.lock().unwrap_or_else(PoisonError::into_inner);
        match &*last {
            Some((known, table)) if *known == turn => table.clone(),
            _ => {
                let table = Arc::new(self.smooth.table(&self.smooth_cells, self.side, f64::from(turn)));
                *last = Some((turn, table.clone()));
                table
            }
        }
    }
}

impl Emission {
    /// Collects the emitting surface of a model.
    pub fn new(triangles: &[Triangle], materials: &[Material], sky: Option<Sky>) -> Self {
        let emits = |material: u32| {
            let material = &materials[material as usize];
            (material.emission != Vec3::ZERO).then(|| material.emitting_sides.unwrap_or(Sides::Both))
        };
        Self { surfaces: emitters::emitters(triangles, emits), sky }
    }

    /// Side of the sky's octahedral table; 0 without a sky.
    pub fn sky_side(&self) -> u32 {
        self.sky.as_ref().map_or(0, |sky| sky.side)
    }

    /// Lights for the surfaces without one in `taken`, and for the sky. Names differ from those
    /// taken. `sky` holds the factor of its radiance and its rotation about +Y in radians.
    pub fn lights(&self, materials: &[Material], sky: Option<(Vec3, f32)>, taken: &[Light]) -> Vec<Light> {
        let mut lights: Vec<Light> = Vec::new();
        let mut add = |name: &str, kind: LightKind| {
            let is_taken = |name: &str| taken.iter().chain(&lights).any(|light| light.name == name);
            let mut names =
                std::iter::once(name.to_owned()).chain((2..).map(|number| format!("{name} {number}")));
            let name = names.find(|name| !is_taken(name)).unwrap_or_default();
            lights.push(Light::new(name, kind));
        };
        let is_named = |material: u32| {
            taken.iter().any(
                |light| matches!(light.kind, LightKind::Surface { material: own, .. } if own == material),
            )
        };
        for &material in self.surfaces.keys().filter(|&&material| !is_named(material)) {
            let Material { name, emission, .. } = &materials[material as usize];
            add(name, LightKind::Surface { material, radiance: *emission });
        }
        if let (Some(sky), Some((radiance, turn))) = (&self.sky, sky) {
            if sky.environment.is_grey() {
                add("sky", LightKind::Sky { radiance, turn, channel: None });
            } else {
                for (channel, name) in (0..).zip(["sky (red)", "sky (green)", "sky (blue)"]) {
                    let kind = LightKind::Sky { radiance, turn, channel: Some(channel) };
                    add(name, kind.with_emission(radiance));
                }
            }
        }
        lights
    }
}

/// Free distance in front of one side over that of the other, below which a side counts as covered.
const COVERED: f64 = 0.2;
/// Samples of an emitter that decide its sides.
const SAMPLES: usize = 16;

/// Chooses the sides of emitters that state none, as OBJ files do not: a side that faces a surface
/// close by, such as the ceiling above a lamp or the inside of a bulb, does not emit.
pub(super) fn choose_sides(triangles: &[Triangle], materials: &mut [Material]) {
    for (index, material) in (0..).zip(materials) {
        if material.emission == Vec3::ZERO || material.emitting_sides.is_some() {
            continue;
        }
        let own: Vec<&Triangle> = triangles.iter().filter(|triangle| triangle.material == index).collect();
        let step = own.len().div_ceil(SAMPLES).max(1);
        let (mut front, mut back) = (0.0, 0.0);
        for triangle in own.into_iter().step_by(step) {
            let [p0, p1, p2] = triangle.positions.map(Vec3::as_dvec3);
            let (middle, normal) = ((p0 + p1 + p2) / 3.0, triangle.geometric_normal().as_dvec3());
            let free = |direction| nearest(triangles, middle, direction);
            let [above, below] = [free(normal), free(-normal)];
            let area = triangle.area_m2();
            front += if below < COVERED * above { area } else { 0.0 };
            back += if above < COVERED * below { area } else { 0.0 };
            front -= 0.5 * area;
            back -= 0.5 * area;
        }
        material.emitting_sides = Some(match (front > 0.0, back > 0.0) {
            (true, _) => Sides::Front,
            (_, true) => Sides::Back,
            _ => Sides::Both,
        });
    }
}

/// Distance to the nearest triangle along a unit direction; infinite if there is none.
fn nearest(triangles: &[Triangle], from: DVec3, direction: DVec3) -> f64 {
    let hit = |triangle: &Triangle| {
        let [p0, p1, p2] = triangle.positions.map(|point| point.as_dvec3() - from);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let determinant = e1.dot(direction.cross(e2));
        let u = -p0.dot(direction.cross(e2)) / determinant;
        let across = (-p0).cross(e1);
        let v = direction.dot(across) / determinant;
        let distance = e2.dot(across) / determinant;
        // Comparisons with the NaN of a parallel triangle fail. The triangle of the point itself
        // is at a distance of rounding errors.
        let is_hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-6 * e1.length().max(e2.length());
        is_hit.then_some(distance)
    };
    triangles.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
}
