//! Tracker samples become polygons, one sample at a time: ribbons, walls and tubes.
//!
//! Every builder takes samples as they come and appends finished [`ConvexPolygon`]s; what is degenerate is dropped
//! and counted in [`Drops`], never passed on.
//!
//! Knows [`recording`](crate::recording) and [`polygon`](crate::polygon).

mod frame;
mod polygon;
mod ribbon;
mod triangulate;
mod tube;
mod wall;

pub use ribbon::RibbonBuilder;
pub use triangulate::split_into_convex;
pub use tube::{TUBE_SIDES, TubeBuilder};
pub use wall::WallBuilder;

use glam::{Quat, Vec3};

use crate::{
    polygon::ConvexPolygon,
    recording::{NormalRule, Tool},
};

/// One sample of a tracker: a control point of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position, world space, metres.
    pub position: Vec3,
    /// World from tracker, unit quaternion.
    pub orientation: Quat,
    /// 0 to 1.
    pub pressure: f32,
}

/// How a stroke is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brush {
    /// What the samples become.
    pub tool: Tool,
    /// Full width at full pressure, metres.
    pub width_m: f32,
    /// Part of the width left at pressure 0.
    pub thinnest: f32,
    /// How a ribbon lies to the tracker.
    pub normal: NormalRule,
}

impl Brush {
    /// Half of the width at this pressure, metres.
    fn half_width_m(&self, pressure: f32) -> f32 {
        let pressure = pressure.clamp(0.0, 1.0);
        0.5 * self.width_m * (self.thinnest + (1.0 - self.thinnest) * pressure)
    }
}

/// What was dropped while polygons were made, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drops {
    /// Samples at the place of the one before: a segment of length zero.
    pub zero_length: u64,
    /// Polygons without area: needles and points, or a width of zero.
    pub degenerate: u64,
    /// Polygons whose corners are not finite or beyond [`crate::math::COORDINATE_LIMIT_M`].
    pub out_of_range: u64,
    /// Corners of a wall beyond [`crate::recording::Event::MAX_VERTICES`]: each replaces the one before it.
    pub excess_corners: u64,
}

/// A stroke in the making, whatever its tool.
#[derive(Clone, Debug)]
pub enum StrokeBuilder {
    /// [`Tool::Ribbon`].
    Ribbon(RibbonBuilder),
    /// [`Tool::Wall`].
    Wall(WallBuilder),
    /// [`Tool::Tube`].
    Tube(TubeBuilder),
}

impl StrokeBuilder {
    /// A builder for this brush.
    pub fn new(brush: Brush) -> Self {
        match brush.tool {
            Tool::Ribbon => Self::Ribbon(RibbonBuilder::new(brush)),
            Tool::Wall => Self::Wall(WallBuilder::new()),
            Tool::Tube => Self::Tube(TubeBuilder::new(brush)),
        }
    }

    /// Takes a sample and appends the polygons that it completes.
    pub fn push(&mut self, sample: Sample, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        match self {
            Self::Ribbon(b) => b.push(sample, out, drops),
            Self::Wall(b) => b.push(sample, drops),
            Self::Tube(b) => b.push(sample, out, drops),
        }
    }

    /// Ends the stroke and appends what only its end completes.
    pub fn finish(&mut self, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        match self {
            Self::Ribbon(_) => {}
            Self::Wall(b) => b.finish(out, drops),
            Self::Tube(b) => b.finish(out, drops),
        }
    }
}
