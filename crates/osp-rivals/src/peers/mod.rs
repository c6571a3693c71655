//! The trees of other crates, each in its best form. A walk tests only the planes that still cut a node, and takes
//! polygons inside every plane without a test. A crate with private nodes is walked by its own code, with the plane
//! test at each node. Only with the feature `peers`.
//!
//! They serve for comparison only: their results for boxes near the ends of `f32` are not checked, and their work is
//! not counted. They refuse the same boxes as every index; for a visitor they are a single leaf.

mod adapter;
mod bvh_crate;
mod obvhs_crate;
mod parry;
mod rstar_crate;

use adapter::Adapted;

use osp::index::{IndexConfig, SpatialIndex};

/// Another crate's tree, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PeerKind {
    /// `parry3d`'s `Bvh`, one box after the other.
    Parry,
    /// The same, built again by binned SAH in every commit that follows a change.
    ParryRebuilt,
    /// `obvhs`'s `Bvh2`, one box after the other.
    Obvhs,
    /// The same, built again by PLOC.
    ObvhsRebuilt,
    /// `rstar`'s R*-tree with nodes of 6 to 16.
    Rstar,
    /// The crate `bvh`'s `Bvh`, one box after the other; built again after a removal.
    Bvh,
}

impl PeerKind {
    /// All of them.
    pub const ALL: &'static [Self] =
        &[Self::Parry, Self::ParryRebuilt, Self::Obvhs, Self::ObvhsRebuilt, Self::Rstar, Self::Bvh];

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parry => "parry3d",
            Self::ParryRebuilt => "parry3d-rebuilt",
            Self::Obvhs => "obvhs",
            Self::ObvhsRebuilt => "obvhs-rebuilt",
            Self::Rstar => "rstar",
            Self::Bvh => "bvh-crate",
        }
    }

    /// Whether every change makes it build everything again.
    pub fn rebuilds(self) -> bool {
        matches!(self, Self::ParryRebuilt | Self::ObvhsRebuilt)
    }

    /// An empty index of this kind.
    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        let name = self.name();
        match self {
            Self::Parry => Box::new(Adapted::<parry::Growing>::new(name, config)),
            Self::ParryRebuilt => Box::new(Adapted::<parry::Rebuilt>::new(name, config)),
            Self::Obvhs => Box::new(Adapted::<obvhs_crate::Growing>::new(name, config)),
            Self::ObvhsRebuilt => Box::new(Adapted::<obvhs_crate::Rebuilt>::new(name, config)),
            Self::Rstar => Box::new(Adapted::<rstar_crate::Rstar>::new(name, config)),
            Self::Bvh => Box::new(Adapted::<bvh_crate::BvhCrate>::new(name, config)),
        }
    }
}
