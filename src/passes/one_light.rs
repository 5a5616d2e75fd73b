//! One light as the input of a pass, and how its work is split into dispatches.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::passes::lattice::{has_sets, pixel_lattice, samples_of_point};
use crate::types::{
    ADDS, HAS_SILHOUETTES, LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SPOT, LightSource,
    MARKS_PENUMBRA, TRACES_ALL,
};

/// Point samples of a light in one dispatch. More would exceed the watchdog of a slow device, and
/// the iteration limit ([`crate::gpu::MAX_LOOP_ITERATIONS`]).
pub(super) const SAMPLES_A_DISPATCH: u32 = 8;

/// Beams of a light of many parts at an entry point that may be glossy.
const MAX_BEAMS: u32 = 16;

/// Beams of the sky at an entry point that may be glossy: four rays each. `glsl/sky_beams.comp`
/// has the same constant.
pub(super) const SKY_BEAMS: u32 = 16;

/// Texels of the map of silhouettes around a point, spot or directional light, and around a point
/// sample of an area light; as in `glsl/include/silhouettes.glsl`.
const MAP_TEXELS: [u64; 2] = [6 * 512 * 512, 6 * 256 * 256];
/// Maximum number of point samples of an area light with maps.
const MAPPED_SAMPLES: u32 = 16;

/// The place of a sky's radiances: octahedral, `side`² values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkyTable {
    /// First word in the table of lights.
    pub first_word: u32,
    /// Side of the octahedral table.
    pub side: u32,
}

impl SkyTable {
    /// Number of values.
    pub fn cells(self) -> u32 {
        self.side * self.side
    }
}

/// One light of the table, or one part of it. Most lights have one part. Emitting meshes have
/// several of one kind, in consecutive rows, with as many point samples each, and so have the
/// bright spots of a sky. They share all results: a dispatch for a later part adds to earlier ones.
#[derive(Clone, Copy)]
pub struct OneLight<'a> {
    /// Table of `LightSource`s.
    pub table: &'a Buffer,
    /// Number of the light.
    pub index: u32,
    /// Row of its first part in the table.
    pub row: u32,
    /// Number of parts.
    pub part_count: u32,
    /// One of the constants `LIGHT_*`: the kind of each part.
    pub kind: u32,
    /// Number of point samples of each part.
    pub samples: u32,
    /// Traces rays although they cannot bring light: from points that face away or stand outside
    /// the light's cone.
    pub traces_all: bool,
    /// This is a later part of a light: its light is added to that of earlier ones.
    pub adds: bool,
    /// Pixels that see only a part of an area light get a mark. `Antialias` removes it.
    pub marks_penumbra: bool,
    /// The radiance that rays out of the scene find. `None` unless the light is a sky.
    pub sky: Option<SkyTable>,
    /// Its maps of silhouettes. `None`: points that see it alike are not known.
    pub silhouettes: Option<&'a Buffer>,
    /// The channel of a light of one colour, if panes have colours.
    pub channel: Option<u32>,
}

impl<'a> OneLight<'a> {
    /// The light at `index`, which is also its row. Rays are traced only if they can bring light.
    pub fn new(table: &'a Buffer, index: u32, source: &LightSource) -> Self {
        let LightSource { kind, samples, .. } = *source;
        let (row, part_count) = (index, 1);
        Self {
            table,
            index,
            row,
            part_count,
            kind,
            samples,
            traces_all: false,
            adds: false,
            marks_penumbra: false,
            sky: None,
            silhouettes: None,
            channel: None,
        }
    }

    /// Its parts, each a light of one part.
    pub fn parts(self) -> impl Iterator<Item = Self> {
        (0..self.part_count).map(move |part| Self {
            row: self.row + part,
            part_count: 1,
            adds: part > 0,
            ..self
        })
    }

    /// Ranges of samples of each part, by dispatch: the first and one past the last. The first
    /// dispatch writes, later ones add.
    pub fn spans(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        Self::spans_of(self.samples)
    }

    /// As [`Self::spans`], of the samples that one image point of a pixel has: all if they are few.
    /// Several image points share a pixel, and each has samples of its own.
    pub fn point_spans(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        Self::spans_of(self.point_samples())
    }

    /// Step of the lattice that the samples of all image points of a pixel are.
    pub fn point_step(&self) -> u32 {
        pixel_lattice(self.point_samples())
    }

    /// Point samples of a part at one image point of a pixel.
    pub fn point_samples(&self) -> u32 {
        samples_of_point(self.samples)
    }

    fn spans_of(samples: u32) -> impl Iterator<Item = (u32, u32)> + use<> {
        let firsts = (0..samples).step_by(SAMPLES_A_DISPATCH as usize);
        firsts.map(move |first| (first, samples.min(first + SAMPLES_A_DISPATCH)))
    }

    /// Point samples of all parts.
    pub fn sample_count(&self) -> u32 {
        self.part_count * self.samples
    }

    /// Point samples that share a beam at an entry point that may be glossy. Neighbouring parts are
    /// stored together, so that samples of one beam have similar directions.
    pub fn samples_per_beam(&self) -> u32 {
        if self.part_count <= 1 { 1 } else { self.sample_count().div_ceil(MAX_BEAMS) }
    }

    /// Beams of the parts at an entry point that may be glossy.
    pub fn part_beams(&self) -> u32 {
        self.sample_count().div_ceil(self.samples_per_beam())
    }

    /// All beams of the light at such an entry point. Those of the parts come first.
    pub fn beam_count(&self) -> u32 {
        self.part_beams() + if self.sky.is_some() { SKY_BEAMS } else { 0 }
    }

    /// Bytes of its maps of silhouettes. Zero if it has several parts or too many samples for maps.
    pub fn map_bytes(&self) -> u64 {
        match self.kind {
            _ if self.part_count != 1 => 0,
            LIGHT_AREA if self.samples > MAPPED_SAMPLES => 0,
            LIGHT_AREA => 4 * MAP_TEXELS[1] * u64::from(self.samples),
            _ => 4 * MAP_TEXELS[0],
        }
    }

    /// Whether it has maps of silhouettes.
    pub fn has_silhouettes(&self) -> bool {
        let bytes = self.map_bytes();
        bytes > 0 && self.silhouettes.is_some_and(|maps| maps.bytes() >= bytes)
    }

    /// The binding of its maps, which kernels read only with `HAS_SILHOUETTES`.
    pub fn map(&self) -> (&'static str, &'a Buffer) {
        ("Silhouettes", self.silhouettes.unwrap_or(self.table))
    }

    /// The flags of a dispatch: `TRACES_ALL`, `ADDS`, `MARKS_PENUMBRA`, `HAS_SILHOUETTES`.
    pub fn flags(&self) -> u32 {
        let flag = |is_set, flag| if is_set { flag } else { 0 };
        let marks = self.marks_penumbra && self.kind == LIGHT_AREA && has_sets(self.samples);
        flag(self.traces_all, TRACES_ALL)
            | flag(self.adds, ADDS)
            | flag(marks, MARKS_PENUMBRA)
            | flag(self.has_silhouettes(), HAS_SILHOUETTES)
    }
}

/// Makes something for each kind of light, in the order of their numbers.
///
/// # Errors
/// One was not made.
pub(super) fn for_kinds<T>(make: impl Fn(u32) -> Result<T>) -> Result<[T; 4]> {
    Ok([make(LIGHT_POINT)?, make(LIGHT_SPOT)?, make(LIGHT_AREA)?, make(LIGHT_DIRECTIONAL)?])
}

/// A kernel for one light, specialised to each kind of light: see `glsl/include/light_kind.glsl`.
pub struct LightKernel([Pipeline; 4]);

impl LightKernel {
    /// Creates the pipelines of the shader with that stem, as [`Pipeline::new`] does.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>, stem: &'static str, constants: &[(&str, u32)]) -> Result<Self> {
        let of_kind = |kind| Pipeline::new(context, stem, &[constants, &[("LIGHT_KIND", kind)]].concat());
        Ok(Self(for_kinds(of_kind)?))
    }

    /// The kernel for a light. Panics if there is no such kind.
    pub fn of(&self, light: OneLight<'_>) -> &Pipeline {
        &self.0[light.kind as usize]
    }
}
