//! Culling by occlusion inside the pipeline: whatever `auto` decides, what can be seen is drawn.

use super::session::{Told, polygon, polygon_of, view};
use glam::{Quat, Vec3};
use osp::{
    frame::{AutoBasis, OcclusionPass, PassConfig, Pipeline, StageClock},
    index::IndexConfig,
    math::Aabb,
    occlusion::{Occlusion, PreviousFrameOccluders, Soundness},
    polygon::{Change, Geometry, PolygonId},
};
use osp_lab::{Method, oracle::OracleConfig, scenes::TestScene, verify};
use osp_rivals::{IndexKind, RivalOcclusion};
use osp_session::{
    recording::{Event, GroupId, StrokeId, SynthKind, Transform, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};
use osp_testkit::events::SOLE;

fn pipeline(pass: Option<PassConfig>) -> Pipeline {
    let index = IndexKind::Osp.create(&IndexConfig::default());
    let pipeline = Pipeline::new(index, 10_000);
    match pass {
        Some(config) => pipeline.with_occlusion(config),
        None => pipeline,
    }
}

fn auto(polygon_ns: f64, basis: AutoBasis) -> PassConfig {
    PassConfig { polygon_ns, basis, ..PassConfig::new(Occlusion::Auto) }
}

fn events_and_heads(scene: TestScene) -> (Vec<Event>, Vec<Event>) {
    scene.events().into_iter().partition(|event| !matches!(event, Event::Head { .. }))
}

/// The rooms as they are in the end, what made them, and the views of them.
fn finished_rooms() -> (Scene, Vec<Change>, Vec<Event>) {
    let (events, heads) = events_and_heads(TestScene::Rooms);
    let (mut model, mut changes) = (Scene::new(), Vec::new());
    events.iter().for_each(|event| model.apply(event, &mut changes));
    (model, changes, heads)
}

/// A built-in scene that grows over 60 frames, seen from inside, and then looked at from everywhere.
fn play(scene: TestScene, pipelines: &mut [Pipeline], mut frame: impl FnMut(usize, &Scene, &[Pipeline])) {
    let (events, views) = events_and_heads(scene);
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let mut looks = views.iter().map(|event| {
        let mut moment = Moment::default();
        moment.note(event);
        camera.view(&moment)
    });
    let inside = looks.next().unwrap_or_else(|| view(Vec3::ZERO, Vec3::NEG_Z));
    let (mut model, mut changes) = (Scene::new(), Vec::new());
    let batches: Vec<&[Event]> = events.chunks(events.len().div_ceil(60)).collect();
    let later = looks.map(|view| (&[][..], view));
    for (number, (batch, view)) in batches.into_iter().map(|batch| (batch, inside)).chain(later).enumerate() {
        changes.clear();
        batch.iter().for_each(|event| model.apply(event, &mut changes));
        for pipeline in &mut *pipelines {
            let record = pipeline.frame(&model, &changes, &view);
            assert_eq!(record.drawn(), pipeline.draw_list().len() as u64);
            assert_eq!(record.visible, pipeline.in_view().len() as u64);
        }
        frame(number, &model, pipelines);
        if number % 9 == 8 {
            let window = view.window().expect("a pointed cone");
            let config = OracleConfig { width: 480, height: 270 };
            let visible = verify::visible_polygons(&model, &window, &pipelines[0].in_view().to_vec(), config);
            for pipeline in &*pipelines {
                let name = pipeline.occlusion().map(|pass| *pass.config());
                let missing = verify::missing(&visible, &pipeline.draw_list().to_vec());
                assert_eq!(missing, 0, "{number}: {name:?}");
            }
        }
    }
}

#[test]
fn auto_never_changes_what_can_be_seen() {
    for scene in [TestScene::Rooms, TestScene::Panels] {
        let mut pipelines = vec![pipeline(None)];
        for polygon_ns in [1.0, 10.0, 100.0, 10_000.0, 1.0e6] {
            for basis in [AutoBasis::Time, AutoBasis::Work] {
                pipelines.push(pipeline(Some(auto(polygon_ns, basis))));
            }
        }
        let (mut in_use, mut idle, mut by_last) = (0, 0, 0);
        play(scene, &mut pipelines, |_, _, pipelines| {
            for pipeline in pipelines {
                by_last += u32::from(pipeline.occlusion().is_some_and(OcclusionPass::is_by_last));
                // Not used: the frustum's own list, to the last polygon.
                let same = std::ptr::eq(pipeline.draw_list(), pipeline.in_view());
                (in_use, idle) = (in_use + u32::from(!same), idle + u32::from(same));
            }
        });
        assert!(in_use > 50 && idle > 50, "{in_use} frames with, {idle} without");
        assert!(by_last > 0, "what was visible last is never tried");
    }
}

/// Walls go up, strokes come, the eye jumps from room to room: whatever was visible last, nothing visible is left out.
#[test]
fn what_was_visible_last_never_hides_what_can_be_seen_now() {
    let mut pipelines = vec![pipeline(Some(PassConfig::new(Occlusion::PreviousFrame)))];
    let mut hidden = 0;
    play(TestScene::Rooms, &mut pipelines, |_, _, pipelines| {
        hidden += pipelines[0].in_view().len() - pipelines[0].draw_list().len();
    });
    assert!(hidden > 1000, "{hidden}");
}

/// More specks than there is room for outlines, a wall that came after them, and what it hides.
#[test]
fn what_fills_hardly_a_pixel_takes_no_room_from_what_was_visible_last() {
    let spread = |i: usize, side: usize| (i % side) as f32 / side as f32 * 2.0 - 1.0;
    let specks = (0..2 * PreviousFrameOccluders::MOST_OCCLUDERS)
        .map(|i| square(2.0 * spread(i, 271), 2.0 * spread(i / 271, 271), -4.0, 1.0e-4));
    let behind = (0..500).map(|i| square(spread(i, 25), spread(i / 25, 25), -8.0, 0.02));
    let all = specks.chain([square(0.0, 0.0, -5.0, 2.0)]).chain(behind);
    let told = Told::of(&all.map(|p| polygon(&p, 1.0)).collect::<Vec<_>>());
    let mut lane = pipeline(Some(PassConfig::new(Occlusion::PreviousFrame)));
    let (changes, view) = (told.changes.clone(), view(Vec3::ZERO, Vec3::NEG_Z));
    assert_eq!(lane.frame(&told.scene, &changes, &view).occlusion.occluded, 0, "not read yet");
    let record = lane.frame(&told.scene, &[], &view).occlusion;
    assert_eq!(record.occluded, 500);
    assert!(record.occluders <= PreviousFrameOccluders::MOST_OCCLUDERS as u64);
}

#[test]
fn every_view_of_a_frame_is_culled_as_if_it_were_alone() {
    let (model, changes, heads) = finished_rooms();
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let mut moment = Moment::default();
    let views = heads.iter().step_by(5).take(4).map(|head| {
        moment.note(head);
        camera.view(&moment)
    });
    let mut views: Vec<_> = views.collect();
    let mut wide = views[0];
    (wide.projection.left, wide.projection.right) = (-1.0e7, 1.0e7);
    views.push(wide);
    for choice in [Occlusion::Msvbsp, Occlusion::PreviousFrame] {
        let always = PassConfig { polygon_ns: 1000.0, ..PassConfig::new(choice) };
        let mut together = pipeline(Some(always));
        let record = together.frame_of_views(&model, &changes, &views);
        let mut occluded = 0;
        for (i, view) in views.iter().enumerate() {
            let mut alone = pipeline(Some(always));
            occluded += alone.frame(&model, &changes, view).occlusion.occluded;
            assert_eq!(alone.draw_list(), &together.draw_lists()[i], "view {i}");
            assert_eq!(alone.in_view(), &together.in_view_lists()[i], "view {i}");
        }
        assert!(occluded > 100 && occluded == record.occlusion.occluded, "{occluded}: {record:?}");
        // Through a window that is no pointed cone, all polygons in view are drawn.
        assert!(wide.window().is_none() && together.draw_lists()[4].len() > 1000);
        assert_eq!(together.draw_lists()[4], together.in_view_lists()[4]);
        // A frame without a view draws nothing and misses nothing.
        assert_eq!(together.frame_of_views(&model, &[], &[]).visible, 0);
        assert!(together.draw_list().is_empty());
    }
}

#[test]
fn auto_by_work_decides_the_same_each_time() {
    for polygon_ns in [30.0, 1.0e6] {
        let (mut fingerprints, mut by_last) = (Vec::new(), 0);
        for _ in 0..2 {
            let mut pipelines = vec![pipeline(Some(auto(polygon_ns, AutoBasis::Work)))];
            let mut drawn = Vec::new();
            play(TestScene::Rooms, &mut pipelines, |_, _, pipelines| {
                drawn.push(osp_session::replay::fingerprint_of_frame(pipelines[0].draw_list().ids()));
                by_last += u32::from(pipelines[0].occlusion().is_some_and(OcclusionPass::is_by_last));
            });
            fingerprints.push(drawn);
        }
        assert_eq!(fingerprints[0], fingerprints[1]);
        assert_eq!(by_last > 0, polygon_ns > 1000.0);
    }
}

/// A pool that has followed changes only roughly still drops erased occluders.
#[test]
fn what_went_while_nobody_asked_hides_nothing() {
    // A wall in front of a sheet. The pass is used only in views with polygons.
    let mut lane = pipeline(Some(auto(1.0e6, AutoBasis::Work)));
    let mut told = Told::of(
        &[(0, -2.0, 3.0), (1, -4.0, 1.5)].map(|(i, z, half)| polygon_of(i, &square(0.0, 0.0, z, half))),
    );
    let before = view(Vec3::ZERO, Vec3::NEG_Z);
    let away = view(Vec3::ZERO, Vec3::Z);
    let changes = told.changes.clone();
    assert_eq!(lane.frame(&told.scene, &changes, &before).drawn(), 1);
    told.tell(&[SOLE.erase(StrokeId(0))]);
    let changes = told.changes.clone();
    assert!(!lane.frame(&told.scene, &changes, &away).occlusion.used);
    let record = lane.frame(&told.scene, &[], &before);
    assert!(record.occlusion.used);
    assert_eq!(record.drawn(), 1, "the sheet behind the wall that has gone");
    // When the wall is back, it hides the sheet again within three frames.
    told.tell(&[SOLE.undo()]);
    let changes = told.changes.clone();
    assert!(!lane.frame(&told.scene, &changes, &away).occlusion.used);
    let drawn: Vec<u64> = (0..3).map(|_| lane.frame(&told.scene, &[], &before).drawn()).collect();
    assert_eq!(drawn.last(), Some(&1), "{drawn:?}");
}

/// A wall moves aside in a frame that is not drawn. What it hid is drawn, and hides what is behind it.
#[test]
fn what_moved_in_a_skipped_frame_hides_nothing_where_it_was() {
    let squares = [(0, -2.0, 0.5), (1, -4.0, 0.4), (2, -8.0, 0.1)];
    let squares = squares.map(|(stroke, z, half_m)| polygon_of(stroke, &square(0.0, 0.0, z, half_m)));
    let view = view(Vec3::ZERO, Vec3::NEG_Z);
    for choice in [Occlusion::Msvbsp, Occlusion::PreviousFrame, Occlusion::Auto] {
        let mut lane = pipeline(Some(PassConfig { polygon_ns: 1.0e6, ..PassConfig::new(choice) }));
        let mut told = Told::of(&squares);
        lane.frame(&told.scene, &told.changes, &view);
        for visible in 1..=2 {
            let mut tries = 0;
            for frame in 0..45 {
                let drawn = lane.frame(&told.scene, &[], &view).drawn();
                assert!(lane.draw_list().contains(PolygonId(visible - 1)), "{choice:?}, frame {frame}");
                if lane.occlusion().is_some_and(OcclusionPass::is_by_last) {
                    assert_eq!(drawn, u64::from(visible), "the last use was too long ago: frame {frame}");
                    tries += 1;
                }
            }
            assert_eq!(tries > 0, choice == Occlusion::Auto, "{choice:?}");
            told.tell(&[SOLE.moved([StrokeId(0)], Vec3::X)]);
            lane.skip(&told.scene, &told.changes);
        }
    }
}

#[test]
fn every_choice_has_a_name_and_the_paper_is_none_by_default() {
    for name in Method::all().map(Method::name) {
        assert_eq!(Method::from_name(name).map(Method::name), Some(name));
    }
    assert_eq!(Method::from_name("guess"), None);
    assert_eq!(Method::Own(Occlusion::Auto).soundness(), Soundness::Conservative);
    // The paper's own form is there to compare with, labelled, and never chosen by itself.
    assert!(matches!(Method::from(RivalOcclusion::MsvbspPaper).soundness(), Soundness::Unsound(_)));
    assert!(!Method::conservative_cullers().contains(&RivalOcclusion::MsvbspPaper.into()));
    assert_eq!(Method::from_name("depth"), Some(Occlusion::Depth.into()));
}

/// Whoever draws says what a polygon costs; `auto` culls where that pays and stops where it does not.
#[test]
fn auto_goes_by_what_drawing_is_said_to_cost() {
    let (model, changes, heads) = finished_rooms();
    let mut moment = Moment::default();
    moment.note(&heads[0]);
    let view = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY).view(&moment);

    let mut lane = pipeline(Some(auto(1.0, AutoBasis::Work)));
    lane.frame(&model, &changes, &view);
    let mut frames_with = |polygon_ns: Option<f64>| {
        if let Some(ns) = polygon_ns {
            lane.set_polygon_ns(ns);
        }
        let mut culled = 0;
        for _ in 0..200 {
            culled += u32::from(lane.frame(&model, &[], &view).occlusion.occluded > 0);
        }
        (culled, lane.occlusion().expect("auto").config().polygon_ns)
    };
    let (cheap, ..) = frames_with(None);
    let (dear, polygon_ns) = frames_with(Some(1.0e5));
    assert_eq!(polygon_ns, 1.0e5);
    assert!(cheap < 10, "{cheap} of 200 frames culled where drawing costs nothing");
    assert!(dear > 150, "{dear} of 200 frames culled where drawing is dear");
    let (cheap, ..) = frames_with(Some(1.0));
    assert!(cheap < 30, "{cheap} of 200 frames culled where drawing costs nothing again");

    // A method that was asked for does not care.
    let mut fixed = pipeline(Some(PassConfig::new(Occlusion::Msvbsp)));
    fixed.set_polygon_ns(1.0e5);
    assert_ne!(fixed.occlusion().expect("msvbsp").config().polygon_ns, 1.0e5);
}

/// Old polygons of a drawn model are erased and come back, a few a frame, as undo and redo do it.
#[test]
fn where_nothing_is_hidden_few_frames_look_for_occluders_though_old_polygons_come_back() {
    let (mut model, mut changes) = (Scene::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, 4000, 1) {
        model.apply(&event.expect("a synthetic session is whole"), &mut changes);
    }
    let ids: Vec<PolygonId> = model.visible_ids().collect();
    let view = view(Vec3::new(0.0, 1.5, 12.0), Vec3::new(0.0, 1.5, 0.0));
    let mut pipeline = pipeline(Some(PassConfig::new(Occlusion::Msvbsp)));
    pipeline.load(&model);
    let of = |frame: usize| (0..16).map(move |i| frame * 71 + i * 113);
    let looks = (0..330).filter(|&frame| {
        let back = (frame > 0).then(|| of(frame - 1)).into_iter().flatten();
        let back = back.map(|i| Change::Insert(ids[i % ids.len()]));
        let gone = of(frame).map(|i| Change::Remove(ids[i % ids.len()]));
        let changes: Vec<Change> = back.chain(gone).collect();
        pipeline.frame(&model, &changes, &view).occlusion.used
    });
    let looks = looks.count();
    assert!((5..40).contains(&looks), "{looks} looks in 330 frames");
}

thread_local! {
    static READINGS: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}

/// Where nothing can pay, `auto` is not even asked what it costs: a frame of a few microseconds would notice.
#[test]
fn a_frame_in_which_nothing_can_pay_does_not_read_the_clock() {
    fn count_reading() -> u64 {
        READINGS.with(|readings| readings.replace(readings.get() + 1))
    }
    let readings = || READINGS.with(std::cell::Cell::get);
    let (model, changes, _) = finished_rooms();
    let view = view(Vec3::new(0.0, 1.5, 12.0), Vec3::new(0.0, 1.5, 0.0));
    let read = [None, Some(10.0), Some(100_000.0)].map(|polygon_ns| {
        let index = IndexKind::Osp.create(&IndexConfig::default());
        let mut pipeline = Pipeline::new(index, 10_000).with_clock(StageClock::counting(count_reading));
        if let Some(polygon_ns) = polygon_ns {
            pipeline = pipeline.with_occlusion(auto(polygon_ns, AutoBasis::Work));
        }
        pipeline.frame(&model, &changes, &view);
        let before = readings();
        for _ in 0..100 {
            let record = pipeline.frame(&model, &[], &view);
            assert!(record.visible > 100 && record.visible < 3600, "{}", record.visible);
        }
        readings() - before
    });
    assert_eq!(read[0], read[1], "without a pass, and with one that cannot pay");
    assert!(read[2] > read[1], "{read:?}");
}

/// An upright square around a point.
fn square(x: f32, y: f32, z: f32, half_m: f32) -> [Vec3; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(i, k)| Vec3::new(x + i * half_m, y + k * half_m, z))
}

/// The event that puts a stroke into group 0.
fn group_of_stroke(stroke: u32) -> Event {
    SOLE.grouped(GroupId(0), [StrokeId(stroke)], None)
}

/// A group that moves as a whole is in no index. Most indexes are walked for what is not hidden and say nothing of it.
#[test]
fn a_group_that_moves_as_a_whole_is_drawn_with_every_index() {
    let spread = |i: usize, side: usize| (i % side) as f32 / side as f32 - 0.5;
    let mut events = vec![polygon(&square(0.0, 0.0, -5.0, 2.0), 1.0)];
    events.extend((0..400).map(|i| polygon(&square(spread(i, 20), spread(i / 20, 20), -8.0, 0.02), 1.0)));
    events.extend((0..30).map(|i| polygon_of(1, &square(spread(i, 6), spread(i / 6, 5), -3.0, 0.02))));
    events.push(group_of_stroke(1));
    for kind in IndexKind::ALL {
        let mut scene = Scene::keeping_groups_whole();
        let config = PassConfig { polygon_ns: 1000.0, ..PassConfig::new(Occlusion::Msvbsp) };
        let index = kind.create(&IndexConfig::default());
        let mut lane = Pipeline::new(index, 1000).with_occlusion(config);
        let mut changes = Vec::new();
        scene.apply_all(&events, &mut changes);
        for frame in 0..6 {
            let to = Transform { p: Vec3::X * (0.01 * frame as f32), q: Quat::IDENTITY, s: 1.0 };
            scene.apply(&SOLE.placed(GroupId(0), to), &mut changes);
            let record = lane.frame(&scene, &changes, &view(Vec3::ZERO, Vec3::NEG_Z));
            changes.clear();
            let name = kind.name();
            assert!(record.occlusion.used && record.occlusion.occluders > 0, "{name}, frame {frame}");
            assert!(record.occlusion.occluded > 0, "{name}, frame {frame}");
            let drawn = lane.draw_list().to_vec();
            let group = (401..431).map(PolygonId);
            assert_eq!(group.filter(|id| drawn.contains(id)).count(), 30, "{name}, frame {frame}");
        }
        assert!((401..431).all(|id| Geometry::space(&scene, PolygonId(id)).is_some()), "it moves as a whole");
    }
}

/// A group that is dragged through a room with a wall: before it, behind it, and half way beside it.
#[test]
fn a_group_that_is_dragged_behind_a_wall_is_hidden_and_nothing_else_of_it() {
    let mut events = vec![polygon(&square(0.0, 0.0, -5.0, 1.0), 1.0)];
    let at = |i: usize| ((i % 8) as f32 * 0.2 - 0.7, (i / 8) as f32 * 0.2 - 0.7);
    events.extend((0..64).map(|i| polygon_of(1, &square(at(i).0, at(i).1, 0.0, 0.05))));
    events.push(group_of_stroke(1));
    let views = [view(Vec3::ZERO, Vec3::NEG_Z), view(Vec3::new(0.5, 0.3, 0.0), Vec3::new(0.0, 0.0, -5.0))];
    // One that is walked for what is not hidden, and one that is not.
    for kind in [IndexKind::OctreeRebuild, IndexKind::Osp] {
        for method in Method::conservative_cullers() {
            let name = format!("{}, {}", kind.name(), method.name());
            let mut scene = Scene::keeping_groups_whole();
            let config = PassConfig { polygon_ns: 1.0e6, ..PassConfig::default() };
            let index = kind.create(&IndexConfig::default());
            let mut lane = method.add_to(Pipeline::new(index, 1000), config);
            let mut changes = Vec::new();
            scene.apply_all(&events, &mut changes);
            let drawn = [(0.0, -3.0), (0.0, -7.0), (1.4, -7.0), (0.0, -7.5), (0.4, -4.0), (3.0, -7.0)].map(
                |(x, z)| {
                    let to = Transform { p: Vec3::new(x, 0.0, z), q: Quat::from_rotation_y(0.1 * x), s: 1.0 };
                    scene.apply(&SOLE.placed(GroupId(0), to), &mut changes);
                    // If nothing was hidden before, occlusion culling runs in only some of the frames.
                    let mut is_culled = lane.frame_of_views(&scene, &changes, &views).occlusion.used;
                    changes.clear();
                    for _ in 0..100 {
                        is_culled = is_culled || lane.frame_of_views(&scene, &[], &views).occlusion.used;
                    }
                    assert!(is_culled, "{name} at {x}, {z}");
                    for (view, (drawn, in_view)) in
                        views.iter().zip(lane.draw_lists().iter().zip(lane.in_view_lists()))
                    {
                        let window = view.window().expect("a window");
                        let (in_view_ids, config) = (in_view.to_vec(), OracleConfig::default());
                        let seen = verify::visible_polygons(&scene, &window, &in_view_ids, config);
                        assert_eq!(verify::missing(&seen, &drawn.to_vec()), 0, "{name} at {x}, {z}");
                        assert!(drawn.ids().all(|id| in_view.contains(id)), "{name} at {x}, {z}");
                    }
                    lane.draw_list().ids().filter(|id| id.0 > 0).count()
                },
            );
            let mut group = (1..=64).map(PolygonId);
            assert!(group.all(|id| Geometry::space(&scene, id).is_some()), "it moves as a whole");
            assert_eq!((drawn[0], drawn[4]), (64, 64), "{name}: before the wall");
            // Single shadows and depth buffers, too, hide what is well behind the wall.
            assert_eq!((drawn[1], drawn[3]), (0, 0), "{name}: behind the wall");
            assert!((1..64).contains(&drawn[2]), "{name}: {} of a half", drawn[2]);
        }
    }
}

#[test]
fn each_culler_but_none_becomes_a_pass_and_a_method_of_the_renderer_does_not() {
    let drawn = [Method::NONE, Method::Hzb, Method::Queries];
    for method in Method::CULLERS.iter().chain(&drawn) {
        let pipeline = Pipeline::new(IndexKind::Osp.create(&IndexConfig::default()), 10);
        let pipeline = method.add_to(pipeline, PassConfig::default());
        assert_eq!(pipeline.occlusion().is_some(), method.is_on_cpu(), "{}", method.name());
        assert_eq!(method.is_on_cpu(), !drawn.contains(method), "{}", method.name());
    }
}
