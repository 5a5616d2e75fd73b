//! The arguments of `map_Kd`: options and the name of an image.

use glam::DVec2;

use super::obj_lines::statement;
use super::value::excerpt;

/// A `map_Kd` line.
#[derive(Debug, PartialEq)]
pub(super) struct Map<'a> {
    pub(super) file: &'a str,
    /// Image coordinates are `scale·vt + offset`.
    pub(super) scale: DVec2,
    /// Offset of image coordinates, see `scale`.
    pub(super) offset: DVec2,
    pub(super) is_clamped: bool,
}

/// Ignored options, with the largest count of numbers that each takes; 0 for a word.
const OPTIONS: [(&str, usize); 9] = [
    ("-blendu", 0),
    ("-blendv", 0),
    ("-bm", 1),
    ("-boost", 1),
    ("-cc", 0),
    ("-imfchan", 0),
    ("-mm", 2),
    ("-t", 3),
    ("-texres", 1),
];

/// Largest number of words after an unknown option.
const UNKNOWN_WORDS: usize = 4;

impl<'a> Map<'a> {
    /// Parses options, then a file name to the end of the line, which may contain spaces.
    /// Ignored and invalid options go to `passed_over`. If names and options are
    /// ambiguous, `is_file` decides.
    ///
    /// `None` if there is no name.
    pub(super) fn parse(
        mut rest: &'a str,
        is_file: impl Fn(&str) -> bool,
        mut passed_over: impl FnMut(String),
    ) -> Option<Self> {
        let mut map = Self { file: "", scale: DVec2::ONE, offset: DVec2::ZERO, is_clamped: false };
        while rest.starts_with('-') && !is_file(rest) {
            let (option, after) = statement(rest);
            rest = after;
            match option {
                "-o" | "-s" => {
                    let default = if option == "-o" { DVec2::ZERO } else { DVec2::ONE };
                    match (vector(&mut rest, default), option) {
                        (Some(offset), "-o") => map.offset = offset,
                        (Some(scale), _) => map.scale = scale,
                        (None, _) => passed_over(option.to_owned()),
                    }
                }
                "-clamp" => match statement(rest) {
                    (value @ ("on" | "off"), after) => (map.is_clamped, rest) = (value == "on", after),
                    _ => passed_over(option.to_owned()),
                },
                _ => {
                    passed_over(excerpt(option).trim_matches('"').to_owned());
                    match OPTIONS.iter().find(|(name, _)| *name == option) {
                        Some((_, 0)) => rest = statement(rest).1,
                        Some(&(_, most)) => {
                            leading_numbers(&mut rest, most);
                        }
                        None => rest = after_unknown(rest, &is_file),
                    }
                }
            }
        }
        // Some programs write options after the name.
        if let Some((file, options)) =
            rest.split_once(" -").filter(|(file, _)| !is_file(rest) && is_file(file.trim_end()))
        {
            passed_over(format!("-{}", statement(options).0.chars().take(20).collect::<String>()));
            rest = file.trim_end();
        }
        map.file = rest;
        (!rest.is_empty()).then_some(map)
    }
}

/// The text after the values of an unknown option: the longest name of a file, or else
/// the last word.
fn after_unknown(rest: &str, is_file: impl Fn(&str) -> bool) -> &str {
    let mut from = rest;
    for _ in 0..=UNKNOWN_WORDS {
        if from.starts_with('-') || is_file(from) {
            return from;
        }
        from = statement(from).1;
    }
    rest.rsplit(char::is_whitespace).next().unwrap_or_default()
}

/// The numbers at the start of `rest`, at most `most`. The last word of a line is a file name, even
/// if it is a number.
fn leading_numbers(rest: &mut &str, most: usize) -> Vec<f64> {
    let mut found = Vec::new();
    while found.len() < most {
        let (word, after) = statement(rest);
        let Ok(number) = word.parse::<f64>() else { break };
        if after.is_empty() {
            break;
        }
        found.push(number);
        *rest = after;
    }
    found
}

/// The first two of one to three numbers up to 1e6; missing ones come from `default`.
fn vector(rest: &mut &str, default: DVec2) -> Option<DVec2> {
    let found = leading_numbers(rest, 3);
    let is_good = !found.is_empty() && found.iter().all(|number| number.abs() <= 1e6);
    is_good.then(|| DVec2::new(found[0], found.get(1).copied().unwrap_or(default.y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_from_options() {
        let parsed = |rest: &'static str| {
            let mut passed_over = Vec::new();
            let is_file = |name: &str| ["a.png", "b c.png", "-d.png", "7"].contains(&name);
            let map = Map::parse(rest, is_file, |option| passed_over.push(option));
            (map.map(|map| (map.file, map.scale, map.offset, map.is_clamped)), passed_over.join(" "))
        };
        let plain =
            |file, passed_over: &str| (Some((file, DVec2::ONE, DVec2::ZERO, false)), passed_over.to_owned());
        assert_eq!(parsed("b c.png"), plain("b c.png", ""));
        assert_eq!(parsed("-d.png"), plain("-d.png", ""));
        assert_eq!(
            parsed("-blendu on -mm 0 1 -bm 0.5 -cc off b c.png"),
            plain("b c.png", "-blendu -mm -bm -cc")
        );
        assert_eq!(parsed("-wrap repeat 3 b c.png"), plain("b c.png", "-wrap"));
        assert_eq!(parsed("-wrap a.png"), plain("a.png", "-wrap"));
        assert_eq!(parsed("-wrap on gone.png"), plain("gone.png", "-wrap"));
        assert_eq!(parsed("-wrap -cc on a.png"), plain("a.png", "-wrap -cc"));
        assert_eq!(parsed("-clamp a.png"), plain("a.png", "-clamp"));
        assert_eq!(parsed("-o a.png"), plain("a.png", "-o"));
        assert_eq!(parsed("-s inf 2 a.png"), plain("a.png", "-s"));
        assert_eq!(parsed("b c.png -s 2 2"), plain("b c.png", "-s"));
        assert_eq!(parsed("-s 2 7"), (Some(("7", DVec2::new(2.0, 1.0), DVec2::ZERO, false)), String::new()));
        let placed = (Some(("a.png", DVec2::new(2.0, 3.0), DVec2::new(0.25, 0.0), true)), String::new());
        assert_eq!(parsed("-s 2 3 1 -o 0.25 -clamp on a.png"), placed);
        for none in ["", "-clamp on", "-wrap", "-s"] {
            assert_eq!(parsed(none).0, None, "{none}");
        }
    }
}
