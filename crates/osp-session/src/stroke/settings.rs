use crate::{
    brush::Brush,
    recording::{NormalRule, Tool},
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeSettings {
    /// The brush. If `None`, `tool` determines the polygons.
    pub brush: Option<&'static Brush>,
    pub tool: Tool,
    /// Full width at full pressure, metres.
    pub width_m: f32,
    /// Width at pressure 0 divided by the full width.
    pub thinnest: f32,
    /// Orientation of a ribbon without a brush, relative to the tracker.
    pub normal: NormalRule,
    /// Seed of a brush's random numbers.
    pub seed: u32,
    /// Factor of the brush's own lengths (spacing, fading), not of the width.
    pub scale: f32,
}

impl StrokeSettings {
    /// Half of the width at this pressure, metres.
    pub(super) fn half_width_m(&self, pressure: f32) -> f32 {
        let pressure = pressure.clamp(0.0, 1.0);
        0.5 * self.width_m * (self.thinnest + (1.0 - self.thinnest) * pressure)
    }
}
