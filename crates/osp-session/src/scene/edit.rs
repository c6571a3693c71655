use glam::Vec3;

use crate::recording::Transform;

/// One step of an author's undo history. Strokes and groups are given by their place in the scene's lists.
#[derive(Clone, Debug)]
pub(super) enum Edit {
    /// A stroke was drawn.
    Draw { stroke: u32 },
    /// A stroke was erased.
    Erase { stroke: u32 },
    /// Strokes or a group were arranged: the place in the [log](super::log::Log), and the number of named strokes.
    Arrange { at: u64, named: u32 },
    /// Several edits that are one step, in their order.
    Several(Vec<Edit>),
}

impl Edit {
    /// Calls `each` for every single edit in it, in their order.
    pub(super) fn for_each(&self, each: &mut impl FnMut(&Self)) {
        match self {
            Self::Several(edits) => edits.iter().for_each(|edit| edit.for_each(each)),
            single => each(single),
        }
    }

    /// Number of strokes that it names.
    pub(super) fn named(&self) -> usize {
        match self {
            Self::Draw { .. } | Self::Erase { .. } => 0,
            Self::Arrange { named, .. } => *named as usize,
            Self::Several(edits) => edits.iter().map(|edit| 1 + edit.named()).sum(),
        }
    }
}

/// A stroke that an arrangement names.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named<T> {
    pub(super) stroke: u32,
    pub(super) of: T,
}

/// Motion of a stroke, in the space of its group, and its offset before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub(super) by: Vec3,
    pub(super) before: Vec3,
}

/// An edit that several authors can make at once, and the state before it. Lists are ascending by stroke.
///
/// While it is active, its state before it (`before`) results from the base and all earlier active arrangements.
#[derive(Clone, Debug, Default)]
pub(super) enum Arrangement {
    /// No remaining effect.
    #[default]
    Nothing,
    /// Strokes were moved.
    Move(Vec<Named<Way>>),
    /// Strokes became members of a group.
    Group(Box<Grouping>),
    /// A group was placed.
    Place { group: usize, before: Transform, to: Transform },
    /// Strokes went to a layer; with each stroke's layer before.
    Assign { layer: u32, strokes: Vec<Named<u32>> },
}

/// The group that a group hangs under, if any.
pub(super) type Parent = Option<usize>;

/// Strokes that became members of a group. The group may get a parent and a name, too.
#[derive(Clone, Debug)]
pub(super) struct Grouping {
    pub(super) group: usize,
    /// The members, with the group that each was in before.
    pub(super) members: Vec<Named<Option<usize>>>,
    /// The group's parent, unless a later grouping has settled it; [`Hangings`](super::hanging::Hangings) stores the
    /// effect.
    pub(super) hanging: Option<Parent>,
    /// The names before and after, if it names the group.
    pub(super) names: Option<[Option<String>; 2]>,
}

impl Arrangement {
    /// Number of strokes that it names.
    pub(super) fn named(&self) -> u32 {
        (match self {
            Self::Nothing | Self::Place { .. } => 0,
            Self::Move(moved) => moved.len(),
            Self::Group(grouping) => grouping.members.len(),
            Self::Assign { strokes, .. } => strokes.len(),
        }) as u32
    }
}
