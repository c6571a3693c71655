use glam::Vec3;

use crate::recording::Transform;

/// An edit in an author's undo history. Strokes and groups are indices of the scene's lists.
#[derive(Clone, Debug)]
pub(super) enum Edit {
    Draw {
        stroke: u32,
    },
    Erase {
        stroke: u32,
    },
    /// Strokes or a group were arranged. Stores the arrangement's index in the [log](super::log::Log), and the number
    /// of strokes that it lists.
    Arrange {
        at: u64,
        named: u32,
    },
    /// Several edits that form one step, in order.
    Several(Vec<Edit>),
}

impl Edit {
    /// Calls `each` for every single edit, in order.
    pub(super) fn for_each(&self, each: &mut impl FnMut(&Self)) {
        match self {
            Self::Several(edits) => edits.iter().for_each(|edit| edit.for_each(each)),
            single => each(single),
        }
    }

    pub(super) fn named(&self) -> usize {
        match self {
            Self::Draw { .. } | Self::Erase { .. } => 0,
            Self::Arrange { named, .. } => *named as usize,
            Self::Several(edits) => edits.iter().map(|edit| 1 + edit.named()).sum(),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Named<T> {
    pub(super) stroke: u32,
    pub(super) of: T,
}

/// Translation of a stroke by a move, and the stroke's offset before the move, in the space of its group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Translation {
    pub(super) by: Vec3,
    pub(super) before: Vec3,
}

/// An edit that moves, groups, places or assigns strokes or groups, and the state before it. Lists are sorted by
/// stroke.
///
/// While the arrangement is active, its `before` values are the values after all earlier active arrangements.
#[derive(Clone, Debug, Default)]
pub(super) enum Arrangement {
    /// No effect remains.
    #[default]
    Nothing,
    Move(Vec<Named<Translation>>),
    /// Strokes became members of a group.
    Group(Box<Grouping>),
    Place {
        group: usize,
        before: Transform,
        to: Transform,
    },
    /// Strokes were assigned to a layer. The values are the strokes' former layers.
    Assign {
        layer: u32,
        strokes: Vec<Named<u32>>,
    },
}

/// The parent of a group, if any.
pub(super) type Parent = Option<usize>;

/// Strokes that became members of a group. The grouping may also set the group's parent and name.
#[derive(Clone, Debug)]
pub(super) struct Grouping {
    pub(super) group: usize,
    pub(super) members: Vec<Named<Option<usize>>>,
    /// The parent that the grouping sets. `None` if a later permanent grouping also sets a parent.
    /// [`GroupParents`](super::parents::GroupParents) stores whether the grouping has an effect.
    pub(super) new_parent: Option<Parent>,
    /// The group's names before and after, if the grouping sets the name.
    pub(super) names: Option<[Option<String>; 2]>,
}

impl Arrangement {
    /// Number of strokes that the arrangement lists.
    pub(super) fn named(&self) -> u32 {
        (match self {
            Self::Nothing | Self::Place { .. } => 0,
            Self::Move(moved) => moved.len(),
            Self::Group(grouping) => grouping.members.len(),
            Self::Assign { strokes, .. } => strokes.len(),
        }) as u32
    }
}
