//! Compares groups that move with a list of every polygon of every node.

use osp::{
    glam::{Affine3A, DAffine3, DMat3, Quat, Vec3},
    math::{Aabb, Frustum},
    polygon::PolygonId,
    view::{Projection, View},
};
use osp_rivals::groups::{CullScratch, GroupError, GroupIndex, MeshId, NodeId, Polygons};
use osp_testkit::Random;

fn point(random: &mut Random, reach: f32) -> Vec3 {
    random.in_cube().as_vec3() * reach
}

fn transform(random: &mut Random, reach: f32) -> Affine3A {
    let scale = random.range(0.3, 2.0) as f32;
    let turn = Quat::from_vec4(point(random, 1.0).extend(0.3)).normalize();
    Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, point(random, reach))
}

fn small_box(random: &mut Random) -> Aabb {
    let (at, half) = (point(random, 1.0), point(random, 0.05).abs());
    Aabb { min: at - half, max: at + half }
}

/// The same world as lists.
#[derive(Default)]
struct Model {
    meshes: Vec<Vec<Option<Aabb>>>,
    nodes: Vec<(Option<usize>, Affine3A, Option<usize>)>,
}

impl Model {
    /// The product of the matrices in the index's order, from the top down.
    fn world(&self, node: usize) -> Affine3A {
        let (parent, to_parent, _) = self.nodes[node];
        parent.map_or(Affine3A::IDENTITY, |parent| self.world(parent)) * to_parent
    }

    fn is_below(&self, node: usize, above: usize) -> bool {
        node == above || self.nodes[node].0.is_some_and(|parent| self.is_below(parent, above))
    }
}

fn exactly(world: &Affine3A) -> DAffine3 {
    let of = |v| Vec3::from(v).as_dvec3();
    let m = world.matrix3;
    let matrix3 = DMat3::from_cols(of(m.x_axis), of(m.y_axis), of(m.z_axis));
    DAffine3 { matrix3, translation: of(world.translation) }
}

/// Of all planes, the least distance by which the best corner of a box lies inside, metres.
fn inside_m(frustum: &Frustum, world: &DAffine3, bounds: &Aabb) -> f64 {
    let corners = bounds.corners().map(|p| world.transform_point3(p.as_dvec3()));
    let of_plane = |plane: &osp::math::Plane| {
        corners
            .iter()
            .map(|p| plane.normal.as_dvec3().dot(*p) + f64::from(plane.d))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    frustum.planes().iter().map(of_plane).fold(f64::INFINITY, f64::min)
}

fn culled(index: &GroupIndex, frustum: &Frustum, model: &Model, scratch: &mut CullScratch) -> Vec<Vec<bool>> {
    let mut seen: Vec<Vec<bool>> = model
        .nodes
        .iter()
        .map(|(.., mesh)| vec![false; mesh.map_or(0, |mesh| model.meshes[mesh].len())])
        .collect();
    index.frustum_cull(frustum, scratch, |found| {
        let (_, _, mesh) = model.nodes[found.node.0 as usize];
        assert_eq!(mesh, Some(found.mesh.0 as usize));
        assert_eq!(*found.world_from_mesh, model.world(found.node.0 as usize));
        let of = &mut seen[found.node.0 as usize];
        match found.polygons {
            Polygons::All => {
                of.iter_mut().zip(&model.meshes[found.mesh.0 as usize]).for_each(|(seen, inserted)| {
                    assert!(!*seen, "handed out twice");
                    *seen = inserted.is_some();
                })
            }
            Polygons::Some(set) => set.ids().for_each(|id| {
                assert!(!std::mem::replace(&mut of[id.index()], true), "handed out twice");
            }),
        }
    });
    seen
}

#[test]
fn what_is_in_view_is_found_wherever_groups_are_moved() {
    let mut random = Random::new(9);
    let (mut polygons, mut visible, mut reported, mut whole) = (0u64, 0u64, 0u64, 0u64);
    for round in 0..40 {
        let mut index = GroupIndex::default();
        let mut model = Model::default();
        let mut scratch = CullScratch::default();
        for _ in 0..3 {
            let mesh = index.add_mesh();
            // A mesh is a list if it is small, otherwise a tree.
            let count = if random.below(3) == 0 { 700 } else { random.below(30) };
            model.meshes.push((0..count).map(|_| Some(small_box(&mut random))).collect());
            for (bounds, number) in model.meshes[mesh.0 as usize].iter().zip(0..) {
                index.set_polygon(mesh, PolygonId(number), bounds.as_ref()).expect("a sound box");
            }
        }
        for step in 0..60 {
            let to = transform(&mut random, if round % 2 == 0 { 3.0 } else { 40.0 });
            match (model.nodes.len(), random.below(6)) {
                (0..5, _) | (5..20, 0 | 1) => {
                    let parent = (!model.nodes.is_empty() && random.below(3) > 0)
                        .then(|| random.below(model.nodes.len()));
                    let mesh = (random.below(4) > 0).then(|| random.below(3));
                    let (below, shows) = (parent.map(|i| NodeId(i as u32)), mesh.map(|i| MeshId(i as u32)));
                    let node = index.add_node(below, to, shows);
                    assert_eq!(node, Ok(NodeId(model.nodes.len() as u32)));
                    model.nodes.push((parent, to, mesh));
                }
                (count, 2) => {
                    let (node, parent) = (random.below(count), random.below(count + 1));
                    let parent = (parent < count).then_some(parent);
                    let hung = index.set_parent(NodeId(node as u32), parent.map(|at| NodeId(at as u32)));
                    let is_ring = parent.is_some_and(|parent| model.is_below(parent, node));
                    let ring = Err(GroupError::Ring(NodeId(node as u32)));
                    assert_eq!(hung, if is_ring { ring } else { Ok(()) });
                    if !is_ring {
                        model.nodes[node].0 = parent;
                    }
                }
                (_, 3) => {
                    let mesh = random.below(3);
                    let inserted = &mut model.meshes[mesh];
                    if !inserted.is_empty() {
                        let id = random.below(inserted.len());
                        let bounds = (random.below(2) == 0).then(|| small_box(&mut random));
                        let outcome =
                            index.set_polygon(MeshId(mesh as u32), PolygonId(id as u32), bounds.as_ref());
                        assert_eq!(outcome.is_err(), bounds.is_none() && inserted[id].is_none());
                        inserted[id] = bounds;
                    }
                }
                (count, _) => {
                    let node = random.below(count);
                    index.place(NodeId(node as u32), to).expect("a sound transform");
                    model.nodes[node].1 = to;
                }
            }
            if step % 4 != 3 {
                continue;
            }
            index.commit();
            let projection = Projection::symmetric(random.range(25.0, 90.0) as f32, 1.3, 0.05, 60.0);
            let (eye, target) = (point(&mut random, 6.0), point(&mut random, 3.0));
            let frustum = View::look_at(eye, target, projection).frustum();
            let seen = culled(&index, &frustum, &model, &mut scratch);
            for (node, seen) in seen.iter().enumerate() {
                let world = exactly(&model.world(node));
                let Some(mesh) = model.nodes[node].2 else { continue };
                let whole_bounds = index.bounds(NodeId(node as u32)).expect("a node");
                for (bounds, &is_seen) in model.meshes[mesh].iter().zip(seen) {
                    let Some(bounds) = bounds else {
                        assert!(!is_seen, "a polygon that was taken out");
                        continue;
                    };
                    polygons += 1;
                    reported += u64::from(is_seen);
                    let in_view_m = inside_m(&frustum, &world, bounds);
                    for corner in bounds.corners().map(|p| world.transform_point3(p.as_dvec3())) {
                        let is_in = |axis: usize| {
                            f64::from(whole_bounds.min[axis]) <= corner[axis]
                                && corner[axis] <= f64::from(whole_bounds.max[axis])
                        };
                        assert!((0..3).all(is_in), "{corner} beside the box of its node");
                        let behind = |plane: &osp::math::Plane| {
                            plane.normal.as_dvec3().dot(corner) + f64::from(plane.d) < 0.0
                        };
                        if !frustum.planes().iter().any(behind) {
                            visible += 1;
                            assert!(is_seen, "node {node}: a corner in view is culled");
                        }
                    }
                    // Except for rounding, the index finds no more than a list of all boxes in their own spaces.
                    let is_right = is_seen == (in_view_m >= 0.0) || in_view_m.abs() < 1.0e-3;
                    assert!(is_right, "node {node}: {in_view_m} m");
                }
                whole += u64::from(seen.iter().all(|&is_seen| is_seen));
            }
        }
    }
    assert!(reported * 20 > polygons && reported < polygons, "{reported} of {polygons}");
    assert!(visible > 10_000 && whole > 100, "{visible} {whole}");
}

fn tile(at: usize) -> Aabb {
    let min = Vec3::new((at % 100) as f32, 0.0, (at / 100) as f32);
    Aabb { min, max: min + Vec3::new(1.0, 0.1, 1.0) }
}

fn tiled() -> (GroupIndex, MeshId) {
    let mut index = GroupIndex::default();
    let mesh = index.add_mesh();
    for number in 0..10_000 {
        index.set_polygon(mesh, PolygonId(number), Some(&tile(number as usize))).expect("a sound box");
    }
    (index, mesh)
}

#[test]
fn a_group_that_moves_costs_its_nodes() {
    let (mut index, mesh) = tiled();
    let at = |x: f32| Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
    let top = index.add_node(None, at(0.0), None).expect("a node");
    let mut nodes = vec![top];
    for number in 1..=100 {
        let parent = nodes[(number - 1) / 10];
        nodes.push(index.add_node(Some(parent), at(number as f32), Some(mesh)).expect("a node"));
    }
    // This tree does not move.
    index.add_node(None, at(-500.0), Some(mesh)).expect("a node");
    index.commit();
    assert_eq!(index.polygon_count(), 10_000, "shown 101 times, inserted once");
    let mut since = index.work();
    let mut cost = |index: &mut GroupIndex| {
        index.commit();
        let (before, now) = (std::mem::replace(&mut since, index.work()), index.work());
        (now.matrices - before.matrices, now.boxes - before.boxes, now.entries - before.entries)
    };
    index.place(top, at(7.0)).expect("a node");
    assert_eq!(cost(&mut index), (101, 101, 1), "the whole tree");
    index.place(nodes[100], at(8.0)).expect("a node");
    // One matrix changes, and three boxes: the leaf's and those of its two ancestors.
    assert_eq!(cost(&mut index), (1, 3, 1), "one leaf");
    for x in 0..50 {
        index.place(nodes[10], at(x as f32)).expect("a node");
    }
    assert_eq!(cost(&mut index).0, 1, "placed fifty times between two frames");
    assert_eq!(cost(&mut index), (0, 0, 0), "nothing has changed");
    assert_eq!(index.world_from_node(nodes[100]).expect("a node").translation.x, 7.0 + 9.0 + 8.0);
}

#[test]
fn a_group_out_of_view_costs_one_test_and_one_in_view_none_for_its_polygons() {
    let (mut index, mesh) = tiled();
    let top = index.add_node(None, Affine3A::IDENTITY, None).expect("a node");
    for _ in 0..50 {
        index.add_node(Some(top), Affine3A::IDENTITY, Some(mesh)).expect("a node");
    }
    index.commit();
    let mut scratch = CullScratch::default();
    let cull = |from: Vec3, towards: Vec3, scratch: &mut CullScratch| {
        let frustum = View::look_at(from, towards, Projection::symmetric(70.0, 1.0, 0.1, 1000.0)).frustum();
        index.frustum_cull(&frustum, scratch, |_| ())
    };
    let away = cull(Vec3::new(0.0, 10.0, 0.0), Vec3::new(0.0, 20.0, 0.0), &mut scratch);
    assert!(away.reported == 0 && away.boxes <= 2, "{away:?}");
    let above = cull(Vec3::new(50.0, 300.0, 50.0), Vec3::new(50.0, 0.0, 50.0), &mut scratch);
    assert_eq!((above.reported, above.taken_whole), (500_000, 500_000));
    assert!(above.boxes < 5, "{above:?}");
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let mut index = GroupIndex::default();
    let (mesh, no_mesh, no_node) = (index.add_mesh(), MeshId(5), NodeId(9));
    let here = Affine3A::IDENTITY;
    let top = index.add_node(None, here, Some(mesh)).expect("a node");
    let below = index.add_node(Some(top), here, None).expect("a node");
    let nowhere = Affine3A::from_translation(Vec3::NAN);
    assert_eq!(index.add_node(None, here, Some(no_mesh)), Err(GroupError::NoMesh(no_mesh)));
    assert_eq!(index.add_node(Some(no_node), here, None), Err(GroupError::NoNode(no_node)));
    assert_eq!(index.add_node(None, nowhere, None), Err(GroupError::NotFinite(NodeId(2))));
    assert_eq!(index.place(below, nowhere), Err(GroupError::NotFinite(below)));
    assert_eq!(index.place(no_node, here), Err(GroupError::NoNode(no_node)));
    assert_eq!(index.set_parent(top, Some(below)), Err(GroupError::Ring(top)));
    assert_eq!(index.set_parent(top, Some(top)), Err(GroupError::Ring(top)));
    assert_eq!(index.bounds(no_node), Err(GroupError::NoNode(no_node)));
    let empty = Aabb::EMPTY;
    assert!(matches!(index.set_polygon(mesh, PolygonId(0), Some(&empty)), Err(GroupError::Index(..))));
    assert!(matches!(index.set_polygon(mesh, PolygonId(0), None), Err(GroupError::Index(..))));
    index.set_polygon(mesh, PolygonId(0), Some(&tile(0))).expect("a sound box");
    index.commit();
    assert!(index.bounds(top).expect("a node").contains(&tile(0)));
    // Together the two scales exceed `f32`. A box at infinity is left out without an error.
    let far = Affine3A::from_translation(Vec3::splat(f32::MAX));
    index.place(top, far * Affine3A::from_scale(Vec3::splat(f32::MAX))).expect("finite numbers");
    index.commit();
    index.frustum_cull(&Frustum::everything(), &mut CullScratch::default(), |_| ());
}

/// The scene graph of lecture notes (source document 000, 1.4), and its first exercise.
#[test]
fn the_planet_and_the_moon_are_where_the_lecture_says() {
    let turn = |degrees: f32| Affine3A::from_rotation_y(degrees.to_radians());
    let offset = |x: f32| Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
    let mut index = GroupIndex::default();
    let mut node = |parent: Option<NodeId>, to: Affine3A| index.add_node(parent, to, None).expect("a node");
    let planet_orbit = node(None, turn(45.0));
    let planet = node(Some(planet_orbit), offset(5.0));
    let moon_orbit = node(Some(planet), turn(30.0));
    let moon = node(Some(moon_orbit), offset(1.5));
    let a = node(None, offset(3.0) * turn(45.0));
    let b = node(Some(a), offset(2.0));
    index.commit();
    let at = |node: NodeId| Vec3::from(index.world_from_node(node).expect("a node").translation);
    assert!(at(planet).abs_diff_eq(Vec3::new(3.54, 0.0, -3.54), 0.005), "{}", at(planet));
    // The lecture prints (4.61, 0, -2.89), but no product of its matrices gives this: 45 + 30 degrees are 75.
    assert!(at(moon).abs_diff_eq(Vec3::new(3.924, 0.0, -4.984), 0.005), "{}", at(moon));
    assert!(at(b).abs_diff_eq(Vec3::new(4.414, 0.0, -1.414), 0.005), "{}", at(b));
}
