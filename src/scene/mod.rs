//! A scene on the host: triangles, materials, lights, cameras and quality settings, all
//! in SI units.
//!
//! World space is right-handed with +Y up. Loading recentres the scene in f64 and stores the offset
//! in `origin`. So f32 coordinates keep their precision for models far from the world's origin.

use glam::{DVec3, Vec2, Vec3};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

mod alpha;
pub mod builtin;
pub mod bvh;
pub mod camera;
pub mod cell_sizes;
mod checks;
pub mod clip;
mod cluster_key;
mod containers;
mod coordinates;
mod cutouts;
pub mod directions;
mod display_transform;
pub mod emission;
pub mod emitters;
pub mod environment;
mod file;
pub mod film;
mod fit;
pub mod fragment;
mod geometry;
mod gltf;
pub mod grid;
pub mod host_bvh;
pub mod hvds;
mod image_map;
pub mod keys;
mod kinds;
pub mod light;
mod light_power;
pub mod limits;
mod lines;
mod load_options;
pub mod luminaire;
pub mod material;
mod material_images;
mod material_names;
pub mod measures;
pub mod mesh_edges;
mod metallic;
pub mod meter;
mod missed;
mod model_keys;
mod models;
mod mtl;
mod mtl_draft;
mod named;
pub mod naming;
mod notes;
mod numbers;
mod obj;
mod obj_lines;
mod objects;
pub mod octahedral;
pub mod octree;
pub mod opacity;
pub mod panes;
pub mod photometry;
mod picture_keys;
mod ply;
mod polygons;
pub mod quality;
mod reading;
mod regions;
pub mod save;
mod settings;
pub mod shapes;
pub mod silhouettes;
mod sky;
mod smoothing;
pub mod solids;
pub mod split_planes;
mod stacked_surfaces;
mod stl;
mod subdivide;
mod sun_sky;
pub mod surfaces;
pub mod texture;
mod transparency;
pub mod unweighted;
mod value;
mod vertex_colours;
mod visible_lights;
mod white_balance;
pub(crate) mod words;

pub use camera::Camera;
pub use cell_sizes::CellSizes;
pub use coordinates::unit_direction;
pub use display_transform::{DisplayConstants, DisplayTransform, ToneCurve};
pub use emission::Emission;
pub use film::Film;
pub use fit::{Place, Up};
pub use kinds::is_model;
pub use light::{Light, LightKind};
pub use load_options::LoadOptions;
pub use load_options::Memory;
pub use material::Material;
pub use measures::{Measure, Measures};
pub use meter::Meter;
#[doc(hidden)]
pub use naming::Naming;
pub use opacity::OpacityMaps;
pub use panes::Pane;
pub use picture_keys::PictureKeys;
pub use quality::Quality;
pub use texture::{Image, Texture};
pub use white_balance::WhiteBalance;

/// A triangle with its vertex attributes. Positions are recentred world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners, counter-clockwise seen from the front.
    pub positions: [Vec3; 3],
    /// Unit shading normals at the corners; the geometric normal if the model has none.
    pub normals: [Vec3; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::objects`].
    pub object: u32,
}

impl Triangle {
    /// Twice the area times the unit front normal, in f64: `(p1 - p0) × (p2 - p0)`.
    pub fn cross(&self) -> DVec3 {
        let [p0, p1, p2] = self.positions.map(Vec3::as_dvec3);
        (p1 - p0).cross(p2 - p0)
    }

    /// Area in m².
    pub fn area_m2(&self) -> f64 {
        0.5 * self.cross().length()
    }

    /// Unit geometric normal of the front side. It exists because loading
    /// drops degenerate triangles.
    pub fn geometric_normal(&self) -> Vec3 {
        self.cross().normalize().as_vec3()
    }

    /// Weights of the corners at a point of the plane.
    pub fn weights_at(&self, position: DVec3) -> DVec3 {
        let [p0, p1, p2] = self.positions.map(Vec3::as_dvec3);
        let normal = (p1 - p0).cross(p2 - p0);
        let [y, z] = [(position - p0).cross(p2 - p0), (p1 - p0).cross(position - p0)]
            .map(|part| part.dot(normal) / normal.length_squared());
        DVec3::new(1.0 - y - z, y, z)
    }
}

/// A checked scene: at least one triangle, one camera and finite numbers everywhere.
#[derive(Clone, Debug)]
pub struct Scene {
    /// File stem or built-in name; names outputs and tables.
    pub name: String,
    /// Non-degenerate triangles, recentred.
    pub triangles: Vec<Triangle>,
    /// Image coordinates of the triangles' corners: u from the left, v from below, 0..=1 over the
    /// image. Empty if no material has an image.
    pub texture_coordinates: Vec<[Vec2; 3]>,
    /// Holes of the triangles.
    pub opacity: OpacityMaps,
    /// Thin surfaces that let light pass and reflect nothing.
    pub panes: Vec<Pane>,
    /// Sizes of the cells that hold light.
    pub cell_sizes: CellSizes,
    /// Materials that triangles refer to.
    pub materials: Vec<Material>,
    /// Names of the objects that triangles belong to, each once: nodes of a glTF model, `o` of an
    /// OBJ model, other models by their files, and visible lights.
    pub objects: Vec<String>,
    /// Indices of the objects of each model of the scene file; none if it is hidden.
    pub model_objects: Vec<Range<u32>>,
    /// Smallest and largest corner of each model of the scene file, recentred. `None`: it is
    /// hidden, or has no vertex.
    pub model_boxes: Vec<Option<[Vec3; 2]>>,
    /// Whether each model of the scene file can move.
    pub model_is_movable: Vec<bool>,
    /// Lights, recentred; empty only if a command allows it. Emitting materials and the sky follow
    /// the lights of the scene file.
    pub lights: Vec<Light>,
    /// Surfaces and directions that these lights stand for.
    pub emission: Arc<Emission>,
    /// Light meters, recentred.
    pub meters: Vec<Meter>,
    /// Cameras, recentred; at least one, the first is the default.
    pub cameras: Vec<Camera>,
    /// Interior viewpoints beside the cameras: closed spaces around them take part in transport.
    pub interior_viewpoints: Vec<Vec3>,
    /// How the scene file displays the picture.
    pub picture: PictureKeys,
    /// Every number of the method that trades time for accuracy.
    pub quality: Quality,
    /// The same with the numbers of the `draft` preset, for a first picture.
    pub draft: Quality,
    /// Offset subtracted from all coordinates at load, world metres.
    pub origin: DVec3,
    /// Files on disk that the scene was read from: scene file, models, materials, images. No output
    /// may replace them.
    pub inputs: Vec<PathBuf>,
    /// Repairs and chosen defaults at load, one sentence each, for stderr.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Reorders the triangles; `order` lists the old indices.
    #[doc(hidden)]
    pub fn reorder(&mut self, order: &[u32]) {
        self.triangles = order.iter().map(|&index| self.triangles[index as usize]).collect();
        if !self.texture_coordinates.is_empty() {
            let coordinates = order.iter().map(|&index| self.texture_coordinates[index as usize]);
            self.texture_coordinates = coordinates.collect();
        }
        self.opacity.reorder(order);
    }

    /// What random decisions are named by: places, if a model can move.
    #[doc(hidden)]
    pub fn naming(&self) -> Naming {
        match self.model_is_movable.contains(&true) {
            true => Naming::Place,
            false => Naming::Number,
        }
    }

    /// Whether each triangle, in the order of loading, belongs to a model that can move.
    pub(crate) fn movable_triangles(&self) -> Vec<bool> {
        let mut is_movable = vec![false; self.objects.len()];
        let models = self.model_objects.iter().zip(&self.model_is_movable);
        for (objects, _) in models.filter(|(_, is_movable)| **is_movable) {
            objects.clone().for_each(|object| is_movable[object as usize] = true);
        }
        self.triangles.iter().map(|triangle| is_movable[triangle.object as usize]).collect()
    }

    /// Total one-sided surface area without holes, m².
    pub fn area_m2(&self) -> f64 {
        let solid =
            |(index, triangle): (u32, &Triangle)| triangle.area_m2() * self.opacity.solid_fraction(index);
        (0..).zip(&self.triangles).map(solid).sum()
    }

    /// Extent in which rays are short enough for small cells: that of the regions with small cells,
    /// or of the whole scene, metres.
    #[doc(hidden)]
    pub fn span_m(&self) -> f32 {
        let (low, high) = self.bounds();
        self.cell_sizes.span_m().unwrap_or_else(|| (high - low).length())
    }

    /// Interior viewpoints: all cameras and `places`. An enclosure without any of them is never
    /// seen and takes no part in transport. A light in it has no visible effect either.
    #[doc(hidden)]
    pub fn viewpoints(&self) -> Vec<Vec3> {
        self.cameras
            .iter()
            .map(|camera| camera.position)
            .chain(self.interior_viewpoints.iter().copied())
            .collect()
    }

    /// Number of measuring points of all meters, and of cache points at each. Zero without cache
    /// points: there is no indirect light then.
    #[doc(hidden)]
    pub fn measuring_points(&self) -> [usize; 2] {
        let count: usize = self.meters.iter().map(Meter::count).sum();
        match self.quality.cache_points {
            0 => [0, 1],
            _ => [count, meter::cache_points_at(count, self.quality.gather_rays)],
        }
    }

    /// Smallest and largest corner of the bounding box, metres.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.triangles
            .iter()
            .flat_map(|t| t.positions)
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
    }

    /// The lines of `info`: label and value, in world coordinates.
    pub fn summary(&self) -> Vec<(String, String)> {
        let row = |label: &str, value: String| (label.to_owned(), value);
        let (low, high) = self.bounds();
        let [low, high] = [low, high].map(|corner| corner.as_dvec3() + self.origin);
        let names = |names: Vec<&str>| names.join(", ");
        let mut rows = vec![
            row("scene", self.name.clone()),
            row("triangles", self.triangles.len().to_string()),
            row("area", format!("{:.3} m²", self.area_m2())),
            row("bounds", format!("{low:.3} to {high:.3} m")),
            row("materials", names(self.materials.iter().map(|material| material.name.as_str()).collect())),
        ];
        let sizes = &self.cell_sizes;
        if !sizes.regions.is_empty() {
            let least = 0.5f64.powi(sizes.max_halvings() as i32) * 100.0;
            let count = sizes.regions.len();
            rows.push(row("small cells", format!("{count} regions, down to {least:.2} % of the full width")));
        }
        let images = self.materials.iter().filter_map(|material| {
            let [width, height] = material.texture.as_ref()?.image.size;
            Some(row("image", format!("{} ({width}×{height})", material.name)))
        });
        rows.extend(images);
        rows.extend(
            self.lights.iter().map(|light| row("light", format!("{} ({})", light.name, light.kind.word()))),
        );
        rows.extend(self.meters.iter().map(|meter| {
            let [columns, rows] = meter.grid();
            row("meter", format!("{} ({columns}×{rows})", meter.name))
        }));
        rows.extend(self.cameras.iter().map(|camera| {
            let [width, height] = camera.size;
            row("camera", format!("{} ({width}×{height}, {}°)", camera.name, camera.fov_y_degrees))
        }));
        rows
    }
}
