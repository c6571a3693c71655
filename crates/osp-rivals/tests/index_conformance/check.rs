//! Checks that every index has to pass, whatever it contains.

use osp::{
    index::{BruteForce, Node, SpatialIndex, Visit, Visitor},
    math::{Aabb, Containment, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::boxes::Rng;

/// The decisions of a test visitor.
#[derive(Clone, Copy, Debug)]
enum Policy {
    DescendAlways,
    TakeFrom(u32),
    Random,
}

/// Collects the polygons of a traversal, and checks the values of its nodes.
struct Recorder<'a> {
    policy: Policy,
    random: Rng,
    frustum: &'a Frustum,
    reference: &'a BruteForceTwin,
    found: Vec<PolygonId>,
    last_asked: Option<(Aabb, usize, Visit)>,
    /// Number of polygons received since the last node.
    since: usize,
    skipped: bool,
    faults: Vec<String>,
}

impl Recorder<'_> {
    fn expect(&mut self, holds: bool, what: &str) {
        if !holds && self.faults.len() < 5 {
            self.faults.push(what.to_owned());
        }
    }
}

impl Visitor for Recorder<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.expect(node.containment != Containment::Outside, "asked about a node outside the frustum");
        self.expect(
            self.frustum.classify(node.bounds) == node.containment,
            "the containment is not that of the bounds",
        );
        self.expect(node.polygons > 0, "asked about an empty node");
        let answer = match self.policy {
            Policy::DescendAlways => Visit::Descend,
            Policy::TakeFrom(depth) if node.depth >= depth => Visit::Take,
            Policy::TakeFrom(_) => Visit::Descend,
            Policy::Random => {
                [Visit::Skip, Visit::Descend, Visit::Descend, Visit::Take][self.random.below(4)]
            }
        };
        self.skipped |= answer == Visit::Skip;
        self.last_asked = Some((*node.bounds, node.polygons, answer));
        self.since = 0;
        answer
    }

    fn polygons(&mut self, ids: &[PolygonId], asked: Visit) {
        self.found.extend_from_slice(ids);
        self.since += ids.len();
        let Some((bounds, count, answer)) = self.last_asked else {
            self.expect(false, "polygons before the first node");
            return;
        };
        self.expect(asked != Visit::Skip, "polygons of a node that was skipped");
        if answer == Visit::Take {
            self.expect(asked == Visit::Take, "taken, but handed over as if asked to descend");
            self.expect(self.since <= count, "more polygons than the node said");
            let inside = ids.iter().all(|&id| bounds.contains(&self.reference.boxes[id.index()]));
            self.expect(inside, "a polygon sticks out of its node's bounds");
        }
    }
}

/// The reference index, and the boxes of its polygons.
#[derive(Default)]
pub(crate) struct BruteForceTwin {
    pub(crate) index: BruteForce,
    pub(crate) boxes: Vec<Aabb>,
}

impl BruteForceTwin {
    pub(crate) fn set(&mut self, id: PolygonId, bounds: &Aabb) {
        if id.index() >= self.boxes.len() {
            self.boxes.resize(id.index() + 1, Aabb::EMPTY);
        }
        self.boxes[id.index()] = *bounds;
    }
}

fn sorted(ids: &[PolygonId]) -> Vec<PolygonId> {
    let mut ids = ids.to_vec();
    ids.sort_unstable();
    ids
}

/// Checks one index against the reference: `validate`, then every frustum by `frustum_cull` and by `traverse`.
pub(crate) fn check(index: &dyn SpatialIndex, twin: &BruteForceTwin, frusta: &[Frustum], place: &str) {
    let name = index.name();
    if let Err(fault) = index.validate() {
        panic!("{name}, {place}: {fault}");
    }
    assert_eq!(index.len(), twin.index.len(), "{name}, {place}: number of polygons");
    assert_eq!(index.is_empty(), twin.index.is_empty(), "{name}, {place}");
    // The list is not emptied in between, because a query appends.
    let mut seen = Vec::new();
    seen.push(PolygonId(u32::MAX));
    let (mut expected, mut blocks) = (Vec::new(), VisibleBlocks::new());
    for (i, frustum) in frusta.iter().enumerate() {
        let before = seen.len();
        let work = index.frustum_cull(frustum, &mut seen);
        expected.clear();
        twin.index.frustum_cull(frustum, &mut expected);
        let expected = sorted(&expected);
        let found = &seen[before..];
        assert_eq!(sorted(found), expected, "{name}, {place}, frustum {i}: frustum_cull");
        assert_eq!(work.reported, expected.len() as u64, "{name}, {place}, frustum {i}: work.reported");
        assert!(work.taken_whole <= work.reported, "{name}, {place}, frustum {i}: work.taken_whole");
        blocks.clear();
        let work = index.frustum_cull_blocks(frustum, &mut blocks);
        assert_eq!(blocks.to_vec(), expected, "{name}, {place}, frustum {i}: frustum_cull_blocks");
        assert_eq!(blocks.len(), expected.len(), "{name}, {place}, frustum {i}: polygons counted");
        assert_eq!(
            work.reported,
            expected.len() as u64,
            "{name}, {place}, frustum {i}: work.reported of blocks"
        );

        let policies = [Policy::DescendAlways, Policy::TakeFrom(i as u32 % 4), Policy::Random];
        for policy in policies {
            let mut recorder = Recorder {
                policy,
                random: Rng(i as u64),
                frustum,
                reference: twin,
                found: Vec::new(),
                last_asked: None,
                since: 0,
                skipped: false,
                faults: Vec::new(),
            };
            let work = index.traverse(frustum, &mut recorder);
            let at = format!("{name}, {place}, frustum {i}, traverse {policy:?}");
            assert!(recorder.faults.is_empty(), "{at}: {:?}", recorder.faults);
            let found = sorted(&recorder.found);
            assert!(found.windows(2).all(|w| w[0] < w[1]), "{at}: a polygon twice");
            assert_eq!(work.reported, found.len() as u64, "{at}: work.reported");
            if recorder.skipped {
                assert!(found.iter().all(|id| expected.binary_search(id).is_ok()), "{at}: one too many");
            } else {
                assert_eq!(found, expected, "{at}");
            }
        }
    }
    assert_eq!(seen[0], PolygonId(u32::MAX), "{name}, {place}: the list was not appended to");
}
