//! Fills what lies inside of directed edges.

use super::super::{picture::STEP_BITS, slope::SIDE};

/// Position of a sample in its pixel, in steps, rounded down; it lies half a step farther, so no corner is at its height.
const SAMPLE: i32 = 1 << (STEP_BITS - 1);

/// Largest number of columns of tiles.
const WORDS: usize = 16;

/// Closed outlines of a surface, and the samples with a positive winding number: those inside of more counterclockwise
/// than clockwise outlines. A sample that lies within rounding of an edge may count on either side.
#[derive(Clone, Debug)]
pub(super) struct Contour {
    /// For each row and column of pixels, how the winding number changes there from left to right.
    steps: Vec<i16>,
    /// For each row, a bit for each column of tiles with a change.
    changed: Vec<[u64; WORDS]>,
    /// The rows and the columns of tiles with a change.
    rows: [i32; 2],
    columns: [i32; 2],
    width: i32,
    height: i32,
}

impl Contour {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        let (width, height) = (columns * SIDE, rows * SIDE);
        assert!(columns <= 64 * WORDS, "at most 8,192 pixels across");
        Self {
            steps: vec![0; width * height],
            changed: vec![[0; WORDS]; height],
            rows: [i32::MAX, 0],
            columns: [i32::MAX, 0],
            width: width as i32,
            height: height as i32,
        }
    }

    /// Adds an edge, in steps; the surface lies on its left, or on its right if the edge is turned.
    #[inline(always)]
    pub(super) fn add(&mut self, [from, to]: [[i32; 2]; 2], is_turned: bool) {
        let is_up = from[1] < to[1];
        let (low, high) = if is_up { (from, to) } else { (to, from) };
        let first = ((low[1] - SAMPLE + (1 << STEP_BITS) - 1) >> STEP_BITS).max(0);
        let end = ((high[1] - SAMPLE + (1 << STEP_BITS) - 1) >> STEP_BITS).min(self.height);
        if first >= end {
            return;
        }
        let step = if is_up == is_turned { 1 } else { -1 };
        let by_y = f64::from(high[0] - low[0]) / f64::from(high[1] - low[1]);
        let middle = f64::from(SAMPLE) + 0.5;
        let mut x =
            f64::from(low[0]) + (f64::from(first << STEP_BITS) + middle - f64::from(low[1])) * by_y - middle;
        let scale = 1.0 / f64::from(1 << STEP_BITS);
        x = x * scale + 1.0;
        self.rows = [self.rows[0].min(first), self.rows[1].max(end)];
        for row in first..end {
            // The first pixel whose sample lies on the right.
            let column = x.clamp(0.0, f64::from(self.width)) as i32;
            x += by_y;
            if column < self.width {
                self.steps[(row * self.width + column) as usize] += step;
                let tile = column / SIDE as i32;
                self.changed[row as usize][tile as usize / 64] |= 1 << (tile % 64);
                self.columns = [self.columns[0].min(tile), self.columns[1].max(tile + 1)];
            }
        }
    }

    /// Passes the tiles with such samples, and the samples, to `each`. Removes all edges.
    #[inline(always)]
    pub(super) fn fill(&mut self, mut each: impl FnMut(usize, u64)) {
        let side = SIDE as i32;
        let columns = self.width / side;
        let (mut row, end) = (self.rows[0] / side * side, self.rows[1]);
        while row < end {
            let (mut winding, mut inside) = ([0_i16; SIDE], 0_u64);
            let rows = row as usize..row as usize + SIDE;
            let mut any = [0; WORDS];
            for changed in &mut self.changed[rows] {
                any.iter_mut().zip(std::mem::take(changed)).for_each(|(any, changed)| *any |= changed);
            }
            for column in self.columns[0].min(columns)..=columns {
                let is_changed =
                    column < self.columns[1] && any[column as usize / 64] >> (column % 64) & 1 == 1;
                if is_changed {
                    let (mut pixels, mut behind) = (0_u64, 0_u64);
                    for (k, winding) in winding.iter_mut().enumerate() {
                        let start = ((row + k as i32) * self.width + column * side) as usize;
                        let mut bits = 0_u64;
                        for (x, step) in self.steps[start..start + SIDE].iter_mut().enumerate() {
                            *winding += std::mem::take(step);
                            bits |= u64::from(*winding > 0) << x;
                        }
                        pixels |= bits << (k * SIDE);
                        behind |= if *winding > 0 { 0xFF << (k * SIDE) } else { 0 };
                    }
                    if pixels != 0 {
                        each((row / side * columns + column) as usize, pixels);
                    }
                    inside = behind;
                } else if column >= columns || inside == 0 && column >= self.columns[1] {
                    break;
                } else if inside != 0 {
                    each((row / side * columns + column) as usize, inside);
                }
            }
            row += side;
        }
        (self.rows, self.columns) = ([i32::MAX, 0], [i32::MAX, 0]);
    }
}
