//! Overlays of a frame over the model: culled polygons, and lines.

use glam::Vec2;

use super::Studio;
use crate::{layers, spans::draw_span, tool::ToolChoice};
use osp::{polygon::VisibleBlocks, view::View};
use osp_render::{Depth, LineBatch, LineColor};
use osp_session::recording::Motion;

/// Colour of the outlines of selected strokes: their own colour can be seen between and through the lines.
const SELECTED: LineColor = [255, 220, 90, 90];

impl Studio {
    /// While the culling camera is frozen, finds the culled polygons. They are drawn tinted.
    pub(super) fn find_culled(&mut self) {
        self.shown.culled.clear();
        self.shown.hidden.clear();
        if self.layers.culled && self.frozen.is_some() {
            self.culling.left_out(self.session.scene(), &mut self.shown.culled, &mut self.shown.hidden);
        }
    }

    /// Draws the lines on top of the model: floor, views, nodes, shadows, outlines, pen and hand.
    pub(super) fn draw_lines(&mut self, size_px: Vec2) {
        self.shown.lines.clear();
        // A picture shows the model alone.
        if self.work.picture.is_some() {
            return;
        }
        let Some(first) = self.shown.views.first() else { return };
        let view = first.view;
        let culled_from = self.frozen.as_ref().and_then(|frozen| frozen.first()).unwrap_or(&view);
        let scene = self.session.scene();
        if self.layers.grid {
            layers::draw_grid(
                view.eye_in_world,
                self.navigator.target(),
                self.navigator.distance_m(),
                &mut self.shown.lines,
            );
        }
        if let Some(frozen) = &self.frozen {
            for view in frozen {
                layers::draw_view(view, self.navigator.distance_m().max(0.2) * 0.8, &mut self.shown.lines);
            }
        }
        if self.layers.nodes {
            layers::draw_nodes(
                self.culling.index(),
                &culled_from.frustum(),
                self.layers.node_depth,
                &mut self.shown.lines,
            );
        }
        if self.layers.shadows {
            let length_m = self.session.bounds().extent().length().max(0.1) * 2.0;
            let shadows = self.culling.shadows();
            layers::draw_shadows(culled_from.eye_in_world, shadows, length_m, &mut self.shown.lines);
        }
        self.shown.cut = None;
        if self.layers.cut {
            let frustum = culled_from.frustum();
            let in_view = self.culling.in_view(0).into_iter().flat_map(VisibleBlocks::ids);
            let (inside, cut) = layers::inside_and_cut(scene, &frustum, in_view);
            self.shown.cut = Some((inside, cut.len() as u64));
            layers::draw_outlines(
                scene,
                cut.into_iter(),
                &Motion::STAY,
                [255, 60, 60, 230],
                &mut self.shown.lines,
            );
        }
        let motion = self.input.gestures.motion();
        for stroke in self.input.selection.strokes() {
            if let Some(stroke) = scene.stroke(*stroke).filter(|stroke| stroke.is_visible()) {
                layers::draw_outlines(scene, stroke.polygon_ids(), &motion, SELECTED, &mut self.shown.lines);
            }
        }
        self.draw_aids();
        self.draw_handles(&view, size_px.y);
        if let Some((span, from, to)) = self.shown_span() {
            draw_span(span, from, to, &mut self.shown.lines);
        }
        #[cfg(feature = "live")]
        self.draw_others(&view);
        self.draw_pen(&view, size_px);
        if let Some(hand) = self.input.watch.hand() {
            let p = self.room.to_world(&self.navigator, hand.in_room.0);
            let color = if hand.pressure > 0.0 { [255, 160, 60, 255] } else { [160, 220, 255, 255] };
            layers::draw_cursor(&view, p, self.input.brush.width_m * 0.5, color, &mut self.shown.lines);
        }
    }

    #[cfg(feature = "live")]
    fn draw_others(&mut self, view: &View) {
        let mut lines = std::mem::take(&mut self.shown.lines);
        let (others, radius_m) = self.others();
        for (author, at) in others {
            let (r, g, b) = self.session.scene().author_color(author);
            let [r, g, b] = [r, g, b].map(|part| (part.clamp(0.0, 1.0) * 255.0) as u8);
            layers::draw_cursor(view, at, radius_m, [r, g, b, 255], &mut lines);
        }
        self.shown.lines = lines;
    }

    pub(super) fn draw_patterns(&mut self) {
        if !self.room.shows_pattern() {
            return;
        }
        self.shown.patterns.resize_with(self.shown.views.len(), LineBatch::default);
        for (view, lines) in self.shown.views.iter().zip(&mut self.shown.patterns) {
            lines.clear();
            self.room.draw_pattern(&self.navigator, view, lines);
        }
    }

    fn draw_pen(&mut self, view: &View, size_px: Vec2) {
        let aspect = size_px.x / size_px.y.max(1.0);
        let Some(at) = self.input.gestures.pointer.filter(|_| self.can_draw()) else { return };
        let Some((_, aim)) = self.aim(at, size_px.y, aspect) else { return };
        let [r, g, b, _] = self.input.brush.color.map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8);
        match self.input.tool {
            ToolChoice::Draw(_) => {
                if let Some(anchor) = self.input.pen.anchor() {
                    layers::draw_plane(
                        view,
                        anchor,
                        self.navigator.distance_m() * 0.5,
                        &mut self.shown.lines,
                    );
                }
                for pair in self.input.pen.outline().windows(2) {
                    self.shown.lines.line(pair[0], pair[1], [r, g, b, 255], Depth::Through);
                }
                let width_m = self.brush_at(view, aim, size_px.y).width_m;
                layers::draw_cursor(view, aim, width_m * 0.5, [r, g, b, 255], &mut self.shown.lines);
            }
            ToolChoice::Erase => {
                let radius_m = self.navigator.distance_m() * 0.012;
                layers::draw_cursor(view, aim, radius_m, [255, 90, 90, 255], &mut self.shown.lines);
            }
            ToolChoice::Look | ToolChoice::Select | ToolChoice::Span(_) => {}
        }
    }
}
