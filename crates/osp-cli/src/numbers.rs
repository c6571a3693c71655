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

pub(super) fn multiple(text: &str) -> Result<f32, String> {
    within(text, &IndexSettings::CUBES, "a multiple")
}

pub(super) fn radius_m(text: &str) -> Result<f32, String> {
    within(text, &(0.0..=1.0e6), "metres")
}

pub(super) fn nanoseconds(text: &str) -> Result<f64, String> {
    within(text, &(0.001..=1.0e9), "nanoseconds")
}

pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let found = text.trim().parse().ok().filter(|&seconds: &f64| seconds > 0.0 && seconds <= MOST_SECONDS);
    found.ok_or_else(|| format!("expected seconds above 0, up to {MOST_SECONDS}; found `{text}`"))
}

pub(super) fn film_s(text: &str) -> Result<f64, String> {
    within(text, &(0.1..=600.0), "seconds")
}

pub(super) fn moment_s(text: &str) -> Result<f32, String> {
    within(text, &(0.0..=1.0e4), "seconds")
}

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
