//! Plays any session frame by frame. The scene stays valid, and the index finds in each frame what a plain loop finds.

use super::input::{self, Input, below};
use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    polygon::{Change, PolygonId},
    view::View,
};
use osp_session::{recording::Event, scene::Scene};

/// Enough for the tree to split.
const MOST_POLYGONS: usize = 1500;
const MOST_FRAMES: usize = 12;

pub fn run(data: &[u8]) {
    let mut u = Input::new(data);
    let config = IndexConfig { capacity: [0, 16, 1000][below(&mut u, 3)], ..IndexConfig::default() };
    let mut pipeline = Pipeline::new(Box::new(Osp::new(&config).with_all_in_tree()), 16);
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
        pipeline.frame(&scene, &changes, &view);
        check_frame(&pipeline, &scene, &view, frame);
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

fn check_frame(pipeline: &Pipeline, scene: &Scene, view: &View, frame: usize) {
    let index = pipeline.index();
    assert_eq!(index.validate(), Ok(()), "frame {frame}");
    assert_eq!(index.len(), inserted(scene).count(), "frame {frame}: polygons inserted");
    let frustum = view.frustum();
    let expected: Vec<PolygonId> = inserted(scene).filter(|&id| frustum.may_see(&scene.bounds(id))).collect();
    assert_eq!(pipeline.in_view().to_vec(), expected, "frame {frame}: what {view:?} may see");
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
