//! Names of the other authors in a shared session, beside the rings around their pens.

use egui::{Color32, FontId, Pos2, Rect, Ui, Vec2};

use super::authors;
use crate::{
    paint_layers::name_or_number,
    studio::{OtherInView, Studio},
};

/// Distance from the ring to the name, points.
const GAP: f32 = 6.0;
/// Margin around the letters, points.
const MARGIN: Vec2 = Vec2::new(4.0, 1.0);

pub(super) fn show(ui: &Ui, area: Rect, studio: &Studio) {
    if area.width() < 1.0 || area.height() < 1.0 {
        return;
    }
    let place = |at: glam::Vec2| area.min + area.size() * Vec2::new(at.x, 1.0 - at.y);
    for other in studio.others_in_view(area.width() / area.height()) {
        let view = Rect::from_two_pos(place(other.from), place(other.to));
        let color = authors::color_of(studio, other.author);
        let painter = ui.painter_at(view);
        let text = painter.layout_no_wrap(written(&other), FontId::proportional(13.0), letters_on(color));
        let label =
            label_rect(place(other.at), other.radius * area.height(), text.size() + MARGIN * 2.0, view);
        painter.rect_filled(label, 3.0, color.gamma_multiply(0.85));
        painter.galley(label.min + MARGIN, text, Color32::PLACEHOLDER);
    }
}

/// A name on one line, or the author's number if the name is empty.
fn written(other: &OtherInView) -> String {
    let name: String = authors::shortened(&other.name).chars().filter(|c| !c.is_control()).collect();
    name_or_number(other.author, &name)
}

/// A readable text colour on this background colour.
fn letters_on(color: Color32) -> Color32 {
    let [r, g, b, _] = color.to_array().map(f32::from);
    if 0.3 * r + 0.6 * g + 0.1 * b > 120.0 { Color32::BLACK } else { Color32::WHITE }
}

/// Rectangle of a label: to the right of a ring, or to the left near the border of the view. The label stays inside the
/// view if it fits.
fn label_rect(ring: Pos2, radius: f32, size: Vec2, view: Rect) -> Rect {
    let right = ring.x + radius + GAP;
    let left = ring.x - radius - GAP - size.x;
    let x = if right + size.x > view.max.x && left >= view.min.x { left } else { right };
    let within = |at: f32, length: f32, from: f32, to: f32| at.min(to - length).max(from);
    let x = within(x, size.x, view.min.x, view.max.x);
    let y = within(ring.y - size.y * 0.5, size.y, view.min.y, view.max.y);
    Rect::from_min_size(Pos2::new(x, y), size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_beside_its_ring_and_in_the_view() {
        let view = Rect::from_min_max(Pos2::new(100.0, 50.0), Pos2::new(500.0, 350.0));
        let size = Vec2::new(80.0, 16.0);
        let middle = label_rect(Pos2::new(300.0, 200.0), 5.0, size, view);
        assert_eq!(middle, Rect::from_min_size(Pos2::new(311.0, 192.0), size));
        for ring in [(480.0, 200.0), (500.0, 52.0), (101.0, 349.0), (420.0, 350.0)].map(Pos2::from) {
            let label = label_rect(ring, 5.0, size, view);
            assert!(view.contains_rect(label), "{label}");
            assert!(!label.expand(5.0).contains(ring), "{label} hides {ring}");
        }
        // The view is too narrow for the name, which then begins inside it.
        let narrow = Rect::from_min_max(Pos2::new(100.0, 50.0), Pos2::new(150.0, 350.0));
        assert_eq!(label_rect(Pos2::new(120.0, 100.0), 5.0, size, narrow).min.x, 100.0);
    }

    #[test]
    fn a_name_is_one_line_that_can_be_read() {
        let of = |name: &str| OtherInView {
            author: osp_session::recording::Author(7),
            name: name.to_owned(),
            at: glam::Vec2::ZERO,
            radius: 0.0,
            from: glam::Vec2::ZERO,
            to: glam::Vec2::ONE,
        };
        assert_eq!(written(&of("Ann\nof\u{7} Bath")), "Annof Bath");
        assert_eq!(written(&of("\n ")), "author 7");
        assert_eq!(written(&of(&"é".repeat(100))).chars().count(), 20);
        assert_eq!(letters_on(Color32::from_rgb(250, 240, 30)), Color32::BLACK);
        assert_eq!(letters_on(Color32::from_rgb(30, 20, 160)), Color32::WHITE);
    }
}
