//! Lights of a renderer, in the coordinates of the file.

use lightpaths::glam::{DVec3, Vec3};
use lightpaths::{Error, LightKind, Result, Scene, unit_direction};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;

use crate::arrays::{Colour, Triple, triple, triple_f32};
use crate::errors::unknown_name;
use crate::shared::Shared;

/// The lights of a renderer, by name.
#[pyclass(frozen, mapping, module = "lightpaths")]
pub(crate) struct Lights(pub(crate) Shared);

impl Lights {
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let names = |scene: &Scene| scene.lights.iter().map(|light| light.name.clone()).collect();
        self.0.with(py, |state| Ok(names(state.renderer.scene())))
    }
}

#[pymethods]
impl Lights {
    fn __getitem__(&self, py: Python<'_>, name: String) -> PyResult<Light> {
        let found = self.0.with(py, |state| Ok(state.renderer.scene().light_named(&name)))?;
        found.map_err(|error| unknown_name(&error))?;
        Ok(Light { shared: self.0.clone(), name })
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.names(py)?.len())
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        Ok(self.names(py)?.iter().any(|known| known == name))
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(self.keys(py)?.into_pyobject(py)?.try_iter()?.into_any().unbind())
    }

    fn keys(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.names(py)
    }

    fn values(&self, py: Python<'_>) -> PyResult<Vec<Light>> {
        self.names(py)?.into_iter().map(|name| self.__getitem__(py, name)).collect()
    }

    fn items(&self, py: Python<'_>) -> PyResult<Vec<(String, Light)>> {
        Ok(self.names(py)?.into_iter().zip(self.values(py)?).collect())
    }

    /// Adds a light. `emission` is in the unit of the kind.
    #[pyo3(signature = (name, kind, *, emission, position=None, direction=None, angle=None, penumbra=0.0, corner=None, edge_u=None, edge_v=None, samples=10))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword")]
    fn add(
        &self,
        py: Python<'_>,
        name: String,
        kind: &str,
        emission: Colour,
        position: Option<[f64; 3]>,
        direction: Option<[f64; 3]>,
        angle: Option<f64>,
        penumbra: f64,
        corner: Option<[f64; 3]>,
        edge_u: Option<[f64; 3]>,
        edge_v: Option<[f64; 3]>,
        samples: u32,
    ) -> PyResult<Light> {
        let emission = emission.vector();
        self.0.with(py, |state| {
            let scene = state.renderer.scene();
            if name.is_empty() || scene.light_named(&name).is_ok() {
                return Err(Error::Usage(format!("a new light needs a name of its own, found `{name}`")));
            }
            let needs = |what: &str| Error::Usage(format!("a light of the kind {kind} needs `{what}`"));
            let vector = |what, value: Option<[f64; 3]>| value.map(DVec3::from).ok_or_else(|| needs(what));
            let place = |what, value| vector(what, value).map(|in_file| scene.recentred(in_file));
            let kind = match kind {
                "point" => LightKind::Point { position: place("position", position)?, intensity: emission },
                "spot" => LightKind::Spot {
                    position: place("position", position)?,
                    direction: unit(vector("direction", direction)?)?,
                    intensity: emission,
                    angle: angle.ok_or_else(|| needs("angle"))?.to_radians() as f32,
                    penumbra: penumbra as f32,
                },
                "area" => LightKind::Area {
                    corner: place("corner", corner)?,
                    edge_u: vector("edge_u", edge_u)?.as_vec3(),
                    edge_v: vector("edge_v", edge_v)?.as_vec3(),
                    radiance: emission,
                    samples,
                },
                "directional" => LightKind::Directional {
                    direction: unit(vector("direction", direction)?)?,
                    irradiance: emission,
                },
                _ => {
                    let kinds = "point, spot, area or directional";
                    return Err(Error::Usage(format!("a light's kind is {kinds}, found `{kind}`")));
                }
            };
            kind.check()?;
            state.renderer.add_light(lightpaths::Light::new(name.clone(), kind))
        })?;
        self.__getitem__(py, name)
    }

    /// Removes a light.
    fn remove(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.0.with(py, |state| {
            let scene = state.renderer.scene();
            let index = scene.light_named(name)?;
            if scene.lights[index].kind.is_fixed() {
                let why = "is part of the scene: switch it off";
                return Err(Error::Usage(format!("the light `{name}` {why}")));
            }
            state.renderer.remove_light(index).map(drop)
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<lightpaths.Lights {:?}>", self.names(py)?))
    }
}

/// A direction of unit length.
fn unit(direction: DVec3) -> Result<Vec3> {
    let zero = || Error::Usage("a direction must be finite and not zero".to_owned());
    unit_direction(direction).ok_or_else(zero)
}

/// A light of a renderer.
#[pyclass(frozen, module = "lightpaths")]
pub(crate) struct Light {
    shared: Shared,
    name: String,
}

impl Light {
    /// Reads the light. `what` is the property; `None` from `read`: its kind has none.
    fn get<T: Send>(
        &self,
        py: Python<'_>,
        what: &str,
        read: impl FnOnce(&Scene, LightKind) -> Option<T> + Send,
    ) -> PyResult<T> {
        let (kind, found) = self.shared.with(py, |state| {
            let scene = state.renderer.scene();
            let light = &scene.lights[scene.light_named(&self.name)?];
            Ok((light.kind, read(scene, light.kind).filter(|_| has(light, what))))
        })?;
        found.ok_or_else(|| lacks(kind, what))
    }

    /// Edits the light. `None` from `edit`: its kind has no such property.
    fn edit(
        &self,
        py: Python<'_>,
        what: &str,
        edit: impl FnOnce(&Scene, LightKind) -> Result<Option<LightKind>> + Send,
    ) -> PyResult<()> {
        let lacking = self.shared.with(py, |state| {
            let scene = state.renderer.scene();
            let index = scene.light_named(&self.name)?;
            let old = &scene.lights[index];
            let new = edit(scene, old.kind)?.filter(|_| has(old, what));
            let Some(kind) = new else { return Ok(Some(old.kind)) };
            lightpaths::Light { kind, ..old.clone() }.check()?;
            state.renderer.set_light(index, kind)?;
            Ok(None)
        })?;
        lacking.map_or(Ok(()), |kind| Err(lacks(kind, what)))
    }
}

/// Whether a light has a colour of its own: not that of a surface or of an image.
fn has_colour(kind: LightKind) -> bool {
    !matches!(kind, LightKind::Surface { .. } | LightKind::Sky { .. })
}

/// Whether a light of a kind that has the property has it, too.
fn has(light: &lightpaths::Light, what: &str) -> bool {
    light.luminaire.is_none() || !["angle", "penumbra"].contains(&what)
}

fn lacks(kind: LightKind, what: &str) -> PyErr {
    PyAttributeError::new_err(format!("a light of the kind {} has no {what}", kind.word()))
}

#[pymethods]
impl Light {
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn kind(&self, py: Python<'_>) -> PyResult<&'static str> {
        self.get(py, "kind", |_, kind| Some(kind.word()))
    }

    #[getter]
    fn on(&self, py: Python<'_>) -> PyResult<bool> {
        self.shared.with(py, |state| {
            let scene = state.renderer.scene();
            Ok(scene.lights[scene.light_named(&self.name)?].is_on)
        })
    }

    #[setter]
    fn set_on(&self, py: Python<'_>, is_on: bool) -> PyResult<()> {
        self.shared.with(py, |state| {
            let index = state.renderer.scene().light_named(&self.name)?;
            match state.renderer.light_is_on(index) == is_on {
                true => Ok(()),
                false => state.renderer.switch_light(index, is_on),
            }
        })
    }

    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, "position", |scene, kind| {
            kind.position().map(|position| triple(scene.in_file(position)))
        })
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, to: [f64; 3]) -> PyResult<()> {
        self.edit(py, "position", |scene, kind| {
            Ok(kind.position().map(|_| kind.moved_to(scene.recentred(DVec3::from(to)))))
        })
    }

    #[getter]
    fn emission(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, "emission", |_, kind| Some(triple_f32(kind.emission())))
    }

    #[setter]
    fn set_emission(&self, py: Python<'_>, emission: Colour) -> PyResult<()> {
        self.edit(py, "emission", |_, kind| Ok(Some(kind.with_emission(emission.vector()))))
    }

    #[getter]
    fn power(&self, py: Python<'_>) -> PyResult<f64> {
        let name = &self.name;
        self.get(py, "power", |scene, _| {
            let light = scene.light_named(name).ok().map(|index| &scene.lights[index]);
            light.and_then(lightpaths::Light::power).map(|(amount, _)| amount)
        })
    }

    #[setter]
    fn set_power(&self, py: Python<'_>, amount: f64) -> PyResult<()> {
        let name = &self.name;
        self.edit(py, "power", |scene, _| {
            let mut light = scene.lights[scene.light_named(name)?].clone();
            light.set_power(amount);
            Ok(light.power().map(|_| light.kind))
        })
    }

    #[getter]
    fn kelvin(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, "kelvin", |_, kind| has_colour(kind).then(|| kind.kelvin()))
    }

    #[setter]
    fn set_kelvin(&self, py: Python<'_>, kelvin: f64) -> PyResult<()> {
        self.edit(py, "kelvin", |_, kind| Ok(has_colour(kind).then(|| kind.with_kelvin(kelvin))))
    }

    #[getter]
    fn direction(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, "direction", |_, kind| match kind {
            LightKind::Spot { direction, .. } | LightKind::Directional { direction, .. } => {
                Some(triple_f32(direction))
            }
            _ => None,
        })
    }

    #[setter]
    fn set_direction(&self, py: Python<'_>, to: [f64; 3]) -> PyResult<()> {
        self.edit(py, "direction", |_, mut kind| match &mut kind {
            LightKind::Spot { direction, .. } | LightKind::Directional { direction, .. } => {
                *direction = unit(DVec3::from(to))?;
                Ok(Some(kind))
            }
            _ => Ok(None),
        })
    }

    #[getter]
    fn angle(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, "angle", |_, kind| match kind {
            LightKind::Spot { angle, .. } => Some(f64::from(angle).to_degrees()),
            _ => None,
        })
    }

    #[setter]
    fn set_angle(&self, py: Python<'_>, degrees: f64) -> PyResult<()> {
        self.edit(py, "angle", |_, mut kind| {
            let LightKind::Spot { angle, .. } = &mut kind else { return Ok(None) };
            *angle = degrees.to_radians() as f32;
            Ok(Some(kind))
        })
    }

    #[getter]
    fn penumbra(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, "penumbra", |_, kind| match kind {
            LightKind::Spot { penumbra, .. } => Some(penumbra.into()),
            _ => None,
        })
    }

    #[setter]
    fn set_penumbra(&self, py: Python<'_>, fraction: f64) -> PyResult<()> {
        self.edit(py, "penumbra", |_, mut kind| {
            let LightKind::Spot { penumbra, .. } = &mut kind else { return Ok(None) };
            *penumbra = fraction as f32;
            Ok(Some(kind))
        })
    }

    /// Corner and both edges of an area light.
    #[getter]
    fn area(&self, py: Python<'_>) -> PyResult<(Triple, Triple, Triple)> {
        self.get(py, "area", |scene, kind| match kind {
            LightKind::Area { corner, edge_u, edge_v, .. } => {
                Some((triple(scene.in_file(corner)), triple_f32(edge_u), triple_f32(edge_v)))
            }
            _ => None,
        })
    }

    #[setter]
    fn set_area(&self, py: Python<'_>, area: [[f64; 3]; 3]) -> PyResult<()> {
        let [new_corner, new_u, new_v] = area.map(DVec3::from);
        self.edit(py, "area", |scene, mut kind| {
            let LightKind::Area { corner, edge_u, edge_v, .. } = &mut kind else { return Ok(None) };
            (*corner, *edge_u, *edge_v) = (scene.recentred(new_corner), new_u.as_vec3(), new_v.as_vec3());
            Ok(Some(kind))
        })
    }

    /// Rotation of a sky about the y axis, degrees.
    #[getter]
    fn rotate(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, "rotate", |_, kind| match kind {
            LightKind::Sky { turn, .. } => Some(f64::from(turn).to_degrees()),
            _ => None,
        })
    }

    #[setter]
    fn set_rotate(&self, py: Python<'_>, degrees: f64) -> PyResult<()> {
        self.edit(py, "rotate", |_, mut kind| {
            let LightKind::Sky { turn, .. } = &mut kind else { return Ok(None) };
            *turn = degrees.to_radians() as f32;
            Ok(Some(kind))
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<lightpaths.Light {:?} ({})>", self.name, self.kind(py)?))
    }
}
