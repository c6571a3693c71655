//! The shapes of textures: alpha, or colour and alpha, at a place from 0 to 1 along (`u`) and across (`v`).

use std::f32::consts::TAU;

use super::noise::{mix, noise, octaves, on_line, random, step};

/// Alpha of something cut out at `cutoff`, of which this is how far a place lies inside.
fn solid(inside: f32, cutoff: f32) -> f32 {
    (cutoff + inside * 12.0).clamp(0.0, 1.0)
}

/// 0 in the middle, 1 at both sides.
fn aside(v: f32) -> f32 {
    (v - 0.5).abs() * 2.0
}

/// Blunt at the start, pointed at the end.
pub(super) fn taper(u: f32, v: f32) -> f32 {
    let width =
        [(0.0, 0.55), (0.05, 1.0), (0.2, 1.0), (0.4, 0.9), (0.6, 0.75), (0.8, 0.5), (0.95, 0.25), (1.0, 0.0)];
    solid(on_line(&width, u) - aside(v), 0.067)
}

/// An outline like a leaf's.
pub(super) fn leaf(u: f32, v: f32) -> f32 {
    let width =
        [(0.0, 0.4), (0.05, 0.7), (0.2, 0.95), (0.4, 1.0), (0.6, 0.9), (0.8, 0.6), (0.95, 0.25), (1.0, 0.0)];
    solid(on_line(&width, u) - aside(v), 0.52)
}

/// A glow with blurred rims.
pub(super) fn soft_tip(u: f32, v: f32) -> f32 {
    let width = on_line(&[(0.0, 0.75), (0.15, 0.9), (0.3, 0.85), (0.6, 0.65), (0.9, 0.25), (1.0, 0.0)], u);
    let soft = step(width * 0.5 + 0.275, width * 0.5 - 0.275, aside(v) * 0.5 + width * 0.25);
    soft * step(0.0, 0.2, u) * step(1.0, 0.85, u)
}

/// A row of an atlas of four, and the place in it.
fn row(v: f32) -> (i32, f32) {
    let v = v.clamp(0.0, 0.9999) * 4.0;
    (v as i32, v.fract())
}

/// How far inside a band a place of an atlas's row lies.
fn band(u: f32, v: f32, widths: &[(f32, f32)], wave: f32, seed: u32) -> f32 {
    let (number, v) = row(v);
    let rim = noise(u, number as f32 / 8.0, (12, 8), seed) - 0.5;
    on_line(widths, u) + rim * wave - aside(v)
}

/// Whether the hair that a place lies on has paint there: it runs out from `from` to `to` along the stroke, and sets in
/// the same way up to `start`.
fn hair(u: f32, v: f32, hairs: i32, (start, from, to): (f32, f32, f32), seed: u32) -> f32 {
    let line = (v * (hairs * 4) as f32) as i32;
    let ends = mix(from, to, random(line, 1, seed));
    let begins = start * random(line, 2, seed);
    (ends - u).min(u - begins) * 4.0
}

const STROKE: [(f32, f32); 6] = [(0.0, 0.0), (0.04, 0.7), (0.12, 0.87), (0.7, 0.87), (0.9, 0.6), (1.0, 0.0)];

/// Four solid strokes, ragged at the end.
pub(super) fn ink(u: f32, v: f32) -> f32 {
    solid(band(u, v, &STROKE, 0.06, 1).min(hair(u, v, 10, (0.02, 0.62, 1.1), 1)), 0.5)
}

/// Four strokes with gaps of bristles at both ends.
pub(super) fn oil_paint(u: f32, v: f32) -> f32 {
    solid(band(u, v, &STROKE, 0.08, 2).min(hair(u, v, 14, (0.12, 0.66, 1.1), 2)), 0.5)
}

/// Four thick strokes with rounded ends.
pub(super) fn wet_paint(u: f32, v: f32) -> f32 {
    let widths = [(0.0, 0.0), (0.05, 0.45), (0.13, 0.68), (0.9, 0.68), (0.96, 0.45), (1.0, 0.0)];
    solid(band(u, v, &widths, 0.16, 3), 0.3)
}

/// Four solid strokes, a little ragged at the end.
pub(super) fn gouache(u: f32, v: f32) -> f32 {
    let widths = [(0.0, 0.0), (0.05, 0.5), (0.15, 0.62), (0.85, 0.62), (1.0, 0.2)];
    solid(band(u, v, &widths, 0.12, 4).min(hair(u, v, 9, (0.03, 0.85, 1.05), 4)), 0.5)
}

/// Four dry strokes, ragged at both ends.
pub(super) fn dry_brush(u: f32, v: f32) -> f32 {
    let dry = octaves(u, v, (6, 64), 2, 5) - 0.36;
    solid(band(u, v, &STROKE, 0.1, 5).min(hair(u, v, 18, (0.25, 0.5, 1.1), 5)).min(dry), 0.2)
}

/// Four dry strokes, ragged at the start, rounded at the end.
pub(super) fn velvet_ink(u: f32, v: f32) -> f32 {
    let widths = [(0.0, 0.3), (0.2, 0.8), (0.9, 0.85), (1.0, 0.4)];
    let inside = band(u, v, &widths, 0.1, 6);
    let (line, _) = ((v * 64.0) as i32, 0);
    let begins = 0.33 * random(line, 3, 6);
    step(0.0, 0.2, inside) * step(begins, begins + 0.06, u) * mix(0.7, 1.0, noise(u, v, (8, 64), 6))
}

/// Four grainy strokes without ends.
pub(super) fn graphite(u: f32, v: f32) -> f32 {
    let grain = octaves(u, v, (24, 48), 2, 7) - 0.4;
    solid(band(u, v, &[(0.0, 0.85)], 0.2, 7).min(grain), 0.5)
}

/// Four strips with ragged rims.
pub(super) fn felt(u: f32, v: f32) -> f32 {
    solid(band(u, v, &[(0.0, 0.7), (0.03, 0.93), (0.97, 0.93), (1.0, 0.7)], 0.1, 8), 0.5)
}

/// Four stretched strokes, pinched in the middle, with holes.
pub(super) fn taffy(u: f32, v: f32) -> f32 {
    let widths = [(0.0, 0.2), (0.1, 0.85), (0.5, 0.5), (0.9, 0.85), (1.0, 0.2)];
    let holes = 0.75 - octaves(u, v, (3, 24), 2, 9);
    solid(band(u, v, &widths, 0.1, 9).min(holes), 0.5)
}

/// A dry stroke, ragged at its far end; red, green and blue vary along it.
pub(super) fn hypercolor(u: f32, v: f32) -> [f32; 4] {
    let widths = [(0.0, 0.3), (0.05, 0.8), (0.6, 0.85), (0.9, 0.7), (1.0, 0.2)];
    let line = (v * 40.0) as i32;
    let dry = mix(0.6, 1.1, random(line, 1, 10)) - u;
    let inside = (on_line(&widths, u) - aside(v)).min(dry * 4.0);
    let shade = octaves(u, v, (4, 24), 3, 11);
    [shade, shade, shade, solid(inside, 0.5)]
}

/// One dry streak of light: hairs that set in one after the other, nearly solid from there on, rounded at the end.
pub(super) fn light(u: f32, v: f32) -> f32 {
    let (middle, end) = (0.44, 0.99);
    let width = on_line(&[(0.0, 0.5), (0.2, 0.8), (0.4, 0.9), (0.85, 0.9)], u);
    let round = (1.0 - ((u - 0.85) / (end - 0.85)).max(0.0).powi(2)).max(0.0).sqrt();
    let rim = 0.1 * (noise(u, v, (24, 6), 48) - 0.5);
    let inside = width * round + rim - (v - middle).abs() * 2.0;
    let line = (v * 44.0) as i32;
    // Most hairs have set in by a third of the way.
    let begins = mix(0.02, 0.4, random(line, 4, 12).powf(0.7));
    let holes = octaves(u, v, (5, 34), 3, 12);
    let lost = on_line(&[(0.0, 0.45), (0.35, 0.34), (0.6, 0.27), (1.0, 0.27)], u);
    step(0.0, 0.1, inside) * step(begins, begins + 0.04, u) * step(-0.03, 0.05, holes - lost)
}

/// A cell of an atlas of two by two, and the place in it from -1 to 1.
fn cell(u: f32, v: f32) -> (i32, f32, f32) {
    let (u, v) = (u.clamp(0.0, 0.9999) * 2.0, v.clamp(0.0, 0.9999) * 2.0);
    (u as i32 + 2 * v as i32, u.fract() * 2.0 - 1.0, v.fract() * 2.0 - 1.0)
}

/// Four puffs.
pub(super) fn smoke(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let r = x.hypot(y) / 0.78;
    let puff = 0.42 * (1.0 - r * r).max(0.0).powf(1.2);
    puff * (0.4 + 1.2 * octaves(u, v, (8, 8), 3, 13 + number as u32)).min(1.0)
}

/// A hot core and a halo.
pub(super) fn ember(u: f32, v: f32) -> f32 {
    let r = aside(u).hypot(aside(v));
    if r < 0.43 { 0.95 } else { 0.35 * (1.0 - (r - 0.43) / 0.57).max(0.0) }
}

/// A soft glow; alpha is the hot core.
pub(super) fn dot(u: f32, v: f32) -> [f32; 4] {
    let r = aside(u).hypot(aside(v));
    let glow = (1.0 - r / 0.85).max(0.0).powf(2.2);
    [glow, glow, glow, (1.0 - r / 0.12).max(0.0)]
}

/// A ring, brighter at its upper left; alpha is two glints.
pub(super) fn bubble(u: f32, v: f32) -> [f32; 4] {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let r = x.hypot(y);
    let ring = step(0.6, 0.93, r) * step(0.99, 0.93, r);
    let side = 0.5 + 0.5 * (-x + y) / (r * std::f32::consts::SQRT_2).max(0.01);
    let bright = ring * mix(0.15, 0.9, side);
    let glint = |cx: f32, cy: f32, size: f32| (1.0 - (x - cx).hypot(y - cy) / size).max(0.0);
    let alpha = glint(-0.45, 0.5, 0.16).max(0.5 * glint(0.45, -0.5, 0.1));
    [bright, bright, bright, alpha.min(1.0)]
}

/// A cross, another, a star of five points, a disc.
pub(super) fn stars(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let r = x.hypot(y);
    let cross = |x: f32, y: f32| {
        let arm =
            |along: f32, aside: f32| (1.0 - along.abs() / 0.9).max(0.0) * (1.0 - aside.abs() / 0.12).max(0.0);
        (arm(x, y) + arm(y, x) + (1.0 - r / 0.3).max(0.0)).min(1.0)
    };
    match number {
        0 => cross((x + y) * 0.707, (x - y) * 0.707),
        1 => cross(x, y),
        2 => {
            let turn = (y.atan2(x) / TAU * 5.0 + 0.25).rem_euclid(1.0);
            step(0.04, -0.04, r - mix(0.8, 0.35, aside(turn)))
        }
        _ => (1.0 - r / 0.7).max(0.0).powf(0.7),
    }
}

/// A crystal of six arms.
pub(super) fn snow(u: f32, v: f32) -> f32 {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let r = x.hypot(y);
    let turn = (y.atan2(x) / TAU * 6.0).rem_euclid(1.0) - 0.5;
    let (along, off) = (r * (turn * TAU / 6.0).cos(), (r * (turn * TAU / 6.0).sin()).abs());
    let arm = step(0.1, 0.04, off) * step(0.95, 0.85, along);
    let branch = |at: f32| {
        let d = (along - at - off * 0.6).abs();
        step(0.09, 0.03, d) * step(0.32, 0.26, off)
    };
    arm.max(branch(0.35)).max(branch(0.6)).min(1.0)
}

/// Four splats with droplets.
pub(super) fn splatter(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let (r, angle) = (x.hypot(y), y.atan2(x) / TAU + 0.5);
    let lobes = noise(angle, number as f32 / 4.0, (11, 4), 14) - 0.5;
    let mut inside = 0.5 + 0.45 * lobes - r;
    for i in 0..7 {
        let at = |k: i32| random(number * 8 + i, k, 15);
        let (turn, far) = (TAU * at(0), mix(0.6, 0.85, at(1)));
        let d = (x - far * turn.cos()).hypot(y - far * turn.sin());
        inside = inside.max(mix(0.03, 0.1, at(2)) - d);
    }
    solid(inside, 0.2)
}

/// Four bunches of hairs.
pub(super) fn bristles(u: f32, v: f32) -> f32 {
    let (number, x, y) = cell(u, v);
    let line = ((y * 0.5 + 0.5) * 22.0) as i32;
    let at = |k: i32| random(line, k, 16 + number as u32);
    let ends = (0.84 * mix(0.6, 1.0, at(0)) - x).min(x + 0.84 * mix(0.6, 1.0, at(1)));
    let fine = 0.22 - ((y * 0.5 + 0.5) * 22.0).fract().mul_add(1.0, -0.5).abs();
    solid((0.56 - y.abs()).min(ends).min(fine), 0.25)
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

/// Wisps of flames; alpha is denser.
pub(super) fn fire(u: f32, v: f32) -> [f32; 4] {
    let rims = step(0.0, 0.12, u) * step(1.0, 0.5, u) * step(0.95, 0.5, aside(v));
    let bent = v + 0.08 * (octaves(u, v, (3, 3), 2, 17) - 0.5);
    let wisps = 1.0 - (octaves(u, bent, (2, 7), 3, 18) - 0.5).abs() * 9.0;
    let dense = octaves(u, v, (4, 6), 3, 19);
    let bright = wisps.clamp(0.0, 1.0) * rims * 0.9;
    [bright, bright, bright, (dense * rims * 1.6).min(1.0)]
}

/// A torn strip, without ends.
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

/// Slabs of a palette knife with cracks, without ends.
pub(super) fn thick_paint(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (7, 2), 2, 23) - 0.5;
    let cracks = octaves(u + 0.4 * v, v, (9, 13), 3, 24) - 0.36;
    solid((0.76 + 0.4 * rim - aside(v)).min(cracks), 0.5)
}

/// Chips with ragged rims, without ends.
pub(super) fn charcoal(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (9, 2), 3, 25) - 0.5;
    let chips = octaves(u, v, (20, 20), 2, 26) - 0.36;
    solid((0.84 + 0.4 * rim - aside(v)).min(chips), 0.5)
}

/// The outline of a square with a diagonal.
pub(super) fn grid(u: f32, v: f32) -> f32 {
    let rim = step(0.95, 0.97, aside(u)).max(step(0.95, 0.97, aside(v)));
    rim.max(step(0.02, 0.01, (u - v).abs()))
}

/// Hairs that bow out from a shaft to a point.
pub(super) fn feather(u: f32, v: f32) -> f32 {
    let width = on_line(&[(0.0, 0.1), (0.2, 0.75), (0.6, 0.9), (1.0, 0.0)], u);
    let hairs = noise(u - aside(v) * 0.3, 0.0, (48, 1), 27);
    let shaft = step(0.05, 0.02, aside(v));
    (step(0.0, 0.2, width - aside(v)) * mix(0.2, 0.9, hairs)).max(shaft)
}

/// A band with deckled rims, without ends.
pub(super) fn deckled(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (16, 2), 3, 28) - 0.5;
    solid(0.8 + 0.12 * rim - aside(v), 0.5)
}

/// A band from whose rims ink has leaked, without ends.
pub(super) fn leaky(u: f32, v: f32) -> f32 {
    let rim = octaves(u, (v > 0.5) as u8 as f32 * 0.5, (6, 2), 3, 29) - 0.5;
    solid(0.74 + 0.5 * rim - aside(v), 0.5)
}

/// Cells of an insect's wing, nearly solid.
pub(super) fn wing(u: f32, v: f32) -> f32 {
    solid(0.93 + 0.06 * (noise(u, v, (24, 24), 30) - 0.5) - aside(v), 0.9)
}

/// A thin tracer with a bright head.
pub(super) fn streamer(u: f32, v: f32) -> [f32; 4] {
    let head = step(0.6, 0.66, u) * step(0.78, 0.72, u);
    let tail = step(0.1, 0.65, u) * step(0.7, 0.6, u) * 0.15;
    let bright = (head.max(tail) * step(0.25, 0.08, aside(v) * 0.5)).min(1.0);
    [bright, bright, bright, bright]
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
    let width = on_line(&[(0.0, 0.0), (0.7, 0.8), (0.9, 0.7), (1.0, 0.0)], u);
    step(0.0, 0.4, width - aside(v))
}

/// A triangle that points along.
pub(super) fn triangle(u: f32, v: f32) -> f32 {
    solid(1.0 - u - aside(v), 0.5)
}

/// Streaks along a tube.
pub(super) fn fibres(u: f32, v: f32) -> [f32; 4] {
    let streaks = octaves(u, v, (3, 16), 3, 35);
    [1.0, mix(0.8, 0.95, streaks), mix(0.78, 0.95, streaks), 1.0]
}
