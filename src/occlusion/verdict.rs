//! What a test of boxes finds.

use crate::math::Aabb;

/// Whether a volume is occluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing of it can be seen through the window.
    Hidden,
    /// No part of it is hidden by these occluders: what it contains needs no test.
    Unoccluded,
    /// Neither of the two is certain.
    PartlyHidden,
}

/// A verdict, and the work that it took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tested {
    /// The answer.
    pub verdict: Verdict,
    /// Planes that the volume was tested against; for a depth buffer, the tiles that were read.
    pub steps: u32,
}

/// Boxes that are tested at once.
pub(super) const TOGETHER: usize = 16;

/// What a test of some boxes has found, a bit for each box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestedBoxes {
    /// Those that are hidden.
    pub hidden: u16,
    /// Those of which nothing is hidden; only where that was asked.
    pub unoccluded: u16,
    /// Planes that each box was tested against, added up.
    pub steps: u32,
    /// Planes that were read for that: one for all boxes that meet it at the same time.
    pub planes: u32,
}

/// What is asked about boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Which are hidden.
    Hidden,
    /// Which are hidden, and which not at all.
    Verdict,
}

/// Tests at most sixteen boxes one after the other.
pub(super) fn one_by_one(boxes: &[Aabb], test: impl Fn(&Aabb) -> Tested) -> TestedBoxes {
    boxes.iter().take(TOGETHER).enumerate().fold(TestedBoxes::default(), |sum, (i, bounds)| {
        let Tested { verdict, steps } = test(bounds);
        TestedBoxes {
            hidden: sum.hidden | u16::from(verdict == Verdict::Hidden) << i,
            unoccluded: sum.unoccluded | u16::from(verdict == Verdict::Unoccluded) << i,
            steps: sum.steps + steps,
            planes: sum.planes + steps,
        }
    })
}
