//! Results of tests of boxes.

use crate::math::Aabb;

/// Whether a volume is occluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No part of it is visible through the window.
    Hidden,
    /// No part of it is hidden by these occluders: its contents need no test.
    Unoccluded,
    /// Neither of the two is certain.
    PartlyHidden,
}

/// A verdict, and the work of the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tested {
    /// The answer.
    pub verdict: Verdict,
    /// Planes that the volume was tested against; for a depth buffer, the tiles that were read.
    pub steps: u32,
}

/// Boxes that are tested at once.
pub(super) const TOGETHER: usize = 16;

/// Result of a test of some boxes, a bit for each box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestedBoxes {
    /// Hidden boxes.
    pub hidden: u16,
    /// Boxes without a hidden part; valid only for [`Asked::Verdict`].
    pub unoccluded: u16,
    /// Planes that each box was tested against, added up.
    pub steps: u32,
    /// Planes that were read for that: one for all boxes that meet it at the same time.
    pub planes: u32,
}

/// Kind of a test of boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The hidden boxes.
    Hidden,
    /// The hidden boxes, and the boxes without a hidden part.
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
