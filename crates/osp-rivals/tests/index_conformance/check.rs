//! Checks that every index has to pass, whatever it contains: each query has the answer of the plainest loop.

use std::collections::BTreeMap;

use glam::Vec3;
use osp::{
    index::{Node, SpatialIndex, Visit, Visitor},
    math::{Aabb, Containment, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::boxes::Rng;

use crate::scenes::around;

/// The boxes that an index has.
pub(crate) type Boxes = BTreeMap<PolygonId, Aabb>;

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
    boxes: &'a Boxes,
    found: Vec<PolygonId>,
    last_asked: Option<(Aabb, usize, Visit)>,
    /// Depths and boxes of the nodes above.
    above: Vec<(u32, Aabb)>,
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
        self.above.retain(|(depth, _)| *depth < node.depth);
        let is_within = self.above.last().is_none_or(|(_, parent)| parent.contains(node.bounds));
        self.expect(is_within, "a node sticks out of the node above");
        self.above.push((node.depth, *node.bounds));
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
            let inside = ids.iter().all(|&id| bounds.contains(&self.boxes[&id]));
            self.expect(inside, "a polygon sticks out of its node's bounds");
        }
    }
}

fn sorted(ids: &[PolygonId]) -> Vec<PolygonId> {
    let mut ids = ids.to_vec();
    ids.sort_unstable();
    ids
}

/// The ids whose boxes pass a test, ascending.
fn those(boxes: &Boxes, mut test: impl FnMut(&Aabb) -> bool) -> Vec<PolygonId> {
    boxes.iter().filter(|(_, bounds)| test(bounds)).map(|(&id, _)| id).collect()
}

/// Asks for the polygons in view in every way: as a list, as blocks, in two views at once, and by traversals.
pub(crate) fn check_frusta(index: &dyn SpatialIndex, boxes: &Boxes, frusta: &[Frustum], place: &str) {
    // The list is not emptied in between, because a query appends.
    let mut seen = vec![PolygonId(u32::MAX)];
    let mut sets = [const { VisibleBlocks::new() }; 2];
    for (i, frustum) in frusta.iter().enumerate() {
        let at = format!("{place}, frustum {i} of {frusta:?}");
        let expected = those(boxes, |bounds| frustum.may_see(bounds));
        let count = expected.len() as u64;
        let before = seen.len();
        let work = index.frustum_cull(frustum, &mut seen);
        assert_eq!(sorted(&seen[before..]), expected, "{at}: frustum_cull");
        assert_eq!(work.reported, count, "{at}: work.reported");
        assert!(work.taken_whole <= work.reported, "{at}: work.taken_whole");
        sets[0].clear();
        let work = index.frustum_cull_blocks(frustum, &mut sets[0]);
        assert_eq!(sets[0].to_vec(), expected, "{at}: frustum_cull_blocks");
        assert_eq!((sets[0].len() as u64, work.reported), (count, count), "{at}: polygons counted");
        let other = &frusta[(i + 1) % frusta.len()];
        sets.iter_mut().for_each(VisibleBlocks::clear);
        index.frustum_cull_views(&[*frustum, *other], &mut sets);
        assert_eq!(sets[0].to_vec(), expected, "{at}: the first view");
        assert_eq!(sets[1].to_vec(), those(boxes, |bounds| other.may_see(bounds)), "{at}: the second view");

        for policy in [Policy::DescendAlways, Policy::TakeFrom(i as u32 % 4), Policy::Random] {
            let mut recorder = Recorder {
                policy,
                random: Rng(i as u64),
                frustum,
                boxes,
                found: Vec::new(),
                last_asked: None,
                above: Vec::new(),
                since: 0,
                skipped: false,
                faults: Vec::new(),
            };
            let work = index.traverse(frustum, &mut recorder);
            assert!(recorder.faults.is_empty(), "{at}, {policy:?}: {:?}", recorder.faults);
            let found = sorted(&recorder.found);
            assert!(found.windows(2).all(|w| w[0] < w[1]), "{at}, {policy:?}: a polygon twice");
            assert_eq!(work.reported, found.len() as u64, "{at}, {policy:?}: work.reported");
            if recorder.skipped {
                assert!(found.iter().all(|id| expected.binary_search(id).is_ok()), "{at}: one too many");
            } else {
                assert_eq!(found, expected, "{at}, {policy:?}");
            }
        }
    }
    assert_eq!(seen[0], PolygonId(u32::MAX), "{place}: the list was not appended to");
}

/// A corner of the box, or a point in an edge, in a face or inside.
fn point_of(bounds: &Aabb, random: &mut Rng) -> Vec3 {
    let half = bounds.min * 0.5 + bounds.max * 0.5;
    Vec3::from_array(std::array::from_fn(|axis| [bounds.min, bounds.max, half][random.below(3)][axis]))
}

/// Asks what lies in a box, in a ball, nearest to a point and on a ray, mostly about places of the model.
pub(crate) fn check_queries(index: &dyn SpatialIndex, boxes: &Boxes, random: &mut Rng, place: &str) {
    let room = Aabb::cube(Vec3::ZERO, 12.0);
    let all: Vec<Aabb> = boxes.values().copied().collect();
    let a_point = |random: &mut Rng| match all.get(random.below(all.len().max(1))) {
        Some(bounds) if random.below(4) > 0 => point_of(bounds, random),
        _ => [random.point(&room), Vec3::splat(-1.0e30)][usize::from(random.below(8) == 0)],
    };
    let mut found = vec![PolygonId(u32::MAX)];

    let at = a_point(random);
    let asked = match random.below(8) {
        0 => Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY),
        1 => {
            [Aabb::EMPTY, Aabb::new(Vec3::ONE, Vec3::ZERO), Aabb::new(Vec3::NAN, Vec3::ONE)][random.below(3)]
        }
        2 => Aabb::new(at, at),
        3 => Aabb::new(at, at + Vec3::ONE),
        _ => around(at, 10f32.powi(random.below(5) as i32 - 3)),
    };
    index.box_query(&asked, &mut found);
    assert_eq!(found.remove(0), PolygonId(u32::MAX), "{place}: a box query appends");
    assert_eq!(sorted(&found), those(boxes, |bounds| bounds.intersects(&asked)), "{place}: {asked:?}");

    let center = a_point(random);
    let radius_m = [0.0, 1.0e-3, 0.1, 2.0, 1.0e9, -1.0, f32::NAN][random.below(7)];
    let is_within = |bounds: &Aabb| radius_m >= 0.0 && bounds.distance_squared(center) <= radius_m * radius_m;
    let mut found = vec![PolygonId(u32::MAX)];
    let sphere = Sphere { center, radius_m };
    let work = index.sphere_query(&sphere, &mut |id| is_within(&boxes[&id]), &mut found);
    assert_eq!(found.remove(0), PolygonId(u32::MAX), "{place}: a sphere query appends");
    assert_eq!(work.reported, found.len() as u64, "{place}: {sphere:?}");
    assert_eq!(sorted(&found), those(boxes, is_within), "{place}: {sphere:?}");

    let count = [0, 1, 7, 40, 5000][random.below(5)];
    let distance_m = |bounds: &Aabb| bounds.distance_squared(center).sqrt();
    let mut expected: Vec<(PolygonId, f32)> = boxes.iter().map(|(&id, b)| (id, distance_m(b))).collect();
    expected.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    expected.truncate(count);
    let (mut nearest, mut asked) = (vec![(PolygonId(0), 0.0)], 0);
    let mut distance = |id: PolygonId| {
        asked += 1;
        distance_m(&boxes[&id])
    };
    index.nearest(center, count, &mut distance, &mut nearest);
    assert!(asked <= boxes.len(), "{place}: some were asked twice");
    // What is infinitely far is found as far as there is nothing nearer, in any order.
    let finite = expected.iter().take_while(|(_, distance_m)| distance_m.is_finite()).count();
    assert_eq!(nearest.len(), expected.len(), "{place}: {count} nearest to {center}");
    assert_eq!(nearest[..finite], expected[..finite], "{place}: {count} nearest to {center}");
    index.nearest(Vec3::NAN, 3, &mut |_| 0.0, &mut nearest);
    assert_eq!(nearest, [], "{place}: nearest to no place");

    for _ in 0..3 {
        let (origin, target) = (a_point(random), a_point(random));
        let part = [1.0f32, -1.0, 0.0, -0.0, 0.5, 1.0e-40, 3.0e38, f32::NAN];
        let direction = match random.below(3) {
            0 => Vec3::from_array(std::array::from_fn(|_| part[random.below(part.len())])),
            1 => [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)][random.below(4)],
            _ => target - origin,
        };
        let ray = Ray::new(origin, direction);
        check_ray(index, boxes, &ray, [f32::INFINITY, 0.7][random.below(2)], place);
    }
}

/// The box of a polygon is what the ray hits.
fn check_ray(index: &dyn SpatialIndex, boxes: &Boxes, ray: &Ray, t_max: f32, place: &str) {
    let place = format!("{place}, {ray:?} up to {t_max}");
    let hit = |id: PolygonId| ray.enter_box(&boxes[&id], t_max);
    let entered: Vec<(PolygonId, f32)> = boxes.keys().filter_map(|&id| hit(id).map(|t| (id, t))).collect();
    let first = entered.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    assert_eq!(index.ray_nearest(ray, t_max, &mut |id| hit(id)), first, "{place}");
    let mut yes = 0;
    let any = index.ray_any(ray, t_max, &mut |id| hit(id).inspect(|_| yes += 1));
    assert_eq!(any.is_some(), first.is_some(), "{place}: any");
    assert!(any.is_none_or(|any| entered.contains(&any)), "{place}: {any:?}");
    assert_eq!(yes, usize::from(any.is_some()), "{place}: asked again after a hit");
    // Each box that the ray enters is asked about, once.
    let mut asked = Vec::new();
    index.ray_nearest(ray, t_max, &mut |id| {
        asked.push(id);
        None
    });
    let all = sorted(&asked);
    assert!(all.windows(2).all(|w| w[0] < w[1]), "{place}: asked twice");
    let lost = entered.iter().find(|(id, _)| all.binary_search(id).is_err());
    assert_eq!(lost, None, "{place}: not asked about");
    let makes_sense = ray.origin.is_finite() && ray.direction.is_finite() && ray.direction != Vec3::ZERO;
    assert!(makes_sense || all.is_empty(), "{place}: it meets nothing");
}
