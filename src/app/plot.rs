//! Plots with two logarithmic axes as SVG, for a file or a page, with light and dark backgrounds.

use std::fmt::Write;

/// Colours that colour-blind readers can distinguish (Okabe and Ito), lighter on a dark background.
/// Each series also has its own marker.
const STYLE: &str = ".plot{--ink:#1a1a1a;--faint:#d5d5d5;--c0:#0072b2;--c1:#d55e00;--c2:#007a5a;--c3:#a3497a;--c4:#8a6d00;--c5:#555}\
@media(prefers-color-scheme:dark){.plot{--ink:#e8e8e8;--faint:#444;--c0:#56b4e9;--c1:#ff9b57;--c2:#2fc79a;--c3:#e79ac5;--c4:#f0e442;--c5:#aaa}}\
.plot text{font:12px system-ui,sans-serif;fill:var(--ink)}.plot .grid{stroke:var(--faint)}\
.plot .axis{stroke:var(--ink);fill:none}.plot .level{stroke:var(--c5);stroke-dasharray:4 4}\
.plot .c0{--c:var(--c0)}.plot .c1{--c:var(--c1)}.plot .c2{--c:var(--c2)}.plot .c3{--c:var(--c3)}.plot .c4{--c:var(--c4)}\
.plot .c5{--c:var(--c5)}.plot .mark{fill:var(--c);stroke:none}.plot .line{fill:none;stroke:var(--c);stroke-width:1.6}\
.plot .hollow{fill:none;stroke:var(--c);stroke-width:1.6}.plot .ring{fill:none;stroke:var(--ink);stroke-width:1.4}";

const WIDTH: f64 = 400.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 388.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 262.0;
/// Height of a legend row.
const ROW: f64 = 18.0;

/// A data point with its marks and tooltip.
#[derive(Clone, Debug)]
pub(in crate::app) struct Point {
    pub(in crate::app) x: f64,
    pub(in crate::app) y: f64,
    /// On the Pareto front: drawn with a ring.
    pub(in crate::app) is_ringed: bool,
    /// Extrapolated, not measured: drawn hollow.
    pub(in crate::app) is_hollow: bool,
    /// Tooltip of the point.
    pub(in crate::app) says: String,
}

/// Points of one kind.
#[derive(Clone, Debug)]
pub(in crate::app) struct Series {
    pub(in crate::app) label: String,
    pub(in crate::app) points: Vec<Point>,
    /// Whether lines join the points in the order of x.
    pub(in crate::app) is_joined: bool,
}

/// A plot; values must be positive.
#[derive(Clone, Debug)]
pub(in crate::app) struct Plot {
    /// Text alternative for screen readers.
    pub(in crate::app) title: String,
    pub(in crate::app) x_label: String,
    pub(in crate::app) y_label: String,
    pub(in crate::app) series: Vec<Series>,
    /// A horizontal line and its label.
    pub(in crate::app) level: Option<(f64, String)>,
}

/// A logarithmic axis that maps data to the page.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logs = values.filter(|value| *value > 0.0 && value.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low > high { (-1.0, 0.0) } else { (low, high) };
        let margin = 0.06 * (high - low).max(0.5);
        Self { low: low - margin, high: high + margin, from, to }
    }

    fn place(&self, value: f64) -> f64 {
        self.from + (value.log10() - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// Round values in the range: powers of ten, with 2 and 5 in short ranges.
    fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = if self.high - self.low > 2.2 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let values = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
        values.filter(|value| (self.low..=self.high).contains(&value.log10())).collect()
    }
}

impl Plot {
    /// The plot as a separate SVG file.
    pub(in crate::app) fn file(&self) -> String {
        self.svg(" xmlns=\"http://www.w3.org/2000/svg\"")
    }

    /// The plot for a page; `file` adds the name space that only a file needs.
    pub(in crate::app) fn svg(&self, attributes: &str) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = Axis::new(points().map(|point| point.x), LEFT, RIGHT);
        let levels = self.level.iter().map(|(value, _)| *value);
        let y = Axis::new(points().map(|point| point.y).chain(levels), BOTTOM, TOP);
        let rows = self.series.len() + usize::from(self.level.is_some());
        let height = BOTTOM + 50.0 + ROW * rows as f64;
        let mut svg = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\"{attributes}><style>{STYLE}</style>",
            escape(&self.title)
        );
        self.axes(&mut svg, &x, &y);
        if let Some((value, _)) = &self.level {
            let at = y.place(*value);
            put(&mut svg, format_args!("<path class=\"level\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/>"));
        }
        for (index, series) in self.series.iter().enumerate() {
            draw_series(&mut svg, series, index, &x, &y);
        }
        self.legend(&mut svg);
        svg + "</svg>"
    }

    fn axes(&self, svg: &mut String, x: &Axis, y: &Axis) {
        for value in x.ticks() {
            let at = x.place(value);
            put(svg, format_args!("<path class=\"grid\" d=\"M{at:.1} {TOP}V{BOTTOM}\"/>"));
            let under = BOTTOM + 16.0;
            put(
                svg,
                format_args!(
                    "<text x=\"{at:.1}\" y=\"{under}\" text-anchor=\"middle\">{}</text>",
                    short(value)
                ),
            );
        }
        for value in y.ticks() {
            let at = y.place(value);
            put(svg, format_args!("<path class=\"grid\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/>"));
            let (left, middle) = (LEFT - 6.0, at + 4.0);
            put(
                svg,
                format_args!(
                    "<text x=\"{left}\" y=\"{middle:.1}\" text-anchor=\"end\">{}</text>",
                    short(value)
                ),
            );
        }
        put(svg, format_args!("<path class=\"axis\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>"));
        let (middle, under) = (0.5 * (LEFT + RIGHT), BOTTOM + 34.0);
        let [x_label, y_label] = [&self.x_label, &self.y_label].map(|label| escape(label));
        put(svg, format_args!("<text x=\"{middle}\" y=\"{under}\" text-anchor=\"middle\">{x_label}</text>"));
        let middle = 0.5 * (TOP + BOTTOM);
        put(
            svg,
            format_args!(
                "<text transform=\"translate(13 {middle}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>"
            ),
        );
    }

    fn legend(&self, svg: &mut String) {
        let mut at = BOTTOM + 56.0;
        for (index, series) in self.series.iter().enumerate() {
            put(svg, format_args!("<g class=\"c{}\">", index % 6));
            if series.is_joined {
                put(svg, format_args!("<path class=\"line\" d=\"M{} {at}h24\"/>", LEFT - 12.0));
            }
            marker(svg, index, LEFT, at, "mark");
            put(svg, format_args!("</g><text x=\"{}\" y=\"{}\">", LEFT + 20.0, at + 4.0));
            put(svg, format_args!("{}</text>", escape(&series.label)));
            at += ROW;
        }
        if let Some((_, label)) = &self.level {
            put(svg, format_args!("<path class=\"level\" d=\"M{} {at}h24\"/>", LEFT - 12.0));
            put(svg, format_args!("<text x=\"{}\" y=\"{}\">{}</text>", LEFT + 20.0, at + 4.0, escape(label)));
        }
    }
}

fn draw_series(svg: &mut String, series: &Series, index: usize, x: &Axis, y: &Axis) {
    put(svg, format_args!("<g class=\"c{}\">", index % 6));
    let mut points: Vec<&Point> = series.points.iter().filter(|p| p.x > 0.0 && p.y > 0.0).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    if series.is_joined && points.len() > 1 {
        let places: Vec<String> =
            points.iter().map(|point| format!("{:.1} {:.1}", x.place(point.x), y.place(point.y))).collect();
        put(svg, format_args!("<path class=\"line\" d=\"M{}\"/>", places.join("L")));
    }
    for point in points {
        let (at_x, at_y) = (x.place(point.x), y.place(point.y));
        put(svg, format_args!("<g><title>{}</title>", escape(&point.says)));
        marker(svg, index, at_x, at_y, if point.is_hollow { "hollow" } else { "mark" });
        if point.is_ringed {
            put(svg, format_args!("<circle class=\"ring\" cx=\"{at_x:.1}\" cy=\"{at_y:.1}\" r=\"8\"/>"));
        }
        put(svg, format_args!("</g>"));
    }
    put(svg, format_args!("</g>"));
}

/// A marker shape per series: series do not differ in colour alone.
fn marker(svg: &mut String, index: usize, x: f64, y: f64, class: &str) {
    let path = match index % 6 {
        0 => "m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z",
        1 => "m-4-4h8v8h-8z",
        2 => "m0-5l5 9h-10z",
        3 => "m0-5.5l5.5 5.5l-5.5 5.5l-5.5-5.5z",
        4 => "m0 5l5-9h-10z",
        _ => "m-1.5-5h3v3.5h3.5v3h-3.5v3.5h-3v-3.5h-3.5v-3h3.5z",
    };
    put(svg, format_args!("<path class=\"{class}\" d=\"M{x:.1} {y:.1}{path}\"/>"));
}

/// Tick label: plain between a thousandth and ten thousand, else a power of ten.
fn short(value: f64) -> String {
    let decade = value.log10().floor() as i32;
    match decade {
        0..=3 => format!("{value:.0}"),
        -3..=-1 => format!("{value:.*}", decade.unsigned_abs() as usize),
        _ => format!("{:.0}e{decade}", value / 10f64.powi(decade)),
    }
}

/// Escapes text for HTML and attributes.
pub(in crate::app) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn put(text: &mut String, arguments: std::fmt::Arguments) {
    text.write_fmt(arguments).expect("writing to a string cannot fail");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        let point = |(x, y)| Point { x, y, is_ringed: true, is_hollow: false, says: "a < b & \"c\"".into() };
        let series =
            Series { label: "ours".into(), points: points.into_iter().map(point).collect(), is_joined: true };
        Plot {
            title: "t".into(),
            x_label: "s".into(),
            y_label: "relMSE".into(),
            series: vec![series],
            level: Some((1e-4, "noise".into())),
        }
    }

    #[test]
    fn axes_are_logarithmic_and_hold_every_point() {
        let axis = Axis::new([1.0, 100.0].into_iter(), 0.0, 100.0);
        assert!((axis.place(10.0) - 50.0).abs() < 1e-9);
        assert!(axis.place(1.0) > 0.0 && axis.place(100.0) < 100.0);
        assert_eq!(Axis::new([1.0, 100.0].into_iter(), 0.0, 1.0).ticks().first(), Some(&1.0));
        assert_eq!(
            [1e-5, 0.002, 0.5, 1.0, 200.0, 1e5].map(short),
            ["1e-5", "0.002", "0.5", "1", "200", "1e5"]
        );
    }

    #[test]
    fn one_point_none_and_odd_values_are_drawn() {
        for points in [vec![], vec![(1.0, 1.0)], vec![(0.0, 1.0), (1.0, -1.0), (f64::NAN, 1.0), (1e-3, 1e3)]]
        {
            let svg = plot(points).svg("");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
        }
    }

    #[test]
    fn text_is_escaped() {
        let svg = plot(vec![(1.0, 1.0)]).file();
        assert!(svg.contains("a &lt; b &amp; &quot;c&quot;") && svg.contains("xmlns="));
    }
}
