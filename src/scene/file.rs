//! Loading a scene: the TOML file, its models, the changes of the command line, and defaults
//! for missing sections.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};

use super::builtin::{self, Files, utf8};
use super::cutouts::Coverage;
use super::geometry::{Assembled, too_many};
use super::keys;
use super::load_options::LoadOptions;
use super::models::{
    Models, NOWHERE, Visible, box_of, built_in, counted, of_one_mesh, override_materials, read_gltf,
    read_obj, refuse_repeated, refuse_triangles, visible,
};
use super::objects::Objects;
use super::reading::Reading;
use super::settings::{SECTIONS, Setting};
use super::value::{Kind, Node, Origin, Section, unknown};
use super::{
    Camera, Emission, Light, PictureKeys, Quality, Scene, Triangle, camera, emission, fit, gltf, kinds,
    limits, material_images, meter, model_keys, ply, regions, sky, stl, subdivide, vertex_colours,
    visible_lights,
};
use crate::files::guarded;
use crate::{Error, Result};

impl Scene {
    /// Loads a scene file, a model alone (with a chosen camera and light, if it has
    /// none), or a built-in scene by name.
    ///
    /// Paths in a file are relative to that file. They stay in its folder or below it unless the
    /// options allow more. [`Scene::warnings`] lists repairs and chosen defaults.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown built-in name or options that do not fit the scene;
    /// [`Error::Input`] with file, line and key for each fault in a file.
    pub fn load(spec: &str, options: &LoadOptions) -> Result<Self> {
        let (mut source, others) = Source::prepare(spec, options)?;
        let file = source.file.clone();
        let (mut warnings, mut inputs) = (Vec::new(), source.inputs());
        let with_image = material_images::names(&source.root);
        let mut reading = Reading::new(source.files.clone(), with_image, &mut warnings, &mut inputs);
        let (mut models, mut objects) = source.load_models(&mut reading)?;
        let images = material_images::read(&file, &source.root, &source.files, &mut reading)?;
        reading.finish();
        source.take_views(std::mem::take(&mut models.cameras), std::mem::take(&mut models.lights));
        override_materials(&file, &source.root, &mut models, &images, &mut warnings)?;
        let Visible { assembled, mut opacity, panes } =
            visible(&mut models, &mut warnings).map_err(|message| Error::input(&file, message))?;
        let Assembled { mut triangles, mut coordinates, colours, origin } = assembled;
        let (mut materials, of_models) = (models.materials, triangles.len());
        drop(models.meshes);
        let surface = vertex_colours::Surface { triangles: &triangles, colours: &colours };
        let folded = surface.colour(&mut materials, &mut coordinates);
        warnings.extend(counted(folded.first(), folded.len()));
        let emits = triangles.iter().any(|t| materials[t.material as usize].emission != Vec3::ZERO);
        let wish = fit::Wish { place: options.place, up: options.up };
        if !is_empty(source.root.get("camera")) {
            wish.refuse_for(&file)?;
        }
        let wish = wish.for_models(&source.root);
        let emitting = |material: u32| materials[material as usize].emission != Vec3::ZERO;
        let choose = |own: Option<&Camera>| fit::choose(&triangles, origin, wish, own, emitting);
        source.complete(origin, choose, emits, &mut warnings)?;
        let mut drafted = source.clone();
        drafted.choose_preset("draft");
        source.change(&others, options)?;
        drafted.change(&others, options)?;

        let root = &source.root;
        let (quality, draft) = (source.quality()?, drafted.quality()?);
        let mut lights = read_lights(&file, root, origin, &source.files)?;
        let measured = lights.iter().filter_map(|light| light.luminaire.as_ref());
        inputs.extend(measured.filter_map(|luminaire| source.files.on_disk(&luminaire.file)));
        visible_lights::show(
            (&file, root),
            &mut lights,
            (&mut materials, &mut objects),
            (&mut triangles, &mut coordinates),
        )?;
        opacity.add_full(triangles.len() - of_models);
        let cameras = read_cameras(&file, root, origin)?;
        let regions = regions::find(&triangles, &cameras, &lights);
        let stays = |triangle: usize| opacity.has_holes(triangle as u32);
        let added = match regions.is_empty() {
            true => 0,
            false => subdivide::subdivide(&mut triangles, &mut coordinates, &regions, stays),
        };
        opacity.add_full(added);
        let cell_sizes = regions::reach(&triangles, regions);
        emission::choose_sides(&triangles, &mut materials);
        let stated = sky::read((&file, root), &source.files, &mut inputs)?;
        let (sky, placing) = stated.map_or((None, None), |stated| (Some(stated.sky), Some(stated.placing)));
        let emission = Emission::new(&triangles, &materials, sky);
        lights.extend(emission.lights(&materials, placing, &lights));
        let is_textured = |triangle: &Triangle| materials[triangle.material as usize].texture.is_some();
        let texture_coordinates = match materials.iter().any(|material| material.texture.is_some()) {
            // Triangles without texture coordinates show the image's lower left corner.
            true if coordinates.is_empty() && triangles.iter().any(is_textured) => {
                vec![[Vec2::ZERO; 3]; triangles.len()]
            }
            true => coordinates,
            false => Vec::new(),
        };
        let recentred = |corners: [DVec3; 2]| corners.map(|corner| (corner - origin).as_vec3());
        let mut scene = Self {
            name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            triangles,
            texture_coordinates,
            opacity,
            panes,
            cell_sizes,
            materials,
            objects: objects.into_names(),
            model_objects: models.of_models,
            model_boxes: models.boxes.into_iter().map(|corners| corners.map(recentred)).collect(),
            model_is_movable: models.are_movable,
            lights,
            emission: Arc::new(emission),
            meters: meter::read_all(&file, root, origin)?,
            cameras,
            picture: PictureKeys::read(&file, root)?,
            quality,
            draft,
            origin,
            interior_viewpoints: Vec::new(),
            inputs,
            warnings,
        };
        if !scene.lights.iter().any(|light| light.is_on && light.kind.emission() != Vec3::ZERO) {
            scene.warnings.push("all lights are off or black, and so is the picture".to_owned());
        }
        scene.choose_camera(options)?;
        Ok(scene)
    }

    fn choose_camera(&mut self, options: &LoadOptions) -> Result<()> {
        if let Some(name) = &options.camera {
            let names: Vec<&str> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
            let found = names.iter().position(|camera| camera == name);
            let index = found
                .ok_or_else(|| Error::Usage(format!("--camera: {}", unknown("camera", &names, name))))?;
            self.cameras[..=index].rotate_right(1);
        }
        if let Some([width, height]) = options.size {
            if !camera::SIZE.contains(&width) || !camera::SIZE.contains(&height) {
                let (low, high) = (camera::SIZE.start(), camera::SIZE.end());
                let message =
                    format!("--size {width}x{height}: width and height must be {low} to {high} pixels");
                return Err(Error::Usage(message));
            }
            self.cameras.iter_mut().for_each(|camera| camera.size = [width, height]);
        }
        Ok(())
    }
}

/// A scene file before its values are read.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) files: Files,
    /// The file that the user named; the built-in's file name.
    pub(super) file: PathBuf,
    /// The file's text; for a model alone, the text of an equivalent scene file.
    pub(super) text: String,
    pub(super) root: Node,
    /// The user named a model; `root` only refers to it.
    is_model_only: bool,
}

impl Source {
    fn open(spec: &str, options: &LoadOptions) -> Result<Self> {
        let extension = Path::new(spec).extension().map(|extension| extension.to_ascii_lowercase());
        let (files, file) = match extension.as_deref().and_then(|extension| extension.to_str()) {
            Some("toml" | "obj" | "gltf" | "glb" | "ply" | "stl") => {
                (Files::from_options(Path::new(spec), options), PathBuf::from(spec))
            }
            _ if builtin::NAMES.contains(&spec) => (Files::Embedded, PathBuf::from(format!("{spec}.toml"))),
            _ => return Err(kinds::no_scene(spec)),
        };
        let is_model_only = kinds::is_model(spec) && !matches!(files, Files::Embedded);
        let text = if is_model_only {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            format!("[[model]]\nfile = {}\n", toml_edit::Value::from(name))
        } else {
            let bytes = files.read_named(&file, limits::TOML_BYTES);
            utf8(&file, bytes.map_err(|message| Error::input(&file, message))?)?
        };
        let root = Node::parse(&file, &text)?;
        Ok(Self { files, file, text, root, is_model_only })
    }

    /// Opens the source and applies the changes of models, materials and presets. Returns the other
    /// changes, which need the loaded models.
    pub(super) fn prepare(spec: &str, options: &LoadOptions) -> Result<(Self, Vec<Setting>)> {
        let mut source = Self::open(spec, options)?;
        let settings = options.set.iter().map(|text| Setting::parse(text)).collect::<Result<Vec<_>>>()?;
        Section::new(&source.file, "", &source.root)?.only(&SECTIONS)?;
        if let Some(preset) = &options.preset {
            source.choose_preset(preset);
        }
        let (first, others): (Vec<_>, Vec<_>) =
            settings.into_iter().partition(|setting| setting.precedes_models());
        first.iter().try_for_each(|setting| setting.apply(&mut source.root, None))?;
        Ok((source, others))
    }

    /// Applies the remaining changes.
    pub(super) fn change(&mut self, others: &[Setting], options: &LoadOptions) -> Result<()> {
        let chosen = options.camera.as_deref();
        others.iter().try_for_each(|setting| setting.apply(&mut self.root, chosen))
    }

    /// The user's file, if it was read as a scene file.
    fn inputs(&self) -> Vec<PathBuf> {
        let file = if self.is_model_only { None } else { self.files.on_disk(&self.file) };
        file.into_iter().collect()
    }

    fn quality(&self) -> Result<Quality> {
        match self.root.get("quality") {
            Some(node) => Quality::read(&Section::new(&self.file, "quality", node)?),
            None => Ok(Quality::default()),
        }
    }

    fn choose_preset(&mut self, preset: &str) {
        let node = |kind| Node { origin: Origin::Flag("--preset".to_owned()), kind };
        let mut quality = node(Kind::Table(vec![("preset".to_owned(), node(Kind::Text(preset.to_owned())))]));
        if let Some(seed) = self.root.get("quality").and_then(|quality| quality.get("seed")) {
            quality.set("seed", seed.clone());
        }
        self.root.set("quality", quality);
    }

    fn load_models(&self, reading: &mut Reading) -> Result<(Models, Objects)> {
        let sections = Section::list(&self.file, &self.root, "model", limits::MODELS)?;
        if sections.is_empty() {
            return Err(Error::input(
                &self.file,
                "the scene has no model: add [[model]] with file = \"….obj\" or \"….glb\"",
            ));
        }
        let (mut all, mut all_objects) = (Models::default(), Objects::default());
        let mut triangles = 0;
        for section in &sections {
            section.only(&keys::names("model", None))?;
            let (transform, name) = (model_keys::transform(section)?, model_keys::name(section)?);
            let material = section.text("material")?;
            reading.of_all_faces = material.map(str::to_owned);
            let Models {
                mut meshes,
                mut objects,
                mut materials,
                mut coverages,
                mut undefined,
                cameras,
                lights,
                ..
            } = match section.text("built_in")? {
                Some(name) => built_in(section, name, reading)?,
                None => self.load_model(section, reading, &transform)?,
            };
            if let Some(name) = material {
                undefined.clear();
                if !model_keys::take_material(&mut meshes, (&mut materials, &mut coverages), name) {
                    let fault = section.fault_at("material", format!("{name:?} {NOWHERE}"));
                    undefined.push((0, fault.to_string()));
                }
            }
            // Its materials stay, because the scene file may change some.
            if section.flag("hidden")?.unwrap_or(false) {
                meshes.clear();
                objects.clear();
            } else if objects.is_empty() {
                objects.push(name);
            }
            all.cameras.extend(cameras);
            all.lights.extend(lights);
            // Checked before the next model is read.
            triangles += meshes.iter().map(|mesh| mesh.indices.len() / 3).sum::<usize>();
            if triangles > limits::TRIANGLES {
                return Err(section.fault(too_many(triangles)));
            }
            let first = all.materials.len();
            if first + materials.len() > limits::MATERIALS {
                let most = limits::MATERIALS;
                return Err(section.fault(format!("the models have more than {most} materials together")));
            }
            all.undefined.extend(undefined.into_iter().map(|(index, warning)| (first + index, warning)));
            coverages.resize(materials.len(), Coverage::Full);
            all.coverages.extend(coverages);
            all.materials.extend(materials);
            let first_object = all_objects.len() as u32;
            for object in &objects {
                all_objects.add(object);
            }
            for mesh in &mut meshes {
                mesh.offset_objects(first_object);
                mesh.transform(&transform);
                mesh.material += first as u32;
            }
            all.of_models.push(first_object..all_objects.len() as u32);
            all.boxes.push(box_of(&meshes));
            all.are_movable.push(section.flag("movable")?.unwrap_or(false));
            all.meshes.extend(meshes);
        }
        Ok((all, all_objects))
    }

    fn load_model(&self, section: &Section, reading: &mut Reading, transform: &DAffine3) -> Result<Models> {
        refuse_triangles(section)?;
        let name = section.need(section.text("file")?, "file", "path of a glTF, OBJ, PLY or STL file")?;
        if let Some(what) = kinds::not_read(name) {
            return Err(section.fault_at("file", format!("{name:?} {what}")));
        }
        let mut path = self.file.with_file_name(name);
        let is_users =
            self.is_model_only || matches!(section.get("file"), Some(Node { origin: Origin::Flag(_), .. }));
        let (named, beside) = match &self.files {
            // The user's model may lie anywhere, and the files that it names beside it.
            Files::Disk(Some(_)) if is_users => (Files::Disk(None), Files::beside(&path)),
            // A user's model in a built-in scene.
            Files::Embedded if is_users => {
                path = PathBuf::from(name);
                (Files::Disk(None), Files::beside(&path))
            }
            files => (files.clone(), files.clone()),
        };
        reading.files = named;
        let bytes = reading.read(&path, limits::OBJ_BYTES).map_err(|message| match self.is_model_only {
            true => Error::input(&path, message),
            false => section.fault_at("file", format!("{:?} {message}", path.display())),
        })?;
        reading.files = beside;
        match path
            .extension()
            .and_then(|extension| extension.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("gltf" | "glb") => read_gltf(reading, &path, &bytes, transform),
            Some("ply") => guarded("PLY", || ply::load(reading, &path, &bytes))
                .map(of_one_mesh)
                .map_err(|why| Error::input(&path, why)),
            Some("stl") => stl::load(reading, &path, bytes).map(of_one_mesh),
            _ => read_obj(reading, &path, bytes),
        }
    }

    /// Takes the cameras and lights of the models where the scene file has none.
    fn take_views(&mut self, cameras: Vec<Node>, lights: Vec<Node>) {
        for (key, nodes) in [("camera", cameras), ("light", lights)] {
            if !nodes.is_empty() && is_empty(self.root.get(key)) {
                self.root.set(key, fit::list(nodes));
            }
        }
    }

    /// Takes the cameras of a loaded scene, if they are several and come from its models.
    pub(super) fn take_cameras(&mut self, scene: &Scene) {
        if scene.cameras.len() > 1 && is_empty(self.root.get("camera")) {
            let node = |camera: &Camera| fit::file_camera_node(&gltf::FileCamera::of(camera, scene.origin));
            self.root.set("camera", fit::list(scene.cameras.iter().map(node).collect()));
        }
    }

    /// Adds a fitting camera if there is none. Adds lights if a model was loaded alone. `choose`
    /// takes the scene's own camera.
    pub(super) fn complete(
        &mut self,
        origin: DVec3,
        choose: impl FnOnce(Option<&Camera>) -> Result<fit::Chosen>,
        emits: bool,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let no_camera = is_empty(self.root.get("camera"));
        // `light = []` states that the scene is dark.
        let no_light = self.root.get("light").is_none() && !self.has_emission();
        // Emission lights rooms. On things it is signs and displays.
        let no_light = no_light && (!emits || self.is_model_only);
        if no_light && !self.is_model_only {
            return Err(Error::input(
                &self.file,
                "the scene has no light: add [[light]] with kind and position, or [environment]; \
                 light = [] states that it is dark",
            ));
        }
        if !no_camera && !no_light {
            return Ok(());
        }
        let own = if no_camera { Vec::new() } else { read_cameras(&self.file, &self.root, origin)? };
        let fit::Chosen { camera, lights, sky, is_lit, said } = choose(own.first())?;
        let [about_camera, about_lights] = said;
        let name = self.file.display();
        if no_camera {
            warnings.push(format!("{name} has no camera: {about_camera}"));
            self.root.set("camera", fit::camera_node(&camera, origin));
        }
        if no_light && !is_lit {
            warnings.push(format!("{name} has no light: {about_lights}"));
            if let Some(radiance) = sky {
                self.root.set("environment", fit::sky_node(radiance));
            }
            let nodes = lights.iter().map(|light| fit::light_node(light, origin));
            self.root.set("light", fit::list(nodes.collect()));
        }
        Ok(())
    }
}

impl Source {
    /// Whether the scene file has a sky or a material that emits.
    fn has_emission(&self) -> bool {
        let emits = |material: &Node| material.get("emission").is_some();
        let materials = match self.root.get("material") {
            Some(Node { kind: Kind::Array(materials), .. }) => &materials[..],
            _ => &[],
        };
        self.root.get("environment").is_some() || materials.iter().any(emits)
    }
}

/// Whether the scene file has no section of a kind.
fn is_empty(node: Option<&Node>) -> bool {
    match node {
        Some(Node { kind: Kind::Array(elements), .. }) => elements.is_empty(),
        node => node.is_none(),
    }
}

pub(super) fn read_lights(file: &Path, root: &Node, origin: DVec3, files: &Files) -> Result<Vec<Light>> {
    let sections = Section::list(file, root, "light", limits::LIGHTS)?;
    let lights = sections.iter().enumerate();
    let lights = lights.map(|(number, section)| Light::read(section, number, origin, files));
    let lights = lights.collect::<Result<Vec<_>>>()?;
    refuse_repeated(&sections, lights.iter().map(|light| light.name.as_str()))?;
    let mut files = BTreeMap::new();
    for luminaire in lights.iter().filter_map(|light| light.luminaire.as_ref()) {
        files.insert(&luminaire.file, luminaire.profile.fractions.len());
    }
    if files.values().sum::<usize>() > limits::INTENSITIES {
        let message = format!("`ies`: these files have more than {} intensities", limits::INTENSITIES);
        return Err(Error::input(file, message));
    }
    Ok(lights)
}

pub(super) fn read_cameras(file: &Path, root: &Node, origin: DVec3) -> Result<Vec<Camera>> {
    let sections = match root.get("camera") {
        Some(node @ Node { kind: Kind::Table(_), .. }) => vec![Section::new(file, "camera", node)?],
        _ => Section::list(file, root, "camera", limits::CAMERAS)?,
    };
    let cameras = sections.iter().map(|section| Camera::read(section, origin)).collect::<Result<Vec<_>>>()?;
    refuse_repeated(&sections, cameras.iter().map(|camera| camera.name.as_str()))?;
    Ok(cameras)
}
