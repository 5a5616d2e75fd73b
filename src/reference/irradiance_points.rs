//! Irradiance points of the photon mapper: points spread evenly over the surfaces that
//! light can reach.
//!
//! [Christensen 1999] estimates irradiance at photons. Such an estimate counts its own photon, so
//! it is too bright by 1 over the number of photons around it.

use crate::cpu::math::ClearDistance;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::SceneBuffers;
use crate::passes::precompute::rays::Rays;
use crate::passes::precompute::visibility::sides;
use crate::passes::reference::photon_gather::Irradiance;
use crate::passes::reference::photon_irradiance::{PhotonIrradiance, Points};
use crate::passes::reference::photon_map::{Photon, PhotonGrid, PhotonMap};
use crate::passes::reference::photon_reach;
use crate::reference::TracedScene;
use crate::scene::{Scene, Triangle, solids::Solids, surfaces};
use crate::types::{Node, Surface};
use glam::Vec3;
use std::sync::Arc;

/// Points of equal area for each irradiance point. Their kernel sum is the mass of the kernel.
const AREA_POINTS: u32 = 4;
/// Maximum number of irradiance points: it bounds the area points' map to 75 MiB.
const MAX_POINTS: u32 = 1 << 19;

/// The surfaces that light can reach.
pub(super) struct Reachable {
    surfaces: Vec<Surface>,
    low: Vec3,
    /// Area of all sides that light can reach, m².
    pub(super) area_m2: f64,
}

impl Reachable {
    pub(super) fn new(context: &Arc<Context>, scene: &TracedScene) -> Result<Self> {
        let sees = surfaces::sides_that_see_something(&scene.scene.triangles);
        let pairs = scene.scene.triangles.iter().zip(sees);
        let mut surfaces: Vec<Surface> =
            pairs.map(|(triangle, active)| surfaces::surface(triangle, active)).collect();
        let root: Vec<Node> = scene.buffers.nodes.followed().read_range(0, 1)?;
        let clear_distance = ClearDistance::new(&root[0], &scene.scene.cell_sizes);
        let rays = Rays::new(context)?;
        let solids = Solids::of_scene(&scene.scene);
        let (buffers, world) = (&scene.buffers, &scene.scene);
        sides::deactivate_unreachable(&rays, buffers, world, &solids, clear_distance, &mut surfaces)?;
        let area_m2 = active_sides(&scene.scene.triangles, &surfaces).map(|(_, area)| area).sum();
        Ok(Self { surfaces, low: scene.scene.bounds().0, area_m2 })
    }
}

/// Points for irradiance estimates of one photon map after another, with one radius.
pub(super) struct IrradiancePoints {
    map: PhotonMap,
    count: u32,
    reaches: Buffer,
    masses: Buffer,
    irradiances: Buffer,
    grid: PhotonGrid,
    radius: f32,
}

impl IrradiancePoints {
    /// Spreads points half a radius apart and computes the surface area within the kernel of each.
    pub(super) fn new(
        context: &Arc<Context>,
        scene: &TracedScene,
        reachable: &Reachable,
        radius: f32,
        estimate: &mut PhotonIrradiance,
        ms: &mut f64,
    ) -> Result<Self> {
        let grid = PhotonGrid { low: reachable.low - radius, inverse_cell: radius.recip() };
        let count = (4.0 * reachable.area_m2 / f64::from(radius).powi(2)).ceil() as u32;
        let count = count.min(MAX_POINTS);
        let area_points = spread(&scene.scene, &reachable.surfaces, count * AREA_POINTS);
        let count = area_points.len().div_ceil(AREA_POINTS as usize) as u32;
        let points: Vec<Photon> = area_points.iter().step_by(AREA_POINTS as usize).copied().collect();

        let map = map_of(context, &scene.buffers, &points, grid, ms)?;
        let reaches = photon_reach::trace(context, &scene.buffers, &map.entries, count, radius, ms)?;
        let storage = |name| Buffer::storage(context, name, u64::from(count) * size_of::<Vec3>() as u64);
        let ones = Buffer::from_slice(context, "ones", &vec![Vec3::ONE; count as usize])?;
        let this = Self {
            map,
            count,
            reaches,
            masses: storage("kernel masses")?,
            irradiances: storage("irradiances")?,
            grid,
            radius,
        };
        let areas = map_of(context, &scene.buffers, &area_points, grid, ms)?;
        estimate.estimate(this.points(), &areas, grid, radius, &ones, &this.masses, ms)?;
        Ok(this)
    }

    /// Radius of the density estimate, metres.
    pub(super) fn radius(&self) -> f32 {
        self.radius
    }

    /// Sorts photons and estimates their irradiance at all points. The map uses `slots` slots.
    pub(super) fn estimate(
        &self,
        context: &Arc<Context>,
        scene: &SceneBuffers,
        photons: &PhotonMap,
        slots: u32,
        estimate: &mut PhotonIrradiance,
        ms: &mut f64,
    ) -> Result<()> {
        *ms += photons.build(context, scene, self.grid, slots)?;
        let (masses, irradiances) = (&self.masses, &self.irradiances);
        estimate.estimate(self.points(), photons, self.grid, self.radius, masses, irradiances, ms)
    }

    /// The irradiance that gather rays read.
    pub(super) fn irradiance(&self) -> Irradiance<'_> {
        Irradiance {
            points: &self.map.entries,
            entry_offsets: &self.map.entry_offsets,
            reaches: &self.reaches,
            irradiances: &self.irradiances,
            grid: self.grid,
            radius: self.radius,
        }
    }

    fn points(&self) -> Points<'_> {
        Points { entries: &self.map.entries, reaches: &self.reaches, count: self.count }
    }
}

fn map_of(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    photons: &[Photon],
    grid: PhotonGrid,
    ms: &mut f64,
) -> Result<PhotonMap> {
    let map = PhotonMap::new(context, photons.len() as u32)?;
    map.slots.write(photons)?;
    *ms += map.build(context, scene, grid, photons.len() as u32)?;
    Ok(map)
}

/// Spreads `count` points over the active sides, each with its area (m²) as flux. Sides get
/// points by area. On a side the points form a lattice: consecutive points of the additive
/// recurrence R2. [Roberts 2018] Points in holes are left out.
fn spread(scene: &Scene, surfaces: &[Surface], count: u32) -> Vec<Photon> {
    let Scene { triangles, opacity, .. } = scene;
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let total: f64 = active_sides(triangles, surfaces).map(|(_, area)| area).sum();
    let area = Vec3::splat((total / f64::from(count)) as f32);
    let mut points = Vec::with_capacity(count as usize);
    let (mut running, mut first) = (0.0, 0);
    for (side, side_area) in active_sides(triangles, surfaces) {
        let [p0, p1, p2] = triangles[side as usize / 2].positions;
        running += side_area / total * f64::from(count);
        // Point i goes to the side that holds the fraction (i + ½) / count of the area.
        let end = ((running + 0.5).floor() as u32).min(count);
        points.extend((first..end).map(|index| {
            let [u, v] = STEPS.map(|step| (0.5 + f64::from(index) * step).fract());
            // The far half of the parallelogram is folded back.
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }.map(|w| w as f32);
            Photon { position: p0 + u * (p1 - p0) + v * (p2 - p0), side, flux: area }
        }));
        first = end;
    }
    points.retain(|point| !opacity.is_hole_at(triangles, point.side / 2, point.position.as_dvec3()));
    points
}

/// The active sides, as 2·triangle + (1 if the back side), and their areas, m².
fn active_sides(triangles: &[Triangle], surfaces: &[Surface]) -> impl Iterator<Item = (u32, f64)> {
    let active = |side: &u32| surfaces[*side as usize / 2].side_is_active(side % 2 == 1);
    (0..2 * triangles.len() as u32).filter(active).map(|side| (side, triangles[side as usize / 2].area_m2()))
}

/// Centre and radius of the sphere around a scene's bounding box, metres.
pub(super) fn bounding_sphere(scene: &Scene) -> (Vec3, f32) {
    let (low, high) = scene.bounds();
    (0.5 * (low + high), 0.5 * (high - low).length() * 1.001)
}
