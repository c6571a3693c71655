//! Pens of the other authors of a shared session, in the window.

use glam::{Vec2, Vec3};

use super::{Studio, on_screen::on_screen};
use crate::session::Live;
use osp_session::recording::Author;

/// Radius of the ring around another author's pen, as a fraction of the camera's distance.
const RING_PART: f32 = 0.01;
/// Largest number of authors whose pens are shown. More pens would hide the model.
const MOST_SHOWN: usize = 100;

/// Another author's pen in the model's part of the window. Positions are 0 to 1 from the left and the lower border.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherInView {
    pub author: Author,
    /// The author's name; may be empty.
    pub name: String,
    /// Position of the pen.
    pub at: Vec2,
    /// Radius of the ring around the pen, as a fraction of the height.
    pub radius: f32,
    /// Lower left corner of the view that shows the pen.
    pub from: Vec2,
    /// Upper right corner of that view.
    pub to: Vec2,
}

impl Studio {
    /// The pens of others in the shared session, and the radius of the rings around them, metres.
    pub(super) fn others(&self) -> (impl Iterator<Item = (Author, Vec3)> + '_, f32) {
        let pens = self.session.live().into_iter().flat_map(Live::pens).take(MOST_SHOWN);
        (pens.map(|pen| (pen.author, pen.at)), self.navigator.distance_m() * RING_PART)
    }

    /// The pens of other authors who are drawing now, on a window of this aspect ratio (width divided by height). Pens
    /// outside the views are skipped.
    pub fn others_in_view(&self, aspect: f32) -> Vec<OtherInView> {
        let (others, radius_m) = self.others();
        let mut others = others.peekable();
        if others.peek().is_none() {
            return Vec::new();
        }
        let mut views = self.views_of(aspect);
        // If two eyes share a part of the window, the name is shown only once.
        views.dedup_by_key(|view| (view.from, view.to));
        let mut found = Vec::new();
        for (author, p) in others {
            let name = self.scene().author(author).map_or("", |info| &info.name);
            for seen in &views {
                let Some((at, distance_m)) = on_screen(&seen.view, p) else { continue };
                let size = seen.to - seen.from;
                let height_m = (seen.view.projection.top - seen.view.projection.bottom) * distance_m;
                found.push(OtherInView {
                    author,
                    name: name.to_owned(),
                    at: seen.from + size * (at * 0.5 + 0.5),
                    radius: radius_m / height_m * size.y,
                    from: seen.from,
                    to: seen.to,
                });
            }
        }
        found
    }
}
