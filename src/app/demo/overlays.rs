//! Overlays on the picture: lights and their gizmos, cache points, rays and paths.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape as Drawn, Stroke, Ui, pos2};
use glam::{Vec2, Vec3};

use super::document::LightEntry;
use super::gizmos::{Axis, Gizmo, Part, Projection, Shape};
use super::light_map::LightMap;
use super::panels::{AXES, PALETTE};
use super::session::Session;
use super::ui_state::{UiState, View};
use crate::error::Result;
use crate::renderer::{Layer, Renderer};
use crate::types::CachePoint;

/// Cache points within this distance of the pointer show their radii, points.
const NEAR: f32 = 70.0;
/// Line segments of a circle.
const CIRCLE: usize = 24;
/// Drawn length of a ray that left the scene, in scene sizes.
const FAR: f32 = 0.2;
/// Fraction of its depth by which a visible point may lie behind the picture's surface.
const DEPTH_SLACK: f32 = 0.01;

/// Data that is read back from the renderer, kept while it is valid.
#[derive(Default)]
pub(super) struct Overlays {
    /// The session's generation.
    generation: u64,
    cache_points: Vec<CachePoint>,
    /// Depth of each pixel, with the picture's version and size.
    depth: (u64, [u32; 2], Vec<f32>),
    lines: Lines,
    /// Values of the picture that is shown as false colours.
    pub(super) light: Option<LightMap>,
}

/// Rays and a path for the clicked position.
#[derive(Default)]
struct Lines {
    of: Option<super::ui_state::Place>,
    rays: Vec<[Vec3; 2]>,
    /// Gather rays that left the scene.
    lost: Vec<[Vec3; 2]>,
    /// Cache points that the pixel interpolates.
    records: Vec<CachePoint>,
    path: Vec<Vec3>,
}

impl Overlays {
    /// Draws the overlays of the current view.
    pub(super) fn paint(
        &mut self,
        ui: &Ui,
        projection: Projection,
        area: Rect,
        session: &Session,
        ui_state: &UiState,
    ) -> Result<()> {
        let Some(renderer) = session.renderer() else {
            *self = Self::default();
            return Ok(());
        };
        if self.generation != session.generation {
            *self = Self { generation: session.generation, ..Self::default() };
        }
        let painter = ui.painter_at(area);
        match ui_state.view {
            View::CachePoints => {
                let pointer = ui.input(|input| input.pointer.hover_pos());
                self.points(&painter, projection, session.version, renderer, pointer)
            }
            View::Inspect => self.rays(&painter, projection, renderer, ui_state, session),
            View::FalseColours(_) => {
                let pointer = ui.input(|input| input.pointer.hover_pos());
                if let (Some(light), Some(pointer)) = (&self.light, pointer) {
                    light.label(&painter, projection, pointer, session.contributions());
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Draws a dot for each visible cache point. Points near the pointer also show
    /// their validity disc.
    fn points(
        &mut self,
        painter: &Painter,
        projection: Projection,
        version: u64,
        renderer: &Renderer,
        pointer: Option<Pos2>,
    ) -> Result<()> {
        if self.cache_points.is_empty() {
            self.cache_points = renderer.stages().cache_points.read()?;
        }
        if self.depth.0 != version {
            let depth = renderer.layer(Layer::Depth)?.into_iter().map(|[depth, ..]| depth).collect();
            self.depth = (version, renderer.size(), depth);
        }
        let (_, size, depths) = &self.depth;
        let pointer = pointer.map(|pointer| Vec2::new(pointer.x, pointer.y));
        let mut dots = egui::Mesh::default();
        for point in &self.cache_points {
            let Some((seen, depth)) = projection.project(point.position) else { continue };
            let [x, y] = projection.pixel(seen, *size);
            let shown = depths[(y * size[0] + x) as usize];
            let rect = painter.clip_rect();
            if depth > shown * (1.0 + DEPTH_SLACK) || !rect.contains(pos2(seen.x, seen.y)) {
                continue;
            }
            let dot = Rect::from_center_size(pos2(seen.x, seen.y), egui::vec2(2.0, 2.0));
            dots.add_colored_rect(dot, PALETTE[3]);
            if pointer.is_some_and(|pointer| pointer.distance(seen) < NEAR) {
                ring(painter, projection, point, PALETTE[0]);
            }
        }
        painter.add(Drawn::mesh(dots));
        Ok(())
    }

    /// Draws the gather rays of the nearest cache point, the discs of the cache points that the
    /// pixel reads, and the light path of the nearest entry point.
    fn rays(
        &mut self,
        painter: &Painter,
        projection: Projection,
        renderer: &Renderer,
        ui_state: &UiState,
        session: &Session,
    ) -> Result<()> {
        let Some(place) = ui_state.place else { return Ok(()) };
        if self.lines.of != Some(place) {
            let (low, high) = session.scene.bounds();
            let far = FAR * (high - low).length();
            self.lines = Lines { of: Some(place), ..Lines::default() };
            if let Some(point) = renderer.nearest_cache_point(place.position, place.normal)? {
                for ray in renderer.gather_rays_of(point)? {
                    match ray.hit {
                        Some(hit) => self.lines.rays.push([ray.origin, hit]),
                        None => self.lines.lost.push([ray.origin, ray.origin + far * ray.direction]),
                    }
                }
            }
            if let Some((seen, _)) = projection.project(place.position) {
                let points: Vec<CachePoint> = renderer.stages().cache_points.read()?;
                let records = renderer.records_at(projection.pixel(seen, renderer.size()))?;
                self.lines.records = records.iter().map(|found| points[found.record as usize]).collect();
            }
            if let Some(entry) = renderer.entry_point_near(place.position)? {
                let path = renderer.light_path_of(entry)?;
                self.lines.path = path.iter().map(|point| point.position).collect();
            }
        }
        let line = |[a, b]: [Vec3; 2], width: f32, colour: Color32| {
            if let Some(ends) = projection.segment(a, b) {
                painter.line_segment(ends.map(pos), Stroke::new(width, colour));
            }
        };
        self.lines.lost.iter().for_each(|ray| line(*ray, 1.0, PALETTE[4].gamma_multiply(0.6)));
        self.lines.rays.iter().for_each(|ray| line(*ray, 1.0, PALETTE[0].gamma_multiply(0.8)));
        self.lines.records.iter().for_each(|point| ring(painter, projection, point, PALETTE[3]));
        for ends in self.lines.path.windows(2) {
            line([ends[0], ends[1]], 3.0, PALETTE[1]);
        }
        for point in &self.lines.path {
            if let Some((seen, _)) = projection.project(*point) {
                painter.circle(pos(seen), 4.0, PALETTE[1], Stroke::new(1.0, Color32::BLACK));
            }
        }
        Ok(())
    }
}

/// Draws a cache point's validity disc.
fn ring(painter: &Painter, projection: Projection, point: &CachePoint, colour: Color32) {
    let (right, up) = point.normal.any_orthonormal_pair();
    let corner = |step: usize| {
        let (sin, cos) = (std::f32::consts::TAU * step as f32 / CIRCLE as f32).sin_cos();
        point.position + point.radius * (cos * right + sin * up)
    };
    for step in 0..CIRCLE {
        if let Some(ends) = projection.segment(corner(step), corner(step + 1)) {
            painter.line_segment(ends.map(pos), Stroke::new(1.0, colour));
        }
    }
}

/// Draws lines in the upper left corner of the picture.
pub(super) fn marks(painter: &Painter, area: Rect, lines: &[String]) {
    let mut top = area.left_top() + egui::vec2(8.0, 8.0);
    for line in lines {
        let text = painter.layout_no_wrap(line.clone(), FontId::proportional(13.0), PALETTE[1]);
        let back = Rect::from_min_size(top, text.size()).expand2(egui::vec2(6.0, 3.0));
        painter.rect_filled(back, 3.0, Color32::from_black_alpha(170));
        let height = back.height() + 4.0;
        painter.galley(top, text, PALETTE[1]);
        top.y += height;
    }
}

/// Draws a light's mark in the light's colour.
pub(super) fn mark(painter: &Painter, place: Vec2, entry: &LightEntry, is_chosen: bool) {
    let colour = entry.light.kind.emission();
    let colour = colour / colour.max_element().max(1e-6);
    let [r, g, b] = colour.to_array().map(|channel| (255.0 * channel.clamp(0.0, 1.0).powf(0.45)) as u8);
    let fill = if entry.light.is_on { Color32::from_rgb(r, g, b) } else { Color32::TRANSPARENT };
    let radius = if is_chosen { 7.0 } else { 5.0 };
    // Two rings are visible on any background.
    painter.circle(pos(place), radius, fill, Stroke::new(3.0, Color32::BLACK));
    painter.circle_stroke(pos(place), radius, Stroke::new(1.5, Color32::WHITE));
}

/// Draws a name beside a screen position.
pub(super) fn caption(painter: &Painter, place: Vec2, text: &str) {
    let (at, font) = (pos(place) + egui::vec2(12.0, 0.0), FontId::proportional(13.0));
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = Align2::LEFT_CENTER.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(3.0), 3.0, Color32::from_black_alpha(180));
    painter.galley(rect.min, galley, Color32::WHITE);
}

/// Draws the gizmos of the chosen light; the held or hovered one is highlighted.
pub(super) fn light_gizmos(painter: &Painter, gizmos: &[Gizmo], held: Option<Part>) {
    for gizmo in gizmos {
        let colour = match gizmo.axis {
            Some(Axis::X) => AXES[0],
            Some(Axis::Y) => AXES[1],
            Some(Axis::Z) => AXES[2],
            None => Color32::WHITE,
        };
        let is_held = held == Some(gizmo.part);
        let width = if is_held { 3.5 } else { 2.0 };
        for shape in &gizmo.shapes {
            match shape {
                Shape::Disc { centre, radius } => {
                    let radius = if is_held { radius + 1.5 } else { *radius };
                    painter.circle_stroke(pos(*centre), radius, Stroke::new(width + 2.0, Color32::BLACK));
                    painter.circle_stroke(pos(*centre), radius, Stroke::new(width, colour));
                }
                Shape::Line(points) => {
                    line(painter, points, width + 2.0, Color32::BLACK);
                    line(painter, points, width, colour);
                }
                Shape::Fill(points) => {
                    let fill = colour.gamma_multiply(if is_held { 0.7 } else { 0.35 });
                    let corners = points.iter().copied().map(pos).collect();
                    painter.add(Drawn::convex_polygon(corners, fill, Stroke::new(1.0, colour)));
                }
                Shape::Guide(points) => line(painter, points, 1.0, colour.gamma_multiply(0.7)),
            }
        }
    }
}

fn line(painter: &Painter, points: &[Vec2], width: f32, colour: Color32) {
    painter.add(Drawn::line(points.iter().copied().map(pos).collect(), Stroke::new(width, colour)));
}

fn pos(point: Vec2) -> Pos2 {
    pos2(point.x, point.y)
}
