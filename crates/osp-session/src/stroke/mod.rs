//! Builds polygons from tracker samples, one sample at a time: ribbons, walls, tubes, and the forms of
//! [brushes](crate::brush).
//!
//! Every builder processes samples one by one and writes the changes of the stroke's polygons to [`Pieces`]. Most
//! builders only append polygons. A growing hull or a smoothed ribbon also replaces polygons. Degenerate pieces are
//! dropped and counted in [`Drops`].
//!
//! Depends on [`recording`](crate::recording), [`brush`](crate::brush) and [`polygon`](osp::polygon).

mod bolt;
mod convex_hull;
mod drops;
pub(crate) mod frame;
mod hull;
mod knots;
mod particles;
mod pieces;
mod polygon;
mod quad_strip;
mod random;
mod refresh;
mod ribbon;
mod sample;
mod sections;
mod settings;
mod slices;
mod spray;
mod track;
mod triangulate;
mod tube;
mod tube_brush;
mod tube_frame;
mod tube_shape;
mod wall;
mod welded;
mod windowed_hull;

pub use drops::Drops;
pub use hull::HullBuilder;
pub use particles::ParticlesBuilder;
pub use pieces::{Piece, Pieces, QuadPieces};
pub use quad_strip::QuadStripBuilder;
pub use ribbon::RibbonBuilder;
pub use sample::Sample;
pub use settings::StrokeSettings;
pub use slices::SlicesBuilder;
pub use spray::SprayBuilder;
pub use triangulate::split_into_convex;
pub use tube::{TUBE_SIDES, TubeBuilder};
pub use tube_brush::TubeBrushBuilder;
pub use wall::WallBuilder;
pub use welded::WeldedBuilder;
pub use windowed_hull::WindowedHullBuilder;

pub use crate::brush::MAX_SCATTERED;
use crate::{
    brush::{Brush, Family, Surface},
    recording::Tool,
};

/// The builder of an unfinished stroke, for any tool or brush.
#[derive(Clone, Debug)]
pub enum StrokeBuilder {
    Ribbon(RibbonBuilder),
    Wall(WallBuilder),
    Tube(TubeBuilder),
    QuadStrip(QuadStripBuilder),
    /// Builder for [`Family::Welded`], [`Family::ThickRibbon`], [`Family::BoxSection`].
    Welded(WeldedBuilder),
    Slices(SlicesBuilder),
    Hull(HullBuilder),
    Particles(ParticlesBuilder),
    Spray(SprayBuilder),
    TubeBrush(TubeBrushBuilder),
    WindowedHull(WindowedHullBuilder),
}

impl StrokeBuilder {
    pub fn new(settings: StrokeSettings) -> Self {
        if let Some(brush) = settings.brush
            && let Some(builder) = Self::of_brush(settings, brush)
        {
            return builder;
        }
        match settings.tool {
            Tool::Ribbon => Self::Ribbon(RibbonBuilder::new(settings)),
            Tool::Wall => Self::Wall(WallBuilder::default()),
            Tool::Tube => Self::Tube(TubeBuilder::new(settings)),
        }
    }

    fn of_brush(settings: StrokeSettings, brush: &'static Brush) -> Option<Self> {
        match brush.family {
            Family::QuadStrip(uv) => Some(Self::QuadStrip(QuadStripBuilder::new(settings, brush, uv))),
            Family::Welded { uv, shape } => {
                Some(Self::Welded(WeldedBuilder::new(settings, brush, uv, shape)))
            }
            Family::ThickRibbon => Some(Self::Welded(WeldedBuilder::thick(settings, brush))),
            Family::BoxSection => Some(Self::Welded(WeldedBuilder::bar(settings, brush))),
            Family::Hull { faceted } => Some(Self::Hull(HullBuilder::new(&settings, brush, faceted))),
            Family::Particles => Some(Self::Particles(ParticlesBuilder::new(&settings, brush))),
            Family::Spray { midpoint } => Some(Self::Spray(SprayBuilder::new(&settings, brush, midpoint))),
            Family::Slices => Some(Self::Slices(SlicesBuilder::new(settings, brush))),
            Family::Tube { .. } => TubeBrushBuilder::new(&settings, brush).map(Self::TubeBrush),
            Family::WindowedHull => Some(Self::WindowedHull(WindowedHullBuilder::new(&settings, brush))),
        }
    }

    /// Processes a sample and writes the changes to `out`. The caller has called [`Pieces::begin`] for the stroke.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        match self {
            Self::Ribbon(b) => out.push_all(drops, |out, drops| b.push(sample, out, drops)),
            Self::Wall(b) => b.push(sample, drops),
            Self::Tube(b) => out.push_all(drops, |out, drops| b.push(sample, out, drops)),
            Self::QuadStrip(b) => b.push(sample, out, drops),
            Self::Welded(b) => b.push(sample, out, drops),
            Self::Slices(b) => b.push(sample, out, drops),
            Self::Hull(b) => b.push(sample, out, drops),
            Self::Particles(b) => b.push(sample, out, drops),
            Self::Spray(b) => b.push(sample, out, drops),
            Self::TubeBrush(b) => b.push(sample, out, drops),
            Self::WindowedHull(b) => b.push(sample, out, drops),
        }
    }

    /// Ends the stroke and writes the changes to `out`.
    pub fn finish(&mut self, out: &mut Pieces, drops: &mut Drops) {
        match self {
            Self::Wall(b) => out.push_all(drops, |out, drops| b.finish(out, drops)),
            Self::Tube(b) => out.push_all(drops, |out, drops| b.finish(out, drops)),
            Self::QuadStrip(b) => b.finish(out),
            Self::Welded(b) => b.finish(out, drops),
            Self::Hull(b) => b.finish(out, drops),
            Self::TubeBrush(b) => b.finish(out, drops),
            _ => {}
        }
    }

    /// Rebuilds polygons that depend on the length of the whole stroke: usually only polygons at its end, sometimes
    /// all. Writes the changes to `out`. Call it once in each frame that adds samples.
    pub fn settle(&mut self, out: &mut Pieces, drops: &mut Drops) {
        if let Self::TubeBrush(b) = self {
            b.settle(out, drops);
        }
    }

    /// Repaints polygons whose surface, but not shape, depends on the stroke's length. Polygons that have not changed
    /// since the last call are skipped. Appends the polygons' positions in the stroke, ascending, and their surfaces.
    /// Call it once a frame, and after [`StrokeBuilder::finish`].
    pub fn repaint(&mut self, out: &mut Vec<(u32, Surface)>) {
        match self {
            Self::Welded(b) => b.repaint(out),
            Self::QuadStrip(b) => b.repaint(out),
            _ => {}
        }
    }
}
