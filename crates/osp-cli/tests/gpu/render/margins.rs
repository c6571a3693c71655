//! What culling while drawing leaves to rounding: scenes in which a polygon is seen only because the rasteriser snaps and
//! rounds, or next to the eye. Each fails without the margin or the guard that it is for.

use std::sync::Arc;

use super::{
    hzb::{HZB, Pair, QUERIES, chunk_len},
    scenes::{all_ids, gpu, square, view_from},
};
use glam::{Mat3, Quat, Vec2, Vec3};
use osp::{
    polygon::PolygonId,
    view::{Projection, View},
};
use osp_render::{Gpu, GpuOcclusion};
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::{
    boxes::Rng,
    events::{polygon, scene_of},
};

const WALL: (f32, f32, f32, f32) = (0.3, 0.5, 0.2, 1.0);
const BRIGHT: (f32, f32, f32, f32) = (1.0, 0.4, 0.9, 1.0);

/// Draws a view of some of a scene's polygons at rest, with and without; pixels that differ in all frames together.
fn differing(pair: &mut Pair, scene: &Scene, view: &View, ids: &[PolygonId], frames: usize) -> usize {
    (0..frames).map(|_| pair.compare(scene, view, ids).0).sum()
}

fn pair(gpu: &Arc<Gpu>, size: (u32, u32), occlusion: GpuOcclusion) -> Option<Pair> {
    Pair::new(gpu, size, occlusion, chunk_len())
}

fn ahead() -> View {
    view_from(Vec3::ZERO, Vec3::NEG_Z)
}

/// Two corners of it lie behind a wall on the left. The third is behind the eye, and would by division by a negative number
/// lie on the left, too; what is seen of it is on the right, before the wall.
#[test]
fn a_polygon_with_a_corner_behind_the_eye_is_drawn() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&[
        polygon(
            None,
            [(-2.0, -1.5), (-0.05, -1.5), (-0.05, 1.5), (-2.0, 1.5)]
                .map(|(x, y)| Vec3::new(x, y, -2.0))
                .to_vec(),
            WALL,
        ),
        polygon(
            None,
            vec![Vec3::new(-2.0, -0.5, -4.0), Vec3::new(-2.0, 0.5, -4.0), Vec3::new(1.0, 0.0, 1.5)],
            BRIGHT,
        ),
    ]);
    let Some(mut pair) = pair(&gpu, (161, 121), HZB) else { return };
    assert_eq!(differing(&mut pair, &scene, &ahead(), &all_ids(&scene), 3), 0);
}

/// A group of 64 whose box begins at `nearest_m` before the eye (negative: behind it) and ends behind a wall that fills the
/// picture; its sides come into the picture only behind the wall. One of the group stands before the wall.
fn box_around_the_eye(nearest_m: f32) -> Scene {
    let mut events = vec![square(Vec3::new(0.0, 0.0, -1.5), 4.0, WALL)];
    // The wall's own group.
    events.resize_with(64, || square(Vec3::new(0.0, 0.0, -9.0), 0.1, WALL));
    let at = |x: f32, y: f32, z_m: f32| square(Vec3::new(x, y, z_m), 0.05, BRIGHT);
    events.extend([at(0.1, 0.1, -1.0), at(2.4, 2.4, -3.0), at(-2.4, -2.4, -3.0), at(2.4, -2.4, -nearest_m)]);
    events.resize_with(128, || at(0.0, 0.0, -3.0));
    scene_of(&events)
}

#[test]
fn a_group_around_the_eye_or_its_near_plane_is_not_asked_by_its_box() {
    let Some(gpu) = gpu() else { return };
    // A box grows by a pixel and a half at its far end; the near plane is at 1 cm.
    let size = (481, 361);
    let grown_m = 3.0 * 2.0 * 30.0f32.to_radians().tan() / size.1 as f32 * 1.5;
    for nearest_m in [-0.5, 0.0, grown_m * 0.5, grown_m + 0.003, grown_m + 0.006, grown_m + 0.009] {
        let scene = box_around_the_eye(nearest_m);
        let Some(mut pair) = pair(&gpu, size, QUERIES) else { return };
        assert_eq!(
            differing(&mut pair, &scene, &ahead(), &all_ids(&scene), 6),
            0,
            "nearest at {nearest_m} m"
        );
    }
}

/// A window of any shape that looks anywhere from anywhere.
fn any_view(random: &mut Rng) -> (View, Mat3) {
    let turn = Quat::from_euler(
        glam::EulerRot::YXZ,
        random.range(-3.0, 3.0),
        random.range(-1.2, 1.2),
        random.range(-3.0, 3.0),
    );
    let eye = Vec3::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0), random.range(-3.0, 3.0));
    let projection = Projection::symmetric(random.range(40.0, 80.0), 4.0 / 3.0, 0.01, 1.0e5);
    (View { eye_in_world: eye, world_from_view: turn, projection }, Mat3::from_quat(turn))
}

/// How far apart the corners of two quadrilaterals are that have the same outline on the picture.
#[derive(Clone, Copy, Debug)]
enum Apart {
    /// Those of the second lie on the edges of the first.
    Within,
    /// Those of the second lie on the lengthened edges of the first, far out of the picture, at other distances.
    FarOut,
}

/// Scenes of a few polygons each, in one model, so that one drawer draws all of them.
#[derive(Default)]
struct Cases {
    events: Vec<Event>,
    views: Vec<(View, std::ops::Range<u32>)>,
}

impl Cases {
    /// Each begins with a group of its own: what queries ask about together. One of which a polygon is too flat for the
    /// scene is left out.
    fn add(&mut self, view: View, events: Vec<Event>) {
        if scene_of(&events).polygon_count() != events.len() {
            return;
        }
        self.events.resize_with(self.events.len().next_multiple_of(64), || square(Vec3::ZERO, 0.1, WALL));
        let first = self.events.len() as u32;
        self.events.extend(events);
        self.views.push((view, first..self.events.len() as u32));
    }

    fn check(&self, size: (u32, u32), occlusion: GpuOcclusion, frames: usize) {
        let Some(gpu) = gpu() else { return };
        let scene = scene_of(&self.events);
        assert_eq!(scene.polygon_count(), self.events.len());
        assert!(self.views.len() > 40, "{} cases", self.views.len());
        let Some(mut pair) = pair(&gpu, size, occlusion) else { return };
        for (number, (view, ids)) in self.views.iter().enumerate() {
            let ids: Vec<_> = ids.clone().map(PolygonId).collect();
            let pixels = differing(&mut pair, &scene, view, &ids, frames);
            assert_eq!(pixels, 0, "{occlusion:?}, {size:?}, case {number}");
        }
    }
}

/// Before: a quadrilateral. Behind: another, whose left and right edges lie on the same lines of the picture as those of the
/// one before. What the rasteriser makes of two such lines differs by what it snaps and rounds.
fn same_outline(random: &mut Rng, apart: Apart) -> (View, Vec<Event>) {
    let (view, to_world) = any_view(random);
    let Projection { right, top, .. } = view.projection;
    // On the window at distance 1: two edges, upright within a third.
    let edge = |x: f32, random: &mut Rng| {
        let at = |y: f32, x: f32| Vec2::new(x * right, y * top);
        let lean = random.range(-0.3, 0.3);
        [at(-0.8, x - lean), at(0.8, x + lean)]
    };
    let edges = [edge(random.range(-0.6, -0.3), random), edge(random.range(0.3, 0.6), random)];
    let place = |at: Vec2, distance_m: f32| view.eye_in_world + to_world * (at.extend(-1.0) * distance_m);
    let quad = |parts: [f32; 4], distances_m: [f32; 4]| {
        let [left, right] = edges;
        let ends = [(left, 0), (right, 1), (right, 2), (left, 3)];
        ends.map(|([from, to], i)| place(from.lerp(to, parts[i]), distances_m[i])).to_vec()
    };
    let before = quad([-0.2, -0.2, 1.2, 1.2], [2.0; 4]);
    let behind = match apart {
        Apart::Within => {
            let (low, high) = (random.range(0.05, 0.4), random.range(0.6, 0.95));
            quad([low, low, high, high], [3.0; 4])
        }
        // One corner only: four need not lie in a plane.
        Apart::FarOut => {
            let far = 10.0f32.powf(random.range(0.5, 4.0));
            let far_m = 3.0 * 10.0f32.powf(random.range(0.0, 3.0));
            let mut corners = quad([0.1, 0.1, far, far], [3.0, 3.0, far_m, far_m]);
            corners.remove(if random.unit() < 0.5 { 2 } else { 3 });
            corners
        }
    };
    (view, vec![polygon(None, before, WALL), polygon(None, behind, BRIGHT)])
}

fn outlines(apart: Apart, count: usize) -> Cases {
    let (mut random, mut cases) = (Rng(1), Cases::default());
    for _ in 0..count {
        let (view, events) = same_outline(&mut random, apart);
        cases.add(view, events);
    }
    cases
}

/// In a small picture nothing but snapping moves an edge.
#[test]
fn an_edge_that_is_snapped_away_from_the_one_before_it_is_seen() {
    outlines(Apart::Within, 400).check((16, 12), HZB, 3);
    outlines(Apart::Within, 60).check((161, 121), HZB, 3);
}

#[test]
fn an_edge_whose_end_is_far_beside_the_picture_is_where_the_rasteriser_puts_it() {
    outlines(Apart::FarOut, 400).check((161, 121), HZB, 3);
}

#[test]
fn an_edge_that_is_snapped_away_from_its_box_is_seen() {
    // Flat boxes: walls across an axis, seen from anywhere.
    let (mut random, mut cases) = (Rng(7), Cases::default());
    for _ in 0..200 {
        let (view, _) = any_view(&mut random);
        let center = Vec3::new(0.0, 0.0, -3.0);
        let eye =
            center + Vec3::new(random.range(-1.5, 1.5), random.range(-1.5, 1.5), random.range(1.5, 2.5));
        let view = View::look_at(eye, center, view.projection);
        let quad = |parts: [(f32, f32); 4]| parts.map(|(x, y)| center + Vec3::new(x, y, 0.0)).to_vec();
        let outer = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        // What hides it has the outline of its box, and lies before it.
        let before = quad(outer).into_iter().map(|p| eye + (p - eye) * 0.9).collect::<Vec<_>>();
        let (low, high) = (random.range(-0.9, -0.3), random.range(0.3, 0.9));
        let across = quad([(-1.0, low), (1.0, low), (1.0, high), (-1.0, high)]);
        let upright = quad([(low, -1.0), (high, -1.0), (high, 1.0), (low, 1.0)]);
        let mut events = vec![polygon(None, before, WALL)];
        events.resize_with(64, || square(Vec3::splat(50.0), 0.1, WALL));
        events.extend([polygon(None, across, BRIGHT), polygon(None, upright, BRIGHT)]);
        cases.add(view, events);
    }
    cases.check((64, 48), QUERIES, 4);
}

/// Of two polygons in one plane, seen straight on, which wins is a matter of rounding.
#[test]
fn in_one_plane_rounding_decides_and_nothing_is_left_out() {
    let (mut random, mut cases) = (Rng(3), Cases::default());
    for _ in 0..60 {
        let (view, to_world) = any_view(&mut random);
        let distance_m = random.range(0.5, 20.0);
        let mut quad = |scale: f32| {
            let turn = random.range(0.0, 3.0);
            let corner = |i: u32| {
                let at = Vec2::from_angle(turn + i as f32 * std::f32::consts::FRAC_PI_2) * scale;
                view.eye_in_world + to_world * (at.extend(-1.0) * distance_m)
            };
            (0..4).map(corner).collect::<Vec<_>>()
        };
        let mut events = vec![polygon(None, quad(0.5), WALL)];
        events.extend((0..12).map(|_| polygon(None, quad(0.2), BRIGHT)));
        cases.add(view, events);
    }
    cases.check((161, 121), HZB, 3);
}

/// A triangle ends 5 pixels beyond the picture's right border, where it is 0.1 pixels wide. A driver may cut it there, and on the
/// pieces depth is known far worse than on the whole: it must not be hidden by what it has drawn itself.
#[test]
fn a_triangle_that_is_cut_at_the_border_does_not_hide_itself() {
    let Some(gpu) = gpu() else { return };
    let view = View {
        eye_in_world: Vec3::new(0.386_899_95, -0.605_199_8, 6.514_940_3),
        world_from_view: Quat::from_xyzw(0.0, 0.848_048_1, 0.0, -0.529_919_27),
        projection: Projection {
            left: -1.026_400_4,
            right: 1.026_400_4,
            bottom: -0.577_350_26,
            top: 0.577_350_26,
            near_m: 0.023_184_9,
            far_m: 46.369_797,
        },
    };
    let size = (1920, 1080);
    // From one pixel to another, so far away.
    let before = |low: [f32; 2], high: [f32; 2], away_m: f32| {
        let Projection { left, right, bottom, top, .. } = view.projection;
        let at = |x: f32, y: f32| {
            let (x, y) = (x / size.0 as f32, 1.0 - y / size.1 as f32);
            let ray = Vec3::new(left + (right - left) * x, bottom + (top - bottom) * y, -1.0);
            view.eye_in_world + view.world_from_view * (ray * away_m)
        };
        let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        polygon(None, corners.map(|[x, y]| at(x, y)).to_vec(), WALL)
    };
    let triangle = |corners: [[f32; 3]; 3], color| polygon(None, corners.map(Vec3::from).to_vec(), color);
    // All but one sample of the pixel (1919, 935) is covered by what is nearer.
    let scene = scene_of(&[
        before([100.0, 700.0], [1918.6, 1000.0], 2.0),
        before([1900.0, 700.0], [1919.95, 934.95], 2.1),
        before([1900.0, 936.05], [1919.95, 1000.0], 2.2),
        triangle(
            [[2.43133, -2.54009, 12.7147], [2.43133, -2.44904, 12.657], [2.46678, -2.48196, 12.6219]],
            WALL,
        ),
        triangle(
            [[2.43133, -2.54009, 12.7147], [2.63625, -2.54009, 12.7147], [2.43133, -2.44904, 12.657]],
            WALL,
        ),
        triangle(
            [[4.55498, -2.5962, 13.3615], [4.56773, -2.63695, 13.3144], [2.48021, -2.5962, 12.9201]],
            BRIGHT,
        ),
    ]);
    assert_eq!(scene.polygon_count(), 6);
    let Some(mut pair) = pair(&gpu, size, HZB) else { return };
    assert_eq!(differing(&mut pair, &scene, &view, &all_ids(&scene), 4), 0);
}
