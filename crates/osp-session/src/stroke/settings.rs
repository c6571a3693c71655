use crate::{
    brush::Brush,
    recording::{NormalRule, Tool},
};

/// How a stroke is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeSettings {
    /// The brush; without one, the samples become what `tool` says.
    pub brush: Option<&'static Brush>,
    /// What the samples become without a brush.
    pub tool: Tool,
    /// Full width at full pressure, metres.
    pub width_m: f32,
    /// Part of the width left at pressure 0.
    pub thinnest: f32,
    /// How a ribbon without a brush lies to the tracker.
    pub normal: NormalRule,
    /// What the random numbers of a brush start from.
    pub seed: u32,
    /// Factor of the lengths that are part of a brush (spacing, fading), not of the width.
    pub scale: f32,
}

impl StrokeSettings {
    /// Half of the width at this pressure, metres.
    pub(super) fn half_width_m(&self, pressure: f32) -> f32 {
        let pressure = pressure.clamp(0.0, 1.0);
        0.5 * self.width_m * (self.thinnest + (1.0 - self.thinnest) * pressure)
    }
}
