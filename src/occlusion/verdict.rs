//! Results of tests of boxes.

use crate::math::Aabb;

/// Whether a volume is occluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No part of the volume is visible through the window.
    Hidden,
    /// The occluders hide no part of the volume, so its contents need no test.
    Unoccluded,
    /// It is not certain that the volume is hidden, nor that it is unoccluded.
    PartlyHidden,
}

/// A verdict, and the work of the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tested {
    /// The result of the test.
    pub verdict: Verdict,
    /// Number of planes that the volume was tested against; for a depth buffer, of tiles that were read.
    pub steps: u32,
}

/// Largest number of boxes that are tested at once.
pub(super) const TOGETHER: usize = 16;

/// Results of a test of up to sixteen boxes, a bit for each box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TestedBoxes {
    /// Hidden boxes.
    pub hidden: u16,
    /// Boxes without a hidden part; valid only for [`Needed::Verdict`].
    pub unoccluded: u16,
    /// Number of planes that each box was tested against, summed over the boxes.
    pub steps: u32,
    /// Number of planes that were read. A plane is read once for all boxes that reach its node together.
    pub planes: u32,
}

/// The results that a test of boxes has to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needed {
    /// The hidden boxes only.
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
