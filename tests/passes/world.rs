//! A small scene on host and device, and the comparison of numbers.

use std::sync::Arc;

use crate::common::{context, random_words};
use glam::{DVec3, Vec2, Vec3};
use lightpaths::cpu::math::ClearDistance;
use lightpaths::cpu::rays::Geometry;
use lightpaths::cpu::sampling::hash;
use lightpaths::cpu::textures::Textures;
use lightpaths::error::Result;
use lightpaths::gpu::{Buffer, Context, Pipeline, Recorder};
use lightpaths::layout::GpuStruct;
use lightpaths::passes::precompute::entry_points::Strata;
use lightpaths::passes::precompute::path_orders::LightPaths;
use lightpaths::passes::precompute::{Silent, light_paths};
use lightpaths::passes::{ClusterBuffers, ClusterTables, SceneBuffers, reflectances};
use lightpaths::scene::bvh::Bvh;
use lightpaths::scene::grid::CellGrid;
use lightpaths::scene::hvds::Hvds;
use lightpaths::scene::mesh_edges::Mesh;
use lightpaths::scene::opacity::MAX_LEVEL;
use lightpaths::scene::{
    CellSizes, Image, Material, Naming, OpacityMaps, Scene, Texture, Triangle, grid, shapes, surfaces,
};
use lightpaths::types::{CachePoint, PathVertex, PixelSurface, Reflectance, Surface};

/// Relative tolerance of the result of a few operations.
pub(crate) const FLOAT: f64 = 1e-5;
/// Relative tolerance of a sum.
pub(crate) const SUM: f64 = 1e-4;

/// Number of entry points in the tests: low enough that many base clusters are below the minimum
/// sample count of gather rays.
const ENTRY_POINTS: u32 = 5_000;

/// Reproducible numbers in [0, 1).
pub(crate) struct Random(std::vec::IntoIter<u32>, u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Vec::new().into_iter(), seed << 32)
    }

    pub(crate) fn word(&mut self) -> u32 {
        if self.0.as_slice().is_empty() {
            self.1 += 1;
            self.0 = random_words(self.1, 4096).into_iter();
        }
        self.0.next().unwrap()
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: u32) -> u32 {
        self.word() % end
    }

    pub(crate) fn unit(&mut self) -> f32 {
        (self.word() >> 8) as f32 / 16_777_216.0
    }

    /// A point in [-1, 1)³.
    pub(crate) fn cube(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.unit(), self.unit(), self.unit()) - 1.0
    }

    /// A uniform direction on the unit sphere.
    pub(crate) fn sphere(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if v.length() < 1.0 && v.length() > 0.01 {
                return v.normalize();
            }
        }
    }
}

/// A scene with its triangles in BVH order, and every buffer that passes bind.
pub(crate) struct World {
    pub context: Arc<Context>,
    pub triangles: Vec<Triangle>,
    pub surfaces: Vec<Surface>,
    pub coordinates: Vec<[Vec2; 3]>,
    pub opacity: OpacityMaps,
    pub materials: Vec<Material>,
    pub hvds: Hvds,
    /// Density of entry points on each fragment of `hvds`: all possible values, in no order.
    pub densities: Vec<f32>,
    /// Expected number of entry points of each cluster.
    pub in_clusters: Vec<f32>,
    pub buffers: SceneBuffers,
    pub clusters: ClusterBuffers,
    pub clear_distance: ClearDistance,
}

impl World {
    pub(crate) fn new(scene: &Scene, cells: u32) -> Self {
        let (low, high) = scene.bounds();
        Self::on_grid(scene, grid::grid(low, high, cells))
    }

    pub(crate) fn on_grid(scene: &Scene, grid: CellGrid) -> Self {
        let context = context();
        let bvh = Bvh::of_scene(scene).unwrap();
        let mut ordered = scene.clone();
        ordered.reorder(&bvh.order);
        let sees = surfaces::sides_that_see_something(&ordered.triangles);
        let surfaces: Vec<_> =
            ordered.triangles.iter().zip(sees).map(|(t, sees)| surfaces::surface(t, sees)).collect();
        let buffers = SceneBuffers::new(&context, &bvh, &ordered, &surfaces).unwrap();
        let mesh = Mesh::of(&ordered.triangles);
        let buffers = buffers.with_mesh_edges(&context, &ordered, &mesh).unwrap();
        let Scene { triangles, texture_coordinates: coordinates, opacity, materials, .. } = ordered;
        let hvds = Hvds::build_split(&triangles, &surfaces, grid);
        let every_third: Vec<bool> = hvds.levels[0].clone().map(|cluster| cluster % 3 == 0).collect();
        let hvds = hvds.with_unweighted(&every_third);
        let densities: Vec<f32> = (0..hvds.fragments.len())
            .map(|fragment| 1.0 + 7.0 * (fragment as f32 * 0.618_034).fract())
            .collect();
        let in_clusters =
            Strata::new(&hvds, &densities, |_| 1.0, ENTRY_POINTS, (1, Naming::Number)).in_clusters;
        let clusters = ClusterTables::new(&hvds, &in_clusters).upload(&context).unwrap();
        let clear_distance = ClearDistance::new(&bvh.nodes[0], &scene.cell_sizes);
        Self {
            context,
            triangles,
            surfaces,
            coordinates,
            opacity,
            materials,
            hvds,
            densities,
            in_clusters,
            buffers,
            clusters,
            clear_distance,
        }
    }

    /// A closed room of 2×1.5×1 m with sixty floating triangles, whose shading normals differ
    /// from their planes.
    pub(crate) fn room() -> Self {
        Self::new(&room(), 16)
    }

    /// The room with images on its walls.
    pub(crate) fn textured_room() -> Self {
        Self::new(&textured(room()), 16)
    }

    /// The room with floating triangles that can move.
    pub(crate) fn room_with_movable_leaves() -> Self {
        let mut scene = room();
        let walls = shapes::closed_box(Vec3::ONE, 0.5).triangles.len();
        scene.triangles.iter_mut().skip(walls).for_each(|leaf| leaf.object = 1);
        scene.objects = ["walls", "leaves"].map(str::to_owned).to_vec();
        scene.model_objects = vec![0..1, 1..2];
        scene.model_is_movable = vec![false, true];
        Self::new(&scene, 16)
    }

    /// The room with holes in every third triangle.
    pub(crate) fn room_with_holes() -> Self {
        Self::new(&with_holes(room()), 16)
    }

    pub(crate) fn glossy_room() -> Self {
        Self::new(&glossy(room()), 16)
    }

    /// Images on glossy surfaces.
    pub(crate) fn textured_glossy_room() -> Self {
        Self::new(&textured(glossy(room())), 16)
    }

    /// The light paths of entry points, which it returns in the order of the paths.
    pub(crate) fn light_paths(
        &self,
        entry_points: Vec<PathVertex>,
        seed: u32,
    ) -> Result<(Vec<PathVertex>, LightPaths)> {
        let (context, buffers, materials) = (&self.context, &self.buffers, &self.materials);
        let streams: Vec<u32> = (0..entry_points.len() as u32).map(hash).collect();
        let vertices = light_paths::trace(
            context,
            buffers,
            &self.clusters,
            (materials, &CellSizes::default()),
            (&entry_points, &streams),
            seed,
            &mut Silent,
        )?;
        let (base_count, has_images) = (self.clusters.base_count, buffers.textures.are_used);
        let entries = (entry_points, streams);
        Ok(LightPaths::new(vertices, entries, &self.surfaces, materials, base_count, has_images))
    }

    pub(crate) fn reflectances(&self) -> Vec<Reflectance> {
        reflectances(&self.materials)
    }

    pub(crate) fn geometry(&self) -> Geometry<'_> {
        Geometry {
            triangles: &self.triangles,
            surfaces: &self.surfaces,
            textures: Textures { materials: &self.materials, coordinates: &self.coordinates },
            opacity: &self.opacity,
            clear_distance: self.clear_distance,
        }
    }

    /// A uniform point of a random side, its interpolated shading normal, and the side.
    pub(crate) fn surface_point(&self, random: &mut Random) -> (Vec3, Vec3, u32) {
        let side = random.below(2 * self.triangles.len() as u32);
        let Triangle { positions: [p0, p1, p2], normals: [n0, n1, n2], .. } =
            self.triangles[side as usize / 2];
        let (along, v) = (random.unit().sqrt(), random.unit());
        let mix = |a: Vec3, b: Vec3, c: Vec3| (1.0 - along) * a + along * ((1.0 - v) * b + v * c);
        let normal = mix(n0, n1, n2).normalize();
        (mix(p0, p1, p2), if side % 2 == 1 { -normal } else { normal }, side)
    }

    pub(crate) fn cache_points(&self, random: &mut Random, count: usize, radius: f32) -> Vec<CachePoint> {
        let point = |index| {
            let (position, normal, side) = self.surface_point(random);
            // Every second point has an occluder plane, half a radius away in a random direction.
            let wall = if random.below(2) == 0 { Vec3::ZERO } else { random.cube() * 2.0 / radius };
            let facet = self.geometry().normal(side);
            // Every fourth point counts less beyond an eighth of a radius.
            let inverse_reach = if index % 4 == 0 { 8.0 / radius } else { 0.0 };
            CachePoint {
                position,
                radius: radius * (0.5 + random.unit()),
                normal,
                side,
                occluder: wall,
                facet,
                inverse_reach,
                stream: hash(index),
            }
        };
        (0..count as u32).map(point).collect()
    }

    pub(crate) fn pixels(&self, random: &mut Random, count: usize) -> Vec<PixelSurface> {
        let pixel = |_| {
            let (position, normal, side) = self.surface_point(random);
            PixelSurface { position, side, normal, footprint: 1e-3 * random.unit() }
        };
        (0..count).map(pixel).collect()
    }

    /// Runs one dispatch of a pass whose host part hides its pipeline.
    pub(crate) fn dispatch(
        &self,
        stem: &'static str,
        constants: &[(&str, u32)],
        threads: impl FnOnce(&Pipeline) -> u32,
        push: &impl GpuStruct,
        bindings: &[(&str, &Buffer)],
    ) {
        let pipeline = Pipeline::new(&self.context, stem, constants).unwrap();
        let threads = [threads(&pipeline), 1, 1];
        let record = |rec: &mut Recorder| {
            rec.pass(stem).dispatch(&pipeline, threads, push, bindings);
        };
        self.context.run(record).unwrap();
    }
}

pub(crate) fn room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.7);
    let colours = [Vec3::new(0.9, 0.8, 0.7), Vec3::new(0.6, 0.1, 0.05), Vec3::new(0.1, 0.5, 0.2), Vec3::ZERO];
    let material = scene.materials[0].clone();
    scene.materials = colours.map(|diffuse| Material { diffuse, ..material.clone() }).to_vec();
    for (index, triangle) in scene.triangles.iter_mut().enumerate() {
        triangle.material = index as u32 % 3;
    }
    let mut random = Random::new(7);
    for index in 0..60 {
        let centre = random.cube() * Vec3::new(0.8, 0.55, 0.35);
        let positions = [0; 3].map(|_| centre + 0.12 * random.cube());
        let mut triangle = Triangle { positions, normals: [Vec3::ZERO; 3], material: index % 4, object: 0 };
        let normal = triangle.geometric_normal();
        triangle.normals = [0; 3].map(|_| (normal + 0.2 * random.cube()).normalize());
        scene.triangles.push(triangle);
    }
    scene
}

/// Images on two of three materials: one repeats, and one does not; noise of all codes.
pub(crate) fn textured(mut scene: Scene) -> Scene {
    let mut random = Random::new(17);
    for (index, material) in scene.materials.iter_mut().enumerate().filter(|(index, _)| index % 3 != 1) {
        let size = [[5, 3], [2, 8]][index % 2];
        let codes = (0..size[0] * size[1]).map(|_| [0; 3].map(|_| random.word() as u8)).collect();
        material.texture =
            Some(Texture { image: Arc::new(Image { size, codes }), is_clamped: index == 2, is_atlas: false });
    }
    let mut corner = || 2.0 * random.cube().truncate();
    scene.texture_coordinates = scene.triangles.iter().map(|_| [corner(), corner(), corner()]).collect();
    scene
}

/// Fails unless all components agree to `tolerance` relative to the larger of the reference's
/// largest one and `scale`.
#[track_caller]
pub(crate) fn assert_near(device: Vec3, reference: DVec3, tolerance: f64, scale: f64, what: &str) {
    let bound = tolerance * reference.abs().max_element().max(scale);
    let error = (device.as_dvec3() - reference).abs();
    assert!(error.max_element() <= bound, "{what}: {device} on the device, {reference} by the reference");
}

/// Cuts holes of many sizes into every third triangle.
pub(crate) fn with_holes(mut scene: Scene) -> Scene {
    let level = |index: u32| if index.is_multiple_of(3) { 1 + index / 3 % MAX_LEVEL } else { 0 };
    let levels: Vec<u32> = (0..scene.triangles.len() as u32).map(level).collect();
    let is_hole = |triangle: usize, centre: DVec3| {
        let waves = (9.0 + triangle as f64) * centre;
        waves.x.sin() + waves.y.cos() * waves.z.sin() > 0.4
    };
    scene.opacity = OpacityMaps::new(&levels, is_hole);
    scene
}

/// One of a scene's materials is glossy, one is editable and has a little broad gloss.
pub(crate) fn glossy(mut scene: Scene) -> Scene {
    let lobes = [(20.0, Vec3::new(0.3, 0.2, 0.4)), (5.0, Vec3::new(0.15, 0.03, 0.015))];
    for (material, (exponent, specular)) in scene.materials.iter_mut().zip(lobes) {
        material.diffuse *= 0.5;
        material.specular = specular;
        material.exponent = exponent;
    }
    scene.materials[1].editable = true;
    scene
}
