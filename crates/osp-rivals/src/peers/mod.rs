//! The trees of other crates, each in its best form. A traversal tests only the planes that cut the parent, and reports
//! polygons inside all planes without a test. If the nodes of a crate are private, the crate's own code traverses them,
//! with the plane test at each node. This module exists only with the feature `peers`.
//!
//! These trees serve for comparison only: their results for boxes near the ends of `f32` are not checked, and their work is
//! not counted. They refuse the same boxes as every index. A visitor gets each tree as a single leaf.

mod adapter;
mod obvhs_crate;
mod parry;
mod rstar_crate;

use adapter::Adapted;

use osp::index::{IndexConfig, SpatialIndex};

/// Another crate's tree, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PeerKind {
    /// `Bvh` of `parry3d`, built by binned SAH whenever it has grown by a quarter, and filled one by one between.
    Parry,
    /// `Bvh2` of `obvhs`, built by PLOC whenever it has grown by a quarter, and filled one by one between.
    Obvhs,
    /// The R*-tree of `rstar`, with nodes of 6 to 16 children.
    Rstar,
}

impl PeerKind {
    pub const ALL: &'static [Self] = &[Self::Parry, Self::Obvhs, Self::Rstar];

    /// The name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parry => "parry3d",
            Self::Obvhs => "obvhs",
            Self::Rstar => "rstar",
        }
    }

    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        let name = self.name();
        match self {
            Self::Parry => Box::new(Adapted::<parry::Growing>::new(name, config)),
            Self::Obvhs => Box::new(Adapted::<obvhs_crate::Growing>::new(name, config)),
            Self::Rstar => Box::new(Adapted::<rstar_crate::Rstar>::new(name, config)),
        }
    }
}
