//! The tolerances and limits of the crate, each with its unit and the effect of changing it.

/// Points closer than this, metres, count as one point. If it is larger, more pieces of a stroke count as degenerate.
/// Sketches are drawn in units from 0.4 mm upwards, and a tenth of a micrometre is below every tracker's noise.
pub const TOLERANCE_M: f32 = 1.0e-7;

/// Coordinates beyond this, metres, are refused as bad input. A plane equation in `f32` is finite for every coordinate
/// below it.
pub const COORDINATE_LIMIT_M: f32 = 1.0e15;
