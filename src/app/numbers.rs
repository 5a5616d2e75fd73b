//! Parsers of numeric arguments. An error states the expected values with an example; clap adds the
//! value and the argument before it.

use std::fmt::Display;
use std::ops::RangeInclusive;

type Parsed<T> = Result<T, String>;

/// Parses a whole number in a range, such as `example`.
pub(super) fn whole(
    range: RangeInclusive<u32>,
    example: &'static str,
) -> impl Fn(&str) -> Parsed<u32> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            let (low, high) = (range.start(), range.end());
            match *high {
                u32::MAX => format!("expected a whole number from {low} on, as in {example}"),
                high => format!("expected a whole number from {low} to {high}, as in {example}"),
            }
        })
    }
}

/// Parses an element of a comma-separated list of whole numbers, such as `example`.
pub(super) fn each_whole(
    range: RangeInclusive<u32>,
    example: &'static str,
) -> impl Fn(&str) -> Parsed<u32> + Clone + Send + Sync + 'static {
    let parse = whole(range, example);
    move |text| {
        let with_list =
            |what: String| what.replacen("a whole number", "whole numbers", 1) + " (commas between them)";
        parse(text).map_err(with_list)
    }
}

/// Parses a number that satisfies `is_good`; `what` describes the condition.
fn float<T: std::str::FromStr + Copy>(
    text: &str,
    is_good: impl Fn(T) -> bool,
    what: impl Display,
) -> Parsed<T> {
    text.trim().parse().ok().filter(|&number| is_good(number)).ok_or_else(|| format!("expected {what}"))
}

/// Refuses a number that is not finite.
pub(super) fn parse_finite(text: &str) -> Parsed<f32> {
    float(text, f32::is_finite, "a finite number, as in -1.5")
}

/// Parses a positive, finite time.
pub(super) fn parse_seconds(text: &str) -> Parsed<f32> {
    let is_good = |seconds: f32| seconds.is_finite() && seconds > 0.0;
    float(text, is_good, "a positive number of seconds, as in 2.5")
}

/// Parses a positive, finite number.
pub(super) fn parse_positive(text: &str) -> Parsed<f64> {
    float(text, |number: f64| number.is_finite() && number > 0.0, "a positive number, as in 1e-3 or 16")
}

/// Parses an upper bound of an error.
pub(super) fn parse_bound(text: &str) -> Parsed<f64> {
    float(text, |bound: f64| bound.is_finite() && bound >= 0.0, "a finite number, not below 0, as in 1e-3")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_must_be_finite() {
        assert_eq!(parse_finite("-1.5"), Ok(-1.5));
        for bad in ["nan", "inf", "1e99", "", "one"] {
            assert!(parse_finite(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-1", "inf", "nan", "x"] {
            assert!(parse_seconds(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_positive("2e-3"), Ok(2e-3));
        assert!(["0", "-1", "inf", "nan", ""].iter().all(|bad| parse_positive(bad).is_err()));
        assert_eq!(parse_bound("0"), Ok(0.0));
        assert!(parse_bound("-1").is_err() && parse_bound("nan").is_err());
    }

    #[test]
    fn refusals_of_whole_numbers_name_range_and_example() {
        let parse = whole(1..=4096, "16");
        assert_eq!(parse("4096"), Ok(4096));
        for bad in ["", "a", "0", "-1", "4097", "1.5", "99999999999", "1 2"] {
            assert_eq!(
                parse(bad),
                Err("expected a whole number from 1 to 4096, as in 16".to_owned()),
                "{bad}"
            );
        }
        let open = whole(4..=u32::MAX, "64")("3").unwrap_err();
        assert_eq!(open, "expected a whole number from 4 on, as in 64");
        let list = each_whole(1..=9, "1,2,4")("b").unwrap_err();
        assert_eq!(list, "expected whole numbers from 1 to 9, as in 1,2,4 (commas between them)");
    }
}
