//! Numbers on the command line, each with its range.

use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

use osp_rivals::IndexSettings;

/// Largest number of occluders of a view. Each takes memory, and far fewer are useful.
const MOST_OCCLUDERS: usize = 65_536;
/// Longest permitted time: thirty years.
const MOST_SECONDS: f64 = 1.0e9;

/// Parses a number in a range. The error names the range.
fn within<T: FromStr + PartialOrd + Display>(
    text: &str,
    range: &RangeInclusive<T>,
    what: &str,
) -> Result<T, String> {
    let found = text.trim().parse().ok().filter(|number| range.contains(number));
    found.ok_or_else(|| format!("expected {what} from {} to {}; found `{text}`", range.start(), range.end()))
}

pub(super) fn occluders(text: &str) -> Result<usize, String> {
    within(text, &(0..=MOST_OCCLUDERS), "occluders")
}

/// Parses a multiple of a size.
pub(super) fn multiple(text: &str) -> Result<f32, String> {
    within(text, &IndexSettings::CUBES, "a multiple")
}

/// Parses a radius in metres.
pub(super) fn radius_m(text: &str) -> Result<f32, String> {
    within(text, &(0.0..=1.0e6), "metres")
}

/// Parses a cost in nanoseconds.
pub(super) fn nanoseconds(text: &str) -> Result<f64, String> {
    within(text, &(0.001..=1.0e9), "nanoseconds")
}

/// Parses a time limit in seconds.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let found = text.trim().parse().ok().filter(|&seconds: &f64| seconds > 0.0 && seconds <= MOST_SECONDS);
    found.ok_or_else(|| format!("expected seconds above 0, up to {MOST_SECONDS}; found `{text}`"))
}

/// Parses the length of a film in seconds.
pub(super) fn film_s(text: &str) -> Result<f64, String> {
    within(text, &(0.1..=600.0), "seconds")
}

/// Parses a moment in seconds.
pub(super) fn moment_s(text: &str) -> Result<f32, String> {
    within(text, &(0.0..=1.0e4), "seconds")
}

/// Parses a factor of speed.
pub(super) fn factor(text: &str) -> Result<f64, String> {
    within(text, &(0.001..=1000.0), "a factor")
}

/// Parses width and height in pixels.
pub(super) fn sides(text: &str, range: &RangeInclusive<u32>) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| range.contains(side));
    let found = text.split_once(['x', 'X']).and_then(|(w, h)| Some((side(w)?, side(h)?)));
    found.ok_or_else(|| {
        format!("expected WIDTHxHEIGHT, each from {} to {}; found `{text}`", range.start(), range.end())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_of_the_range_is_refused() {
        for text in ["NaN", "inf", "-inf", "0.09", "600.1", "1e999", "", "x", "1,0"] {
            assert!(film_s(text).is_err(), "{text}");
        }
        assert_eq!(film_s("0.25"), Ok(0.25));
        for text in ["NaN", "inf", "0", "-1", "1e10", ""] {
            assert!(seconds(text).is_err() && nanoseconds(text).is_err(), "{text}");
        }
        for text in ["-1", "65537", "18446744073709551616", "1.5", "NaN"] {
            assert!(occluders(text).is_err(), "{text}");
        }
        assert_eq!(occluders("65536"), Ok(65_536));
        for text in ["0x5", "5x0", "5", "x", "5x16385", "4294967296x1", "NaNxNaN", "5x5x5"] {
            assert!(sides(text, &(1..=16_384)).is_err(), "{text}");
        }
        for text in ["0", "-1", "NaN", "101", ""] {
            assert!(multiple(text).is_err(), "{text}");
        }
        for text in ["-1", "NaN", "10001", "x"] {
            assert!(moment_s(text).is_err(), "{text}");
        }
        assert_eq!(sides("640X480", &(1..=16_384)), Ok((640, 480)));
        assert_eq!(multiple("200"), Err("expected a multiple from 0.01 to 100; found `200`".to_owned()));
    }
}
