//! Groups that move as a whole: the same answers as where each of their polygons is inserted again.

use glam::Affine3A;
use osp::{
    math::{Ray, Sphere},
    polygon::{Change, ConvexPolygon, Geometry, SpaceId, SpacePlace, VisibleBlocks},
};
use osp_testkit::events::{SOLE, polygon};
use rand_pcg::{Pcg64, rand_core::Rng};

use super::*;

const GROUPS: u32 = 5;

struct Random(Pcg64);

impl Random {
    fn below(&mut self, count: u64) -> u64 {
        self.0.next_u64() % count
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.0.next_u64() >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vector(&mut self, half: f32) -> Vec3 {
        Vec3::from([0; 3].map(|_| self.between(-half, half)))
    }

    fn turn(&mut self) -> Quat {
        let [x, y, z, w] = [0; 4].map(|_| self.between(-1.0, 1.0));
        Quat::from_xyzw(x, y, z, w)
    }

    fn transform(&mut self) -> Transform {
        // One in sixteen is such that nothing in its space can be decided.
        let s = if self.below(16) == 0 { 1.0e-9 } else { self.between(0.5, 1.5) };
        let far = if self.below(8) == 0 { 3.0e5 } else { 3.0 };
        Transform { p: self.vector(far), q: self.turn(), s }
    }

    fn view(&mut self) -> View {
        let projection = Projection::symmetric(60.0, 1.5, 0.05, 60.0);
        let eye = self.vector(4.0);
        View::look_at(eye, eye + self.vector(1.0), projection)
    }

    fn event(&mut self, strokes: &mut u32) -> Event {
        let stroke = StrokeId(self.below(u64::from(*strokes).max(1)) as u32);
        let group = GroupId(self.below(u64::from(GROUPS)) as u32);
        match self.below(16) {
            0..=3 => {
                let stroke = if self.below(2) == 0 { stroke } else { StrokeId(*strokes) };
                *strokes += u32::from(stroke.0 == *strokes);
                let corner = self.vector(2.0);
                let size = if self.below(10) == 0 { 3.0 } else { 0.1 };
                let vertices = [corner, corner + self.vector(size), corner + self.vector(size)];
                polygon(Some(stroke), vertices, (1.0, 1.0, 1.0, 1.0))
            }
            4..=5 => {
                let parent = (self.below(2) == 0).then(|| GroupId(self.below(u64::from(GROUPS)) as u32));
                SOLE.grouped(group, [stroke], parent)
            }
            6 => SOLE.erase(stroke),
            7 => SOLE.moved([stroke], self.vector(0.5)),
            8 => SOLE.undo(),
            9 => SOLE.redo(),
            _ => SOLE.placed(group, self.transform()),
        }
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
        let mut random = Random(Pcg64::new(seed, 7));
        let mut scenes = [Scene::new(), Scene::keeping_groups_whole()];
        let mut pipelines = [pipeline(), pipeline()];
        let mut strokes = 0;
        for frame in 0..120 {
            let events: Vec<Event> = (0..1 + random.below(6)).map(|_| random.event(&mut strokes)).collect();
            let views = [random.view(), random.view()];
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
                    let apart = (center - plain.bounds(id).center().as_dvec3()).length();
                    assert!(
                        apart
                            <= f64::from(2.0 * plain.bounds(id).extent().length()) + 1.0e-6 * center.length(),
                        "{context}, {id:?}: {apart} m from {:?}",
                        plain.bounds(id)
                    );
                }
            }
            // What else is asked of an index.
            let ray = Ray::new(random.vector(4.0), random.vector(1.0));
            let sphere = Sphere { center: random.vector(4.0), radius_m: random.between(0.0, 2.0) };
            let part = Aabb::cube(random.vector(4.0), random.between(0.0, 3.0));
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
    assert!(
        places > 1000 && in_spaces > 10_000 && seen > 10_000 && met > 100,
        "{places} {in_spaces} {seen} {met}"
    );
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
    let view = View::look_at(
        Vec3::new(2.0, 3.0, 12.0),
        Vec3::new(2.0, 3.0, 0.0),
        Projection::symmetric(60.0, 1.0, 0.1, 50.0),
    );
    pipeline.frame(&scene, &changes, &view);
    let mut told = Vec::new();
    for frame in 0..6 {
        changes.clear();
        let to = Transform {
            p: Vec3::X * frame as f32 * 0.01,
            q: Quat::from_rotation_z(0.01 * frame as f32),
            s: 1.0,
        };
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

/// Polygons that are all in one space; the first stands beside it, too, if it is asked for.
struct Flat {
    place: SpacePlace,
}

impl Geometry for Flat {
    fn id_end(&self) -> usize {
        4
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < 4
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.polygon(id).expect("there is one").bounds()
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        let corner = Vec3::X * id.0 as f32;
        Some(ConvexPolygon::triangle(corner, corner + Vec3::X, corner + Vec3::Y))
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }

    fn space(&self, _: PolygonId) -> Option<SpaceId> {
        Some(SpaceId(7))
    }

    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        let bounds = self.bounds(id);
        Aabb { min: bounds.min - Vec3::Z, max: bounds.max + Vec3::Z }
    }

    fn place(&self, _: SpaceId) -> SpacePlace {
        self.place
    }
}

#[test]
fn a_space_that_has_shrunk_to_a_plane_is_seen_and_met_and_numbers_beyond_the_limit_are_refused() {
    let flat = Flat { place: Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0)).into() };
    let mut pipeline = pipeline();
    let view = View::look_at(
        Vec3::new(2.0, 0.5, 5.0),
        Vec3::new(2.0, 0.5, 0.0),
        Projection::symmetric(60.0, 1.5, 0.1, 50.0),
    );
    let changes: Vec<Change> =
        (0..4).chain([PolygonId::LIMIT]).map(|id| Change::Insert(PolygonId(id))).collect();
    let record = pipeline.frame(&flat, &changes, &view);
    assert_eq!((record.visible, record.polygons, pipeline.refused()), (4, 4, 1));
    let ray = Ray::new(Vec3::new(2.25, 0.25, 3.0), Vec3::NEG_Z);
    let nearest = pipeline.ray_nearest(&flat, &ray, 10.0, &mut |id| flat.polygon(id)?.meet(&ray));
    assert_eq!(nearest, Some((PolygonId(2), 3.0)));
    let mut found = Vec::new();
    pipeline.box_query(&flat, &Aabb::cube(Vec3::new(3.5, 0.0, 0.0), 0.1), &mut found);
    assert_eq!(found, [PolygonId(3)]);
}

/// Polygons in one space whose corners are computed less exactly than its matrix: each lies beside its place.
struct Displaced {
    place: SpacePlace,
    boxes: Vec<[Aabb; 2]>,
}

impl Displaced {
    fn new(random: &mut Random) -> Self {
        let mut place = SpacePlace::from(Affine3A::from_rotation_z(0.3));
        place.rounding_per_m = 0.01;
        let boxes = (0..400).map(|_| {
            let in_space = Aabb::cube(random.vector(8.0), 0.02);
            let center = place.world_from_space.transform_point3(in_space.center().as_dvec3()).as_vec3();
            let most_m = 0.009 * in_space.center().length();
            let by = random.vector(1.0).normalize_or(Vec3::X) * most_m;
            [in_space, Aabb::cube(center + by, 0.03)]
        });
        Self { boxes: boxes.collect(), place }
    }
}

impl Geometry for Displaced {
    fn id_end(&self) -> usize {
        self.boxes.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.boxes.len()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.boxes[id.index()][1]
    }

    fn polygon(&self, _: PolygonId) -> Option<ConvexPolygon> {
        None
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }

    fn space(&self, _: PolygonId) -> Option<SpaceId> {
        Some(SpaceId(0))
    }

    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        self.boxes[id.index()][0]
    }

    fn place(&self, _: SpaceId) -> SpacePlace {
        self.place
    }
}

#[test]
fn polygons_that_lie_beside_their_place_in_a_space_are_seen_where_they_are() {
    let mut random = Random(Pcg64::new(5, 7));
    let (mut seen, mut hidden) = (0, 0);
    for _ in 0..20 {
        let scene = Displaced::new(&mut random);
        let mut pipeline = pipeline();
        let changes: Vec<Change> = (0..400).map(|id| Change::Insert(PolygonId(id))).collect();
        pipeline.frame(&scene, &changes, &random.view());
        for _ in 0..50 {
            let view = random.view();
            pipeline.frame(&scene, &[], &view);
            let frustum = view.frustum();
            let expected: Vec<PolygonId> =
                (0..400).map(PolygonId).filter(|&id| frustum.may_see(&scene.bounds(id))).collect();
            (seen, hidden) = (seen + expected.len(), hidden + 400 - expected.len());
            assert_eq!(pipeline.in_view().to_vec(), expected);
        }
    }
    assert!(seen > 10_000 && hidden > 10_000, "{seen} {hidden}");
}

/// The sums of a box test overflow there, in the space and not in the world.
#[test]
fn polygons_of_a_space_as_far_away_as_numbers_go_are_seen() {
    let mut random = Random(Pcg64::new(9, 7));
    let mut seen = 0;
    for _ in 0..200 {
        let to = random.vector(1.0).signum() * 3.1e38;
        let boxes = (0..60).map(|_| {
            let center = random.vector(1.0) * 2.0e37;
            [center - to, center].map(|center| Aabb::cube(center, 2.0e35))
        });
        let boxes = boxes.collect();
        let scene = Displaced { place: SpacePlace::from(Affine3A::from_translation(to)), boxes };
        let view = View {
            eye_in_world: random.vector(1.0) * 1.0e37,
            world_from_view: random.turn().normalize(),
            projection: Projection::symmetric(80.0, 1.3, 1.0e34, 1.0e38),
        };
        let changes: Vec<Change> = (0..60).map(|id| Change::Insert(PolygonId(id))).collect();
        let mut pipeline = pipeline();
        pipeline.frame(&scene, &changes, &view);
        let frustum = view.frustum();
        let expected: Vec<PolygonId> =
            (0..60).map(PolygonId).filter(|&id| frustum.may_see(&scene.bounds(id))).collect();
        assert_eq!(pipeline.in_view().to_vec(), expected);
        seen += expected.len();
    }
    assert!(seen > 1_000, "{seen}");
}

#[test]
fn the_last_number_costs_no_more_in_a_space_than_the_first() {
    let flat = Flat { place: Affine3A::IDENTITY.into() };
    let view = View::look_at(Vec3::Z * 5.0, Vec3::ZERO, Projection::symmetric(60.0, 1.5, 0.1, 50.0));
    let bytes = |id: u32| {
        let mut pipeline = pipeline();
        pipeline.frame(&flat, &[Change::Insert(PolygonId(id))], &view);
        assert_eq!((pipeline.polygon_count(), pipeline.refused()), (1, 0));
        pipeline.bytes()
    };
    let (first, last) = (bytes(0), bytes(PolygonId::LIMIT - 1));
    assert!(last < first + (8 << 20), "{last} bytes, {first} for the first");
}
