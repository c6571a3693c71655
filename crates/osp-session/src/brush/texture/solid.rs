//! Texels of a brush's picture that are opaque at every mip level. They hide the polygons behind them.

use std::sync::{LazyLock, OnceLock};

use super::SIDE;
use crate::brush::{self, Brush, Draw, Effect, Family, Uv};

/// Safety margin of alpha for an opaque texel, because textures have 8 bits and devices filter them with low precision.
const SURELY: f32 = 0.03;

/// For each texel column along the stroke, one bit for each texel across. The bit is set if the texel and its
/// neighbours are opaque at every mip level.
type Solid = [u128; SIDE];

static SOLID: LazyLock<Vec<OnceLock<Option<Box<Solid>>>>> =
    LazyLock::new(|| brush::all().iter().map(|_| OnceLock::new()).collect());

/// The widest opaque range of `v` within `v.0` to `v.1`: all its texels from `u.0` to `u.1` are opaque. `None` if there
/// is no such range, if the brush is not [`Draw::Cutout`], or if its texture is animated.
pub fn solid_across(brush: &'static Brush, u: (f32, f32), v: (f32, f32)) -> Option<(f32, f32)> {
    if brush.draw != Draw::Cutout || brush.effect != Effect::None {
        return None;
    }
    let solid = SOLID.get(usize::from(brush.number()))?.get_or_init(|| find(brush)).as_deref()?;
    let texel = |x: f32| (x * SIDE as f32).floor() as i64;
    let (from, to) = (texel(u.0.min(u.1)), texel(u.0.max(u.1)));
    // A range longer than the texture covers all columns.
    let columns = from..=to.min(from + SIDE as i64 - 1);
    let column = |x: i64| match repeats(brush) {
        true => solid[x.rem_euclid(SIDE as i64) as usize],
        false => solid[x.clamp(0, SIDE as i64 - 1) as usize],
    };
    let all = columns.fold(u128::MAX, |all, x| all & column(x));
    let (low, high) = (v.0.min(v.1).max(0.0), v.0.max(v.1).min(1.0));
    // Only texels that lie completely within the range count.
    let rows = (low * SIDE as f32).ceil() as usize..(high * SIDE as f32).floor() as usize;
    let (mut best, mut start) = (0..0, rows.start);
    for row in rows {
        if all >> row & 1 == 0 {
            start = row + 1;
        } else if row + 1 - start > best.len() {
            best = start..row + 1;
        }
    }
    (!best.is_empty()).then(|| (best.start as f32 / SIDE as f32, best.end as f32 / SIDE as f32))
}

/// Whether the texture repeats along the stroke; else it is clamped at its ends.
pub fn repeats(brush: &Brush) -> bool {
    match brush.family {
        Family::QuadStrip(uv) | Family::Welded { uv, .. } | Family::Tube { uv, .. } => uv == Uv::Distance,
        _ => false,
    }
}

fn find(brush: &Brush) -> Option<Box<Solid>> {
    let Some(picture) = brush.picture else { return Some(Box::new([u128::MAX; SIDE])) };
    let place = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    let mut level: Vec<f32> = (0..SIDE * SIDE)
        .map(|i| picture.texel(place(i % SIDE), place(i / SIDE))[3].clamp(0.0, 1.0))
        .collect();
    let enough = brush.cutoff + SURELY;
    let (mut solid, mut side) = (Box::new([u128::MAX; SIDE]), SIDE);
    loop {
        let columns: Vec<u128> = (0..side)
            .map(|x| (0..side).fold(0, |of, y| of | u128::from(level[y * side + x] >= enough) << y))
            .collect();
        let (texels, last) = (SIDE / side, side - 1);
        for x in 0..side {
            // A texel counts if its eight neighbours are opaque, too. At the border, the neighbour is on the opposite
            // side of a repeated texture. Otherwise it is the border texel itself.
            let (left, right, below, above) = match repeats(brush) {
                true => ((x + last) % side, (x + 1) % side, last, 0),
                false => (x.saturating_sub(1), (x + 1).min(last), 0, last),
            };
            let all = columns[left] & columns[x] & columns[right];
            let all = all & (all << 1 | all >> below & 1) & (all >> 1 | (all >> above & 1) << last);
            let wide = (0..SIDE).fold(0, |of, y| of | (all >> (y / texels) & 1) << y);
            solid[x * texels..(x + 1) * texels].iter_mut().for_each(|column| *column &= wide);
        }
        if side == 1 {
            break;
        }
        side /= 2;
        let of = |x: usize, y: usize| level[y * side * 2 + x];
        level = (0..side * side)
            .map(|i| (i % side * 2, i / side * 2))
            .map(|(x, y)| (of(x, y) + of(x + 1, y) + of(x, y + 1) + of(x + 1, y + 1)) * 0.25)
            .collect();
    }
    solid.iter().any(|column| *column != 0).then_some(solid)
}
