//! Box and ray queries of every index against the plainest code.

#[path = "support/boxes.rs"]
mod boxes;

use boxes::{Rng, drawn, root};
use glam::Vec3;
use osp::{
    index::{IndexConfig, IndexKind, SpatialIndex},
    math::{Aabb, Ray},
    scene::PolygonId,
};

/// A session with gaps (some polygons are erased) in every index.
fn filled(boxes: &[Aabb]) -> Vec<Box<dyn SpatialIndex>> {
    let fill = |kind: &IndexKind| {
        let mut index = kind.create(&IndexConfig { root: root(), capacity: boxes.len() });
        for (i, bounds) in boxes.iter().enumerate() {
            index.insert(PolygonId(i as u32), bounds).expect("a good box");
        }
        for i in (0..boxes.len()).filter(|&i| is_erased(i)) {
            index.remove(PolygonId(i as u32)).expect("it is filed");
        }
        index.commit();
        index
    };
    IndexKind::ALL.iter().map(fill).collect()
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
        let filed = boxes.iter().enumerate().filter(|&(i, b)| !is_erased(i) && b.intersects(bounds));
        let expected: Vec<u32> = filed.map(|(i, _)| i as u32).collect();
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
            let all = asked.len();
            asked.sort_unstable();
            asked.dedup();
            assert_eq!(asked.len(), all, "{}: a polygon was asked twice", index.name());
        }
    }
    assert!(hits > 100, "only {hits} rays hit: the test tests nothing");
}
