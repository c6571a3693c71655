//! Large polygons: what hides them is found as well as by occlusion queries, which draw.

use std::sync::Arc;

use super::{
    hzb::{HZB, Pair, QUERIES, chunk_len},
    scenes::{all_ids, apply, gpu, square, view_from},
};
use glam::Vec3;
use osp::view::View;
use osp_render::{Gpu, GpuOcclusion};
use osp_session::{
    recording::{Author, Event},
    scene::Scene,
};

const SIZE: (u32, u32) = (961, 721);
/// Polygons that are asked about together by queries.
const GROUP: usize = 64;
/// Frames of a camera at rest: each group has been asked by then.
const FRAMES: usize = 12;

/// A board across an axis.
fn board(axis: usize, center: Vec3, half_m: [f32; 2]) -> Event {
    let corner = |u: f32, v: f32| {
        let mut p = center;
        p[(axis + 1) % 3] += u * half_m[0];
        p[(axis + 2) % 3] += v * half_m[1];
        p
    };
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Event::Polygon {
        author: Author::SOLE,
        t: 0.0,
        stroke: None,
        vertices,
        shading: None,
        color: (0.4, 0.5, 0.3, 1.0),
    }
}

/// Three boards that meet in a corner, and behind each a stack of boards, nearly as large and close to each other. The number
/// of polygons that only the three hide.
fn stacks() -> (Scene, usize) {
    let mut scene = Scene::new();
    let faces: Vec<Event> = (0..3).map(|axis| board(axis, Vec3::AXES[axis], [1.0, 1.0])).collect();
    apply(&mut scene, &faces);
    // The first group is seen.
    for i in faces.len()..GROUP {
        apply(&mut scene, &[square(Vec3::new(0.02 * i as f32, 1.3, 1.3), 0.008, (0.9, 0.1, 0.1, 1.0))]);
    }
    for axis in 0..3 {
        for i in 0..GROUP {
            // Of several shapes, so that edges lie anywhere.
            let part = 0.7 + 0.2 * (i * 37 % GROUP) as f32 / GROUP as f32;
            let half_m = if i % 2 == 0 { [part, 0.85] } else { [0.85, part] };
            apply(&mut scene, &[board(axis, Vec3::AXES[axis] * (0.98 - 0.008 * i as f32), half_m)]);
        }
    }
    (scene, 3 * GROUP)
}

fn eyes() -> [View; 3] {
    [Vec3::new(2.4, 2.1, 2.3), Vec3::new(3.2, 1.6, 1.9), Vec3::new(1.9, 3.5, 1.5)]
        .map(|eye| view_from(eye, Vec3::splat(0.6)))
}

/// Polygons found to be hidden by a camera at rest, in the frame in which most were.
fn most_hidden(gpu: &Arc<Gpu>, scene: &Scene, occlusion: GpuOcclusion) -> Option<Vec<u64>> {
    let ids = all_ids(scene);
    let mut found = Vec::new();
    for view in eyes() {
        let mut pair = Pair::new(gpu, SIZE, occlusion, chunk_len())?;
        let mut most = 0;
        for frame in 0..FRAMES {
            let before = pair.counts.hidden();
            let (differing, _) = pair.compare(scene, &view, &ids);
            assert_eq!(differing, 0, "{occlusion:?}, {}, frame {frame}", view.eye_in_world);
            most = most.max(pair.counts.hidden() - before);
        }
        found.push(most);
    }
    Some(found)
}

#[test]
fn of_large_polygons_as_many_are_found_as_by_queries() {
    let Some(gpu) = gpu() else { return };
    let (scene, behind) = stacks();
    let (Some(hzb), Some(queries)) = (most_hidden(&gpu, &scene, HZB), most_hidden(&gpu, &scene, QUERIES))
    else {
        return;
    };
    eprintln!("of {behind} hidden: hzb {hzb:?}, queries {queries:?}");
    for (hzb, queries) in hzb.iter().zip(&queries) {
        assert!(*queries * 10 > behind as u64 * 6, "queries find {queries} of {behind}");
        assert!(*hzb * 10 >= *queries * 9, "hzb finds {hzb}, queries {queries}");
        assert!(*hzb * 10 > behind as u64 * 9, "hzb finds {hzb} of {behind}");
    }
}

/// Layers of paint, a few millimetres apart and seen aslant: only single samples tell.
#[test]
fn what_lies_close_behind_a_slanted_surface_is_found() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    apply(&mut scene, &[board(1, Vec3::new(0.0, 0.0, 0.0), [2.0, 2.0])]);
    // Small ones: a pixel is as wide as they lie deep.
    let below = 400;
    for i in 0..below {
        let at = Vec3::new((i % 20) as f32 * 0.1 - 1.0, -0.006, (i / 20) as f32 * 0.1 - 1.0);
        apply(&mut scene, &[board(1, at, [0.04, 0.04])]);
    }
    let view = view_from(Vec3::new(0.0, 1.2, 3.5), Vec3::ZERO);
    let Some(mut pair) = Pair::new(&gpu, (481, 361), HZB, chunk_len()) else { return };
    let mut found = 0;
    for frame in 0..3 {
        let before = pair.counts.hidden();
        pair.check(&scene, &view, &format!("frame {frame}"));
        found = pair.counts.hidden() - before;
    }
    assert!(found * 20 > below * 19, "{found} of {below}");
}
