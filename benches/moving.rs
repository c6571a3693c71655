//! Polygons that move from frame to frame: each structure updates their boxes, then lists the ids in a view.
//!
//! `cargo bench --bench moving [-- [drawn | shuffled] [each] [others] SIZE...]`. The same 0, 0.1, 1, 10 or 100 % of the
//! polygons move in every frame, on small circles. Updates are sorted by number.
//! * `drawn`: a synthetic session, in which pieces of 32 consecutive numbers move.
//! * `shuffled`: boxes whose numbers have no spatial order; a random choice of them moves.
//! * `each`: one call of `update` for each polygon, instead of one call of `update_all`.
//! * `others`: different polygons move in every frame; without `loop-beside`, which needs the moving ones in advance.
//!
//! The view contains about a tenth of the polygons. Every frame updates and culls all structures, in rotating order.
//! All structures must find the same polygons. `--features osp-lab/peers` adds trees of other crates. `loop-beside` has
//! an index of the resting polygons and a plain loop over the moving polygons. `two-threads` is a plain loop whose
//! second half runs on another thread. `floor` is a lower bound: it only copies the boxes of the moving polygons, and
//! the numbers of the polygons in view. The table has the median, the 99th percentile and the maximum of the time of a
//! frame, in microseconds. It also has the nanoseconds to update one polygon, and the median of each frame's ratio to
//! `osp`. The last line has the bytes that `floor` copies in a frame, and their rate.

#[path = "support/models.rs"]
mod models;

use std::{
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
    time::Instant,
};

use models::Cases;
use osp::{
    glam::Vec3,
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::PolygonId,
    view::{Projection, View},
};
use osp_lab::Contender;
use osp_rivals::IndexKind;
use rand_pcg::{Pcg32, rand_core::Rng};

/// Polygons of a piece, radius of the circles as a fraction of the model's diagonal, and angle of a frame in radians.
/// All equal the values of `osp bench`.
const PIECE: usize = 32;
const RADIUS: f32 = 0.02;
const TURN: f32 = 0.125;
/// Number of measured frames, and of frames before. The latter let a structure separate the moving from the resting
/// polygons.
const FRAMES: usize = 100;
const BEFORE: usize = 320;

/// A case: the order of the boxes, and the call that updates them.
#[derive(Clone, Copy)]
struct Kind {
    is_shuffled: bool,
    is_each: bool,
    moves_others: bool,
}

/// The polygons of a case, and which of them move.
struct Model {
    boxes: Vec<Aabb>,
    around: Aabb,
    moving: Vec<PolygonId>,
    is_moving: Vec<bool>,
}

impl Model {
    fn new(boxes: Vec<Aabb>, share: f64, kind: Kind) -> Self {
        let around = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
        let count = (boxes.len() as f64 * share).ceil() as usize;
        let mut is_moving = vec![false; boxes.len()];
        if kind.is_shuffled {
            let mut lot = Pcg32::new(11, 5);
            let mut left = count;
            while left > 0 {
                let id = lot.next_u32() as usize % boxes.len();
                left -= usize::from(!is_moving[id]);
                is_moving[id] = true;
            }
        } else {
            let before = |piece: usize| (piece as f64 * share).ceil() as usize;
            for (piece, of) in is_moving.chunks_mut(PIECE).enumerate() {
                of.fill(before(piece + 1) > before(piece));
            }
        }
        let ids = is_moving.iter().enumerate().filter(|(_, moves)| **moves);
        let moving = ids.map(|(id, _)| PolygonId(id as u32)).collect();
        Self { boxes, around, moving, is_moving }
    }

    /// As many polygons as `moving`, chosen anew for each frame, sorted.
    fn others(&self, frame: usize, is_shuffled: bool) -> Vec<PolygonId> {
        let (mut lot, together) = (Pcg32::new(frame as u64, 7), if is_shuffled { 1 } else { PIECE });
        // If all move, there are no others.
        let mut is_moving = vec![self.moving.len() == self.boxes.len(); self.boxes.len()];
        let mut left = if is_moving[0] { 0 } else { self.moving.len() };
        while left > 0 {
            let first = lot.next_u32() as usize % self.boxes.len() / together * together;
            for moves in is_moving[first..].iter_mut().take(together.min(left)) {
                left -= usize::from(!std::mem::replace(moves, true));
            }
        }
        (0..self.boxes.len()).filter(|&id| is_moving[id]).map(|id| PolygonId(id as u32)).collect()
    }

    fn moved(&self, frame: usize, kind: Kind, out: &mut Vec<(PolygonId, Aabb)>) {
        out.clear();
        let radius_m = RADIUS * self.around.extent().length();
        let others = if kind.moves_others { self.others(frame, kind.is_shuffled) } else { Vec::new() };
        let moving = if kind.moves_others { &others } else { &self.moving };
        out.extend(moving.iter().map(|&id| {
            let phase = if kind.is_shuffled { id.0 } else { id.0 / PIECE as u32 } as f32;
            let angle = frame as f32 * TURN + phase;
            let by = Vec3::new(angle.cos(), angle.sin(), (angle + phase).cos()) * radius_m;
            let of = &self.boxes[id.index()];
            (id, Aabb { min: of.min + by, max: of.max + by })
        }));
    }

    /// Returns a slowly turning view from inside, which contains about a tenth of a filled cube.
    fn view(&self, frame: usize) -> Frustum {
        let size_m = self.around.extent().max_element();
        let angle = frame as f32 * 0.02;
        let eye = self.around.center();
        let ahead = Vec3::new(angle.cos(), 0.1, angle.sin());
        let projection = Projection::symmetric(60.0, 1.6, 0.01 * size_m, 2.0 * size_m);
        View::look_at(eye, eye + ahead, projection).frustum()
    }
}

/// A measured structure.
trait Structure {
    /// Passes the result of another structure. The measured time excludes this call.
    fn set_result(&mut self, _in_view: &[PolygonId]) {}
    fn apply(&mut self, moved: &[(PolygonId, Aabb)], is_each: bool);
    fn cull(&self, view: &Frustum, list: &mut Vec<PolygonId>);
}

struct Single(Box<dyn SpatialIndex>);

fn update(index: &mut dyn SpatialIndex, moved: &[(PolygonId, Aabb)], is_each: bool) {
    let mut refused: Vec<IndexError> = Vec::new();
    if is_each {
        moved.iter().for_each(|(id, bounds)| refused.extend(index.update(*id, bounds).err()));
    } else {
        index.update_all(moved, &mut refused);
    }
    index.commit();
    assert_eq!(refused, []);
}

impl Structure for Single {
    fn apply(&mut self, moved: &[(PolygonId, Aabb)], is_each: bool) {
        update(&mut *self.0, moved, is_each);
    }

    fn cull(&self, view: &Frustum, list: &mut Vec<PolygonId>) {
        self.0.frustum_cull(view, list);
    }
}

/// An index of the resting polygons, and a plain loop over the moving polygons.
struct LoopBeside {
    resting: Osp,
    moving: Box<dyn SpatialIndex>,
    numbers: Vec<PolygonId>,
    renumbered: Vec<(PolygonId, Aabb)>,
}

impl Structure for LoopBeside {
    fn apply(&mut self, moved: &[(PolygonId, Aabb)], is_each: bool) {
        self.renumbered.clear();
        self.renumbered
            .extend(moved.iter().enumerate().map(|(at, (_, bounds))| (PolygonId(at as u32), *bounds)));
        update(&mut *self.moving, &self.renumbered, is_each);
        self.resting.commit();
    }

    fn cull(&self, view: &Frustum, list: &mut Vec<PolygonId>) {
        self.moving.frustum_cull(view, list);
        list.iter_mut().for_each(|id| *id = self.numbers[id.index()]);
        self.resting.frustum_cull(view, list);
    }
}

/// The work of the second thread.
enum Work {
    Move(Vec<(PolygonId, Aabb)>),
    Cull(Frustum, Vec<PolygonId>),
}

/// Two plain loops, each over one half of the polygons. Another thread runs the second loop.
struct TwoThreads {
    first: Box<dyn SpatialIndex>,
    /// The number of polygons in the first half.
    half: u32,
    work: SyncSender<Work>,
    done: Receiver<Work>,
}

impl TwoThreads {
    fn new(boxes: &[Aabb], config: &IndexConfig) -> Self {
        let half = boxes.len().div_ceil(2);
        let of = |boxes: &[Aabb]| {
            let numbered = boxes.iter().enumerate().map(|(id, b)| (PolygonId(id as u32), *b));
            filled(IndexKind::BruteSimd.create(config), numbered)
        };
        let (first, mut second) = (of(&boxes[..half]), of(&boxes[half..]));
        let (work, jobs) = sync_channel(1);
        let (finished, done) = sync_channel(1);
        thread::spawn(move || {
            for mut job in jobs {
                match &mut job {
                    Work::Move(moved) => update(&mut *second, moved, false),
                    Work::Cull(view, list) => _ = second.frustum_cull(view, list),
                }
                if finished.send(job).is_err() {
                    return;
                }
            }
        });
        Self { first, half: half as u32, work, done }
    }
}

impl Structure for TwoThreads {
    fn apply(&mut self, moved: &[(PolygonId, Aabb)], _is_each: bool) {
        let (first, second) = moved.split_at(moved.partition_point(|(id, _)| id.0 < self.half));
        let second = second.iter().map(|(id, bounds)| (PolygonId(id.0 - self.half), *bounds)).collect();
        self.work.send(Work::Move(second)).expect("the thread runs");
        update(&mut *self.first, first, false);
        self.done.recv().expect("the thread runs");
    }

    fn cull(&self, view: &Frustum, list: &mut Vec<PolygonId>) {
        self.work.send(Work::Cull(*view, Vec::new())).expect("the thread runs");
        self.first.frustum_cull(view, list);
        if let Work::Cull(_, found) = self.done.recv().expect("the thread runs") {
            list.extend(found.iter().map(|id| PolygonId(id.0 + self.half)));
        }
    }
}

/// Copies only the new boxes and the known result. Every structure must read and write at least these bytes.
struct Floor {
    boxes: Vec<Aabb>,
    in_view: Vec<PolygonId>,
}

impl Structure for Floor {
    fn apply(&mut self, moved: &[(PolygonId, Aabb)], _is_each: bool) {
        moved.iter().for_each(|(id, bounds)| self.boxes[id.index()] = *bounds);
    }

    fn cull(&self, _view: &Frustum, list: &mut Vec<PolygonId>) {
        list.extend_from_slice(&self.in_view);
    }

    fn set_result(&mut self, in_view: &[PolygonId]) {
        self.in_view.clear();
        self.in_view.extend_from_slice(in_view);
    }
}

struct Measured {
    name: &'static str,
    of: Box<dyn Structure>,
    list: Vec<PolygonId>,
    frames_us: Vec<f64>,
    apply_ns: Vec<f64>,
}

impl Measured {
    fn frame(&mut self, moved: &[(PolygonId, Aabb)], view: &Frustum, is_each: bool, is_measured: bool) {
        self.list.clear();
        let start = Instant::now();
        self.of.apply(moved, is_each);
        let applied = start.elapsed();
        self.of.cull(view, &mut self.list);
        let frame_us = start.elapsed().as_nanos() as f64 * 1.0e-3;
        if is_measured {
            self.frames_us.push(frame_us);
            self.apply_ns.push(applied.as_nanos() as f64 / moved.len().max(1) as f64);
        }
    }
}

fn filled(
    mut index: Box<dyn SpatialIndex>,
    boxes: impl Iterator<Item = (PolygonId, Aabb)>,
) -> Box<dyn SpatialIndex> {
    for (at, (id, bounds)) in boxes.enumerate() {
        index.insert(id, &bounds).expect("a finite box, each id once");
        if at % 64 == 63 {
            index.commit();
        }
    }
    index.commit();
    index
}

fn measured(name: &'static str, of: impl Structure + 'static) -> Measured {
    Measured { name, of: Box::new(of), list: Vec::new(), frames_us: Vec::new(), apply_ns: Vec::new() }
}

fn structures(model: &Model, kind: Kind) -> Vec<Measured> {
    let boxes = &model.boxes;
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    let all = || boxes.iter().enumerate().map(|(id, b)| (PolygonId(id as u32), *b));
    let mut structures = vec![measured("osp", Single(filled(Box::new(Osp::new(&config)), all())))];
    let rivals: &[&str] = if kind.is_shuffled && boxes.len() > 100_000 {
        &["brute-simd", "loose-octree", "parry3d", "obvhs"]
    } else {
        &["brute-simd", "loose-octree", "time-order", "bvh-sah", "lbvh", "parry3d", "obvhs", "rstar"]
    };
    // `from_name` returns `None` for the trees of other crates if the build lacks them.
    for contender in rivals.iter().filter_map(|name| Contender::from_name(name)) {
        let index = filled(contender.create(&config), all());
        structures.push(measured(contender.name(), Single(index)));
    }
    let mut resting = Osp::new(&config);
    for (id, bounds) in all().filter(|(id, _)| !model.is_moving[id.index()]) {
        resting.insert(id, &bounds).expect("a finite box, each id once");
        resting.commit();
    }
    let moving = IndexKind::BruteSimd.create(&config);
    let numbered = model.moving.iter().enumerate().map(|(at, id)| (PolygonId(at as u32), boxes[id.index()]));
    let moving = filled(moving, numbered);
    let beside = LoopBeside { resting, moving, numbers: model.moving.clone(), renumbered: Vec::new() };
    if !kind.moves_others {
        structures.push(measured("loop-beside", beside));
    }
    structures.push(measured("two-threads", TwoThreads::new(boxes, &config)));
    structures
}

fn at(values: &mut [f64], part: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * part).round() as usize]
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn measure(boxes: Vec<Aabb>, share: f64, kind: Kind) {
    let model = Model::new(boxes, share, kind);
    let mut structures = structures(&model, kind);
    let mut floor = measured("floor", Floor { boxes: model.boxes.clone(), in_view: Vec::new() });
    let mut moved = Vec::new();
    let mut seen = 0;
    for frame in 0..BEFORE + FRAMES {
        model.moved(frame, kind, &mut moved);
        let view = model.view(frame);
        let is_measured = frame >= BEFORE;
        let count = structures.len();
        for turn in 0..count {
            structures[(frame + turn) % count].frame(&moved, &view, kind.is_each, is_measured);
        }
        floor.of.set_result(&structures[0].list);
        floor.frame(&moved, &view, kind.is_each, is_measured);
        let sorted = |list: &[PolygonId]| {
            let mut ids = list.to_vec();
            ids.sort_unstable();
            ids
        };
        if frame % 16 == 0 {
            let expected = sorted(&structures[0].list);
            seen = expected.len();
            for other in &structures[1..] {
                assert_eq!(sorted(&other.list), expected, "{}", other.name);
            }
        }
    }
    let order = if kind.is_shuffled { "shuffled" } else { "drawn" };
    let reference = structures[0].frames_us.clone();
    let in_view = structures[0].list.len();
    for of in structures.iter_mut().chain([&mut floor]) {
        let ratio =
            at(&mut of.frames_us.iter().zip(&reference).map(|(us, osp)| us / osp).collect::<Vec<_>>(), 0.5);
        let (median, p99, most) =
            (at(&mut of.frames_us, 0.5), at(&mut of.frames_us, 0.99), at(&mut of.frames_us, 1.0));
        println!(
            "{:>9} {order:<8} {:>9} {seen:>8} {:<12} {median:>10.1} {p99:>10.1} {most:>10.1} {:>8.1} {ratio:>7.3}",
            model.boxes.len(),
            moved.len(),
            of.name,
            at(&mut of.apply_ns, 0.5),
        );
    }
    // Reads each moving box with its number, and writes the box. Reads and writes each number in view.
    let bytes = moved.len() * (size_of::<(PolygonId, Aabb)>() + size_of::<Aabb>())
        + in_view * 2 * size_of::<PolygonId>();
    let us = at(&mut floor.frames_us, 0.5);
    println!(
        "{:>9} {order:<8} {:>9} floor: {bytes} bytes, {:.1} GB/s",
        model.boxes.len(),
        moved.len(),
        bytes as f64 / us * 1.0e-3
    );
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    let cases = Cases::of_command_line();
    println!(
        "{:>9} {:<8} {:>9} {:>8} {:<12} {:>10} {:>10} {:>10} {:>8} {:>7}",
        "polygons", "order", "moving", "seen", "structure", "frame us", "p99", "most", "ns each", "ratio"
    );
    for (order, boxes) in cases.orders() {
        let (is_each, moves_others) = (cases.has("each"), cases.has("others"));
        let kind = Kind { is_shuffled: order == "shuffled", is_each, moves_others };
        for size in cases.sizes(&[1_000, 10_000, 100_000]) {
            for share in [0.0, 0.001, 0.01, 0.1, 1.0] {
                measure(boxes(size), share, kind);
            }
        }
    }
}
