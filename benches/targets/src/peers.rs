//! The measured structures: the project's own, and the structures of other crates ([`osp_rivals::PeerKind`]).

use std::{cell::RefCell, time::Instant};

use osp::{
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_rivals::{IndexKind, PeerKind};

/// A measured structure.
pub trait Subject {
    fn insert(&mut self, id: u32, bounds: &Aabb);
    /// Ends a frame's inserts.
    fn commit(&mut self);
    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>);
    /// Runs frames in which nothing changes.
    fn rest(&mut self) {}
    /// Appends the result of the last `cull` to `out` if the structure returns blocks.
    fn list(&self, _out: &mut Vec<PolygonId>) {}
    fn bytes(&self) -> usize;
}

/// A kind of measured structure, and its constructor.
pub struct Kind {
    pub name: &'static str,
    pub rebuilds: bool,
    pub peer: bool,
    /// Whether the results are blocks of sixteen ids with a mask.
    pub blocks: bool,
    pub make: fn(&IndexConfig) -> Box<dyn Subject>,
}

pub const KINDS: &[Kind] = &[
    Kind { name: "osp", rebuilds: false, peer: false, blocks: false, make: |c| own(IndexKind::Osp, c) },
    Kind {
        name: "osp, as blocks",
        rebuilds: false,
        peer: false,
        blocks: true,
        make: |c| Box::new(Blocks::new(c)),
    },
    Kind {
        name: "osp, packed",
        rebuilds: false,
        peer: false,
        blocks: false,
        make: |c| Box::new(Rested(own(IndexKind::Osp, c))),
    },
    Kind {
        name: "osp, packed, as blocks",
        rebuilds: false,
        peer: false,
        blocks: true,
        make: |c| Box::new(Rested(Box::new(Blocks::new(c)))),
    },
    Kind {
        name: "brute-simd",
        rebuilds: false,
        peer: false,
        blocks: false,
        make: |c| own(IndexKind::BruteSimd, c),
    },
    Kind {
        name: "time-order",
        rebuilds: false,
        peer: false,
        blocks: false,
        make: |c| own(IndexKind::TimeOrder, c),
    },
    Kind {
        name: "octree-rebuild",
        rebuilds: true,
        peer: false,
        blocks: false,
        make: |c| own(IndexKind::OctreeRebuild, c),
    },
    Kind { name: "lbvh", rebuilds: true, peer: false, blocks: false, make: |c| own(IndexKind::Lbvh, c) },
    Kind {
        name: "parry3d insert",
        rebuilds: false,
        peer: true,
        blocks: false,
        make: |c| peer(PeerKind::Parry, c),
    },
    Kind {
        name: "parry3d binned",
        rebuilds: true,
        peer: true,
        blocks: false,
        make: |c| peer(PeerKind::ParryRebuilt, c),
    },
    Kind {
        name: "obvhs insert",
        rebuilds: false,
        peer: true,
        blocks: false,
        make: |c| peer(PeerKind::Obvhs, c),
    },
    Kind {
        name: "obvhs PLOC",
        rebuilds: true,
        peer: true,
        blocks: false,
        make: |c| peer(PeerKind::ObvhsRebuilt, c),
    },
    Kind {
        name: "rstar insert",
        rebuilds: false,
        peer: true,
        blocks: false,
        make: |c| peer(PeerKind::Rstar, c),
    },
    Kind { name: "bvh insert", rebuilds: false, peer: true, blocks: false, make: |c| peer(PeerKind::Bvh, c) },
];

struct Indexed(Box<dyn SpatialIndex>);

fn own(kind: IndexKind, config: &IndexConfig) -> Box<dyn Subject> {
    Box::new(Indexed(kind.create(config)))
}

fn peer(kind: PeerKind, config: &IndexConfig) -> Box<dyn Subject> {
    Box::new(Indexed(kind.create(config)))
}

impl Subject for Indexed {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(PolygonId(id), bounds).expect("finite boxes, each id once");
    }

    fn commit(&mut self) {
        self.0.commit();
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        self.0.frustum_cull(frustum, out);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// `osp` after frames without changes, in which it packs the leaves of scattered polygons.
struct Rested(Box<dyn Subject>);

impl Subject for Rested {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(id, bounds);
    }

    fn commit(&mut self) {
        self.0.commit();
    }

    fn rest(&mut self) {
        let frame = |_| {
            let start = Instant::now();
            self.0.commit();
            start.elapsed().as_secs_f64() * 1.0e6
        };
        let mut times: Vec<f64> = (0..20_000).map(frame).collect();
        // Frames that pack nothing take almost no time.
        times.retain(|us| *us > 1.0);
        times.sort_by(f64::total_cmp);
        if let Some(most) = times.last() {
            let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
            println!(
                "\nQuiet frames that packed: {}; p50 / p99 / max {:.1} / {:.1} / {most:.1} µs.",
                times.len(),
                at(0.5),
                at(0.99)
            );
        }
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        self.0.cull(frustum, out);
    }

    fn list(&self, out: &mut Vec<PolygonId>) {
        self.0.list(out);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// `osp` with blocks as results. `list` converts the blocks to ids, so that the results can be compared.
struct Blocks {
    tree: Osp,
    found: RefCell<VisibleBlocks>,
}

impl Blocks {
    fn new(config: &IndexConfig) -> Self {
        Self { tree: Osp::new(config), found: RefCell::default() }
    }
}

impl Subject for Blocks {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.tree.insert(PolygonId(id), bounds).expect("finite boxes, each id once");
    }

    fn commit(&mut self) {
        self.tree.commit();
    }

    fn cull(&self, frustum: &Frustum, _out: &mut Vec<PolygonId>) {
        let mut found = self.found.borrow_mut();
        found.clear();
        self.tree.frustum_cull_blocks(frustum, &mut found);
    }

    fn list(&self, out: &mut Vec<PolygonId>) {
        out.extend(self.found.borrow().ids());
    }

    fn bytes(&self) -> usize {
        self.tree.bytes()
    }
}
