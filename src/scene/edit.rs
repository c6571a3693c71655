use glam::Vec3;

use crate::recording::Transform;

/// One step of the undo history. Strokes and groups are given by their place in the scene's lists.
#[derive(Clone, Debug)]
pub(super) enum Edit {
    /// A stroke was drawn.
    Draw { stroke: u32 },
    /// A stroke was erased.
    Erase { stroke: u32 },
    /// Strokes were moved; what each one's offset was before, and by how much.
    Move { before: Vec<(u32, Vec3)>, by: Vec3 },
    /// Strokes changed their group; the groups of before, and the new one.
    Group {
        before: Vec<(u32, Option<usize>)>,
        group: usize,
        parent_before: Option<usize>,
        parent: Option<usize>,
    },
    /// A group was placed.
    Place { group: usize, before: Transform, after: Transform },
}
