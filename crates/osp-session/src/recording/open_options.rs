use super::Limits;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// Whether damaged parts are skipped and counted in [`Notes::skipped`](super::Notes::skipped). Otherwise damage
    /// ends the session with an error.
    pub lenient: bool,
    pub limits: Limits,
    /// The axis that points up in a format without a rule for it (`.obj`); `None` if the file decides.
    pub up: Option<Up>,
    /// Length of a unit in such a format, metres; `None` if the file decides.
    pub unit_m: Option<f64>,
}

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    #[default]
    Y,
    Z,
}

impl Up {
    /// A point or direction of the file in the axes of osp.
    pub(super) fn turned(self, p: glam::DVec3) -> glam::DVec3 {
        match self {
            Self::Y => p,
            Self::Z => glam::DVec3::new(p.x, p.z, -p.y),
        }
    }
}

/// The length of a unit with this name or abbreviation, metres.
pub fn unit_m(name: &str) -> Option<f64> {
    Some(match name {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "dm" | "decimeters" | "decimetres" => 0.1,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 0.01,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 0.001,
        "km" | "kilometers" | "kilometres" => 1000.0,
        "in" | "inch" | "inches" => 0.0254,
        "ft" | "foot" | "feet" => 0.3048,
        "yd" | "yards" => 0.9144,
        _ => return None,
    })
}

impl OpenOptions {
    /// Damage is an error. The limits are [`Limits::DEFAULT`].
    pub const STRICT: Self = Self { lenient: false, limits: Limits::DEFAULT, up: None, unit_m: None };
    /// Damage is skipped. The limits are [`Limits::DEFAULT`].
    pub const LENIENT: Self = Self { lenient: true, ..Self::STRICT };
}
