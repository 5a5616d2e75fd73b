//! Pass replay: one pass of the frame recorded again and again, for a profiler.

use super::dirty::Work;
use super::report::FrameWatch;
use super::{FrameReport, Renderer};
use crate::error::Result;
use crate::passes::frame::{
    antialias::Antialias, blend::Blend, cluster_proxies::ClusterProxies, compose::Compose, direct::Direct,
    form_factors::FormFactors, gather::Gather, gloss::Gloss, gloss_pixels::GlossPixels, hvds::Pyramid,
    near_field::NearField, needed_records::NeededRecords, path_scan::PathScan, pixel_colours::PixelColours,
    primary::Primary, splat::Splat, tonemap::Tonemap,
};

/// Every pass that a frame may have. A pass that changes its own input follows the pass that renews
/// this input, see [`prepared`].
const PASSES: [&str; 26] = [
    Primary::STEM,
    Antialias::STEM,
    PixelColours::STEM,
    GlossPixels::RAYS_STEM,
    GlossPixels::HIGHLIGHTS_STEM,
    Direct::BATCHES_STEM,
    Direct::STEM,
    Antialias::SHADOW_STEM,
    Direct::SUM_STEM,
    FormFactors::STEM,
    Gloss::BEAMS_STEM,
    PathScan::STEM,
    Gloss::ENTRIES_STEM,
    Pyramid::LIGHTS_STEM,
    Pyramid::STEM,
    Gloss::STEM,
    ClusterProxies::STEM,
    NearField::STEM,
    Gather::STEM,
    Splat::STEM,
    NeededRecords::STEM,
    Blend::STEM,
    Splat::APPLY_STEM,
    GlossPixels::STEM,
    Compose::STEM,
    Tonemap::STEM,
];

/// The pass, after the pass that must precede it, if there is one.
fn prepared(place: usize) -> &'static [&'static str] {
    // The shadow edge pass averages edges in the buffer in which it detects them: a buffer that is
    // already averaged has fewer edges.
    let first = if PASSES[place] == Antialias::SHADOW_STEM { place - 1 } else { place };
    &PASSES[first..=place]
}

impl Renderer {
    /// Names of all passes that frames may have. The scene determines the passes of a frame.
    pub fn pass_names() -> &'static [&'static str] {
        &PASSES
    }

    /// Records all occurrences of one pass as in a frame with all results stale. The report also
    /// holds the pass that must precede it; all other results stay. The previous frame must have
    /// computed everything; the next one does. Panics if no pass has this name.
    ///
    /// # Errors
    /// The device failed.
    pub fn repeat(&mut self, pass: &str) -> Result<FrameReport> {
        let place = PASSES.iter().position(|&name| name == pass).expect("passes are named by `pass_names`");
        self.force(Work::Everything);
        let plan = self.plan();
        self.lights.prepare_near(&plan, &mut self.transport.near_lights)?;
        let watch = FrameWatch::start(&self.context);
        let ((), passes) = self.context.run(|rec| {
            rec.only(prepared(place));
            self.record(rec, &plan);
        })?;
        Ok(FrameReport {
            lights_unchanged: [0.0, 0.0],
            ..self.report(&plan, passes, watch.stop(&self.context), 0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_pass_changes_is_made_anew_before_it() {
        let of = |name: &str| prepared(PASSES.iter().position(|pass| *pass == name).unwrap());
        assert_eq!(of("shadow_edges"), ["direct", "shadow_edges"]);
        assert_eq!(of("primary"), ["primary"]);
        assert_eq!(of("gather"), ["gather"]);
    }
}
