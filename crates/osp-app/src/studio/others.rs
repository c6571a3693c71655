//! Pens of the other authors of a shared session, in the window.

use glam::{Vec2, Vec3};

use super::Studio;
use crate::session::Live;
use osp::view::View;
use osp_session::recording::Author;

/// Radius of the ring around another author's pen, as a fraction of the camera's distance.
const RING_PART: f32 = 0.01;
/// Largest number of authors whose pens are shown, because more would hide the model.
const MOST_SHOWN: usize = 100;

/// Another author's pen in the model's part of the window. Positions are 0 to 1 from the left and the lower border.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherInView {
    /// The author.
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

/// Position of a point on a view's screen, -1 to 1, and its depth, metres; `None` if the view does not show the point.
fn on_screen(view: &View, p: Vec3) -> Option<(Vec2, f32)> {
    let distance_m = (p - view.eye_in_world).dot(view.forward_in_world());
    if distance_m.partial_cmp(&view.projection.near_m) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let clip = view.clip_from_world() * p.extend(1.0);
    let at = Vec2::new(clip.x, clip.y) / clip.w;
    (at.abs().max_element() <= 1.0).then_some((at, distance_m))
}

impl Studio {
    /// The pens of others in the shared session, and the radius of the rings around them, metres.
    pub(super) fn others(&self) -> (impl Iterator<Item = (Author, Vec3)> + '_, f32) {
        let pens = self.session.live().into_iter().flat_map(Live::pens).take(MOST_SHOWN);
        (pens.map(|pen| (pen.author, pen.at)), self.navigator.distance_m() * RING_PART)
    }

    /// The pens of other authors who are drawing now, on a window of this aspect ratio (width divided by height). Pens
    /// outside the views are left out.
    pub fn others_in_view(&self, aspect: f32) -> Vec<OtherInView> {
        let (others, radius_m) = self.others();
        let mut others = others.peekable();
        if others.peek().is_none() {
            return Vec::new();
        }
        let hands = self.hands_before_screens();
        let mut views = self.room.views(&self.navigator, &hands, aspect, &self.session.bounds());
        // If two eyes share a part of the window, only one of them shows the name.
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

#[cfg(test)]
mod tests {
    use super::*;
    use osp::view::Projection;

    #[test]
    fn a_point_is_on_the_screen_where_the_ray_through_it_goes_and_nowhere_behind_the_eye() {
        let projection = Projection::symmetric(60.0, 1.5, 0.01, 100.0);
        let view = View::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-0.5, 0.4, 0.2), projection);
        for at in [Vec2::ZERO, Vec2::new(0.9, -0.3), Vec2::new(-0.5, 0.99)] {
            let ray = view.ray_through(at);
            let (seen, distance_m) = on_screen(&view, ray.origin + ray.direction * 2.5).expect("in view");
            assert!(seen.abs_diff_eq(at, 1.0e-4) && (distance_m - 2.5).abs() < 1.0e-4, "{seen} {at}");
            assert_eq!(on_screen(&view, ray.origin - ray.direction * 2.5), None);
        }
        let aside = view.ray_through(Vec2::new(1.1, 0.0));
        assert_eq!(on_screen(&view, aside.origin + aside.direction * 2.0), None);
        assert_eq!(on_screen(&view, view.eye_in_world), None);
        assert_eq!(on_screen(&view, Vec3::NAN), None);
    }
}
