//! `osp render --painter`: draws by the painter's algorithm, and compares the pictures with those of the depth buffer.

use std::{path::Path, sync::Arc};

use anyhow::anyhow;

use super::{output::one_line, output::warn, parsers::Size};
use osp::{
    polygon::{Change, VisibleBlocks},
    view::View,
};
use osp_lab::report::thousands;
use osp_render::{
    DrawTimes, Gpu, Image, Layer, Offscreen, PaintList, PaintStats, Painter, RenderError, RendererConfig,
};
use osp_session::{brush::Draw, scene::Scene};

/// One in this number of pixels may be unexplained.
const ONE_UNEXPLAINED_IN: usize = 10_000;

pub(super) fn named_painter(name: &str) -> Option<Painter> {
    Painter::ALL.into_iter().find(|painter| painter.name() == name)
}

/// Draws the same picture twice: by a painter, and with a depth buffer.
pub(super) struct PainterPictures {
    painter: Painter,
    by_painter: Offscreen,
    by_depth: Offscreen,
    is_noted: bool,
}

/// A painter's picture, compared with the picture of the depth buffer.
pub(super) struct Compared {
    painter: Painter,
    polygons: usize,
    stats: PaintStats,
    times: DrawTimes,
    by_depth: DrawTimes,
    pixels: usize,
    differing: usize,
    unexplained: usize,
}

impl PainterPictures {
    pub(super) fn new(
        painter: Painter,
        gpu: &Arc<Gpu>,
        Size { width, height }: Size,
        config: &RendererConfig,
    ) -> Result<Self, RenderError> {
        let drawer = || {
            let mut drawer = Offscreen::on(Arc::clone(gpu), width, height, config)?;
            drawer.renderer.set_solid(true);
            Ok(drawer)
        };
        Ok(Self { painter, by_painter: drawer()?, by_depth: drawer()?, is_noted: false })
    }

    pub(super) fn follow(&mut self, changes: &[Change]) {
        self.by_painter.renderer.follow(changes);
        self.by_depth.renderer.follow(changes);
    }

    pub(super) fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        polygons: &VisibleBlocks,
    ) -> anyhow::Result<Compared> {
        self.note_what_is_drawn_otherwise(scene, polygons);
        let list = PaintList::new(self.painter, scene, polygons, view.eye_in_world)
            .map_err(|error| anyhow!("--painter {}: {error}", self.painter.name()))?;
        let times = self.by_painter.draw_parts(scene, view, &list)?;
        let by_depth = self.by_depth.draw(scene, view, &[Layer::plain(polygons)])?;
        let (image, other) = (self.by_painter.image()?, self.by_depth.image()?);
        Ok(Compared {
            painter: self.painter,
            polygons: polygons.len(),
            stats: list.stats,
            times,
            by_depth,
            pixels: image.rgba().len() / 4,
            differing: image.differing_pixels(&other),
            unexplained: image.unlike_pixels(&other),
        })
    }

    /// Reports once the number of polygons that both pictures show differently from an ordinary picture.
    fn note_what_is_drawn_otherwise(&mut self, scene: &Scene, polygons: &VisibleBlocks) {
        if self.is_noted {
            return;
        }
        let (mut brushes, mut see_through) = (0u64, 0u64);
        for id in polygons.ids() {
            let stroke = scene.stroke_of(id);
            let draw = stroke.brush().map(|brush| brush.draw);
            brushes += u64::from(draw.is_some());
            see_through += u64::from(match draw {
                Some(draw) => matches!(draw, Draw::Additive | Draw::Blended),
                None => stroke.color().3 < 1.0,
            });
        }
        if brushes > 0 || see_through > 0 {
            self.is_noted = true;
            warn(&format!(
                "of {} polygons in view, {} have a brush, and {} are transparent or add light: both pictures \
                 show all of them solid in plain colours",
                thousands(polygons.len() as u64),
                thousands(brushes),
                thousands(see_through)
            ));
        }
    }

    pub(super) fn image(&self) -> Result<Image, RenderError> {
        self.by_painter.image()
    }
}

impl Compared {
    /// Whether at most one in [`ONE_UNEXPLAINED_IN`] pixels is unexplained.
    pub(super) fn is_explained(&self) -> bool {
        self.unexplained * ONE_UNEXPLAINED_IN <= self.pixels
    }

    pub(super) fn line(&self, frame: u64, path: &Path) -> String {
        let Self { stats, .. } = self;
        let count = |n: usize| thousands(n as u64);
        let ms = |ns: u64| ns as f64 * 1.0e-6;
        let tree = match self.painter {
            Painter::Bsp => format!(
                "{} parts, {} of them by distance, a tree of {} nodes and {} levels, ",
                count(stats.parts),
                count(stats.unordered),
                count(stats.nodes),
                count(stats.depth + 1)
            ),
            Painter::Centre => String::new(),
        };
        format!(
            "frame {frame}: painter {}: {} polygons, {tree}order found in {:.2} ms, drawn in {:.2} ms (with a depth \
             buffer {:.2} ms); {} of {} pixels differ from the depth buffer's, {} of them unexplained, {}",
            self.painter.name(),
            count(self.polygons),
            ms(stats.ns),
            ms(self.times.draw.ns),
            ms(self.by_depth.draw.ns),
            count(self.differing),
            count(self.pixels),
            count(self.unexplained),
            one_line(&path.to_string_lossy())
        )
    }
}
