//! Names and curves that several benchmarks share.

use crate::rows::quantile;

/// Largest number of points of a curve. More values are divided into this many groups; the points are the medians of
/// the groups.
const GROUPS: usize = 240;
/// Prefix of the names of synthetic models; the number of polygons follows.
pub(super) const SYNTHETIC: &str = "scribble-";

pub(super) fn synthetic_name(polygons: u32) -> String {
    format!("{SYNTHETIC}{polygons}")
}

/// The medians of [`GROUPS`] groups of neighbouring values. Fewer values stay unchanged.
pub(super) fn grouped(values: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if values.len() <= GROUPS {
        return values;
    }
    let group = |chunk: &[(f64, f64)]| {
        let mut sorted: Vec<f64> = chunk.iter().map(|&(_, y)| y).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        (chunk[chunk.len() / 2].0, quantile(&sorted, 0.5))
    };
    values.chunks(values.len().div_ceil(GROUPS)).map(group).collect()
}
