//! Groups that move as a whole: the same answers as where each of their polygons is inserted again.

use glam::Affine3A;
use osp::{
    math::{Ray, Sphere},
    polygon::{Change, ConvexPolygon, Geometry, SpaceId, SpacePlace, VisibleBlocks},
};
use osp_testkit::{
    Random,
    events::{SOLE, polygon},
};

use super::*;

const GROUPS: usize = 5;

fn between(random: &mut Random, low: f64, high: f64) -> f32 {
    random.range(low, high) as f32
}

fn vector(random: &mut Random, half: f32) -> Vec3 {
    random.in_cube().as_vec3() * half
}

fn turn(random: &mut Random) -> Quat {
    Quat::from_array([(); 4].map(|()| between(random, -1.0, 1.0)))
}

fn transform(random: &mut Random) -> Transform {
    // One in sixteen is such that nothing in its space can be decided.
    let s = if random.below(16) == 0 { 1.0e-9 } else { between(random, 0.5, 1.5) };
    let far = if random.below(8) == 0 { 3.0e5 } else { 3.0 };
    Transform { p: vector(random, far), q: turn(random), s }
}

fn view(random: &mut Random) -> View {
    let eye = vector(random, 4.0);
    View::look_at(eye, eye + vector(random, 1.0), Projection::symmetric(60.0, 1.5, 0.05, 60.0))
}

/// A view along -z, onto the plane z = 0.
fn onto(x: f32, y: f32, z: f32) -> View {
    View::look_at(Vec3::new(x, y, z), Vec3::new(x, y, 0.0), Projection::symmetric(60.0, 1.5, 0.1, 50.0))
}

fn event(random: &mut Random, strokes: &mut u32) -> Event {
    let stroke = StrokeId(random.below((*strokes).max(1) as usize) as u32);
    let group = GroupId(random.below(GROUPS) as u32);
    match random.below(16) {
        0..=3 => {
            let stroke = if random.chance(0.5) { stroke } else { StrokeId(*strokes) };
            *strokes += u32::from(stroke.0 == *strokes);
            let corner = vector(random, 2.0);
            let size = if random.chance(0.1) { 3.0 } else { 0.1 };
            let vertices = [corner, corner + vector(random, size), corner + vector(random, size)];
            polygon(Some(stroke), vertices, (1.0, 1.0, 1.0, 1.0))
        }
        4..=5 => {
            let parent = random.chance(0.5).then(|| GroupId(random.below(GROUPS) as u32));
            SOLE.grouped(group, [stroke], parent)
        }
        6 => SOLE.erase(stroke),
        7 => SOLE.moved([stroke], vector(random, 0.5)),
        8 => SOLE.undo(),
        9 => SOLE.redo(),
        _ => SOLE.placed(group, transform(random)),
    }
}

fn pipeline() -> Pipeline {
    Pipeline::new(IndexKind::Osp.create(&IndexConfig::default()), 1024)
}

fn ids(lists: &[VisibleBlocks]) -> Vec<Vec<PolygonId>> {
    lists.iter().map(VisibleBlocks::to_vec).collect()
}

#[test]
fn groups_that_move_as_a_whole_are_seen_as_if_each_polygon_were_inserted_again() {
    let (mut places, mut in_spaces, mut seen, mut met) = (0, 0, 0, 0);
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let mut scenes = [Scene::new(), Scene::keeping_groups_whole()];
        let mut pipelines = [pipeline(), pipeline()];
        let mut strokes = 0;
        for frame in 0..120 {
            let events: Vec<Event> =
                (0..1 + random.below(6)).map(|_| event(&mut random, &mut strokes)).collect();
            let views = [view(&mut random), view(&mut random)];
            let context = format!("seed {seed}, frame {frame}");
            let mut answers = Vec::new();
            for (scene, pipeline) in scenes.iter_mut().zip(&mut pipelines) {
                let mut changes = Vec::new();
                scene.free_unreachable();
                scene.apply_all(&events, &mut changes);
                places += changes.iter().filter(|change| matches!(change, Change::Place(_))).count();
                let record = pipeline.frame_of_views(scene, &changes, &views);
                assert_eq!(record.polygons, scene.counts().visible, "{context}");
                seen += record.visible;
                answers.push(ids(pipeline.in_view_lists()));
            }
            assert_eq!(answers[0], answers[1], "{context}");
            let [plain, whole] = &scenes;
            assert_eq!(plain.polygon_count(), whole.polygon_count());
            for id in (0..plain.polygon_count() as u32).map(PolygonId) {
                // Nothing brings back what no undo reaches any more.
                if plain.stroke_of(id).id().is_some_and(|stroke| plain.stroke(stroke).is_none()) {
                    continue;
                }
                assert_eq!(plain.bounds(id), whole.bounds(id), "{context}, {id:?}");
                let space = Geometry::space(whole, id).filter(|_| whole.is_visible(id));
                in_spaces += u32::from(space.is_some());
                // Whatever is tested there is around the polygon.
                if let Some(space) = space {
                    let place = Geometry::place(whole, space);
                    let in_space = whole.bounds_in_space(id);
                    let center = place.world_from_space.transform_point3(in_space.center().as_dvec3());
                    let bounds = plain.bounds(id);
                    let apart = (center - bounds.center().as_dvec3()).length();
                    let most_m = f64::from(2.0 * bounds.extent().length()) + 1.0e-6 * center.length();
                    assert!(apart <= most_m, "{context}, {id:?}: {apart} m from {bounds:?}");
                }
            }
            // What else is asked of an index.
            let ray = Ray::new(vector(&mut random, 4.0), vector(&mut random, 1.0));
            let sphere =
                Sphere { center: vector(&mut random, 4.0), radius_m: between(&mut random, 0.0, 2.0) };
            let part = Aabb::cube(vector(&mut random, 4.0), between(&mut random, 0.0, 3.0));
            let asked = scenes.iter().zip(&pipelines).map(|(scene, pipeline)| {
                let mut hit = |id: PolygonId| scene.polygon(id).meet(&ray);
                let nearest = pipeline.ray_nearest(scene, &ray, 100.0, &mut hit);
                let (mut in_box, mut in_sphere) = (Vec::new(), Vec::new());
                pipeline.box_query(scene, &part, &mut in_box);
                let mut is_in =
                    |id: PolygonId| scene.polygon(id).distance_m(sphere.center) <= sphere.radius_m;
                pipeline.sphere_query(scene, &sphere, &mut is_in, &mut in_sphere);
                in_box.sort_unstable();
                in_sphere.sort_unstable();
                (nearest, in_box, in_sphere)
            });
            let asked: Vec<_> = asked.collect();
            met += u32::from(asked[0].0.is_some());
            assert_eq!(asked[0], asked[1], "{context}");
        }
    }
    assert!(places > 1000 && in_spaces > 10_000, "{places} {in_spaces}");
    assert!(seen > 10_000 && met > 100, "{seen} {met}");
}

#[test]
fn a_group_that_is_dragged_costs_one_change() {
    let mut scene = Scene::keeping_groups_whole();
    let mut changes = Vec::new();
    let count = 3000;
    for i in 0..count {
        let p = Vec3::new((i % 50) as f32, (i / 50) as f32, 0.0) * 0.1;
        let vertices = [p, p + Vec3::X * 0.05, p + Vec3::Y * 0.05];
        scene.apply(&polygon(Some(StrokeId(i / 100)), vertices, (1.0, 1.0, 1.0, 1.0)), &mut changes);
    }
    let strokes: Vec<_> = (0..count / 100).map(StrokeId).collect();
    scene.apply(&SOLE.grouped(GroupId(0), strokes, None), &mut changes);
    let mut pipeline = pipeline();
    let view = onto(2.0, 3.0, 12.0);
    pipeline.frame(&scene, &changes, &view);
    let mut told = Vec::new();
    for frame in 0..6 {
        changes.clear();
        let by = frame as f32 * 0.01;
        let to = Transform { p: Vec3::X * by, q: Quat::from_rotation_z(by), s: 1.0 };
        scene.apply(&SOLE.placed(GroupId(0), to), &mut changes);
        let displaced = scene.work().displaced;
        let record = pipeline.frame(&scene, &changes, &view);
        told.push((changes.len(), displaced));
        assert_eq!((record.polygons, record.visible), (3000, 3000));
        assert!(frame < 2 || record.work.boxes < 100, "{:?}", record.work);
    }
    // Twice each polygon is inserted; from then on the group is.
    assert_eq!(told[..2], [(3000, 6000), (3000, 9000)]);
    assert!(told[2..].iter().all(|told| *told == (1, 9000)), "{told:?}");
}

/// Triangles that are all in one space, by their boxes there and in the world.
struct InSpace<F> {
    place: SpacePlace,
    count: usize,
    /// The one polygon that is in no space.
    alone: u32,
    boxes: F,
}

impl<F: Fn(usize) -> [Aabb; 2]> Geometry for InSpace<F> {
    fn id_end(&self) -> usize {
        self.count
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.count
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        (self.boxes)(id.index())[1]
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        let Aabb { min, max } = self.bounds(id);
        Some(ConvexPolygon::triangle(min, Vec3 { x: max.x, ..min }, Vec3 { y: max.y, ..min }))
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }

    fn space(&self, id: PolygonId) -> Option<SpaceId> {
        (id.0 != self.alone).then_some(SpaceId(7))
    }

    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        (self.boxes)(id.index())[0]
    }

    fn place(&self, _: SpaceId) -> SpacePlace {
        self.place
    }
}

/// Four triangles in a row; in their space, their boxes are thicker.
fn flat(place: Affine3A) -> InSpace<impl Fn(usize) -> [Aabb; 2]> {
    let boxes = |id: usize| {
        let min = Vec3::X * id as f32;
        let max = min + Vec3::X + Vec3::Y;
        [Aabb::new(min - Vec3::Z, max + Vec3::Z), Aabb::new(min, max)]
    };
    InSpace { place: place.into(), count: 4, alone: u32::MAX, boxes }
}

#[test]
fn a_space_that_has_shrunk_to_a_plane_is_seen_and_met_and_numbers_beyond_the_limit_are_refused() {
    for alone in [u32::MAX, 2, 3] {
        let flat = InSpace { alone, ..flat(Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0))) };
        let mut pipeline = pipeline();
        let view = onto(2.0, 0.5, 5.0);
        let changes: Vec<Change> =
            (0..4).chain([PolygonId::LIMIT]).map(|id| Change::Insert(PolygonId(id))).collect();
        let record = pipeline.frame(&flat, &changes, &view);
        assert_eq!((record.visible, record.polygons, pipeline.refused()), (4, 4, 1));
        // Of the two that share a corner there, the first is met, also if one of them is in no space.
        let ray = Ray::new(Vec3::new(3.0, 0.0, 3.0), Vec3::NEG_Z);
        let nearest = pipeline.ray_nearest(&flat, &ray, 10.0, &mut |id| flat.polygon(id)?.meet(&ray));
        assert_eq!(nearest, Some((PolygonId(2), 3.0)));
        let mut found = Vec::new();
        pipeline.box_query(&flat, &Aabb::cube(Vec3::new(3.5, 0.0, 0.0), 0.1), &mut found);
        assert_eq!(found, [PolygonId(3)]);
        let boxes = |id: usize| {
            let of = PolygonId(id as u32);
            if id == 1 { [Aabb::EMPTY; 2] } else { [flat.bounds_in_space(of), flat.bounds(of)] }
        };
        let broken = InSpace { place: flat.place(SpaceId(0)), count: 4, alone, boxes };
        let record = pipeline.frame(&broken, &[Change::Update(PolygonId(1))], &view);
        assert_eq!((record.visible, record.polygons, pipeline.refused()), (3, 3, 2));
    }
}

/// What a pipeline finds in view, and what is in view by the boxes in the world.
fn found_and_expected(scene: &impl Geometry, pipeline: &mut Pipeline, view: &View) -> [Vec<PolygonId>; 2] {
    let all = (0..scene.id_end() as u32).map(PolygonId);
    let came: Vec<Change> =
        all.clone().filter(|_| pipeline.polygon_count() == 0).map(Change::Insert).collect();
    pipeline.frame(scene, &came, view);
    let frustum = view.frustum();
    let expected = all.filter(|&id| frustum.may_see(&scene.bounds(id)));
    [pipeline.in_view().to_vec(), expected.collect()]
}

/// The corners are computed less exactly than the matrix of their space.
#[test]
fn polygons_that_lie_beside_their_place_in_a_space_are_seen_where_they_are() {
    let mut random = Random::new(5);
    let (mut seen, mut hidden) = (0, 0);
    for _ in 0..20 {
        let mut place = SpacePlace::from(Affine3A::from_rotation_z(0.3));
        place.rounding_per_m = 0.01;
        let boxes: [[Aabb; 2]; 400] = std::array::from_fn(|_| {
            let in_space = Aabb::cube(vector(&mut random, 8.0), 0.02);
            let center = place.world_from_space.transform_point3(in_space.center().as_dvec3()).as_vec3();
            let most_m = 0.009 * in_space.center().length();
            [in_space, Aabb::cube(center + random.direction().as_vec3() * most_m, 0.03)]
        });
        let scene = InSpace { place, count: 400, alone: u32::MAX, boxes: |id: usize| boxes[id] };
        let mut pipeline = pipeline();
        for _ in 0..50 {
            let [found, expected] = found_and_expected(&scene, &mut pipeline, &view(&mut random));
            (seen, hidden) = (seen + expected.len(), hidden + 400 - expected.len());
            assert_eq!(found, expected);
        }
    }
    assert!(seen > 10_000 && hidden > 10_000, "{seen} {hidden}");
}

/// The sums of a box test overflow there, in the space and not in the world.
#[test]
fn polygons_of_a_space_as_far_away_as_numbers_go_are_seen() {
    let mut random = Random::new(9);
    let mut seen = 0;
    for _ in 0..200 {
        let to = vector(&mut random, 1.0).signum() * 3.1e38;
        let boxes: [[Aabb; 2]; 60] = std::array::from_fn(|_| {
            let center = vector(&mut random, 2.0e37);
            [center - to, center].map(|center| Aabb::cube(center, 2.0e35))
        });
        let place = Affine3A::from_translation(to).into();
        let scene = InSpace { place, count: 60, alone: u32::MAX, boxes: |id: usize| boxes[id] };
        let view = View {
            eye_in_world: vector(&mut random, 1.0e37),
            world_from_view: turn(&mut random).normalize(),
            projection: Projection::symmetric(80.0, 1.3, 1.0e34, 1.0e38),
        };
        let [found, expected] = found_and_expected(&scene, &mut pipeline(), &view);
        assert_eq!(found, expected);
        seen += expected.len();
    }
    assert!(seen > 1_000, "{seen}");
}

#[test]
fn the_last_number_costs_no_more_in_a_space_than_the_first() {
    let flat = flat(Affine3A::IDENTITY);
    let view = onto(0.0, 0.0, 5.0);
    let bytes = |id: u32| {
        let mut pipeline = pipeline();
        pipeline.frame(&flat, &[Change::Insert(PolygonId(id))], &view);
        assert_eq!((pipeline.polygon_count(), pipeline.refused()), (1, 0));
        pipeline.bytes()
    };
    let (first, last) = (bytes(0), bytes(PolygonId::LIMIT - 1));
    assert!(last < first + (8 << 20), "{last} bytes, {first} for the first");
}
