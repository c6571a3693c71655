use glam::Vec3;

use crate::recording::Transform;

/// One step of the undo history. Strokes and groups are given by their place in the scene's lists.
#[derive(Clone, Debug)]
pub(super) enum Edit {
    /// A stroke was drawn.
    Draw { stroke: u32 },
    /// A stroke was erased.
    Erase { stroke: u32 },
    /// Strokes were moved; the offset that each one has on the other side of the edit: before it while it is done, after
    /// it while it is taken back. So both come back to the bit, whatever the way there was.
    Move { offsets: Vec<(u32, Vec3)> },
    /// Strokes changed their group; the groups of before, and the new one.
    Group {
        before: Vec<(u32, Option<usize>)>,
        group: usize,
        parent_before: Option<usize>,
        parent: Option<usize>,
        /// Before and after, if the edit names the group.
        names: Option<Box<[Option<String>; 2]>>,
    },
    /// A group was placed.
    Place { group: usize, before: Transform, after: Transform },
    /// Strokes went to a layer; the layer that each one has on the other side of the edit.
    Assign { layers: Vec<(u32, u32)> },
    /// Several edits that are one step, in their order.
    Several(Vec<Edit>),
}

impl Edit {
    /// Calls `drawn` for each stroke that was drawn by it, and `erased` for each that was erased.
    pub(super) fn strokes_of(&self, drawn: &mut impl FnMut(u32), erased: &mut impl FnMut(u32)) {
        match self {
            Self::Draw { stroke } => drawn(*stroke),
            Self::Erase { stroke } => erased(*stroke),
            Self::Several(edits) => edits.iter().for_each(|edit| edit.strokes_of(drawn, erased)),
            Self::Move { .. } | Self::Group { .. } | Self::Place { .. } | Self::Assign { .. } => {}
        }
    }

    /// How many strokes it remembers something of.
    pub(super) fn named(&self) -> usize {
        match self {
            Self::Draw { .. } | Self::Erase { .. } | Self::Place { .. } => 0,
            Self::Move { offsets } => offsets.len(),
            Self::Group { before, .. } => before.len(),
            Self::Assign { layers } => layers.len(),
            Self::Several(edits) => edits.iter().map(|edit| 1 + edit.named()).sum(),
        }
    }
}
