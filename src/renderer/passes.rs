//! The passes of frames: label, column of the timing table, replay and cost. Reports, replay and
//! `ARCHITECTURE.md` follow this table.

use super::pass_sizes::{Cost, Sizes};
use crate::passes::frame::{
    antialias::Antialias, blend::Blend, bright::Bright, compose::Compose, direct::Direct,
    form_factors::FormFactors, gather::Gather, gloss::Gloss, gloss_pixels::GlossPixels,
    gloss_records::GlossRecords, hvds::Pyramid, near_field::NearField, needed_records::NeededRecords,
    own_records::OwnRecords, path_scan::PathScan, pixel_colours::PixelColours, primary::Primary,
    silhouettes::Silhouettes, splat::Splat, tonemap::Tonemap,
};

/// A column of the paper's timing table. [Yue, Table 2]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Tdi,
    Tlpe,
    Thvds,
    Tfg,
    Tsplat,
}

/// A pass of a frame: a line of `ARCHITECTURE.md`.
pub(super) struct Pass {
    /// Label in timings, in debuggers and of `time --repeat`.
    pub(super) stem: &'static str,
    pub(super) column: Column,
    /// Bytes that the pass moves at least, and its rays. `None`: not modelled.
    pub(super) cost: Option<fn(&Sizes) -> Cost>,
    /// The pass that a replay must record before, because this pass changes its own input.
    pub(super) renewed_by: Option<&'static str>,
}

const fn pass(stem: &'static str, column: Column, cost: fn(&Sizes) -> Cost) -> Pass {
    Pass { stem, column, cost: Some(cost), renewed_by: None }
}

const fn unmodelled(stem: &'static str, column: Column) -> Pass {
    Pass { stem, column, cost: None, renewed_by: None }
}

/// Every pass that a frame may have, in the order of its first occurrence.
pub(super) const PASSES: [Pass; 29] = [
    pass(Primary::STEM, Column::Tdi, |size| Cost::of_rays(size.surface, size.pixels)),
    pass(Antialias::STEM, Column::Tdi, |size| {
        Cost::of(size.surface + 8 * size.pixels + size.edge_samples + size.fragments)
    }),
    pass(PixelColours::STEM, Column::Tdi, |size| {
        Cost::of(size.surface + size.edge_samples + size.pixel_colours + size.edge_colours)
    }),
    unmodelled(GlossPixels::RAYS_STEM, Column::Tdi),
    unmodelled(GlossPixels::HIGHLIGHTS_STEM, Column::Tdi),
    pass(Direct::BATCHES_STEM, Column::Tdi, |size| Cost::of(size.surface)),
    pass(Silhouettes::STEM, Column::Tdi, |size| Cost::of(size.silhouettes)),
    pass(Direct::STEM, Column::Tdi, |size| {
        let bytes = size.planned_irradiances * (size.surface + 4 * size.pixels);
        Cost::of_rays(bytes, size.pixel_rays)
    }),
    Pass {
        stem: Antialias::SHADOW_STEM,
        column: Column::Tdi,
        cost: Some(|size| {
            let bytes = 2 * size.fragments + 4 * size.fragment_count + 8 * size.pixels;
            Cost::of_rays(size.planned_irradiances * bytes, size.edge_rays)
        }),
        // It averages edges in the buffer in which it detects them: a buffer that is already
        // averaged has fewer edges.
        renewed_by: Some(Direct::STEM),
    },
    pass(Direct::SUM_STEM, Column::Tdi, |size| Cost::of((4 * size.lights + 12) * size.points)),
    pass(FormFactors::STEM, Column::Tlpe, |size| {
        Cost::of_rays(size.planned_factors * 20 * size.paths, size.factor_rays)
    }),
    unmodelled(Gloss::BEAMS_STEM, Column::Tlpe),
    // Steps are read twice, contributions written one vec3 at a time.
    pass(PathScan::STEM, Column::Tlpe, |size| {
        Cost::of(2 * size.steps + size.steps_once + size.contributions)
    }),
    unmodelled(Gloss::ENTRIES_STEM, Column::Tlpe),
    pass(Pyramid::LIGHTS_STEM, Column::Thvds, |size| {
        let of_light = size.first_bounce * size.paths + size.light_flux;
        Cost::of(size.contributions + size.planned_clusters * of_light)
    }),
    pass(Pyramid::STEM, Column::Thvds, |size| Cost::of(size.lights * size.light_flux + 3 * size.clusters)),
    unmodelled(Gloss::STEM, Column::Thvds),
    pass(NearField::STEM, Column::Tfg, |size| Cost::of(size.near_field)),
    pass(Bright::STEM, Column::Tfg, |size| Cost::of(size.watched)),
    pass(Splat::STEM, Column::Tsplat, |size| {
        Cost::of(size.surface + size.cache_points + size.record_tree + size.weights)
    }),
    // Mask and sums of records, and sums of the list. Splat weights only if the view is new.
    pass(NeededRecords::STEM, Column::Tfg, |size| {
        Cost::of(size.marked_weights + size.neighbours + 24 * size.record_count)
    }),
    pass(Gather::STEM, Column::Tfg, |size| {
        let of_all = size.merged_rays + size.records;
        let bytes = size.gathered * of_all / size.record_count + size.clusters;
        Cost { bytes, rays: size.bright_rays }
    }),
    pass(Blend::STEM, Column::Tfg, |size| Cost::of(size.neighbours + 2 * size.records + size.cache_points)),
    pass(Splat::APPLY_STEM, Column::Tsplat, |size| {
        Cost::of(size.surface + size.weights + size.records + size.image)
    }),
    unmodelled(OwnRecords::STEM, Column::Tfg),
    unmodelled(GlossRecords::STEM, Column::Tfg),
    unmodelled(GlossPixels::STEM, Column::Tfg),
    pass(Compose::STEM, Column::Tsplat, |size| {
        let colours = size.pixel_colours + size.edge_colours;
        let of_edges = 12 * size.fragment_count + size.fragments;
        Cost::of(size.surface + 3 * size.image + 4 * size.pixels + of_edges + colours)
    }),
    pass(Tonemap::STEM, Column::Tsplat, |size| Cost::of(size.image + 4 * size.pixels)),
];

/// The pass with a label. Panics if there is none: frames record no other passes.
pub(super) fn named(stem: &str) -> &'static Pass {
    PASSES.iter().find(|pass| pass.stem == stem).unwrap_or_else(|| panic!("`{stem}` is no pass of frames"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_frame_passes_in_the_documents_is_this_one() {
        let text = include_str!("../../ARCHITECTURE.md");
        let (_, frame) = text.split_once("### Frame, in order").unwrap();
        let (table, _) = frame.split_once("\n## ").unwrap();
        let rows: Vec<(String, String)> = table
            .lines()
            .filter(|line| line.starts_with("| `"))
            .map(|line| {
                let cells: Vec<&str> = line.split('|').map(str::trim).collect();
                (cells[1].split('`').nth(1).unwrap().to_owned(), cells[4].to_owned())
            })
            .collect();
        let expected: Vec<(String, String)> =
            PASSES.iter().map(|pass| (pass.stem.to_owned(), format!("{:?}", pass.column))).collect();
        assert_eq!(rows, expected);
    }

    #[test]
    fn a_pass_has_one_row() {
        for (index, pass) in PASSES.iter().enumerate() {
            assert!(PASSES[..index].iter().all(|other| other.stem != pass.stem), "{}", pass.stem);
            assert!(pass.renewed_by.is_none_or(|stem| PASSES[..index].iter().any(|pass| pass.stem == stem)));
        }
    }
}
