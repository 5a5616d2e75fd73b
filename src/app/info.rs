//! `lightpaths info`: lists devices and the contents of a scene.

use std::fmt::Write;

use clap::Args;
use glam::Vec3;
use serde_json::json;

use super::args::SceneArgs;
use crate::error::{Error, Result};
use crate::gpu::{Context, DeviceSummary};
use crate::scene::{Camera, Light, Quality, Scene};

/// List Vulkan devices with the limits that matter, and what a scene holds
#[derive(Debug, Args)]
pub(super) struct Info {
    /// A scene, as for render [default: devices only]
    scene: Option<String>,
    /// Prints both as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
}

impl Info {
    pub(super) fn run(self) -> Result<()> {
        let scene = self.scene.as_deref().map(|spec| self.scene_args.load_with_meters(spec)).transpose()?;
        let devices = Context::devices();
        let mut text = String::new();
        if self.json {
            super::print(&format!(
                "{:#}\n",
                document(devices.as_deref().unwrap_or_default(), scene.as_ref())
            ))?;
            return self.result(scene.is_some(), false, devices);
        }
        match &devices {
            Ok(devices) => devices.iter().for_each(|device| describe_device(&mut text, device)),
            // A scene can be inspected without a device, so a missing device is a note,
            // not a failure.
            Err(error) if scene.is_some() => line(&mut text, format_args!("{error}")),
            Err(_) => {}
        }
        if let Some(scene) = &scene {
            text.push('\n');
            describe_scene(&mut text, scene);
        }
        super::print(&text)?;
        self.result(scene.is_some(), text.is_empty(), devices)
    }

    /// The error if no device can be used. A scene can be described without one.
    fn result(&self, has_scene: bool, is_empty: bool, devices: Result<Vec<DeviceSummary>>) -> Result<()> {
        let usable = devices.map(|devices| devices.iter().any(|device| device.unmet.is_none()));
        match usable {
            _ if has_scene => Ok(()),
            Ok(true) => Ok(()),
            Ok(false) if is_empty => Err(Error::no_device_found()),
            Ok(false) => Err(Error::NoDevice("each one found lacks something, as listed".to_owned())),
            Err(error) => Err(error),
        }
    }
}

/// Devices and the scene as JSON.
fn document(devices: &[DeviceSummary], scene: Option<&Scene>) -> serde_json::Value {
    let device = |device: &DeviceSummary| {
        let DeviceSummary { index, name, kind, driver, limits, unmet, .. } = device;
        json!({
            "index": index, "name": name, "kind": kind, "driver": driver, "unmet": unmet, "limits": limits,
        })
    };
    let devices: Vec<_> = devices.iter().map(device).collect();
    match scene {
        None => json!({"devices": devices}),
        Some(scene) => json!({"devices": devices, "scene": scene_document(scene)}),
    }
}

/// Lengths and places in the coordinates of the scene file, metres.
fn scene_document(scene: &Scene) -> serde_json::Value {
    let world = |place: Vec3| (place.as_dvec3() + scene.origin).to_array();
    let (low, high) = scene.bounds();
    let light = |light: &Light| {
        json!({
            "name": light.name, "kind": light.kind.word(), "on": light.is_on,
            "position": light.kind.position().map(world), "emission": light.kind.emission().to_array(),
        })
    };
    let camera = |camera: &Camera| {
        json!({
            "name": camera.name, "size": camera.size, "fov_y": camera.fov_y_degrees,
            "position": world(camera.position), "target": world(camera.target),
        })
    };
    json!({
        "name": scene.name, "triangles": scene.triangles.len(), "area_m2": scene.area_m2(),
        "bounds": [world(low), world(high)],
        "materials": scene.materials.iter().map(|material| &material.name).collect::<Vec<_>>(),
        "lights": scene.lights.iter().map(light).collect::<Vec<_>>(),
        "cameras": scene.cameras.iter().map(camera).collect::<Vec<_>>(),
        "meters": scene.meters.iter().map(|meter| json!({"name": meter.name, "grid": meter.grid()})).collect::<Vec<_>>(),
        "quality": scene.quality,
        "device_memory_bytes": memory_need_bytes(scene, scene.cameras[0].size),
        "warnings": scene.warnings,
    })
}

fn describe_device(text: &mut String, device: &DeviceSummary) {
    let DeviceSummary { index, name, kind, driver, limits, unmet, .. } = device;
    if !text.is_empty() {
        text.push('\n');
    }
    let product = |sides: [u32; 3]| sides.map(|side| side.to_string()).join(" x ");
    row(text, &format!("device {index}"), format!("{name} ({kind}, {driver})"));
    row(text, "usable", unmet.as_ref().map_or("yes".to_owned(), |reason| format!("no: {reason}")));
    row(text, "device memory", format!("{:.0} MB", megabytes(limits.device_memory_bytes)));
    row(text, "largest binding", format!("{:.0} MB", megabytes(limits.storage_range_bytes)));
    row(text, "buffers bound at once", limits.storage_buffers.to_string());
    row(text, "push constants", format!("{} B", limits.push_bytes));
    row(text, "shared memory", format!("{} B", limits.shared_bytes));
    row(text, "subgroup", format!("{} invocations", limits.subgroup_size));
    let invocations = limits.workgroup_invocations;
    row(text, "workgroup", format!("{invocations} invocations, at most {}", product(limits.workgroup_size)));
    row(text, "workgroups", product(limits.workgroup_count));
    let (bits, period) = (limits.timestamp_bits, limits.timestamp_period_ns);
    row(text, "timestamps", format!("{bits} bits of {period} ns"));
    let tuned = device.tuning(true, &[]).expect("no value is given");
    row(text, "tuning", tuned.to_string());
    tuned.warning.into_iter().for_each(|warning| row(text, "warning", warning));
}

fn describe_scene(text: &mut String, scene: &Scene) {
    scene.summary().into_iter().for_each(|(label, value)| row(text, &label, value));
    let Quality { preset, entry_points, cache_points, gather_rays, directions, cells, .. } = scene.quality;
    row(
        text,
        "quality",
        format!(
            "{preset}: {entry_points} entry points, {cache_points} cache points, {gather_rays} gather rays, \
             {directions} directions, {cells} cells"
        ),
    );
    let need = megabytes(memory_need_bytes(scene, scene.cameras[0].size));
    row(text, "device memory", format!("about {need:.0} MB (time prints what is really used)"));
    scene.warnings.iter().for_each(|warning| row(text, "warning", warning.clone()));
}

/// Estimated device memory of a scene from its counts; within a factor of about 1.5.
fn memory_need_bytes(scene: &Scene, [width, height]: [u32; 2]) -> u64 {
    /// Corners, normals, material and the triangle's fraction of the BVH.
    const TRIANGLE: u64 = 160;
    /// An entry point and about four vertices of its path, with their energies.
    const PATH: u64 = 128;
    /// A cache point with its gradients, without its gather rays.
    const CACHE_POINT: u64 = 128;
    /// Index of the cell entry that a ray reads, and its entry in the list of readers.
    const GATHER_RAY: u64 = 8;
    /// Visible surface, direct and indirect light, and the list of records that contribute
    /// to the pixel.
    const PIXEL: u64 = 160;
    let quality = &scene.quality;
    let cache_point = CACHE_POINT + GATHER_RAY * u64::from(quality.gather_rays);
    scene.triangles.len() as u64 * TRIANGLE
        + u64::from(quality.entry_points) * PATH
        + u64::from(quality.cache_points) * cache_point
        + u64::from(width) * u64::from(height) * PIXEL
}

/// Converts bytes to 10⁶ bytes.
fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// Appends a line with a label.
fn row(text: &mut String, label: &str, value: String) {
    line(text, format_args!("{label:<22} {value}"));
}

/// Appends a line.
fn line(text: &mut String, arguments: std::fmt::Arguments) {
    writeln!(text, "{arguments}").expect("writing to a string cannot fail");
}
