//! The lights as the renderer keeps them: the device's table, and for each light what was traced of
//! it, free of its colour.

use super::near_lights::NearFactors;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::gloss::GlossLight;
use crate::passes::frame::hvds::{ClusterLight, Pyramid};
use crate::passes::{OneLight, light_sources};
use crate::scene::Light;
use crate::types::LightSource;
use glam::Vec3;
use std::sync::Arc;

/// What was traced of a light.
struct Rows {
    /// Its form factor at each entry point.
    factors: Buffer,
    /// What becomes of those beside it, and their number; none where it is near to nothing.
    near: Option<NearFactors>,
    /// Its light at each pixel and each edge sample.
    layer: Buffer,
    /// Pixels at the edges of its shadows, counted.
    shadow_groups: Buffer,
    /// What base clusters receive of it.
    clusters: Buffer,
    /// Its beams at entry points that may be glossy, if any may.
    beams: Option<Buffer>,
    /// What paths carry on of it from their entry points, if any surface may be glossy.
    first_bounce: Option<Buffer>,
    /// What slots send of it, if any surface may be glossy.
    slots: Option<Buffer>,
    /// What samples of glossy pixels see of it on glossy surfaces, if any may be glossy.
    hits: Option<Buffer>,
    /// Its highlight at each sample of active pixels, if any may be glossy.
    highlights: Option<Buffer>,
    /// `factors` and `beams` are those of the light as it is.
    has_factors: bool,
    /// `layer` is that of the light and the camera as they are.
    has_layer: bool,
    /// `first_bounce`, `clusters` and `slots` are those of the light and the materials as they are.
    has_clusters: bool,
    /// `hits` are those of the light, the camera and the materials as they are.
    has_hits: bool,
    /// `highlights` are those of the light, the camera and the materials as they are.
    has_highlights: bool,
}

/// All lights, in the scene's order.
pub(super) struct Lights {
    context: Arc<Context>,
    /// `LightSource`s; those of lights that are off emit nothing.
    pub(super) table: Buffer,
    sources: Vec<LightSource>,
    /// What all light in a frame is to be multiplied with: where a single light is active it emits
    /// one unit of each channel in the table, and its emission stands here, so that another colour
    /// of it changes nothing but the picture's last step.
    pub(super) emission_scale: Vec3,
    rows: Vec<Rows>,
    factor_count: u32,
    point_count: u32,
    cluster_count: u32,
    gloss: Option<GlossCapacity>,
    /// Tiles of the pixels are those of the camera as it is.
    pub(super) has_batches: bool,
    /// Lights that are off and points that face away are traced, too, to no effect.
    pub(super) traces_all: bool,
}

/// What a light needs where surfaces may be glossy.
#[derive(Clone, Copy)]
pub(super) struct GlossCapacity {
    /// Bytes of its beams for each of its point samples.
    pub(super) beam_bytes: u64,
    /// Slots that are no sums.
    pub(super) slot_count: u32,
    /// Samples of glossy pixels.
    pub(super) sample_count: u32,
}

/// What lights need for another picture.
pub(super) struct NewLayers {
    point_count: u32,
    sample_count: Option<u32>,
    /// Layer, and hits and highlights, of each.
    of_lights: Vec<(Buffer, Option<[Buffer; 2]>)>,
}

fn cluster_light(rows: &Rows) -> ClusterLight<'_> {
    ClusterLight { factors: &rows.factors, first_bounce: rows.first_bounce.as_ref(), layer: &rows.clusters }
}

/// A light as the passes of gloss take it; none if nothing may be glossy.
fn gloss_light<'a>(light: OneLight<'_>, rows: &'a Rows) -> Option<GlossLight<'a>> {
    Some(GlossLight {
        samples: light.samples,
        beams: rows.beams.as_ref()?,
        first_bounce: rows.first_bounce.as_ref()?,
        slots: rows.slots.as_ref()?,
        hits: rows.hits.as_ref()?,
    })
}

/// A light that is off emits nothing in the table, and what emits nothing is left out of every sum.
fn is_active(source: &LightSource) -> bool {
    source.emission != Vec3::ZERO
}

impl Lights {
    /// Room for so many form factors, points that the camera sees and base clusters, of each light.
    pub(super) fn new(
        context: &Arc<Context>,
        lights: &[Light],
        [factor_count, point_count, cluster_count]: [u32; 3],
        gloss: Option<GlossCapacity>,
    ) -> Result<Self> {
        let mut made = Self {
            context: context.clone(),
            table: Buffer::from_slice::<LightSource>(context, "lights", &[])?,
            sources: Vec::new(),
            emission_scale: Vec3::ONE,
            rows: Vec::new(),
            factor_count,
            point_count,
            cluster_count,
            gloss,
            has_batches: false,
            traces_all: false,
        };
        for _ in lights {
            made.add()?;
        }
        made.upload(lights)?;
        Ok(made)
    }

    /// Makes room for one more light, the last.
    pub(super) fn add(&mut self) -> Result<()> {
        let row = |name, count: u32| Buffer::storage(&self.context, name, 4 * u64::from(count));
        let rows = Rows {
            factors: row("form factors", self.factor_count)?,
            near: None,
            layer: row("light layer", self.point_count)?,
            shadow_groups: Antialias::groups(&self.context)?,
            clusters: Pyramid::layer(&self.context, self.cluster_count)?,
            beams: None,
            first_bounce: self.gloss.map(|_| row("first bounce flux", 3 * self.factor_count)).transpose()?,
            slots: self.gloss.map(|gloss| row("light slots", 3 * gloss.slot_count)).transpose()?,
            hits: self.gloss.map(|gloss| row("light hits", 3 * gloss.sample_count)).transpose()?,
            highlights: self.gloss.map(|gloss| row("light highlights", gloss.sample_count)).transpose()?,
            has_factors: false,
            has_layer: false,
            has_clusters: false,
            has_hits: false,
            has_highlights: false,
        };
        self.rows.push(rows);
        Ok(())
    }

    /// Forgets a light.
    pub(super) fn remove(&mut self, light: usize) {
        self.rows.remove(light);
    }

    /// Of this light nothing that was traced holds any more.
    pub(super) fn moved(&mut self, light: usize) {
        let rows = &mut self.rows[light];
        (rows.has_factors, rows.has_layer, rows.has_clusters) = (false, false, false);
        (rows.has_hits, rows.has_highlights) = (false, false);
    }

    /// The camera sees other points.
    pub(super) fn view_changed(&mut self) {
        self.rows.iter_mut().for_each(|rows| rows.has_layer = false);
        self.has_batches = false;
        self.lobes_changed();
    }

    /// The camera sees other lobes.
    pub(super) fn lobes_changed(&mut self) {
        self.rows.iter_mut().for_each(|rows| (rows.has_hits, rows.has_highlights) = (false, false));
    }

    /// Light paths carry other shares, and the glossy surfaces that they meet reflect otherwise.
    pub(super) fn paths_changed(&mut self) {
        self.rows.iter_mut().for_each(|rows| (rows.has_clusters, rows.has_hits) = (false, false));
    }

    /// Room for so many other points that the camera sees, and samples of glossy pixels;
    /// none: these stay.
    pub(super) fn new_layers(&self, point_count: u32, sample_count: Option<u32>) -> Result<NewLayers> {
        let row = |name, count: u32| Buffer::storage(&self.context, name, 4 * u64::from(count));
        let of_gloss = |count: u32| Ok([row("light hits", 3 * count)?, row("light highlights", count)?]);
        let of_light = |_| Ok((row("light layer", point_count)?, sample_count.map(of_gloss).transpose()?));
        let of_lights = (0..self.rows.len()).map(of_light).collect::<Result<_>>()?;
        Ok(NewLayers { point_count, sample_count, of_lights })
    }

    /// Takes them in the place of those that there are. They hold nothing yet: the view has
    /// to change, too.
    pub(super) fn take_layers(&mut self, new: NewLayers) {
        self.point_count = new.point_count;
        if let (Some(gloss), Some(sample_count)) = (&mut self.gloss, new.sample_count) {
            gloss.sample_count = sample_count;
        }
        for (rows, (layer, of_gloss)) in self.rows.iter_mut().zip(new.of_lights) {
            rows.layer = layer;
            if let Some([hits, highlights]) = of_gloss {
                (rows.hits, rows.highlights) = (Some(hits), Some(highlights));
            }
        }
    }

    /// All that was due has been traced.
    pub(super) fn settle(&mut self) {
        for (rows, source) in self.rows.iter_mut().zip(&self.sources) {
            if self.traces_all || is_active(source) {
                (rows.has_factors, rows.has_layer, rows.has_clusters) = (true, true, true);
                (rows.has_hits, rows.has_highlights) = (true, true);
                self.has_batches = true;
            }
        }
    }

    /// Writes the device's table. What has changed of what the lights emit: the sums over them, and
    /// the emission scale. Where that fails, what was written before still holds.
    pub(super) fn upload(&mut self, lights: &[Light]) -> Result<[bool; 2]> {
        let emissions =
            |sources: &[LightSource]| sources.iter().map(|source| source.emission).collect::<Vec<_>>();
        let mut sources = light_sources(lights);
        for (source, light) in sources.iter_mut().zip(lights) {
            source.emission = if light.is_on { source.emission } else { Vec3::ZERO };
        }
        let mut active = sources.iter_mut().filter(|source| source.emission != Vec3::ZERO);
        let emission_scale = match (active.next(), active.next()) {
            (Some(only), None) => std::mem::replace(&mut only.emission, Vec3::ONE),
            _ => Vec3::ONE,
        };
        if let Some(gloss) = self.gloss {
            for (source, rows) in sources.iter().zip(&mut self.rows) {
                let bytes = u64::from(source.samples) * gloss.beam_bytes;
                if rows.beams.as_ref().is_none_or(|beams| beams.bytes() < bytes) {
                    rows.beams = Some(Buffer::storage(&self.context, "gloss beams", bytes)?);
                    (rows.has_factors, rows.has_clusters, rows.has_hits) = (false, false, false);
                }
            }
        }
        if size_of_val(&*sources) as u64 > self.table.bytes() {
            self.table = Buffer::from_slice(&self.context, "lights", &sources)?;
        } else {
            self.table.write(&sources)?;
        }
        let changed =
            [emissions(&self.sources) != emissions(&sources), self.emission_scale != emission_scale];
        (self.sources, self.emission_scale) = (sources, emission_scale);
        Ok(changed)
    }

    /// How many there are, on or off.
    pub(super) fn count(&self) -> u32 {
        self.rows.len() as u32
    }

    /// Active lights whose form factors are to be traced, with what becomes of those beside them.
    pub(super) fn near_due(&mut self) -> impl Iterator<Item = (&LightSource, &mut Option<NearFactors>)> {
        let all = self.traces_all;
        let due = self.sources.iter().zip(&mut self.rows).filter(|(_, rows)| !rows.has_factors);
        due.filter(move |(source, _)| all || is_active(source)).map(|(source, rows)| (source, &mut rows.near))
    }

    /// Active lights whose form factors are to be traced, with where they go.
    pub(super) fn without_factors(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        self.active()
            .filter(|(_, rows)| !rows.has_factors)
            .map(|(light, rows)| (light, &rows.factors))
            .collect()
    }

    /// What becomes of form factors beside a light; none where it is near to nothing.
    pub(super) fn near(&self, light: u32) -> Option<&NearFactors> {
        self.rows[light as usize].near.as_ref()
    }

    /// Active lights whose layer is to be traced, with where it goes.
    pub(super) fn without_layer(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        self.active().filter(|(_, rows)| !rows.has_layer).map(|(light, rows)| (light, &rows.layer)).collect()
    }

    /// Where the edges of a light's shadows are counted.
    pub(super) fn shadow_groups(&self, light: OneLight<'_>) -> &Buffer {
        &self.rows[light.index as usize].shadow_groups
    }

    /// Pixels at the edges of the shadows of each active light, added up.
    pub(super) fn shadow_edge_count(&self) -> Result<u64> {
        let counts = self.active().map(|(_, rows)| Antialias::counted(&rows.shadow_groups).map(u64::from));
        counts.sum()
    }

    /// Emission and form factors of each active light.
    pub(super) fn factors(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| Some(&rows.factors))
    }

    /// Active lights, as the hierarchy takes them.
    pub(super) fn cluster_lights(&self) -> Vec<ClusterLight<'_>> {
        self.active().map(|(_, rows)| cluster_light(rows)).collect()
    }

    /// Those whose clusters are out of date.
    pub(super) fn without_clusters(&self) -> Vec<ClusterLight<'_>> {
        let due = self.active().filter(|(_, rows)| !rows.has_clusters);
        due.map(|(_, rows)| cluster_light(rows)).collect()
    }

    /// Emission and clusters of each active light.
    pub(super) fn clusters(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| Some(&rows.clusters))
    }

    /// Emission and layer of each active light.
    pub(super) fn layers(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| Some(&rows.layer))
    }

    /// Shares of the active lights that have form factors, and a layer; 1 if none is active.
    pub(super) fn unchanged(&self) -> [f64; 2] {
        let active = self.active().count().max(1) as f64;
        [self.without_factors().len(), self.without_layer().len()].map(|due| 1.0 - due as f64 / active)
    }

    /// The active lights.
    pub(super) fn active_sources(&self) -> impl Iterator<Item = &LightSource> {
        self.sources.iter().filter(|source| is_active(source))
    }

    /// Active lights whose form factors and layer are those of the light as it is, with both,
    /// and its number.
    pub(super) fn traced(&self) -> impl Iterator<Item = (&LightSource, [&Buffer; 2], u32)> {
        let traced = self.active().filter(|(_, rows)| rows.has_factors && rows.has_layer);
        traced.map(|(light, rows)| {
            (&self.sources[light.index as usize], [&rows.factors, &rows.layer], light.index)
        })
    }

    /// Active lights whose beams are to be traced, their form factors, and where beams go; none if
    /// nothing may be glossy.
    pub(super) fn without_beams(&self) -> Vec<(OneLight<'_>, &Buffer, GlossLight<'_>)> {
        let due = self.active().filter(|(_, rows)| !rows.has_factors);
        due.filter_map(|(light, rows)| Some((light, &rows.factors, gloss_light(light, rows)?))).collect()
    }

    /// Active lights whose highlights are to be traced, with where they go; none if nothing
    /// may be glossy.
    pub(super) fn without_highlights(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        let due = self.active().filter(|(_, rows)| !rows.has_highlights);
        due.filter_map(|(light, rows)| Some((light, rows.highlights.as_ref()?))).collect()
    }

    /// Active lights whose slots are out of date, as their clusters are; none if nothing
    /// may be glossy.
    pub(super) fn without_slots(&self) -> Vec<GlossLight<'_>> {
        let due = self.active().filter(|(_, rows)| !rows.has_clusters);
        due.filter_map(|(light, rows)| gloss_light(light, rows)).collect()
    }

    /// Active lights whose hits are out of date; none if nothing may be glossy.
    pub(super) fn without_hits(&self) -> Vec<GlossLight<'_>> {
        let due = self.active().filter(|(_, rows)| !rows.has_hits);
        due.filter_map(|(light, rows)| gloss_light(light, rows)).collect()
    }

    /// Emission and slots of each active light; none if nothing may be glossy.
    pub(super) fn slots(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| rows.slots.as_ref())
    }

    /// Emission and hits of each active light; none if nothing may be glossy.
    pub(super) fn hits(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| rows.hits.as_ref())
    }

    /// Emission and highlights of each active light; none if nothing may be glossy.
    pub(super) fn highlights(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|rows| rows.highlights.as_ref())
    }

    /// Emission of each active light, and a buffer of it, if it has that.
    fn emitting(&self, buffer: impl Fn(&Rows) -> Option<&Buffer>) -> Vec<(Vec3, &Buffer)> {
        self.active().filter_map(|(light, rows)| Some((self.emission(light), buffer(rows)?))).collect()
    }

    fn emission(&self, light: OneLight<'_>) -> Vec3 {
        self.sources[light.index as usize].emission
    }

    fn active(&self) -> impl Iterator<Item = (OneLight<'_>, &Rows)> {
        let lights = self.sources.iter().zip(&self.rows);
        let active = (0..).zip(lights).filter(|(_, (source, _))| self.traces_all || is_active(source));
        active.map(|(index, (source, rows))| {
            let light = OneLight::new(&self.table, index, source);
            (OneLight { traces_all: self.traces_all, ..light }, rows)
        })
    }
}
