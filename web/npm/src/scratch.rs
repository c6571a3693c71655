//! Numbers that are passed between JavaScript and Rust. Their memory is used again.

use osp::{glam::Vec3, math::Aabb, polygon::PolygonId};

use crate::{
    refusal::{Outcome, refused},
    room,
};

/// Number of values of a box.
const BOX: usize = 6;

/// Numbers from JavaScript, and numbers for it.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// A matrix, planes, points.
    pub(crate) numbers: [f64; 24],
    /// Boxes: `min x, min y, min z, max x, max y, max z` each.
    pub(crate) boxes: Vec<f32>,
    /// One id for each box.
    pub(crate) ids: Vec<u32>,
    /// The results of a query.
    pub(crate) found: Vec<u32>,
    /// A distance or another number for each of these.
    pub(crate) measured: Vec<f32>,
}

/// Resizes a list. JavaScript overwrites its contents.
pub(crate) fn resize<T: Clone>(list: &mut Vec<T>, len: usize, blank: T) -> Outcome<()> {
    list.truncate(len);
    if list.capacity() < len {
        room::note_taken();
    }
    if list.try_reserve(len - list.len()).is_err() {
        *list = Vec::new();
        return refused("there is no memory left for so many numbers at once");
    }
    list.resize(len, blank);
    Ok(())
}

impl Scratch {
    /// Makes room for the numbers from JavaScript.
    pub(crate) fn room(&mut self, floats: usize, ids: usize) -> Outcome<()> {
        resize(&mut self.boxes, floats, 0.0)?;
        resize(&mut self.ids, ids, 0)
    }

    /// Returns the box at an index.
    pub(crate) fn bounds(&self, at: usize) -> Aabb {
        let corner = |from: usize| Vec3::from_slice(&self.boxes[at * BOX + from..]);
        Aabb::new(corner(0), corner(3))
    }

    /// Returns the box at an index, if it is valid.
    pub(crate) fn checked(&self, at: usize) -> Outcome<Aabb> {
        let bounds = self.bounds(at);
        if bounds.is_valid() {
            return Ok(bounds);
        }
        let numbers = &self.boxes[at * BOX..(at + 1) * BOX];
        refused(&format!("box {at}: expected finite numbers and min <= max, found {numbers:?}"))
    }

    /// Replaces the result.
    pub(crate) fn answer(&mut self, ids: impl Iterator<Item = PolygonId>) -> usize {
        self.found.clear();
        self.found.extend(ids.map(|id| id.0));
        self.found.len()
    }

    /// Returns three of the numbers.
    pub(crate) fn point(&self, from: usize) -> [f64; 3] {
        [self.numbers[from], self.numbers[from + 1], self.numbers[from + 2]]
    }
}

/// Returns the smallest `f32` that is not less.
pub(crate) fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}

/// Returns the largest `f32` that is not greater.
pub(crate) fn round_down(v: f64) -> f32 {
    -round_up(-v)
}
