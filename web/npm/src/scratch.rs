//! Numbers on their way between JavaScript and Rust; kept for their memory.

use osp::{glam::Vec3, math::Aabb, polygon::PolygonId};

use crate::{
    refusal::{Outcome, refused},
    room,
};

/// Numbers of a box.
const BOX: usize = 6;

/// Numbers that JavaScript has written, and those that it will read.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// A matrix, planes, points.
    pub(crate) numbers: [f64; 24],
    /// Boxes: `min x, min y, min z, max x, max y, max z` each. Or corners.
    pub(crate) boxes: Vec<f32>,
    /// One for each box.
    pub(crate) ids: Vec<u32>,
    /// What a query has found.
    pub(crate) found: Vec<u32>,
    /// For each of these, a distance or the like.
    pub(crate) measured: Vec<f32>,
}

/// Makes a list as long as asked; what is in it, JavaScript overwrites.
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
    /// Room for what JavaScript writes.
    pub(crate) fn room(&mut self, floats: usize, ids: usize) -> Outcome<()> {
        resize(&mut self.boxes, floats, 0.0)?;
        resize(&mut self.ids, ids, 0)
    }

    /// The box at a place.
    pub(crate) fn bounds(&self, at: usize) -> Aabb {
        let corner = |from: usize| Vec3::from_slice(&self.boxes[at * BOX + from..]);
        Aabb::new(corner(0), corner(3))
    }

    /// The box at a place, if an index takes it.
    pub(crate) fn checked(&self, at: usize) -> Outcome<Aabb> {
        let bounds = self.bounds(at);
        if bounds.is_valid() {
            return Ok(bounds);
        }
        let numbers = &self.boxes[at * BOX..(at + 1) * BOX];
        refused(&format!("box {at}: expected finite numbers and min <= max, found {numbers:?}"))
    }

    /// Boxes that were written.
    pub(crate) fn box_count(&self) -> usize {
        self.boxes.len() / BOX
    }

    /// Replaces the answer.
    pub(crate) fn answer(&mut self, ids: impl Iterator<Item = PolygonId>) -> usize {
        self.found.clear();
        self.found.extend(ids.map(|id| id.0));
        self.found.len()
    }

    /// Three of the numbers.
    pub(crate) fn point(&self, from: usize) -> [f64; 3] {
        [self.numbers[from], self.numbers[from + 1], self.numbers[from + 2]]
    }
}

/// The least `f32` that is no less.
pub(crate) fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}

/// The largest `f32` that is no more.
pub(crate) fn round_down(v: f64) -> f32 {
    -round_up(-v)
}
