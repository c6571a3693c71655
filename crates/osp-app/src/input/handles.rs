//! The handles of the selection in the window.

use glam::{Vec2, Vec3};

use crate::{
    handles::{Handle, Ring},
    navigator::on_plane_through,
    studio::Studio,
    tool::ToolChoice,
};
use osp::view::View;

impl Studio {
    /// The ring around the selection, while the user can grab it.
    fn ring(&self, view: &View, height_px: f32) -> Option<Ring> {
        if self.input.tool != ToolChoice::Select || !self.can_draw() {
            return None;
        }
        let bounds = self.input.shown_bounds.filter(|bounds| !bounds.is_empty())?;
        Ring::around(bounds.center(), bounds.extent().length() * 0.5, view, height_px)
    }

    /// The handle under a point of the window, its ring, and the point on the plane of the ring.
    pub(crate) fn handle_under(&self, at: Vec2, size_px: Vec2) -> Option<(Handle, Ring, Vec3)> {
        let (view, on_screen) = self.view_at(at, size_px.x / size_px.y.max(1.0))?;
        let ring = self.ring(&view, size_px.y)?;
        let p = on_plane_through(&view, on_screen, ring.middle);
        Some((ring.handle_at(p)?, ring, p))
    }

    /// Draws the handles, except while the selection is dragged.
    pub(crate) fn draw_handles(&mut self, view: &View, height_px: f32) {
        let is_stale =
            self.input.bounds_of.as_ref() != Some(&self.input.selection) || !self.changes.is_empty();
        if is_stale {
            self.input.shown_bounds = Some(self.selection_bounds());
            self.input.bounds_of = Some(self.input.selection.clone());
        }
        if self.input.gestures.is_dragging() {
            return;
        }
        if let Some(ring) = self.ring(view, height_px) {
            ring.draw(&mut self.shown.lines);
        }
    }
}
