//! The shapes of textures: alpha, or colour and alpha, at a position from 0 to 1 along (`u`) and across (`v`) the
//! stroke.

use std::f32::consts::TAU;

use super::{
    SIDE,
    noise::{mix, noise, octaves, on_line, random, step},
};

/// Alpha of a shape that is cut out at alpha `cutoff`. `inside` is the signed distance to the outline, positive inside
/// the shape.
fn solid(inside: f32, cutoff: f32) -> f32 {
    (cutoff + inside * 12.0).clamp(0.0, 1.0)
}

/// Distance from the centre line: 0 in the middle, 1 at both sides.
fn aside(v: f32) -> f32 {
    (v - 0.5).abs() * 2.0
}

/// A stroke with a blunt start and a pointed end.
pub(super) fn taper(u: f32, v: f32) -> f32 {
    let width = [[0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0], [0.55, 1.0, 1.0, 0.9, 0.75, 0.5, 0.25, 0.0]];
    solid(on_line(&width, u) - aside(v), 0.067)
}

/// A stroke that is densest in the middle.
pub(super) fn tent(_: f32, v: f32) -> f32 {
    1.0 - 1.9 * (v - 0.5).abs()
}

/// A stroke with the outline of a leaf.
pub(super) fn leaf(u: f32, v: f32) -> f32 {
    let width = [[0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0], [0.4, 0.7, 0.95, 1.0, 0.9, 0.6, 0.25, 0.0]];
    solid(on_line(&width, u) - aside(v), 0.52)
}

/// A plump drop of light. The constants are the widths at which its alpha is 1, one half and nearly 0, and the
/// brightness of its centre line. Widths are fractions of the full width.
pub(super) fn soft_tip(u: f32, v: f32) -> f32 {
    const MIDDLE: [[f32; 10]; 2] = [
        [0.0, 0.02, 0.05, 0.1, 0.15, 0.7, 0.85, 0.93, 0.98, 1.0],
        [0.0, 0.07, 0.22, 0.69, 1.0, 1.0, 0.81, 0.26, 0.05, 0.0],
    ];
    const SOLID: [[f32; 6]; 2] = [[0.1, 0.15, 0.3, 0.5, 0.7, 0.85], [0.0, 0.29, 0.44, 0.35, 0.22, 0.0]];
    const HALF: [[f32; 7]; 2] =
        [[0.05, 0.1, 0.15, 0.3, 0.5, 0.7, 0.93], [0.3, 0.45, 0.6, 0.65, 0.55, 0.43, 0.2]];
    const RIM: [[f32; 9]; 2] = [
        [0.02, 0.05, 0.1, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95],
        [0.4, 0.66, 0.84, 0.91, 0.95, 0.84, 0.73, 0.57, 0.4],
    ];
    let [solid, half, rim] = [on_line(&SOLID, u), on_line(&HALF, u), on_line(&RIM, u)];
    let off = aside(v);
    // The falloff is two halves of a smooth step, of unequal width.
    let fall = if off < half {
        1.0 - 0.5 * (((off - solid) / (half - solid)).clamp(0.0, 1.0)).powi(2)
    } else {
        0.5 * (1.0 - ((off - half) / (rim - half)).clamp(0.0, 1.0)).powf(1.6)
    };
    on_line(&MIDDLE, u) * fall
}

/// The row of an atlas of four rows, and the position `v` in the row.
fn row(v: f32) -> (i32, f32) {
    let v = v.clamp(0.0, 0.9999) * 4.0;
    (v as i32, v.fract())
}

/// Signed distance to the outline of a band in one atlas row, positive inside. `width` is the band's width at `u`.
fn band(u: f32, v: f32, width: f32, wave: f32, seed: u32) -> f32 {
    let (number, v) = row(v);
    let rim = noise(u, number as f32 / 8.0, (12, 8), seed) - 0.5;
    width + rim * wave - aside(v)
}

/// Signed distance along `u` to the ends of the hair at `v`, positive inside. Each hair starts between 0 and `start`,
/// and ends between `from` and `to`.
fn hair(u: f32, v: f32, hairs: i32, (start, from, to): (f32, f32, f32), seed: u32) -> f32 {
    let line = (v * (hairs * 4) as f32) as i32;
    let ends = mix(from, to, random(line, 1, seed));
    let begins = start * random(line, 2, seed);
    (ends - u).min(u - begins) * 4.0
}

const STROKE: [[f32; 6]; 2] = [[0.0, 0.04, 0.12, 0.7, 0.9, 1.0], [0.0, 0.7, 0.87, 0.87, 0.6, 0.0]];

/// Signed distance to the outline of a hair of an atlas row, positive inside. Hairs end between `from` and `to` along
/// the stroke, and neighbours end near each other.
fn tuft(u: f32, v: f32, hairs: i32, (from, to): (f32, f32), seed: u32) -> f32 {
    let place = v * (hairs * 4) as f32;
    let near = noise(0.0, v, (1, 16), seed);
    let own = random(place as i32, 1, seed);
    let point = 0.1 * aside(place.fract());
    (mix(from, to, 0.5 * near + 0.5 * own) - point - u) * 4.0
}

/// Four strokes, round at the start. The last stroke is solid nearly to its end; the others end in tufts of hairs.
pub(super) fn ink(u: f32, v: f32) -> f32 {
    const WIDTHS: [[f32; 6]; 2] = [[0.0, 0.04, 0.12, 0.3, 0.6, 1.0], [0.1, 0.55, 0.82, 0.87, 0.82, 0.7]];
    let ends = if row(v).0 == 3 { (0.8, 1.08) } else { (0.48, 1.12) };
    solid(band(u, v, on_line(&WIDTHS, u), 0.06, 1).min(tuft(u, v, 12, ends, 1)), 0.5)
}

/// Four strokes with ragged rims. The last stroke has pointed ends, the others begin square. The first has long
/// scratches.
pub(super) fn oil_paint(u: f32, v: f32) -> f32 {
    const POINTED: [[f32; 5]; 2] = [[0.0, 0.12, 0.3, 0.7, 1.0], [0.0, 0.6, 0.8, 0.8, 0.2]];
    const SQUARE: [[f32; 4]; 2] = [[0.0, 0.05, 0.6, 1.0], [0.6, 0.76, 0.8, 0.7]];
    let number = row(v).0;
    let width = if number == 3 { on_line(&POINTED, u) } else { on_line(&SQUARE, u) };
    let rim = 0.1 * (noise(u, v, (48, 24), 71) - 0.5);
    let scratches = if number == 0 { (octaves(u, v, (4, 64), 2, 72) - 0.3) * 2.0 } else { 1.0 };
    let start = u - 0.06 * random((v * 56.0) as i32, 2, 2);
    let inside = band(u, v, width, 0.08, 2) + rim;
    solid(inside.min(tuft(u, v, 14, (0.64, 1.09), 2)).min(start * 4.0).min(scratches), 0.5)
}

/// Four thick strokes with rounded ends.
pub(super) fn wet_paint(u: f32, v: f32) -> f32 {
    let widths = [[0.0, 0.05, 0.13, 0.9, 0.96, 1.0], [0.0, 0.45, 0.68, 0.68, 0.45, 0.0]];
    solid(band(u, v, on_line(&widths, u), 0.16, 3), 0.3)
}

/// Four solid strokes, a little ragged at the end.
pub(super) fn gouache(u: f32, v: f32) -> f32 {
    let widths = [[0.0, 0.05, 0.15, 0.85, 1.0], [0.0, 0.5, 0.62, 0.62, 0.2]];
    solid(band(u, v, on_line(&widths, u), 0.12, 4).min(hair(u, v, 9, (0.03, 0.85, 1.05), 4)), 0.5)
}

/// Four dry strokes, ragged at both ends.
pub(super) fn dry_brush(u: f32, v: f32) -> f32 {
    let dry = octaves(u, v, (6, 64), 2, 5) - 0.36;
    solid(band(u, v, on_line(&STROKE, u), 0.1, 5).min(hair(u, v, 18, (0.25, 0.5, 1.1), 5)).min(dry), 0.2)
}

/// Four dry strokes, ragged at the start, rounded at the end.
pub(super) fn velvet_ink(u: f32, v: f32) -> f32 {
    let widths = [[0.0, 0.2, 0.9, 1.0], [0.3, 0.8, 0.85, 0.4]];
    let inside = band(u, v, on_line(&widths, u), 0.1, 6);
    let (line, _) = ((v * 64.0) as i32, 0);
    let begins = 0.33 * random(line, 3, 6);
    step(0.0, 0.2, inside) * step(begins, begins + 0.06, u) * mix(0.7, 1.0, noise(u, v, (8, 64), 6))
}

/// Four grainy strokes without ends.
pub(super) fn graphite(u: f32, v: f32) -> f32 {
    let grain = octaves(u, v, (24, 48), 2, 7) - 0.4;
    solid(band(u, v, 0.85, 0.2, 7).min(grain), 0.5)
}

/// Four strips with ragged rims.
pub(super) fn felt(u: f32, v: f32) -> f32 {
    solid(band(u, v, on_line(&[[0.0, 0.03, 0.97, 1.0], [0.7, 0.93, 0.93, 0.7]], u), 0.1, 8), 0.5)
}

/// Four stretched strokes, pinched in the middle, with holes.
pub(super) fn taffy(u: f32, v: f32) -> f32 {
    let widths = [[0.0, 0.1, 0.5, 0.9, 1.0], [0.2, 0.85, 0.5, 0.85, 0.2]];
    let holes = 0.75 - octaves(u, v, (3, 24), 2, 9);
    solid(band(u, v, on_line(&widths, u), 0.1, 9).min(holes), 0.5)
}

/// A dry stroke, ragged at its far end. Red, green and blue are uniform inside, and fall off in a narrow rim and towards
/// the far end.
pub(super) fn hypercolor(u: f32, v: f32) -> [f32; 4] {
    let inside = hypercolor_inside(u, v);
    let streaks = 0.08 * (octaves(u, v, (3, 32), 2, 11) - 0.5);
    let body = on_line(&[[0.0, 0.1, 0.5, 0.7, 0.85], [0.82, 0.86, 0.86, 0.7, 0.5]], u);
    let shade = mix(0.3, body, step(0.0, 0.1, inside)) + streaks;
    [shade, shade, shade, solid(inside, 0.5)]
}

/// Signed distance to the outline of [`hypercolor`], positive inside.
fn hypercolor_inside(u: f32, v: f32) -> f32 {
    let widths = [[0.0, 0.05, 0.6, 0.9, 1.0], [0.5, 0.8, 0.85, 0.7, 0.2]];
    let line = (v * 40.0) as i32;
    let dry = mix(0.6, 0.95, random(line, 1, 10)) - u;
    let rim = 0.1 * (noise(u, (v > 0.5) as u8 as f32 * 0.5, (10, 2), 51) - 0.5);
    (on_line(&widths, u) + rim - aside(v)).min(dry * 2.0).min(u * 8.0)
}

/// A dry streak of light. Most of its hairs start at a quarter of its length, and it ends in a round tip.
pub(super) fn light(u: f32, v: f32) -> f32 {
    const START: [[f32; 6]; 2] = [[0.1, 0.3, 0.42, 0.55, 0.7, 0.8], [0.32, 0.27, 0.23, 0.24, 0.29, 0.45]];
    const END: [[f32; 8]; 2] =
        [[0.07, 0.1, 0.2, 0.4, 0.55, 0.7, 0.8, 0.84], [0.7, 0.82, 0.92, 0.985, 0.985, 0.93, 0.84, 0.74]];
    // Shares of the holes along and across.
    const ALONG: [[f32; 5]; 2] = [[0.0, 0.25, 0.4, 0.6, 1.0], [0.34, 0.38, 0.32, 0.27, 0.29]];
    const ACROSS: [[f32; 6]; 2] = [[0.1, 0.2, 0.35, 0.5, 0.65, 0.8], [0.05, 0.04, -0.02, -0.08, -0.01, 0.06]];
    let early = (random((v * 40.0) as i32, 4, 12) / 0.4).min(1.0);
    let start = on_line(&START, v) * early + 0.06 * (noise(u, v, (4, 60), 49) - 0.5);
    let end = on_line(&END, v) + 0.02 * (noise(u, v, (1, 24), 50) - 0.5);
    let rim = 0.05 * (octaves(u, v, (10, 2), 2, 48) - 0.5);
    let aside = (v - 0.085 - 0.5 * rim).min(0.83 - v + 2.5 * rim);
    let holes = octaves(u, v, (9, 30), 2, 14) - on_line(&ALONG, u) - on_line(&ACROSS, v);
    step(-0.01, 0.02, aside) * step(-0.012, 0.012, (u - start).min(end - u)) * step(-0.03, 0.03, holes)
}

/// The number of the cell in an atlas of two by two cells, and the position in the cell, from -1 to 1.
fn cell(u: f32, v: f32) -> (i32, f32, f32) {
    let (u, v) = (u.clamp(0.0, 0.9999) * 2.0, v.clamp(0.0, 0.9999) * 2.0);
    (u as i32 + 2 * v as i32, u.fract() * 2.0 - 1.0, v.fract() * 2.0 - 1.0)
}

/// Four lumpy puffs with a bright, narrow core.
pub(super) fn smoke(u: f32, v: f32) -> f32 {
    const PLAIN: [f32; 10] = [0.42, 0.42, 0.41, 0.36, 0.29, 0.2, 0.11, 0.05, 0.02, 0.0];
    const CORES: [[f32; 10]; 4] = [
        PLAIN,
        PLAIN,
        [0.48, 0.49, 0.46, 0.38, 0.27, 0.15, 0.05, 0.01, 0.0, 0.0],
        [0.66, 0.64, 0.55, 0.42, 0.3, 0.17, 0.07, 0.02, 0.0, 0.0],
    ];
    let (number, x, y) = cell(u, v);
    // Each value applies to the middle of a tenth of the radius.
    let at = (x.hypot(y) * 10.0 - 0.5).max(0.0);
    let of = |i: usize| CORES[number as usize % 4].get(i).copied().unwrap_or(0.0);
    let puff = mix(of(at as usize), of(at as usize + 1), at.fract());
    let lumps = octaves(u, v, (10, 10), 2, 13 + number as u32) - 0.5;
    puff * (1.0 + 1.1 * lumps)
}

/// A hot core and a halo.
pub(super) fn ember(u: f32, v: f32) -> f32 {
    let r = aside(u).hypot(aside(v));
    const HALO: [[f32; 11]; 2] = [
        [0.4, 0.43, 0.55, 0.67, 0.72, 0.77, 0.82, 0.87, 0.92, 1.0, 1.01],
        [0.95, 0.36, 0.36, 0.28, 0.24, 0.19, 0.14, 0.1, 0.06, 0.02, 0.0],
    ];
    on_line(&HALO, r)
}

/// A soft glow. The alpha channel has the hot core.
pub(super) fn dot(u: f32, v: f32) -> [f32; 4] {
    let r = aside(u).hypot(aside(v));
    let glow = (1.0 - r / 0.85).max(0.0).powf(2.2);
    [glow, glow, glow, (1.0 - r / 0.12).max(0.0)]
}

/// A film that brightens towards its rim, most at the top. The alpha channel has two glints.
pub(super) fn bubble(u: f32, v: f32) -> [f32; 4] {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let r = x.hypot(y);
    const FILM: [[f32; 9]; 2] = [
        [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.975, 0.99],
        [0.06, 0.08, 0.12, 0.19, 0.28, 0.38, 0.5, 0.7, 0.7],
    ];
    // Brightness of the rim by angle, from the right, counter-clockwise.
    const RIM: [f32; 9] = [0.59, 0.66, 0.72, 0.72, 0.61, 0.24, 0.06, 0.26, 0.59];
    let turn = (y.atan2(x) / TAU).rem_euclid(1.0) * 8.0;
    let i = (turn as usize).min(7);
    let side = mix(RIM[i], RIM[i + 1], turn - i as f32);
    let film = 0.06 + (on_line(&FILM, r) - 0.06) * side / 0.5;
    let bright = film * step(1.0, 0.98, r);
    let half_moon = {
        let (dx, dy) = ((u - 0.3) / 0.08, (v - 0.73) / 0.08);
        step(1.0, 0.85, dx.hypot(dy)) * (0.5 + 0.5 * (dy - dx) * 0.707).clamp(0.0, 1.0)
    };
    let dot = 0.33 * step(1.0, 0.85, (u - 0.74).hypot(v - 0.26) / 0.042);
    [bright, bright, bright, half_moon.max(dot)]
}

/// A star of five points, a disc with a halo, and two crosses of thin arms.
pub(super) fn stars(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let r = x.hypot(y);
    let cross = |x: f32, y: f32| {
        let arm = |along: f32, off: f32| {
            let half_width = mix(0.06, 0.035, along.abs());
            step(half_width + 0.015, half_width - 0.015, off.abs()) * step(0.86, 0.82, along.abs())
        };
        arm(x, y).max(arm(y, x))
    };
    const DISC: [[f32; 6]; 2] = [[0.43, 0.47, 0.52, 0.57, 0.62, 0.67], [1.0, 0.62, 0.36, 0.19, 0.08, 0.0]];
    match number {
        0 => {
            // Signed distance from the straight edge between a point of the star and the next notch.
            let turn = ((y.atan2(x) / TAU * 5.0 - 0.25).rem_euclid(1.0) - 0.5).abs() * 2.0;
            let (sin, cos) = ((1.0 - turn) * TAU / 10.0).sin_cos();
            let (point, notch) = (0.95, 0.52);
            let (notch_x, notch_y) = (notch * (TAU / 10.0).cos(), notch * (TAU / 10.0).sin());
            let beyond = notch_y * (r * cos - point) - (notch_x - point) * (r * sin);
            step(0.02, -0.02, beyond / notch_y.hypot(notch_x - point))
        }
        1 => on_line(&DISC, r),
        2 => cross((x + y) * 0.707, (x - y) * 0.707),
        _ => cross(x, y),
    }
}

/// A crystal of six arms with buds near their tips and hollow diamonds between.
pub(super) fn snow(u: f32, v: f32) -> f32 {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let r = x.hypot(y);
    let turn = (y.atan2(x) / TAU * 6.0 + 0.12).rem_euclid(1.0) - 0.5;
    let (sin, cos) = (turn * TAU / 6.0).sin_cos();
    let (along, off) = (r * cos, (r * sin).abs());
    let arm = step(0.075, 0.045, off) * step(0.9, 0.85, along);
    let bud = |at: f32| step(0.07, 0.04, (along - at - off * 0.6).abs()) * step(0.2, 0.15, off);
    let diamond = ((along - 0.35).abs() / 0.11 + off / 0.15 - 1.0).abs();
    let core = step(0.2, 0.15, r);
    arm.max(bud(0.55)).max(bud(0.72)).max(step(0.4, 0.25, diamond)).max(core)
}

/// Four splats with small drops around them.
pub(super) fn splatter(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let (r, angle) = (x.hypot(y), y.atan2(x) / TAU + 0.5);
    let lobes = noise(angle, number as f32 / 4.0, (11, 4), 14) - 0.5;
    let mut inside = 0.62 + 0.45 * lobes - r;
    for i in 0..7 {
        let at = |k: i32| random(number * 8 + i, k, 15);
        let (turn, far) = (TAU * at(0), mix(0.6, 0.85, at(1)));
        let d = (x - far * turn.cos()).hypot(y - far * turn.sin());
        inside = inside.max(mix(0.03, 0.1, at(2)) - d);
    }
    solid(inside, 0.2)
}

/// Four bunches of hairs, which lean, fan out, and have very different widths.
pub(super) fn bristles(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let oval = 1.0 - (x / 0.9).powi(2);
    let mut alpha = 0.025_f32;
    for hair in 0..18 {
        let at = |k: i32| random(hair, k, 16 + 8 * number as u32);
        let place = (hair as f32 + at(0)) / 9.0 - 1.0;
        let line =
            0.58 * place * (1.0 + 0.25 * x) + 0.14 * x + 0.12 * (at(1) - 0.5) * (x * 2.5 + 6.0 * at(2)).sin();
        let half_width = mix(0.008, 0.055, at(3).powi(3));
        let (from, to) = (-0.9 * mix(0.5, 1.0, at(4)), 0.9 * mix(0.5, 1.0, at(5)));
        let taper = ((x - from).min(to - x) * 3.0).clamp(0.0, 1.0);
        let inside = half_width * taper - (y - line).abs();
        let covered = (inside * 32.0 + 0.5).clamp(0.0, 1.0)
            * mix(0.45, 1.0, at(6))
            * taper.min(oval.max(0.0) * 4.0).min(1.0);
        alpha = alpha.max(covered);
    }
    alpha
}

/// Four leaves with lobes.
pub(super) fn leaves(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let angle = y.atan2(x) + number as f32 * 0.3;
    let lobes = 0.63 + 0.2 * (5.0 * angle).cos() + 0.06 * (15.0 * angle).cos();
    let stem = (0.05 - y.abs()).min(-x - 0.1).min(x + 0.9);
    solid((lobes - x.hypot(y)).max(stem), 0.5)
}

/// A disc with a hard rim.
pub(super) fn disc(u: f32, v: f32) -> f32 {
    solid(0.985 - aside(u).hypot(aside(v)), 0.5)
}

/// Thin curls of flames on black. The alpha channel has the flames and a faint net everywhere. The moving net tears the
/// flames.
pub(super) fn fire(u: f32, v: f32) -> [f32; 4] {
    const ALONG: [[f32; 9]; 2] = [
        [0.0, 0.06, 0.19, 0.31, 0.44, 0.56, 0.66, 0.75, 0.85],
        [0.0, 0.25, 0.75, 1.0, 1.2, 1.2, 0.75, 0.3, 0.0],
    ];
    const ACROSS: [[f32; 9]; 2] = [
        [0.0, 0.07, 0.19, 0.31, 0.44, 0.69, 0.8, 0.92, 1.0],
        [0.0, 0.25, 0.85, 1.0, 1.1, 1.1, 0.85, 0.1, 0.0],
    ];
    let heat = on_line(&ALONG, u) * on_line(&ACROSS, v);
    let bent_u = u + 0.09 * (octaves(u, v, (5, 5), 2, 17) - 0.5);
    let bent_v = v + 0.16 * (octaves(u, v, (5, 5), 2, 50) - 0.5);
    let line = |level: f32, width: f32| (1.0 - (level - 0.5).abs() / (0.115 * width + 1.0e-6)).max(0.0);
    let level = octaves(bent_u, bent_v, (8, 8), 2, 18);
    let curls = line(level, heat).max(0.8 * line(octaves(bent_u + 0.3, bent_v, (9, 7), 2, 60), 0.8 * heat));
    let torn = step(0.25, 0.5, octaves(u, v, (7, 7), 2, 70));
    let patch = 0.9 * step(1.2, 0.5, ((u - 0.6) / 0.06).hypot((v - 0.35) / 0.05)) * torn;
    // A faint glow around the curls.
    let glow = 0.05 * line(level, 1.9 * heat) * step(0.0, 0.3, heat);
    let bright = ((curls * torn).powf(2.2) * heat.min(1.0).powf(0.4)).max(patch).max(glow);
    // Bright flames are few and nearly opaque: the product of brightness and alpha has the mean 0.07.
    let bright = (1.27 * bright.powf(1.3)).min(1.0);
    let net = line(octaves(u, v, (6, 6), 3, 80), 1.0);
    let alpha = (0.19 * net + 0.024 + 0.064 * noise(u, v, (8, 8), 90)).max(1.9 * bright);
    [bright, bright, bright, alpha.min(1.0)]
}

/// A torn strip of paper without ends.
pub(super) fn paper(u: f32, v: f32) -> f32 {
    let torn = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (5, 2), 3, 20) - 0.5;
    solid(0.88 + 0.14 * torn - aside(v), 0.16) * mix(0.85, 1.0, noise(u, v, (32, 32), 21))
}

/// Woven tape with frayed edges, without ends.
pub(super) fn tape(u: f32, v: f32) -> [f32; 4] {
    let frayed = random((v * 2.0) as i32, (u * 64.0) as i32, 22) * 0.05;
    let weave = 0.86 + 0.1 * ((u * 48.0).fract() - 0.5).abs() + 0.1 * ((v * 24.0).fract() - 0.5).abs();
    [weave, weave, weave, solid(0.92 - frayed - aside(v), 0.2)]
}

/// Slabs of paint from a palette knife with narrow cracks between them and ragged spikes at both sides, without ends.
pub(super) fn thick_paint(u: f32, v: f32) -> f32 {
    // The spikes lean to one side.
    let lean = u + 0.12 * aside(v);
    let spikes = octaves(lean, (v > 0.5) as u8 as f32 * 0.5, (11, 2), 2, 23) - 0.5;
    let outline = 0.72 + 0.6 * spikes - aside(v);
    // Slabs are the Voronoi cells of four by three random points.
    let bent = |x: f32, y: f32, seed: u32| 0.06 * (octaves(x, y, (8, 8), 2, seed) - 0.5);
    let (x, y) = ((u + bent(u, v, 53)) * 4.0, (v + bent(u, v, 54)) * 3.6 - 0.3);
    let (mut first, mut second) = (f32::INFINITY, f32::INFINITY);
    for i in -1..=1 {
        for j in -1..=1 {
            let (column, row) = (x.floor() as i32 + i, y.floor() as i32 + j);
            let at = |k: u32| 0.15 + 0.7 * random(column.rem_euclid(4), row, 55 + k);
            let d = (column as f32 + at(0) - x).hypot(row as f32 + at(1) - y);
            (first, second) = if d < first { (d, first) } else { (first, second.min(d)) };
        }
    }
    // Only some of the cracks are open.
    let crack = 0.02 * step(0.5, 0.75, noise(u, v, (5, 5), 57));
    let paint = mix(0.65, 0.95, octaves(u, v, (6, 6), 2, 58));
    solid(outline.min(((second - first) * 0.125 - crack) * 3.0 + 0.02), 0.5).min(paint)
}

/// Chips with ragged rims, without ends.
pub(super) fn charcoal(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (9, 2), 3, 25) - 0.5;
    let chips = octaves(u, v, (20, 20), 2, 26) - 0.36;
    solid((0.84 + 0.4 * rim - aside(v)).min(chips), 0.5)
}

/// The outline of a square and its diagonal.
pub(super) fn grid(u: f32, v: f32) -> f32 {
    let rim = step(0.95, 0.97, aside(u)).max(step(0.95, 0.97, aside(v)));
    rim.max(step(0.02, 0.01, (u - v).abs()))
}

/// Hairs that bow out from a shaft to a point.
pub(super) fn feather(u: f32, v: f32) -> f32 {
    let width = on_line(&[[0.0, 0.2, 0.6, 1.0], [0.1, 0.75, 0.9, 0.0]], u);
    let hairs = noise(u - aside(v) * 0.3, 0.0, (48, 1), 27);
    let shaft = step(0.05, 0.02, aside(v));
    (step(0.0, 0.2, width - aside(v)) * mix(0.2, 0.9, hairs)).max(shaft)
}

/// A band with deckled rims, without ends.
pub(super) fn deckled(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (16, 2), 3, 28) - 0.5;
    solid(0.8 + 0.12 * rim - aside(v), 0.5)
}

/// An endless band with ink that bleeds from its edges.
pub(super) fn leaky(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (6, 2), 3, 29) - 0.5;
    solid(0.74 + 0.5 * rim - aside(v), 0.5)
}

/// Cells of an insect's wing, nearly solid.
pub(super) fn wing(u: f32, v: f32) -> f32 {
    solid(0.93 + 0.06 * (noise(u, v, (24, 24), 30) - 0.5) - aside(v), 0.9)
}

/// Two hairlines that brighten towards a bar, which joins them.
pub(super) fn streamer(u: f32, v: f32) -> [f32; 4] {
    const LINES: [[f32; 11]; 2] = [
        [0.07, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.672, 0.718, 0.723],
        [0.0, 0.035, 0.07, 0.13, 0.22, 0.33, 0.43, 0.58, 0.9, 0.9, 0.0],
    ];
    // The part of a texel that lies in a range.
    let within = |x: f32, from: f32, to: f32| {
        let half = 0.5 / SIDE as f32;
        ((x + half).min(to) - (x - half).max(from)).max(0.0) / (2.0 * half)
    };
    let lines = (within(v, 0.4578, 0.4713) + within(v, 0.5643, 0.5778)) * on_line(&LINES, u);
    let bright = lines.max(within(u, 0.662, 0.718) * within(v, 0.457, 0.577));
    [bright, bright, bright, 1.0]
}

/// Soft blobs of red, green and blue.
pub(super) fn blobs(u: f32, v: f32) -> [f32; 4] {
    let of = |cells, seed| ((noise(u, v, (cells, cells), seed) - 0.35) * 1.6).clamp(0.0, 1.0);
    [of(3, 31), of(5, 32), of(8, 33), 1.0]
}

/// Soft curls.
pub(super) fn curls(u: f32, v: f32) -> f32 {
    let bent = v + 0.15 * (TAU * (u + noise(u, v, (3, 3), 34))).sin();
    let lines = 0.5 + 0.5 * (TAU * 3.0 * bent).sin();
    lines * step(1.0, 0.6, aside(v))
}

/// A soft drop.
pub(super) fn drop(u: f32, v: f32) -> f32 {
    let width = on_line(&[[0.0, 0.7, 0.9, 1.0], [0.0, 0.8, 0.7, 0.0]], u);
    step(0.0, 0.4, width - aside(v))
}

/// A triangle that points along the stroke.
pub(super) fn triangle(u: f32, v: f32) -> f32 {
    solid(1.0 - u - aside(v), 0.5)
}

/// Streaks along a tube.
pub(super) fn fibres(u: f32, v: f32) -> [f32; 4] {
    let streaks = octaves(u, v, (3, 16), 3, 35);
    [1.0, mix(0.8, 0.95, streaks), mix(0.78, 0.95, streaks), 1.0]
}
