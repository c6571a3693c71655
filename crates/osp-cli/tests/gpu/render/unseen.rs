//! What was moved while it could not be seen is drawn where it is: a drawer that follows a session, frame by frame and
//! through jumps, against one that meets the model for the first time.

use std::sync::Arc;

use super::scenes::{self, apply, gpu, square};
use glam::Vec3;
use osp::{
    polygon::{Change, PolygonId},
    view::{Projection, View},
};
use osp_render::{Gpu, GpuOcclusion, Image, Offscreen, RenderError, RendererConfig};
use osp_session::{
    recording::{Author, Event, StrokeId},
    scene::Scene,
};
use osp_testkit::Editor;

const SIDE: u32 = 64;

fn drawer(gpu: &Arc<Gpu>) -> Offscreen {
    let config = RendererConfig { chunk_len: 64, ..RendererConfig::default() };
    Offscreen::on(Arc::clone(gpu), SIDE, SIDE, &config).expect("a drawer")
}

fn ahead() -> View {
    View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 1.0, 0.01, 100.0))
}

fn picture(drawer: &mut Offscreen, scene: &Scene) -> Image {
    scenes::picture(drawer, scene, &ahead())
}

fn compare(gpu: &Arc<Gpu>, follower: &mut Offscreen, scene: &Scene, when: &str) -> u64 {
    let followed = picture(follower, scene);
    let fresh = picture(&mut drawer(gpu), scene);
    assert_eq!(followed.differing_pixels(&fresh), 0, "{when}");
    fresh.drawn_pixels() as u64
}

#[test]
fn whatever_is_edited_the_picture_is_a_fresh_drawers() {
    let Some(gpu) = gpu() else { return };
    let mut shown = 0;
    for seed in 0..6 {
        let mut editor = Editor::new(seed);
        let (mut scene, mut follower) = (Scene::new(), drawer(&gpu));
        let changes = apply(&mut scene, &editor.start());
        follower.renderer.follow(&changes);
        picture(&mut follower, &scene);
        for frame in 0..40 {
            let mut changes: Vec<Change> = Vec::new();
            scene.free_unreachable();
            scene.apply_all(&editor.frame(), &mut changes);
            follower.renderer.follow(&changes);
            // Some frames are not drawn.
            if editor.below(3) > 0 {
                shown += compare(&gpu, &mut follower, &scene, &format!("seed {seed}, frame {frame}"));
            }
        }
    }
    assert!(shown > 5_000, "{shown} pixels drawn");
}

/// A jump as a window takes it: the numbers that will be given out again are forgotten, what moved is sent again.
#[cfg(feature = "window")]
#[test]
fn wherever_a_recording_is_entered_the_picture_is_a_fresh_drawers() {
    use osp_app::Session;
    use osp_session::{
        recording::{Flush, Header, Pace, RonWriter},
        replay::CameraChoice,
    };
    let Some(gpu) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    for seed in 100..104 {
        let path = folder.path().join(format!("{seed}.ron"));
        let mut editor = Editor::new(seed);
        let mut writer = RonWriter::create(&path, &Header::new("", ""), Flush::AtEnd).expect("a file");
        let mut events = editor.start();
        (0..150).for_each(|_| events.extend(editor.edit()));
        events.iter().for_each(|event| writer.write(event).expect("a line"));
        writer.finish().expect("a file");
        let mut player = Session::to_play(&path, Pace::Samples(2), CameraChoice::Orbit).expect("a recording");
        let mut follower = drawer(&gpu);
        let frames = player.replay().expect("a replay").frame_count() as u32;
        assert!(frames > 40, "{frames} frames");
        for round in 0..40 {
            if editor.below(2) == 0 {
                let jump = player.seek(u64::from(editor.below(frames + 1))).expect("a replay");
                follower.renderer.forget_from(jump.polygon_count);
                let moved: Vec<Change> = jump.moved.into_iter().map(Change::Update).collect();
                follower.renderer.follow(&moved);
            } else {
                let mut changes = Vec::new();
                (0..editor.below(6)).for_each(|_| _ = player.step(&mut changes));
                follower.renderer.follow(&changes);
            }
            if editor.below(3) > 0 {
                let when = format!(
                    "seed {seed}, round {round}, frame {}",
                    player.replay().expect("a replay").position()
                );
                compare(&gpu, &mut follower, player.scene(), &when);
            }
        }
    }
}

/// Squares in stacks of 64, a chunk each.
fn stacks(count: u32, number: &mut u32) -> Vec<Event> {
    let mut events = Vec::new();
    for _ in 0..count {
        let stroke = Some(StrokeId(*number));
        for i in 0..64 {
            let x = (*number % 7) as f32 * 0.2 - 0.6;
            let mut event = square(Vec3::new(x, 0.0, -2.0 - 0.01 * i as f32), 0.08, (0.9, 0.5, 0.1, 1.0));
            if let Event::Polygon { stroke: of, .. } = &mut event {
                *of = stroke;
            }
            events.push(event);
        }
        *number += 1;
    }
    events
}

#[test]
fn what_the_scene_lets_go_takes_no_memory_of_the_gpu() {
    let Some(gpu) = gpu() else { return };
    const CHUNK_BYTES: u64 = 64 * 96;
    let config = RendererConfig { chunk_len: 64, ..RendererConfig::default() };
    for occlusion in [GpuOcclusion::None, GpuOcclusion::Hzb] {
        let mut follower = Offscreen::on(Arc::clone(&gpu), SIDE, SIDE, &config).expect("a drawer");
        match follower.set_occlusion(occlusion) {
            Err(error @ RenderError::NoOcclusion { .. }) if !osp_testkit::nothing_may_be_skipped() => {
                eprintln!("skipped: {error}");
                continue;
            }
            outcome => outcome.expect("what hzb needs"),
        }
        let (mut scene, mut number) = (Scene::new(), 0);
        let frame = |scene: &mut Scene, follower: &mut Offscreen, events: &[Event]| {
            let mut changes = Vec::new();
            scene.free_unreachable();
            scene.apply_all(events, &mut changes);
            follower.renderer.follow(&changes);
            compare(&gpu, follower, scene, &format!("{occlusion:?}"));
            follower.renderer.bytes()
        };
        let first = stacks(20, &mut number);
        assert_eq!(frame(&mut scene, &mut follower, &first), 20 * CHUNK_BYTES);
        let early = scene.clone();
        // All but two are taken back and drawn over.
        let mut events = vec![Event::Undo { author: Author::SOLE, t: 0.0 }; 18];
        events.extend(stacks(3, &mut number));
        frame(&mut scene, &mut follower, &events);
        frame(&mut scene, &mut follower, &[]);
        assert_eq!(frame(&mut scene, &mut follower, &[]), 5 * CHUNK_BYTES);
        // A replay that is taken back to when they were there.
        follower.renderer.forget_from(early.polygon_count());
        let all: Vec<Change> =
            (0..early.polygon_count() as u32).map(|i| Change::Update(PolygonId(i))).collect();
        follower.renderer.follow(&all);
        let mut scene = early;
        assert_eq!(frame(&mut scene, &mut follower, &[]), (20 + 3) * CHUNK_BYTES);
        assert_eq!(frame(&mut scene, &mut follower, &stacks(2, &mut number)), (20 + 3) * CHUNK_BYTES);
    }
}
