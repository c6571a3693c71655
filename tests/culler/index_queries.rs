//! Box and ray queries of every index against the plainest code.

mod bsp;
pub(crate) mod own;
mod rays;

use glam::Vec3;
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray, Sphere},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;
use osp_testkit::boxes::{Rng, drawn, root};

/// A session with gaps (some polygons are erased) in every index.
fn filled(boxes: &[Aabb]) -> Vec<Box<dyn SpatialIndex>> {
    let mut indexes = whole(boxes);
    for index in &mut indexes {
        for i in (0..boxes.len()).filter(|&i| is_erased(i)) {
            index.remove(PolygonId(i as u32)).expect("it is inserted");
        }
        index.commit();
    }
    indexes
}

/// All of these boxes in every index.
fn whole(boxes: &[Aabb]) -> Vec<Box<dyn SpatialIndex>> {
    let fill = |kind: &IndexKind| {
        let mut index = kind.create(&IndexConfig { root: root(), capacity: boxes.len() });
        insert_all(&mut *index, boxes);
        index
    };
    IndexKind::ALL.iter().map(fill).collect()
}

fn insert_all(index: &mut dyn SpatialIndex, boxes: &[Aabb]) {
    for (i, bounds) in boxes.iter().enumerate() {
        index.insert(PolygonId(i as u32), bounds).expect("a good box");
    }
    index.commit();
}

fn is_erased(i: usize) -> bool {
    i % 7 == 3
}

fn mixed(count: usize) -> Vec<Aabb> {
    let mut boxes = drawn(count, 9);
    let mut rng = Rng(10);
    for bounds in boxes.iter_mut().step_by(10) {
        let center = rng.point(&Aabb::cube(Vec3::ZERO, 12.0));
        *bounds = Aabb::cube(center, 10f32.powi(rng.below(5) as i32 - 3));
    }
    boxes
}

#[test]
fn box_queries_find_what_touches() {
    let boxes = mixed(3000);
    let indexes = filled(&boxes);
    let mut rng = Rng(11);
    let mut asked: Vec<Aabb> = (0..40)
        .map(|_| Aabb::cube(rng.point(&Aabb::cube(Vec3::ZERO, 10.0)), 10f32.powi(rng.below(5) as i32 - 3)))
        .collect();
    // Touching at a face, a single point, everything, nothing, an unordered box, not a number.
    asked.push(Aabb::new(boxes[5].max, boxes[5].max + Vec3::ONE));
    asked.push(Aabb::new(boxes[6].min, boxes[6].min));
    asked.push(Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY));
    asked.push(Aabb::EMPTY);
    asked.push(Aabb::new(Vec3::ONE, Vec3::ZERO));
    asked.push(Aabb::new(Vec3::NAN, Vec3::ONE));
    for bounds in &asked {
        let inserted = boxes.iter().enumerate().filter(|&(i, b)| !is_erased(i) && b.intersects(bounds));
        let expected: Vec<u32> = inserted.map(|(i, _)| i as u32).collect();
        for index in &indexes {
            let mut found = vec![PolygonId(u32::MAX)];
            index.box_query(bounds, &mut found);
            assert_eq!(found.remove(0), PolygonId(u32::MAX), "{}: it appends", index.name());
            let mut found: Vec<u32> = found.iter().map(|id| id.0).collect();
            found.sort_unstable();
            assert_eq!(found, expected, "{}: {bounds:?}", index.name());
        }
    }
}

/// Stands for the exact polygon test: the ray meets the middle plate of the box.
fn plate(ray: &Ray, bounds: &Aabb) -> Option<f32> {
    let z = bounds.center().z;
    let t = (z - ray.origin.z) / ray.direction.z;
    let p = ray.origin + ray.direction * t;
    let inside = p.x >= bounds.min.x && p.x <= bounds.max.x && p.y >= bounds.min.y && p.y <= bounds.max.y;
    (t >= 0.0 && inside).then_some(t)
}

#[test]
fn rays_find_the_nearest_polygon() {
    let mut boxes = mixed(3000);
    // Two coincident polygons: the lower id wins.
    boxes[2990] = Aabb::cube(Vec3::new(0.0, 0.0, 5.5), 1.0);
    boxes[2992] = boxes[2990];
    let indexes = filled(&boxes);
    let mut rng = Rng(12);
    let mut rays: Vec<(Ray, f32)> = (0..200)
        .map(|_| {
            let origin = rng.point(&Aabb::cube(Vec3::ZERO, 8.0));
            let target = boxes[rng.below(boxes.len())].center();
            (Ray::new(origin, target - origin), if rng.below(3) == 0 { 0.7 } else { f32::INFINITY })
        })
        .collect();
    rays.push((Ray::new(Vec3::new(0.0, 0.0, 9.0), Vec3::NEG_Z), f32::INFINITY));
    rays.push((Ray::new(Vec3::splat(100.0), Vec3::X), f32::INFINITY));
    let mut hits = 0;
    for (ray, t_max) in &rays {
        let mut expected: Option<(PolygonId, f32)> = None;
        for (i, bounds) in boxes.iter().enumerate().filter(|&(i, _)| !is_erased(i)) {
            match plate(ray, bounds) {
                Some(t) if t <= *t_max && expected.is_none_or(|(_, best)| t < best) => {
                    expected = Some((PolygonId(i as u32), t));
                }
                _ => {}
            }
        }
        hits += usize::from(expected.is_some());
        for index in &indexes {
            let mut asked = Vec::new();
            let mut hit = |id: PolygonId| {
                asked.push(id);
                plate(ray, &boxes[id.index()])
            };
            let found = index.ray_nearest(ray, *t_max, &mut hit);
            assert_eq!(found, expected, "{}: {ray:?}", index.name());
            let mut yes = 0;
            let any = index.ray_any(ray, *t_max, &mut |id| {
                let t = plate(ray, &boxes[id.index()]);
                yes += usize::from(t.is_some_and(|t| t <= *t_max));
                t
            });
            assert_eq!(any.is_some(), expected.is_some(), "{}: {ray:?}", index.name());
            assert_eq!(yes, usize::from(any.is_some()), "{}: asked again after a hit", index.name());
            if let Some((id, t)) = any {
                assert_eq!(plate(ray, &boxes[id.index()]), Some(t), "{}", index.name());
                assert!(!is_erased(id.index()), "{}", index.name());
            }
            let all = asked.len();
            asked.sort_unstable();
            asked.dedup();
            assert_eq!(asked.len(), all, "{}: a polygon was asked twice", index.name());
        }
    }
    assert!(hits > 100, "only {hits} rays hit: the test tests nothing");
}

/// The inserted polygons with the distances of their boxes from a point, the nearest first.
fn by_distance(boxes: &[Aabb], point: Vec3) -> Vec<(PolygonId, f32)> {
    let inserted = boxes.iter().enumerate().filter(|&(i, _)| !is_erased(i));
    let mut all: Vec<(PolygonId, f32)> =
        inserted.map(|(i, b)| (PolygonId(i as u32), b.distance_squared(point).sqrt())).collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    all
}

#[test]
fn spheres_and_nearest_polygons_are_found() {
    let mut boxes = mixed(3000);
    // The same distance from everywhere: the lower ids come first.
    for i in 100..110 {
        boxes[i] = boxes[100];
    }
    let indexes = filled(&boxes);
    let mut rng = Rng(13);
    let mut points: Vec<Vec3> = (0..60).map(|_| rng.point(&Aabb::cube(Vec3::ZERO, 12.0))).collect();
    points.extend([boxes[100].center(), Vec3::splat(1.0e6), Vec3::splat(-1.0e30)]);
    let mut found_some = 0;
    for point in points {
        let all = by_distance(&boxes, point);
        for radius_m in [0.0, 1.0e-3, 0.1, 2.0, 1.0e9] {
            let within = |b: &Aabb| b.distance_squared(point) <= radius_m * radius_m;
            let mut expected: Vec<PolygonId> =
                all.iter().map(|&(id, _)| id).filter(|id| within(&boxes[id.index()])).collect();
            expected.sort_unstable();
            found_some += usize::from(expected.len() > 2 && expected.len() < all.len());
            for index in &indexes {
                let mut found = vec![PolygonId(u32::MAX)];
                let sphere = Sphere { center: point, radius_m };
                let work = index.sphere_query(&sphere, &mut |id| within(&boxes[id.index()]), &mut found);
                assert_eq!(found.remove(0), PolygonId(u32::MAX), "{}: it appends", index.name());
                assert_eq!(work.reported, found.len() as u64, "{}", index.name());
                found.sort_unstable();
                assert_eq!(found, expected, "{}: {sphere:?}", index.name());
            }
        }
        for count in [0, 1, 7, 40, 5000] {
            let expected = &all[..count.min(all.len())];
            for index in &indexes {
                let mut found = vec![(PolygonId(0), 0.0)];
                let mut asked = 0;
                let mut distance = |id: PolygonId| {
                    asked += 1;
                    boxes[id.index()].distance_squared(point).sqrt()
                };
                index.nearest(point, count, &mut distance, &mut found);
                assert_eq!(found, expected, "{}: {count} nearest to {point}", index.name());
                assert!(asked <= all.len(), "{}: some were asked twice", index.name());
                // Best first: only what lies around the point is asked about (from afar all is equally near).
                let is_best_first = index.name() == "bvh-sah" && point.length() < 100.0;
                assert!(!is_best_first || asked <= 8 * count + 100, "{asked} asked for {count} at {point}");
            }
        }
    }
    assert!(found_some > 30, "only {found_some} spheres held something, but not all");
    for index in &indexes {
        let (mut none, mut nearest) = (Vec::new(), vec![(PolygonId(0), 0.0)]);
        for radius_m in [-1.0, f32::NAN] {
            index.sphere_query(&Sphere { center: Vec3::ZERO, radius_m }, &mut |_| true, &mut none);
        }
        index.nearest(Vec3::NAN, 3, &mut |_| 0.0, &mut nearest);
        assert!(none.is_empty() && nearest.is_empty(), "{}", index.name());
    }
}

/// An index that nothing was inserted in, one that everything has left, one with a single polygon: every query has an
/// answer.
/// Their distances are larger than any number.
#[test]
fn what_is_infinitely_far_is_found_as_far_as_there_is_nothing_nearer() {
    let boxes: Vec<Aabb> = (0..400)
        .map(|i| Aabb::cube(Vec3::new(if i % 2 == 0 { 2.0e38 } else { -2.0e38 }, i as f32, 2.0e38), 1.0))
        .chain([Aabb::cube(Vec3::ONE, 1.0)])
        .collect();
    for index in filled(&boxes) {
        let mut found = Vec::new();
        index.nearest(Vec3::ZERO, 1000, &mut |id| if id.0 < 400 { f32::INFINITY } else { 1.0 }, &mut found);
        let there = (0..boxes.len()).filter(|&i| !is_erased(i)).count();
        assert_eq!(found.len(), there, "{}", index.name());
    }
}

#[test]
fn indexes_with_nothing_in_them_can_be_asked() {
    let ray = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z);
    for kind in IndexKind::ALL {
        for (inserted, left) in [(0, 0), (40, 0), (1, 1)] {
            let mut index = kind.create(&IndexConfig { root: root(), capacity: 0 });
            for i in 0..inserted {
                index.insert(PolygonId(i), &Aabb::cube(Vec3::ZERO, 0.1)).expect("a good box");
            }
            for i in left..inserted {
                index.remove(PolygonId(i)).expect("it is inserted");
            }
            let found = |id: Option<(PolygonId, f32)>| usize::from(id.is_some());
            // Before and after the commit of the frame.
            for committed in [false, true] {
                if committed {
                    index.commit();
                }
                let name = format!("{}, {left} of {inserted}, committed {committed}", kind.name());
                let mut hit = |_: PolygonId| Some(4.95);
                let counts = [
                    found(index.ray_nearest(&ray, f32::MAX, &mut hit)),
                    found(index.ray_any(&ray, f32::MAX, &mut hit)),
                ];
                if committed {
                    assert_eq!(counts, [left as usize; 2], "{name}");
                }
                let (mut ids, mut near) = (Vec::new(), Vec::new());
                index.box_query(&Aabb::cube(Vec3::ZERO, 2.0), &mut ids);
                index.nearest(Vec3::ONE, 3, &mut |_| 1.0, &mut near);
                if committed {
                    assert_eq!((ids.len(), near.len()), (left as usize, left as usize), "{name}");
                }
            }
        }
    }
}
