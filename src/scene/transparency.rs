//! Transparency as MTL files state it: which materials are panes.

use glam::Vec3;

/// Opacity below which a surface is a pane. Exporters write values up to one for cloth, leaves and
/// paint, which reflect most of the light.
pub(super) const PANE: f64 = 0.5;

/// The note on a pane.
pub(super) const IS_PANE: &str =
    "opacity below one half makes thin panes, which let light pass and reflect nothing";

/// What a material states about light that passes, each with its line.
#[derive(Default)]
pub(super) struct Transparency {
    /// Opacity by `d`.
    pub(super) dissolve: Option<(f64, usize)>,
    /// Opacity by `Tr`, which is 1 − Tr.
    pub(super) transparency: Option<(f64, usize)>,
    /// `Tf`, the colour of the light that passes.
    pub(super) filter: Option<(Vec3, usize)>,
    /// An `illum` of glass.
    pub(super) illum: Option<usize>,
}

impl Transparency {
    /// Colour of the light that passes, with the line that states the opacity. `None` if the
    /// material is no pane.
    pub(super) fn pane(&self) -> Option<(Vec3, usize)> {
        let (opacity, line) = self.dissolve.or(self.transparency)?;
        let filter = self.filter.map(|(filter, _)| filter).filter(|filter| *filter != Vec3::ZERO);
        let filter = filter.unwrap_or(Vec3::ONE).clamp(Vec3::ZERO, Vec3::ONE);
        (opacity > 0.0 && opacity < PANE).then(|| ((1.0 - opacity) as f32 * filter, line))
    }

    /// Statements without effect on a material that is no pane, each with its line.
    pub(super) fn without_effect(&self) -> impl Iterator<Item = (&'static str, usize)> {
        let of =
            |stated: Option<(f64, usize)>| stated.filter(|(opacity, _)| *opacity < 1.0).map(|(_, line)| line);
        let is_neutral = |(filter, _): &(Vec3, usize)| *filter == Vec3::ZERO || *filter == Vec3::ONE;
        let filter = self.filter.filter(|stated| !is_neutral(stated)).map(|(_, line)| line);
        let stated =
            [("d", of(self.dissolve)), ("Tr", of(self.transparency)), ("Tf", filter), ("illum", self.illum)];
        stated.into_iter().filter_map(|(keyword, line)| Some((keyword, line?)))
    }
}

/// The first number of a statement. `None` if it is none.
pub(super) fn number(rest: &str) -> Option<f64> {
    rest.split_whitespace().next()?.parse().ok().filter(|number: &f64| !number.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panes_have_a_low_opacity_and_the_colour_of_their_filter() {
        let of = |dissolve: Option<f64>, transparency: Option<f64>, filter: Option<Vec3>| {
            let line = |value: f64| (value, 7);
            let stated = Transparency {
                dissolve: dissolve.map(line),
                transparency: transparency.map(line),
                filter: filter.map(|filter| (filter, 8)),
                illum: None,
            };
            stated.pane().map(|(colour, _)| colour)
        };
        let blue = Vec3::new(0.2, 0.4, 1.0);
        assert_eq!(of(Some(0.25), None, None), Some(Vec3::splat(0.75)));
        assert_eq!(of(Some(0.25), Some(1.0), Some(blue)), Some(0.75 * blue));
        assert_eq!(of(None, Some(0.25), Some(Vec3::ZERO)), Some(Vec3::splat(0.75)));
        for opaque in [of(Some(0.5), None, None), of(None, None, Some(blue)), of(Some(0.0), None, None)] {
            assert_eq!(opaque, None);
        }
    }
}
