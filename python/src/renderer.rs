//! Renderers: pictures, layers and readings as arrays.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use lightpaths::renderer::Kept;
use lightpaths::{
    Context, ContextOptions, DisplayTransform, Error, Folder, Layer, Measured, Result, Store, ToneCurve,
};
use numpy::{PyArray3, PyArrayMethods, PyUntypedArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{picture, plane};
use crate::camera::Camera;
use crate::lights::Lights;
use crate::materials::Materials;
use crate::progress::Watch;
use crate::readings::Reading;
use crate::scene::Scene;
use crate::shared::{Shared, State};

/// Limit of the light paths in a folder, bytes: that of `lightpaths render --cache`.
const CACHE_LIMIT: u64 = 4 << 30;

/// A scene with traced light paths.
#[pyclass(frozen, module = "lightpaths")]
pub(crate) struct Renderer {
    shared: Shared,
    device: String,
}

/// Devices by what the user calls them. Each is opened once, because it compiles its pipelines
/// when it is first used.
static OPENED: Mutex<BTreeMap<Option<String>, Arc<Context>>> = Mutex::new(BTreeMap::new());

fn context(device: &Option<String>) -> Result<Arc<Context>> {
    let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(context) = opened.get(device) {
        return Ok(context.clone());
    }
    // As the program does: with the values that `lightpaths tune` has stored.
    let options = ContextOptions { device: device.clone(), stored_tuning: true, ..ContextOptions::default() };
    let context = Context::new(&options)?;
    opened.insert(device.clone(), context.clone());
    Ok(context)
}

/// Traces the light paths of a scene, or reads them from a folder.
fn traced(
    scene: lightpaths::Scene,
    device: Option<String>,
    cache: Option<PathBuf>,
    watch: &mut Watch,
) -> Result<State> {
    let context = context(&device)?;
    let (mut kept, mut warnings) = (Kept::default(), Vec::new());
    let made = match cache {
        None => lightpaths::Renderer::new_keeping(&context, scene, &mut kept, watch),
        Some(path) => {
            let store = Store::Folder(Folder { path, limit_bytes: CACHE_LIMIT });
            let mut say = |line: &str| warnings.push(line.to_owned());
            lightpaths::Renderer::cached(&context, scene, &store, watch, &mut say)
        }
    };
    if let Err(Error::Vulkan { .. }) = made {
        // The device may be lost; the next renderer opens it again.
        OPENED.lock().unwrap_or_else(PoisonError::into_inner).remove(&device);
    }
    let mut renderer = made?;
    // Passes that wait for each other only tell their times apart.
    renderer.set_serialised(false);
    warnings.extend(renderer.scene().warnings.iter().cloned());
    Ok(State { renderer, context, kept, frame_ms: None, warnings })
}

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (scene, *, device=None, cache=None, progress=None))]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        device: Option<String>,
        cache: Option<PathBuf>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let mut watch = Watch::new(progress);
        let scene = scene.scene.clone();
        let state = match py.detach(|| traced(scene, device, cache, &mut watch)) {
            Ok(state) => state,
            Err(error) => return Err(watch.exception(error)),
        };
        let device = state.context.name().to_owned();
        Ok(Self { shared: Shared::new(state), device })
    }

    /// Shows another scene from now on, or the same one with a model elsewhere.
    #[pyo3(signature = (scene, *, progress=None))]
    fn set_scene(&self, py: Python<'_>, scene: &Scene, progress: Option<Py<PyAny>>) -> PyResult<()> {
        let scene = scene.scene.clone();
        self.shared.watched(py, Watch::new(progress), |state, watch| state.set_scene(scene, watch))
    }

    #[getter]
    fn lights(&self) -> Lights {
        Lights(self.shared.clone())
    }

    #[getter]
    fn materials(&self) -> Materials {
        Materials(self.shared.clone())
    }

    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.shared.clone())
    }

    #[getter]
    fn device(&self) -> &str {
        &self.device
    }

    #[getter]
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.shared.with(py, |state| Ok(state.warnings.clone()))
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self, py: Python<'_>) -> PyResult<(u32, u32)> {
        self.shared.with(py, |state| Ok(state.renderer.size().into()))
    }

    #[setter]
    fn set_size(&self, py: Python<'_>, size: [u32; 2]) -> PyResult<()> {
        self.shared.with(py, |state| state.renderer.resize(size))
    }

    /// Wall-clock time of the precomputation, seconds.
    #[getter]
    fn precompute_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.shared.with(py, |state| Ok(state.renderer.precompute_s()))
    }

    /// Wall-clock time of the last frame, milliseconds. `None` before the first.
    #[getter]
    fn frame_ms(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        self.shared.with(py, |state| Ok(state.frame_ms))
    }

    /// The picture, or another layer of it.
    #[pyo3(signature = (layer="beauty"))]
    fn render<'py>(&self, py: Python<'py>, layer: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
        let layer: Layer = layer.parse().map_err(crate::errors::raised)?;
        let (size, pixels) = self.shared.with_picture(py, |state| {
            let renderer = &state.renderer;
            let pixels = match layer {
                Layer::Position => renderer.positions_in_file()?,
                layer => renderer.layer(layer)?,
            };
            Ok((renderer.size(), pixels))
        })?;
        Ok(match layer {
            Layer::Depth => {
                plane(py, size, pixels.into_iter().map(|[depth, ..]| depth).collect()).as_untyped().clone()
            }
            _ => picture(py, size, pixels).as_untyped().clone(),
        })
    }

    /// The picture as sRGB codes. The scene file's `[picture]` states what the arguments do not.
    #[pyo3(signature = (exposure=None, *, tone=None, white_balance=None, tint=None))]
    fn display<'py>(
        &self,
        py: Python<'py>,
        exposure: Option<f32>,
        tone: Option<&str>,
        white_balance: Option<f32>,
        tint: Option<f32>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let tone = tone.map(ToneCurve::parse).transpose();
        let tone =
            tone.map_err(|expected| crate::errors::raised(Error::Usage(format!("tone: {expected}"))))?;
        self.shared.with(py, |state| {
            let mut display = state.renderer.scene().picture.over(DisplayTransform::default());
            display.exposure_stops = exposure.unwrap_or(display.exposure_stops);
            display.tone = tone.unwrap_or(display.tone);
            let white = &mut display.white_balance;
            white.kelvin = white_balance.unwrap_or(white.kelvin);
            white.tint = tint.unwrap_or(white.tint);
            display.check()?;
            state.renderer.set_display_transform(display);
            Ok(())
        })?;
        let (size, codes) =
            self.shared.with_picture(py, |state| Ok((state.renderer.size(), state.renderer.display()?)))?;
        Ok(picture(py, size, codes.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()))
    }

    /// Direct and indirect light of each active light, by its name.
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (size, found) = self.shared.with_picture(py, |state| {
            let found = state.renderer.light_pictures()?;
            let lights = &state.renderer.scene().lights;
            let named = found.into_iter().map(|layers| (lights[layers.light].name.clone(), layers));
            Ok((state.renderer.size(), named.collect::<Vec<_>>()))
        })?;
        let all = PyDict::new(py);
        for (name, layers) in found {
            let own = PyDict::new(py);
            own.set_item("direct", picture(py, size, layers.direct))?;
            own.set_item("indirect", picture(py, size, layers.indirect))?;
            all.set_item(name, own)?;
        }
        Ok(all)
    }

    /// What the light meters of the scene show, by their names.
    fn measure(&self, py: Python<'_>) -> PyResult<BTreeMap<String, Reading>> {
        let (meters, points) = self.shared.with_picture(py, |state| {
            let scene = state.renderer.scene();
            let measured = state.renderer.measured()?;
            let points: Vec<Vec<Measured>> = match measured.is_empty() {
                true => Vec::new(),
                false => Measured::by_meter(scene, &measured).into_iter().map(<[Measured]>::to_vec).collect(),
            };
            Ok((scene.meters.clone(), points))
        })?;
        let readings = meters.iter().zip(points);
        Ok(readings.map(|(meter, points)| (meter.name.clone(), Reading::new(py, meter, &points))).collect())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (width, height) = self.size(py)?;
        Ok(format!("<lightpaths.Renderer {width}×{height} on {:?}>", self.device))
    }
}
