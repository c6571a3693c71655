//! Outputs of a rig's screens: monitors, and parts of monitors.

use serde::{Deserialize, Serialize};

use super::{Eye, Stereo};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Eyes {
    /// Both eyes, arranged by [`Stereo`].
    #[default]
    Both,
    Left,
    Right,
}

/// A part of a monitor: left, top, width and height, as fractions of the monitor's width and height.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viewport(pub f32, pub f32, pub f32, pub f32);

impl Default for Viewport {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl Viewport {
    pub const WHOLE: Self = Self(0.0, 0.0, 1.0, 1.0);

    fn is_on_monitor(self) -> bool {
        /// Tolerance, because the sum of a third and two thirds may slightly exceed one.
        const ROUNDING: f32 = 1.0e-4;
        let Self(x, y, width, height) = self;
        let inside = |from: f32, size: f32| from >= 0.0 && size > 0.0 && from + size <= 1.0 + ROUNDING;
        inside(x, width) && inside(y, height)
    }

    /// The part from `from` to `to` of this viewport (fractions 0 to 1, y up).
    pub fn part(self, from: [f32; 2], to: [f32; 2]) -> Self {
        let Self(x, y, width, height) = self;
        Self(
            x + from[0] * width,
            y + (1.0 - to[1]) * height,
            (to[0] - from[0]) * width,
            (to[1] - from[1]) * height,
        )
    }

    fn overlaps(self, other: Self) -> bool {
        let apart = |a: f32, a_size: f32, b: f32| b >= a + a_size - 1.0e-4;
        let Self(x, y, width, height) = self;
        let Self(other_x, other_y, other_width, other_height) = other;
        !(apart(x, width, other_x)
            || apart(other_x, other_width, x)
            || apart(y, height, other_y)
            || apart(other_y, other_height, y))
    }
}

/// A part of a monitor that shows a screen's picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// The monitor: its name in the system, or its number from 1. Monitors are numbered from left to right, then from
    /// top to bottom.
    pub monitor: String,
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub viewport: Viewport,
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub eyes: Eyes,
}

impl Output {
    pub fn shows(&self, eye: Eye) -> bool {
        match self.eyes {
            Eyes::Both => true,
            Eyes::Left => eye == Eye::Left,
            Eyes::Right => eye == Eye::Right,
        }
    }

    /// The part of the monitor that shows an eye's picture.
    pub fn place_of(&self, stereo: Stereo, eye: Eye) -> Viewport {
        match self.eyes {
            Eyes::Both => {
                let (from, to) = stereo.part_of(eye);
                self.viewport.part(from, to)
            }
            // The picture of a single eye fills the viewport.
            Eyes::Left | Eyes::Right => self.viewport,
        }
    }

    /// Checks the outputs of a rig's screens (screen name, output); the error is the expected form.
    pub(super) fn check(outputs: &[(&str, &Self)], stereo: Stereo) -> Result<(), String> {
        for (i, (screen, output)) in outputs.iter().enumerate() {
            let expected = if output.monitor.trim().is_empty() {
                "the name or number of a monitor"
            } else if !output.viewport.is_on_monitor() {
                "a viewport (left, top, width, height) within the monitor, each a part of 1"
            } else if output.eyes == Eyes::Both && stereo == Stereo::Windows {
                "`eyes: Left` or `eyes: Right`, as `stereo: Windows` has an output for each eye,"
            } else if output.eyes != Eyes::Both && stereo == Stereo::Mono {
                "no `eyes`, as `stereo: Mono` has one picture,"
            } else {
                let same = |(_, other): &&(&str, &Self)| {
                    other.monitor == output.monitor && other.viewport.overlaps(output.viewport)
                };
                match outputs[..i].iter().find(same) {
                    // The two pictures of an anaglyph overlap.
                    Some((other, _)) => {
                        return Err(format!(
                            "outputs that do not overlap: `{screen}` and `{other}` share a part of monitor `{}`",
                            output.monitor
                        ));
                    }
                    None => continue,
                }
            };
            return Err(format!("{expected} in the outputs of screen `{screen}`"));
        }
        Ok(())
    }
}
