//! Names and lines that several harnesses have.

use crate::rows::quantile;

/// Points of a line at most: values are gathered into this many groups, of which the median is drawn.
const GROUPS: usize = 240;
/// The names of the synthetic models, of which each has a size, begin with this.
pub(super) const SYNTHETIC: &str = "scribble-";

/// The name of the synthetic model with so many polygons.
pub(super) fn synthetic_name(polygons: u32) -> String {
    format!("{SYNTHETIC}{polygons}")
}

/// The medians of groups of neighbouring values.
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
