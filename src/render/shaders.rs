/// Every shader of the crate by its name, in WGSL.
pub const SHADERS: &[(&str, &str)] = &[("line", LINE), ("polygon", POLYGON), ("show", SHOW)];

pub(super) const LINE: &str = include_str!("shaders/line.wgsl");
pub(super) const POLYGON: &str = include_str!("shaders/polygon.wgsl");
pub(super) const SHOW: &str = include_str!("shaders/show.wgsl");
