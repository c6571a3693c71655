//! Exercises 2 to 6, and the spheres of section 3.4, of the lecture notes "Scene Graphs and Spatial Data Structures" (document 000 of docs/seeds.md):
//! `cargo run -p osp-rivals --example exercises`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{
    glam::{Vec2, Vec3, vec2, vec3},
    index::{IndexConfig, IndexError, SpatialIndex},
    math::{Aabb, Containment, Frustum, Plane, Ray, Sphere},
    polygon::{ConvexPolygon, PolygonId},
};
use osp_rivals::{Bsp, BspConfig, BspNode, IndexKind, IndexSettings};
use osp_testkit::boxes::Rng;

/// Exercise 2: the corners of five triangles, metres.
const TRIANGLES: [[Vec3; 3]; 5] = [
    [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)],
    [vec3(2.0, 1.0, -1.0), vec3(3.0, 1.5, -1.0), vec3(2.5, 2.0, 0.5)],
    [vec3(-1.0, 2.0, 3.0), vec3(-2.0, 2.5, 3.0), vec3(-1.5, 4.0, 2.0)],
    [vec3(0.5, -3.0, 1.0), vec3(1.5, -2.0, 1.0), vec3(1.0, -2.5, 4.0)],
    [vec3(4.0, 0.0, -2.0), vec3(4.0, 1.0, -2.0), vec3(4.0, 0.0, -3.0)],
];

fn boxes_of(triangles: &[[Vec3; 3]]) -> Vec<Aabb> {
    triangles.iter().map(|corners| Aabb::from_points(corners)).collect()
}

fn box_around(boxes: &[Aabb]) -> Aabb {
    boxes.iter().fold(Aabb::EMPTY, |all, bounds| all.union(bounds))
}

/// Section 3.4, exercises 3 and 4: random spheres with their centres in a cube of 10 m.
fn spheres(count: usize) -> Vec<Sphere> {
    let (mut rng, room) = (Rng(42), Aabb::cube(Vec3::ZERO, 10.0));
    (0..count).map(|_| Sphere { center: rng.point(&room), radius_m: rng.range(0.3, 1.0) }).collect()
}

/// An index of the spheres' boxes with two in a leaf, as in the notes; sphere `i` has the id `i`.
fn index_of(kind: IndexKind, spheres: &[Sphere]) -> Result<Box<dyn SpatialIndex>, IndexError> {
    let settings = IndexSettings { leaf_capacity: Some(2), ..IndexSettings::default() };
    let mut index = kind.create_with(&IndexConfig::default(), &settings);
    for (id, sphere) in (0..).map(PolygonId).zip(spheres) {
        index.insert(id, &Aabb::cube(sphere.center, 2.0 * sphere.radius_m))?;
    }
    index.commit();
    Ok(index)
}

/// Where a ray meets a sphere, as a multiple of its direction.
fn meet_sphere(ray: &Ray, sphere: &Sphere) -> Option<f32> {
    let from = ray.origin - sphere.center;
    let (a, b) = (ray.direction.length_squared(), from.dot(ray.direction));
    let root = b * b - a * (from.length_squared() - sphere.radius_m * sphere.radius_m);
    let root = (root >= 0.0).then(|| root.sqrt())?;
    [-b - root, -b + root].into_iter().map(|t| t / a).find(|t| *t >= 0.0)
}

/// Distance of a point from a sphere, metres; 0 inside.
fn from_sphere_m(point: Vec3, sphere: &Sphere) -> f32 {
    (point.distance(sphere.center) - sphere.radius_m).max(0.0)
}

/// Rays from around the cube to points in it.
fn rays(count: usize) -> Vec<Ray> {
    let (mut rng, room) = (Rng(7), Aabb::cube(Vec3::ZERO, 10.0));
    let ray = |_| {
        let (from, to) = (rng.point(&room).normalize_or(Vec3::X) * 12.0, rng.point(&room));
        Ray::new(from, to - from)
    };
    (0..count).map(ray).collect()
}

/// Exercise 5: the planes of a view from the origin along -z, 90 degrees wide and high, from 1 to 10 m: left, right, bottom,
/// top, near and far.
fn planes() -> [Plane; 6] {
    let through = |z: f32, normal: Vec3| Plane::from_point_normal(Vec3::Z * z, normal);
    [
        through(0.0, vec3(1.0, 0.0, -1.0)),
        through(0.0, vec3(-1.0, 0.0, -1.0)),
        through(0.0, vec3(0.0, 1.0, -1.0)),
        through(0.0, vec3(0.0, -1.0, -1.0)),
        through(-1.0, Vec3::NEG_Z),
        through(-10.0, Vec3::Z),
    ]
}

/// Boxes in this view, across its border and beside it.
const BOXES: [(&str, Aabb); 5] = [
    ("in the middle", Aabb::new(vec3(-1.0, -1.0, -6.0), vec3(1.0, 1.0, -5.0))),
    ("across the near plane", Aabb::new(vec3(-0.2, -0.2, -1.5), vec3(0.2, 0.2, -0.5))),
    ("behind the eye", Aabb::new(vec3(-1.0, -1.0, 1.0), vec3(1.0, 1.0, 2.0))),
    ("to the right", Aabb::new(vec3(7.0, 0.0, -6.0), vec3(8.0, 1.0, -5.0))),
    // It lies outside, but behind no single plane, so it may be visible as far as the planes tell.
    ("round the far corner", Aabb::new(vec3(10.5, -1.0, -12.0), vec3(14.0, 1.0, -6.0))),
];

/// Whether a box lies outside six planes with normals inwards, inside, or intersects them.
fn place(planes: &[Plane; 6], bounds: &Aabb) -> Containment {
    Frustum::new(*planes).classify(bounds)
}

/// Exercise 6: a wall on a plan, metres; x goes to the right, and y of the plan is the z axis of the world.
struct Wall {
    name: char,
    middle: Vec2,
    /// Length 1.
    normal: Vec2,
    length_m: f32,
}

/// Wall e stands across wall a, so one of them is cut.
const WALLS: [Wall; 5] = [
    Wall { name: 'a', middle: vec2(0.0, 0.0), normal: vec2(0.0, 1.0), length_m: 6.0 },
    Wall { name: 'b', middle: vec2(-2.0, 2.0), normal: vec2(1.0, 0.0), length_m: 2.0 },
    Wall { name: 'c', middle: vec2(2.0, -2.0), normal: vec2(-1.0, 0.0), length_m: 2.0 },
    Wall { name: 'd', middle: vec2(2.0, 3.0), normal: vec2(-0.6, 0.8), length_m: 2.0 },
    Wall { name: 'e', middle: vec2(0.5, 0.0), normal: vec2(0.8, 0.6), length_m: 2.5 },
];

/// Two eyes on the plan, metres.
const EYES: [Vec2; 2] = [vec2(0.0, 6.0), vec2(-5.0, -4.0)];

/// Height of the eyes, metres. The walls are twice as high.
const EYE_HEIGHT_M: f32 = 1.25;

/// A point of the plan at a height, world space.
fn raised(at: Vec2, height_m: f32) -> Vec3 {
    vec3(at.x, height_m, at.y)
}

impl Wall {
    /// The wall as a vertical quad, world space, whose front is the side of the normal.
    fn quad(&self) -> ConvexPolygon {
        let half = vec2(self.normal.y, -self.normal.x) * (self.length_m * 0.5);
        let (from, to) = (self.middle - half, self.middle + half);
        let top_m = 2.0 * EYE_HEIGHT_M;
        ConvexPolygon::quad([raised(from, 0.0), raised(to, 0.0), raised(to, top_m), raised(from, top_m)])
    }
}

/// The tree of the walls; the polygon of wall `i` has the id `i`.
fn tree_of(walls: &[Wall]) -> Result<Bsp, IndexError> {
    let config = IndexConfig { capacity: walls.len(), ..IndexConfig::default() };
    let mut tree = Bsp::new(BspConfig::default(), &config);
    for (id, wall) in (0..).map(PolygonId).zip(walls) {
        let quad = wall.quad();
        tree.insert(id, &quad.bounds())?;
        tree.shape(id, &quad);
    }
    tree.commit();
    Ok(tree)
}

/// A part of a wall: the wall's id and the corners.
type Part = (PolygonId, Vec<Vec3>);

/// A part's name: that of its wall, with a number if the wall is cut. `all` has the parts of all walls.
fn name_of(part: &Part, all: &[Part]) -> String {
    let wall = WALLS[part.0.index()].name;
    let of_wall: Vec<_> = all.iter().filter(|other| other.0 == part.0).collect();
    match of_wall.iter().position(|other| *other == part) {
        Some(at) if of_wall.len() > 1 => format!("{wall}{}", at + 1),
        _ => wall.to_string(),
    }
}

/// All parts, nearest to the eye first.
fn front_to_back(tree: &Bsp, eye: Vec2) -> Vec<Part> {
    let mut parts = Vec::new();
    tree.front_to_back(raised(eye, EYE_HEIGHT_M), &mut |id, corners| parts.push((id, corners.to_vec())));
    parts
}

/// All parts, farthest from the eye first.
fn back_to_front(tree: &Bsp, eye: Vec2) -> Vec<Part> {
    let mut parts = Vec::new();
    tree.back_to_front(raised(eye, EYE_HEIGHT_M), &mut |id, corners| parts.push((id, corners.to_vec())));
    parts
}

/// The lines of a node and of all nodes below it. `side` is the node's place: `top`, `front` or `back`.
fn lines_of(node: BspNode<'_>, side: &str, depth: usize, all: &[Part]) -> Vec<String> {
    let own: Vec<_> = node.pieces().map(|(id, corners)| name_of(&(id, corners.to_vec()), all)).collect();
    let mut lines = vec![format!("{:1$}{side}: {2}", "", 2 * depth, own.join(", "))];
    for (side, below) in [("front", node.front()), ("back", node.back())] {
        lines.extend(below.into_iter().flat_map(|below| lines_of(below, side, depth + 1, all)));
    }
    lines
}

fn main() -> Result<(), IndexError> {
    println!("Exercise 2: boxes of five triangles");
    let boxes = boxes_of(&TRIANGLES);
    for (number, bounds) in (1..).zip(&boxes) {
        println!("  triangle {number}: from {} to {}", bounds.min, bounds.max);
    }
    let all = box_around(&boxes);
    println!("  all: from {} to {}", all.min, all.max);

    println!("Section 3.4: a ray among 20 spheres");
    let twenty = spheres(20);
    let ray = Ray::new([0.0, 0.0, 10.0], [0.0, 0.0, -1.0]);
    let index = index_of(IndexKind::BvhSah, &twenty)?;
    match index.ray_nearest(&ray, f32::INFINITY, &mut |id| meet_sphere(&ray, &twenty[id.index()])) {
        Some((id, t)) => println!("  meets the sphere at {} at t = {t:.3}", twenty[id.index()].center),
        None => println!("  meets none"),
    }

    println!("Exercise 3: spheres that each of 1,000 rays tests among 1,000");
    let thousand = spheres(1000);
    for kind in [IndexKind::BvhMidpoint, IndexKind::BvhSah] {
        let (index, mut tests) = (index_of(kind, &thousand)?, 0);
        for ray in rays(1000) {
            index.ray_nearest(&ray, f32::INFINITY, &mut |id| {
                tests += 1;
                meet_sphere(&ray, &thousand[id.index()])
            });
        }
        println!("  {}: {:.1}", kind.name(), f64::from(tests) / 1000.0);
    }

    println!("Exercise 4: the nearest of 100 spheres in an octree, from the middle");
    let (hundred, mut near) = (spheres(100), Vec::new());
    let octree = index_of(IndexKind::OctreeRebuild, &hundred)?;
    octree.nearest(Vec3::ZERO, 3, &mut |id| from_sphere_m(Vec3::ZERO, &hundred[id.index()]), &mut near);
    for (id, distance_m) in near {
        println!("  the sphere at {}: {distance_m:.3} m", hundred[id.index()].center);
    }

    println!("Exercise 5: boxes and the six planes of a view");
    for (name, bounds) in &BOXES {
        println!("  {name}: {:?}", place(&planes(), bounds));
    }

    println!("Exercise 6: a BSP tree of five walls");
    let tree = tree_of(&WALLS)?;
    let all = back_to_front(&tree, EYES[0]);
    let lines = tree.top().map(|top| lines_of(top, "top", 1, &all));
    lines.into_iter().flatten().for_each(|line| println!("{line}"));
    for eye in EYES {
        let names =
            |parts: Vec<Part>| parts.iter().map(|part| name_of(part, &all)).collect::<Vec<_>>().join(" ");
        println!("  from {eye}, front to back: {}", names(front_to_back(&tree, eye)));
        println!("  from {eye}, back to front: {}", names(back_to_front(&tree, eye)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_and_points_find_the_nearest_spheres() {
        let spheres = spheres(100);
        let order = |a: &(PolygonId, f32), b: &(PolygonId, f32)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
        let all = || (0..).map(PolygonId).zip(&spheres);
        let mut hits = 0;
        for kind in [IndexKind::BvhMidpoint, IndexKind::BvhSah, IndexKind::OctreeRebuild] {
            let (index, mut near) = (index_of(kind, &spheres).expect("finite boxes"), Vec::new());
            for ray in rays(200) {
                let hit = &mut |id: PolygonId| meet_sphere(&ray, &spheres[id.index()]);
                let met =
                    all().filter_map(|(id, sphere)| Some((id, meet_sphere(&ray, sphere)?))).min_by(order);
                assert_eq!(index.ray_nearest(&ray, f32::INFINITY, hit), met);
                hits += u32::from(met.is_some());
                let from = ray.origin + ray.direction * 0.7;
                index.nearest(from, 3, &mut |id| from_sphere_m(from, &spheres[id.index()]), &mut near);
                let mut far: Vec<_> = all().map(|(id, sphere)| (id, from_sphere_m(from, sphere))).collect();
                far.sort_by(order);
                assert_eq!(near, far[..3]);
            }
        }
        assert!((200..550).contains(&hits), "{hits} of 600 rays hit");
    }

    #[test]
    fn a_box_reaches_exactly_as_far_as_its_corners() {
        let check = |bounds: &Aabb, corners: &[Vec3]| {
            for axis in 0..3 {
                let mut along: Vec<f32> = corners.iter().map(|corner| corner[axis]).collect();
                along.sort_by(f32::total_cmp);
                assert_eq!((bounds.min[axis], bounds.max[axis]), (along[0], along[along.len() - 1]));
            }
        };
        let boxes = boxes_of(&TRIANGLES);
        assert_eq!(boxes.len(), 5);
        boxes.iter().zip(&TRIANGLES).for_each(|(bounds, corners)| check(bounds, corners));
        check(&box_around(&boxes), TRIANGLES.as_flattened());
    }

    #[test]
    fn the_place_of_a_box_is_that_of_its_corners() {
        let planes = planes();
        use Containment::{Inside, Intersects, Outside};
        let expected = |bounds: &Aabb| {
            let corners = bounds.corners();
            let is_behind = |plane: &Plane, corner: &Vec3| plane.signed_distance(*corner) < 0.0;
            if planes.iter().any(|plane| corners.iter().all(|corner| is_behind(plane, corner))) {
                Outside
            } else if planes.iter().any(|plane| corners.iter().any(|corner| is_behind(plane, corner))) {
                Intersects
            } else {
                Inside
            }
        };
        let shown = BOXES.map(|(_, bounds)| place(&planes, &bounds));
        assert_eq!(shown, [Inside, Intersects, Outside, Outside, Intersects]);
        let mut rng = Rng(5);
        let mut counts = [0; 3];
        for _ in 0..2000 {
            let bounds = Aabb::cube(rng.point(&Aabb::cube(vec3(0.0, 0.0, -5.0), 16.0)), rng.range(0.1, 4.0));
            assert_eq!(place(&planes, &bounds), expected(&bounds), "{bounds:?}");
            counts[expected(&bounds) as usize] += 1;
        }
        assert!(counts.iter().all(|&count| count > 50), "{counts:?}");
    }

    fn hit_m(ray: &Ray, corners: &[Vec3]) -> Option<f32> {
        corners.windows(2).skip(1).find_map(|pair| ray.meet_triangle([corners[0], pair[0], pair[1]]))
    }

    #[test]
    fn walls_come_in_the_order_in_which_rays_meet_them() {
        let tree = tree_of(&WALLS).expect("finite walls");
        assert_eq!((tree.counts().pieces, tree.counts().unordered), (6, 0), "one wall is cut");
        let mut orders = Vec::new();
        for eye in EYES {
            let parts = front_to_back(&tree, eye);
            let mut reversed = back_to_front(&tree, eye);
            reversed.reverse();
            assert_eq!(parts, reversed);
            let mut pairs = 0;
            for step in 0..720 {
                let direction = Vec2::from_angle(step as f32 / 720.0 * std::f32::consts::TAU);
                let ray = Ray::new(raised(eye, EYE_HEIGHT_M), raised(direction, 0.0));
                let met: Vec<f32> = parts.iter().filter_map(|(_, corners)| hit_m(&ray, corners)).collect();
                for pair in met.windows(2) {
                    assert!(pair[0] <= pair[1] + 1.0e-4, "{met:?} from {eye} along {direction}");
                    pairs += 1;
                }
            }
            assert!(pairs > 20, "only {pairs} pairs were compared from {eye}");
            orders.push(parts);
        }
        assert_ne!(orders[0], orders[1], "the order depends on the eye");
    }

    /// Checks that all pieces below a node lie on the node's sides, and returns their number.
    fn check_sides(node: BspNode<'_>) -> usize {
        let mut count = node.pieces().count();
        let wall = node.pieces().next().map(|(id, _)| &WALLS[id.index()]).expect("each node has a wall");
        for (sign, below) in [(1.0, node.front()), (-1.0, node.back())] {
            let Some(below) = below else { continue };
            let mut waiting = vec![below];
            while let Some(node) = waiting.pop() {
                for corner in node.pieces().flat_map(|(_, corners)| corners) {
                    let distance_m = (vec2(corner.x, corner.z) - wall.middle).dot(wall.normal);
                    assert!(sign * distance_m >= -1.0e-4, "{corner} is on the wrong side of {}", wall.name);
                }
                waiting.extend(node.front().into_iter().chain(node.back()));
            }
            count += check_sides(below);
        }
        count
    }

    #[test]
    fn each_node_has_the_walls_in_front_of_it_and_behind_it_on_these_sides() {
        let tree = tree_of(&WALLS).expect("finite walls");
        let top = tree.top().expect("a tree of five walls");
        assert_eq!(check_sides(top), tree.counts().pieces);
        let all = back_to_front(&tree, EYES[0]);
        let mut names: Vec<_> = all.iter().map(|part| name_of(part, &all)).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 6, "each part has a name of its own: {names:?}");
        assert_eq!(lines_of(top, "top", 0, &all).len(), tree.counts().nodes);
        assert!(tree_of(&[]).expect("no walls").top().is_none());
    }
}
