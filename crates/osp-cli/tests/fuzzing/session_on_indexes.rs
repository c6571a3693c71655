//! Any session, frame by frame: the scene keeps its books, and every index finds in every frame what the plainest code
//! finds.

use super::input::{self, Input, below};
use osp::{
    frame::Pipeline,
    index::{IndexConfig, SpatialIndex},
    math::{Ray, Sphere},
    polygon::{Change, PolygonId},
    view::View,
};
use osp_rivals::IndexKind;
use osp_session::{recording::Event, scene::Scene};

/// Enough for every structure to split; a frame compares all of them.
const MOST_POLYGONS: usize = 1500;
const MOST_FRAMES: usize = 12;

pub fn run(data: &[u8]) {
    let mut u = Input::new(data);
    let config = IndexConfig { capacity: [0, 16, 1000][below(&mut u, 3)], ..IndexConfig::default() };
    let mut lanes: Vec<Pipeline> =
        IndexKind::ALL.iter().map(|kind| Pipeline::new(kind.create(&config), 16)).collect();
    let mut scene = Scene::new();
    let (mut told, mut changes) = (Vec::new(), Vec::new());
    let mut frame = 0;
    while !u.is_empty() && frame < MOST_FRAMES && scene.polygon_count() < MOST_POLYGONS {
        changes.clear();
        for _ in 0..1 + below(&mut u, 40) {
            let event = input::event(&mut u);
            assert_eq!(event.check(), Ok(()), "{event:?}");
            scene.apply(&event, &mut changes);
            told.push(event);
        }
        check_scene(&scene);
        let view = input::view(&mut u);
        for lane in &mut lanes {
            lane.frame(&scene, &changes, &view);
            check_lane(lane, &scene, &view, frame);
        }
        check_queries(&lanes, &scene, &mut u, frame);
        frame += 1;
    }
    check_retold(&scene, &told);
}

/// The scene's own books.
fn check_scene(scene: &Scene) {
    let counts = scene.counts();
    assert_eq!(counts.polygons, scene.polygon_count() as u64);
    assert_eq!(counts.visible, scene.visible_ids().count() as u64, "polygons in the model");
    let mut owned = 0;
    for stroke in scene.strokes().iter() {
        for id in stroke.polygon_ids() {
            owned += 1;
            assert_eq!(scene.is_visible(id), stroke.is_visible(), "{id:?}");
        }
    }
    assert_eq!(owned, scene.polygon_count(), "each polygon is of one stroke");
    for id in (0..owned as u32).map(PolygonId) {
        let (kept, fresh) = (scene.bounds(id), scene.polygon(id).bounds());
        let is_padded = scene.stroke_of(id).brush().is_some_and(|brush| brush.bounds_padding_m > 0.0);
        if is_padded || scene.surface(id).is_facing() {
            // What moves or turns to the eye is kept in a larger box.
            let holds = (kept.min.cmple(fresh.min) & fresh.max.cmple(kept.max)).all();
            assert!(holds || !fresh.is_valid(), "the box of {id:?}: {kept:?}, and afresh {fresh:?}");
            continue;
        }
        // A box that is not a number is like no other, but it is none in both.
        let is_same = |a: f32, b: f32| a == b || a.is_nan() && b.is_nan();
        let pairs = kept.min.to_array().into_iter().zip(fresh.min.to_array());
        let mut pairs = pairs.chain(kept.max.to_array().into_iter().zip(fresh.max.to_array()));
        assert!(pairs.all(|(a, b)| is_same(a, b)), "the box of {id:?}: {kept:?}, and afresh {fresh:?}");
    }
}

fn inserted(scene: &Scene) -> impl Iterator<Item = PolygonId> + '_ {
    scene.visible_ids().filter(|&id| scene.bounds(id).is_valid())
}

fn sorted(mut ids: Vec<PolygonId>) -> Vec<PolygonId> {
    ids.sort_unstable();
    ids
}

fn check_lane(lane: &Pipeline, scene: &Scene, view: &View, frame: usize) {
    let index = lane.index();
    let name = index.name();
    if let Err(fault) = index.validate() {
        panic!("{name}, frame {frame}: {fault}");
    }
    assert_eq!(index.len(), inserted(scene).count(), "{name}, frame {frame}: polygons inserted");
    let frustum = view.frustum();
    let expected: Vec<PolygonId> = inserted(scene).filter(|&id| frustum.may_see(&scene.bounds(id))).collect();
    let found = lane.in_view().to_vec();
    assert_eq!(found.len(), lane.in_view().len(), "{name}, frame {frame}: polygons counted");
    assert_eq!(found, expected, "{name}, frame {frame}: what {view:?} may see");
}

/// Box, ray, sphere and nearest queries: the same from every index.
fn check_queries(lanes: &[Pipeline], scene: &Scene, u: &mut Input<'_>, frame: usize) {
    let bounds = input::bounds(u);
    let ray = Ray::new(input::near_point(u), input::direction(u));
    let t_max = [f32::INFINITY, 1.0][below(u, 2)];
    let sphere = Sphere { center: input::near_point(u), radius_m: input::unit(u) * 2.0 };
    let count = below(u, 20);
    let touching: Vec<PolygonId> =
        inserted(scene).filter(|&id| scene.bounds(id).intersects(&bounds)).collect();
    let within = |id: PolygonId| scene.bounds(id).distance_squared(sphere.center) <= sphere.radius_m.powi(2);
    let inside: Vec<PolygonId> = inserted(scene).filter(|&id| within(id)).collect();
    // An index may rely on a hit lying in the polygon's box; rounding can put it a little before.
    let hit = |id: PolygonId| {
        let entered = ray.enter_box(&scene.bounds(id), t_max)?;
        scene.polygon(id).meet(&ray).map(|t| t.max(entered))
    };
    let mut expected: Option<(PolygonId, f32)> = None;
    for id in inserted(scene) {
        if let Some(t) = hit(id)
            && t <= t_max
            && expected.is_none_or(|(_, best)| t < best)
        {
            expected = Some((id, t));
        }
    }
    let distance_m = |id: PolygonId| scene.bounds(id).distance_squared(sphere.center).sqrt();
    let mut nearest: Vec<(PolygonId, f32)> =
        inserted(scene).map(|id| (id, distance_m(id))).filter(|(_, d)| !d.is_nan()).collect();
    nearest.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    nearest.truncate(count);
    for lane in lanes {
        let index: &dyn SpatialIndex = lane.index();
        let place = format!("{}, frame {frame}", index.name());
        let mut found = Vec::new();
        index.box_query(&bounds, &mut found);
        assert_eq!(sorted(found), touching, "{place}: {bounds:?}");
        let mut found = Vec::new();
        index.sphere_query(&sphere, &mut |id| within(id), &mut found);
        assert_eq!(sorted(found), inside, "{place}: {sphere:?}");
        assert_eq!(index.ray_nearest(&ray, t_max, &mut |id| hit(id)), expected, "{place}: {ray:?}");
        let any = index.ray_any(&ray, t_max, &mut |id| hit(id));
        assert_eq!(any.is_some(), expected.is_some(), "{place}, any: {ray:?}");
        let mut found = Vec::new();
        index.nearest(sphere.center, count, &mut |id| distance_m(id), &mut found);
        assert_eq!(found, nearest, "{place}: {count} nearest to {}", sphere.center);
    }
}

/// Told the same events at once, another scene becomes the same.
fn check_retold(scene: &Scene, told: &[Event]) {
    let (mut again, mut changes) = (Scene::new(), Vec::<Change>::new());
    told.iter().for_each(|event| again.apply(event, &mut changes));
    assert_eq!(again.counts(), scene.counts());
    for id in (0..scene.polygon_count() as u32).map(PolygonId) {
        let bits = |scene: &Scene| {
            scene.polygon(id).vertices().iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>()
        };
        assert_eq!(bits(&again), bits(scene), "{id:?}");
    }
    // What the changes say is what there is.
    let mut there = vec![false; scene.polygon_count()];
    for change in changes {
        match change {
            Change::Insert(id) => {
                assert!(!std::mem::replace(&mut there[id.index()], true), "{id:?} came twice")
            }
            Change::Remove(id) => assert!(std::mem::take(&mut there[id.index()]), "{id:?} was not there"),
            Change::Update(id) | Change::Repaint(id) => {
                assert!(there[id.index()], "{id:?} moved and was not there");
            }
            Change::Place(space) => panic!("{space:?}: this scene tells of each polygon"),
        }
    }
    for (id, there) in (0..).map(PolygonId).zip(there) {
        assert_eq!(scene.is_visible(id), there, "{id:?}");
    }
}
