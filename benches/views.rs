//! Several views culled in one walk of the index, and one after the other.
//!
//! `cargo bench --bench views [-- SIZE... WORD...]`. SIZE is the number of polygons of a synthetic session, by default
//! 100,000 and 1,000,000. A rig is a set of views of one head, for example the eyes of a headset. The rigs turn from
//! frame to frame, outside and inside the model. WORDs select the rigs whose names contain one of the words. Every
//! frame culls all views both one after the other and in one walk, in alternating order. The table has medians and 99th
//! percentiles of both times, microseconds. Then it has the medians of two ratios: the walk's time divided by the time
//! of all views, and divided by the mean time of one view. The last columns have the number of boxes that each method
//! tests, and the number of polygons in view.

use std::time::Instant;

use osp::{
    glam::{Quat, Vec3},
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum, Plane},
    polygon::{Change, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_session::{
    recording::{SynthKind, synthesize},
    scene::Scene,
};

/// Number of frames of a rig.
const FRAMES: usize = 400;
/// Half the distance between the eyes, metres.
const HALF_EYES_M: f32 = 0.032;

fn filled(polygons: u32) -> (Osp, Aabb) {
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    let mut osp = Osp::new(&IndexConfig { capacity: polygons as usize, ..IndexConfig::default() });
    let (mut next, mut around) = (0, Aabb::EMPTY);
    for event in synthesize(SynthKind::Scribble, polygons, 1) {
        changes.clear();
        scene.apply(&event.expect("a synthetic session is whole"), &mut changes);
        for change in &changes {
            if let Change::Insert(PolygonId(id)) = *change
                && id == next
            {
                let bounds = scene.bounds(PolygonId(id));
                osp.insert(PolygonId(id), &bounds).expect("a finite box, each id once");
                around = around.union(&bounds);
                next += 1;
            }
        }
        osp.commit();
    }
    (osp, around)
}

/// The position and the rotation of the head in a frame.
#[derive(Clone, Copy)]
struct Head {
    at: Vec3,
    turn: Quat,
}

impl Head {
    fn new(around: &Aabb, frame: usize, is_inside: bool) -> Self {
        let angle = frame as f32 * 0.0441;
        let turn = Quat::from_rotation_y(angle);
        let back_m = if is_inside { 0.1 } else { 1.2 } * around.extent().max_element();
        Self { at: around.center() + turn * Vec3::new(0.0, 0.05, back_m), turn }
    }

    fn view(&self, aside_m: f32, turn: Quat, projection: Projection) -> Frustum {
        let eye_in_world = self.at + self.turn * Vec3::new(aside_m, 0.0, 0.0);
        View { eye_in_world, world_from_view: self.turn * turn, projection }.frustum()
    }
}

type Rig = (&'static str, fn(&Head) -> Vec<Frustum>);

const RIGS: [Rig; 6] = [
    ("stereo", |head| {
        let eye = Projection::symmetric(90.0, 1.0, 0.05, 100.0);
        [-HALF_EYES_M, HALF_EYES_M].map(|aside| head.view(aside, Quat::IDENTITY, eye)).to_vec()
    }),
    ("stereo, headset", |head| {
        // Each eye sees farther outwards than inwards.
        let eye =
            |left, right| Projection { left, right, bottom: -1.2, top: 1.0, near_m: 0.05, far_m: 100.0 };
        [(-HALF_EYES_M, eye(-1.3, 0.9)), (HALF_EYES_M, eye(-0.9, 1.3))]
            .map(|(aside, eye)| head.view(aside, Quat::IDENTITY, eye))
            .to_vec()
    }),
    ("two cameras", |head| {
        // Both cameras look in the same direction, three metres apart.
        let eye = Projection::symmetric(90.0, 1.0, 0.05, 100.0);
        [-1.5, 1.5].map(|aside| head.view(aside, Quat::IDENTITY, eye)).to_vec()
    }),
    ("four walls", |head| {
        let wall = Projection::symmetric(90.0, 1.0, 0.05, 100.0);
        [0.0, 1.0, 2.0, 3.0].map(|wall_at| quarter(head, wall_at, wall)).to_vec()
    }),
    ("cubemap", |head| {
        let face = Projection::symmetric(90.0, 1.0, 0.05, 100.0);
        let sides = [0.0, 1.0, 2.0, 3.0].map(|side| quarter(head, side, face));
        let up_down = [1.0, -1.0]
            .map(|up| head.view(0.0, Quat::from_rotation_x(up * std::f32::consts::FRAC_PI_2), face));
        sides.into_iter().chain(up_down).collect()
    }),
    ("four cascades", |head| {
        // Boxes along the light, in front of the camera, each twice as large as the previous one.
        let light = Vec3::new(0.3, -0.8, 0.52).normalize();
        let (right, forward) = (light.cross(Vec3::X).normalize(), head.turn * Vec3::NEG_Z);
        let up = right.cross(light);
        [0.5, 1.0, 2.0, 4.0]
            .map(|reach_m: f32| {
                let middle = head.at + forward * reach_m;
                let slab = |axis: Vec3, half_m: f32| {
                    let d = axis.dot(middle);
                    [Plane { normal: axis, d: half_m - d }, Plane { normal: -axis, d: half_m + d }]
                };
                let [a, b] = slab(right, reach_m);
                let [c, d] = slab(up, reach_m);
                let [e, f] = slab(light, 20.0);
                Frustum::new([a, b, c, d, e, f])
            })
            .to_vec()
    }),
];

fn quarter(head: &Head, side: f32, projection: Projection) -> Frustum {
    head.view(0.0, Quat::from_rotation_y(side * std::f32::consts::FRAC_PI_2), projection)
}

/// Returns the median and the 99th percentile.
fn median_and_p99(values: &mut [f64]) -> (f64, f64) {
    values.sort_unstable_by(f64::total_cmp);
    (values[values.len() / 2], values[values.len() * 99 / 100])
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    // Cargo adds an option of its own.
    let args = std::env::args().skip(1).filter(|arg| !arg.starts_with('-'));
    let (sizes, words): (Vec<_>, Vec<_>) = args.partition(|arg| arg.parse::<u32>().is_ok());
    let sizes: Vec<u32> = sizes.iter().filter_map(|size| size.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![100_000, 1_000_000] } else { sizes };
    println!("kernel {}", osp::index::Backend::detect().name());
    println!(
        "{:>10} {:8} {:16} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>11} {:>11} {:>9}",
        "polygons",
        "camera",
        "rig",
        "each, µs",
        "p99",
        "one walk",
        "p99",
        "of each",
        "of 1 view",
        "boxes, each",
        "one walk",
        "seen"
    );
    for size in sizes {
        let (osp, around) = filled(size);
        for (camera, is_inside) in [("outside", false), ("inside", true)] {
            let is_selected = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
            for (name, rig) in RIGS.into_iter().filter(|(name, _)| is_selected(name)) {
                let mut sets: Vec<VisibleBlocks> = vec![VisibleBlocks::with_capacity(osp.len()); 6];
                let (mut each_us, mut walk_us, mut shares, mut of_one) = (vec![], vec![], vec![], vec![]);
                let (mut boxes, mut seen) = ([0u64; 2], 0u64);
                for frame in 0..FRAMES {
                    let frusta = rig(&Head::new(&around, frame, is_inside));
                    let sets = &mut sets[..frusta.len()];
                    let mut us = [0.0; 2];
                    // The order alternates, because the first method finds colder caches.
                    for is_walk in [frame % 2 == 0, frame % 2 != 0] {
                        sets.iter_mut().for_each(VisibleBlocks::clear);
                        let start = Instant::now();
                        if is_walk {
                            let work = osp.frustum_cull_views(&frusta, sets);
                            us[1] = start.elapsed().as_nanos() as f64 / 1000.0;
                            boxes[1] += work.boxes;
                        } else {
                            for (frustum, set) in frusta.iter().zip(&mut *sets) {
                                boxes[0] += osp.frustum_cull_blocks(frustum, set).boxes;
                            }
                            us[0] = start.elapsed().as_nanos() as f64 / 1000.0;
                            seen += sets.iter().map(|set| set.len() as u64).sum::<u64>();
                        }
                    }
                    each_us.push(us[0]);
                    walk_us.push(us[1]);
                    shares.push(us[1] / us[0]);
                    of_one.push(us[1] / us[0] * frusta.len() as f64);
                }
                let (each, walk) = (median_and_p99(&mut each_us), median_and_p99(&mut walk_us));
                println!(
                    "{:>10} {camera:8} {name:16} {:>9.1} {:>9.1} {:>9.1} {:>9.1} {:>9.2} {:>9.2} {:>11} {:>11} {:>9}",
                    osp.len(),
                    each.0,
                    each.1,
                    walk.0,
                    walk.1,
                    median_and_p99(&mut shares).0,
                    median_and_p99(&mut of_one).0,
                    boxes[0] / FRAMES as u64,
                    boxes[1] / FRAMES as u64,
                    seen / FRAMES as u64
                );
            }
        }
    }
}
