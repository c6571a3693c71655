//! The tolerances and limits of the crate, each with its unit and the effect of changing it.

/// Two points closer than this, in metres, are one point. Larger: more pieces of a stroke count as degenerate.
/// Sketches are drawn in units from 0.4 mm upwards; a tenth of a micrometre is below every tracker's noise.
pub const TOLERANCE_M: f32 = 1.0e-7;

/// Coordinates beyond this, in metres, are refused as bad input: a plane equation in `f32` still evaluates to a
/// finite number for every coordinate below it.
pub const COORDINATE_LIMIT_M: f32 = 1.0e15;
