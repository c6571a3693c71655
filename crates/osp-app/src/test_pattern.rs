//! The test pattern of a rig's screen: lines that are fixed to the screen, independent of the head's motion.
//!
//! The border and the diagonals show whether the whole screen is lit and rectangular. The grid shows the size in
//! metres, the circle whether the picture is stretched. The digit is the number of the screen, and the letter names the
//! eye. Each eye has its own letter, position and colour.

use glam::{Vec2, Vec3};

use osp_render::{Depth, LineBatch};
use osp_session::rig::{Eye, Screen};

/// Grid spacings, metres. The pattern has the smallest spacing that gives at most [`MOST_LINES`] lines.
const STEPS_M: [f32; 7] = [0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0];
const MOST_LINES: f32 = 32.0;
const CIRCLE_SIDES: u16 = 64;

/// Draws the pattern of a screen of the room; `to_world` transforms a point from room space to world space.
pub(super) fn draw(
    screen: &Screen,
    number: usize,
    eye: Eye,
    to_world: &dyn Fn(Vec3) -> Vec3,
    out: &mut LineBatch,
) {
    let (along, upwards) = screen.sides();
    let size_m = Vec2::new(along.length(), upwards.length());
    // In metres from the lower left corner.
    let place = |p: Vec2| to_world(screen.lower_left + along * (p.x / size_m.x) + upwards * (p.y / size_m.y));
    let mut line = |a: Vec2, b: Vec2, color: [u8; 4]| out.line(place(a), place(b), color, Depth::Through);
    let bright = match eye {
        Eye::Left => [80, 255, 120, 255],
        Eye::Middle => [255, 255, 255, 255],
        Eye::Right => [255, 110, 230, 255],
    };
    let dim = [bright[0] / 3, bright[1] / 3, bright[2] / 3, 255];

    let largest_m = size_m.max_element();
    let step_m = STEPS_M.into_iter().find(|step_m| largest_m / step_m <= MOST_LINES);
    let step_m = step_m.unwrap_or(largest_m / MOST_LINES);
    for axis in [Vec2::X, Vec2::Y] {
        let across = Vec2::ONE - axis;
        let length_m = size_m.dot(axis);
        let mut at_m = step_m;
        while at_m < length_m {
            line(axis * at_m, axis * at_m + across * size_m, dim);
            at_m += step_m;
        }
    }
    // The lines are slightly inside the border, which would clip half of each line.
    let inset = Vec2::splat(size_m.min_element() * 0.004);
    let (from, to) = (inset, size_m - inset);
    let corners = [from, Vec2::new(to.x, from.y), to, Vec2::new(from.x, to.y)];
    for i in 0..4 {
        line(corners[i], corners[(i + 1) % 4], bright);
    }
    line(corners[0], corners[2], bright);
    line(corners[1], corners[3], bright);
    let (middle, radius_m) = (size_m * 0.5, size_m.min_element() * 0.45);
    let on_circle = |i: u16| {
        let angle = f32::from(i) * std::f32::consts::TAU / f32::from(CIRCLE_SIDES);
        middle + Vec2::from_angle(angle) * radius_m
    };
    for i in 0..CIRCLE_SIDES {
        line(on_circle(i), on_circle(i + 1), bright);
    }
    let height_m = size_m.min_element() * 0.2;
    let glyph = Vec2::new(height_m * 0.5, height_m);
    let above = Vec2::new(0.0, radius_m * 0.5);
    for (i, digit) in (number + 1).to_string().bytes().enumerate() {
        let at = middle + above + Vec2::new(i as f32 * glyph.x * 1.4, 0.0) - glyph * 0.5;
        strokes(segments(digit), at, glyph, bright, &mut line);
    }
    let side = Vec2::new(size_m.x * 0.25, 0.0);
    match eye {
        Eye::Left => strokes(&L, middle - side - glyph * 0.5, glyph, bright, &mut line),
        Eye::Middle => {}
        Eye::Right => strokes(&R, middle + side - glyph * 0.5, glyph, bright, &mut line),
    }
}

type Stroke = [(u8, u8); 2];

fn strokes(
    strokes: &[Stroke],
    at: Vec2,
    size_m: Vec2,
    color: [u8; 4],
    line: &mut dyn FnMut(Vec2, Vec2, [u8; 4]),
) {
    // Coordinates are halves of a glyph's width and height.
    let place = |(x, y): (u8, u8)| at + size_m * Vec2::new(f32::from(x), f32::from(y)) * 0.5;
    for [a, b] in strokes {
        line(place(*a), place(*b), color);
    }
}

const TOP: Stroke = [(0, 2), (2, 2)];
const MIDDLE: Stroke = [(0, 1), (2, 1)];
const BOTTOM: Stroke = [(0, 0), (2, 0)];
const UPPER_LEFT: Stroke = [(0, 1), (0, 2)];
const UPPER_RIGHT: Stroke = [(2, 1), (2, 2)];
const LOWER_LEFT: Stroke = [(0, 0), (0, 1)];
const LOWER_RIGHT: Stroke = [(2, 0), (2, 1)];
const L: [Stroke; 3] = [UPPER_LEFT, LOWER_LEFT, BOTTOM];
const R: [Stroke; 6] = [UPPER_LEFT, LOWER_LEFT, TOP, UPPER_RIGHT, MIDDLE, [(0, 1), (2, 0)]];

/// The strokes of a digit on a display of seven segments.
fn segments(digit: u8) -> &'static [Stroke] {
    match digit {
        b'0' => &[TOP, UPPER_LEFT, UPPER_RIGHT, LOWER_LEFT, LOWER_RIGHT, BOTTOM],
        b'1' => &[UPPER_RIGHT, LOWER_RIGHT],
        b'2' => &[TOP, UPPER_RIGHT, MIDDLE, LOWER_LEFT, BOTTOM],
        b'3' => &[TOP, UPPER_RIGHT, MIDDLE, LOWER_RIGHT, BOTTOM],
        b'4' => &[UPPER_LEFT, UPPER_RIGHT, MIDDLE, LOWER_RIGHT],
        b'5' => &[TOP, UPPER_LEFT, MIDDLE, LOWER_RIGHT, BOTTOM],
        b'6' => &[TOP, UPPER_LEFT, MIDDLE, LOWER_LEFT, LOWER_RIGHT, BOTTOM],
        b'7' => &[TOP, UPPER_RIGHT, LOWER_RIGHT],
        b'8' => &[TOP, UPPER_LEFT, UPPER_RIGHT, MIDDLE, LOWER_LEFT, LOWER_RIGHT, BOTTOM],
        _ => &[TOP, UPPER_LEFT, UPPER_RIGHT, MIDDLE, LOWER_RIGHT, BOTTOM],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::rig::Rig;

    /// The lines lie on the screen; each eye and each screen has different lines.
    #[test]
    fn the_pattern_is_on_its_screen_and_differs_by_eye_and_screen() {
        for name in ["desktop", "dual-wall", "cave4"] {
            let rig = Rig::open(name).expect("a shipped rig");
            let mut seen = Vec::new();
            for (number, screen) in rig.screens.iter().enumerate() {
                for eye in [Eye::Left, Eye::Middle, Eye::Right] {
                    let points = std::cell::RefCell::new(Vec::new());
                    let note = |p: Vec3| {
                        points.borrow_mut().push(p);
                        p
                    };
                    let mut lines = LineBatch::new();
                    draw(screen, number, eye, &note, &mut lines);
                    let points = points.into_inner();
                    assert!(points.len() > 150, "{name}: {} ends", points.len());
                    let (along, upwards) = screen.sides();
                    for p in &points {
                        let p = *p - screen.lower_left;
                        let (x, y) = (
                            p.dot(along) / along.length_squared(),
                            p.dot(upwards) / upwards.length_squared(),
                        );
                        assert!(
                            (-1.0e-4..=1.0001).contains(&x) && (-1.0e-4..=1.0001).contains(&y),
                            "{x} {y}"
                        );
                        assert!(p.dot(screen.towards_eye()).abs() < 1.0e-4, "off the screen");
                    }
                    seen.push(points);
                }
            }
            for i in 0..seen.len() {
                assert!(seen[..i].iter().all(|other| *other != seen[i]), "{name}: two patterns are alike");
            }
        }
    }
}
