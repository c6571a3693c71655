//! A view that jumps: the frame that shows another place finds out what is visible there, so the next one draws the depth of
//! that and not of everything in view.

use super::{
    hzb::{HZB, Pair, chunk_len},
    scenes::{all_ids, apply, gpu, square, view_from},
};
use glam::Vec3;
use osp::{polygon::PolygonId, view::View};
use osp_render::DrawnCounts;
use osp_session::scene::Scene;

const SIZE: (u32, u32) = (481, 361);
/// Walls and what is between them.
const SQUARES: usize = 32 * 32;

/// A wall at either end, and between them many squares that the nearer wall hides.
fn between_walls(center: Vec3) -> Scene {
    let mut scene = Scene::new();
    add_between_walls(&mut scene, center);
    scene
}

fn add_between_walls(scene: &mut Scene, center: Vec3) {
    let wall = |z: f32| square(center + Vec3::Z * z, 1.5, (0.6, 0.6, 0.5, 1.0));
    apply(scene, &[wall(1.0), wall(-1.0)]);
    for i in 0..SQUARES {
        let at = Vec3::new((i % 32) as f32 / 16.0 - 1.0, (i / 32) as f32 / 16.0 - 1.0, (i % 5) as f32 * 0.1);
        apply(scene, &[square(center + at, 0.02, (0.9, 0.2, 0.1, 1.0))]);
    }
}

/// Draws a frame, which must show what it shows without culling; what it drew.
fn frame(pair: &mut Pair, scene: &Scene, view: &View, ids: &[PolygonId], what: &str) -> DrawnCounts {
    pair.counts = DrawnCounts::default();
    assert_eq!(pair.compare(scene, view, ids).0, 0, "{what}");
    eprintln!("{what}: {:?}", pair.counts);
    pair.counts
}

/// Three frames after a jump: the first draws each polygon once, the second recalls what is visible, as the third does.
fn check_three(pair: &mut Pair, scene: &Scene, view: &View, ids: &[PolygonId], what: &str) {
    let [first, second, third] =
        [1, 2, 3].map(|n| frame(pair, scene, view, ids, &format!("{what}, frame {n}")));
    assert_eq!((first.first_pass, first.second_pass), (0, first.in_view), "{what}");
    // The near wall hides all the squares and the other wall.
    let most = ids.len() as u64 / 10;
    assert!(second.first_pass > 0 && second.first_pass < most, "{what}: {second:?}");
    assert!(second.second_pass < most, "{what}: {second:?}");
    assert_eq!((second.first_pass, second.second_pass), (third.first_pass, third.second_pass), "{what}");
}

#[test]
fn the_second_frame_after_a_jump_recalls_what_is_visible_and_no_more() {
    let Some(gpu) = gpu() else { return };
    // Around the walls: the same is in view, and other sides of it are seen.
    let scene = between_walls(Vec3::ZERO);
    let ids = all_ids(&scene);
    let Some(mut pair) = Pair::new(&gpu, SIZE, HZB, chunk_len()) else { return };
    let from = |eye: Vec3| view_from(eye, Vec3::ZERO);
    check_three(&mut pair, &scene, &from(Vec3::new(0.1, 0.2, 5.0)), &ids, "the first frames");
    check_three(&mut pair, &scene, &from(Vec3::new(0.1, 0.2, -5.0)), &ids, "from behind");
    check_three(&mut pair, &scene, &from(Vec3::new(0.1, 0.2, 5.0)), &ids, "and back");
    // A step is no jump: what was visible is recalled at once, and hides the rest.
    let step = frame(&mut pair, &scene, &from(Vec3::new(0.3, 0.2, 4.9)), &ids, "a step");
    assert!(step.first_pass > 0 && step.second_pass < ids.len() as u64 / 10, "{step:?}");
    // A turn: all in view is new, at the same eye.
    let mut scene = between_walls(Vec3::ZERO);
    let count = scene.polygon_count();
    add_between_walls(&mut scene, Vec3::Z * 10.0);
    let all = all_ids(&scene);
    let (here, there) = all.split_at(count);
    let eye = Vec3::new(0.1, 0.2, 5.0);
    let Some(mut pair) = Pair::new(&gpu, SIZE, HZB, chunk_len()) else { return };
    check_three(&mut pair, &scene, &view_from(eye, Vec3::ZERO), here, "ahead");
    check_three(&mut pair, &scene, &view_from(eye, Vec3::Z * 10.0), there, "behind");
    check_three(&mut pair, &scene, &view_from(eye, Vec3::ZERO), here, "ahead again");
}

#[test]
fn what_a_jump_leaves_behind_hides_nothing_that_comes_into_view() {
    let Some(gpu) = gpu() else { return };
    let mut scene = between_walls(Vec3::ZERO);
    let Some(mut pair) = Pair::new(&gpu, SIZE, HZB, chunk_len()) else { return };
    let eyes = [(0.0, 0.0, 5.0), (0.0, 0.3, -0.5), (2.0, 0.0, 0.2), (0.2, 4.0, 3.0), (0.0, 0.0, -5.0)];
    for (i, (x, y, z)) in eyes.into_iter().cycle().take(15).enumerate() {
        for time in 0..1 + i % 3 {
            // Every frame with something new, in front of or behind what was there, and after the jump with a step of the eye.
            let at = Vec3::new(x, y, z) * if (i + time) % 2 == 0 { 0.6 } else { -0.4 };
            let color = (0.1, 0.4, 0.9, 0.5 + 0.5 * ((i + time) % 2) as f32);
            let changes = apply(&mut scene, &[square(at, 0.2, color)]);
            pair.follow(&changes);
            let view = view_from(Vec3::new(x, y, z) * (1.0 + 0.2 * time as f32), Vec3::ZERO);
            pair.check(&scene, &view, &format!("jump {i}, time {time}"));
        }
    }
    assert!(pair.counts.hidden() > 1000, "{:?}", pair.counts);
}
