use osp::index::{IndexConfig, SpatialIndex};
#[cfg(feature = "peers")]
use osp_rivals::PeerKind;
use osp_rivals::{IndexKind, REBUILDS};

/// A structure to measure: one of this project, or (with the feature `peers`) one of another crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contender {
    /// A structure of this project.
    Own(IndexKind),
    /// A structure of another crate.
    #[cfg(feature = "peers")]
    Peer(PeerKind),
}

impl Contender {
    /// Names of the structures of other crates; only builds with the feature `peers` have them.
    pub const PEERS: [&'static str; 3] = ["parry3d", "obvhs", "rstar"];

    /// All structures that can be measured, those of this project first.
    pub fn all() -> Vec<Self> {
        let own = IndexKind::ALL.iter().copied().map(Self::Own);
        #[cfg(feature = "peers")]
        let all = own.chain(PeerKind::ALL.iter().copied().map(Self::Peer));
        #[cfg(not(feature = "peers"))]
        let all = own;
        all.collect()
    }

    /// All but the octree that is rebuilt at other times: for each insert it takes too long, and a thread disturbs the others.
    pub fn usual() -> Vec<Self> {
        let is_other = |kind: &Self| REBUILDS[1..].iter().any(|(_, other)| *kind == Self::Own(*other));
        Self::all().into_iter().filter(|kind| !is_other(kind)).collect()
    }

    /// The contender's name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own(kind) => kind.name(),
            #[cfg(feature = "peers")]
            Self::Peer(kind) => kind.name(),
        }
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|contender| contender.name() == name)
    }

    /// An empty index of this kind.
    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        match self {
            Self::Own(kind) => kind.create(config),
            #[cfg(feature = "peers")]
            Self::Peer(kind) => kind.create(config),
        }
    }
}

#[cfg(all(test, feature = "peers"))]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_of_the_peers() {
        assert!(PeerKind::ALL.iter().map(|kind| kind.name()).eq(Contender::PEERS));
    }
}
