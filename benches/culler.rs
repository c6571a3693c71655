//! Measures the culler and the layer below it, a `Pipeline` around `Osp`, with the same objects.
//!
//! `cargo bench --bench culler [-- SIZE... WORD...]`. The world is a square with SIZE objects (default 100,000); some
//! are walls. The numbers of the objects follow the rows of the square, or are random. In each frame nothing changes,
//! or a tenth of the objects moves and a hundredth is replaced. The frame then culls for one camera, for two eyes, or
//! for one camera with the walls as occluders, and lists the visible objects. The bench measures the pipeline with a
//! plain array as `Geometry`, the culler with `Dense` numbers, and the culler with 64-bit keys. Each frame measures all
//! three methods, in an order that changes from frame to frame. The table has the median time of a frame in
//! microseconds, and the median of each frame's ratio to the pipeline. Rows whose names do not contain every WORD are
//! skipped.

use std::time::Instant;

use osp::{
    Camera, Culler, Dense, Key, Occluder,
    frame::{PassConfig, Pipeline},
    glam::Vec3,
    index::{IndexConfig, Osp},
    math::Aabb,
    occlusion::Occlusion,
    polygon::{Change, ConvexPolygon, Geometry, PolygonId},
    view::{Projection, View},
};

const FRAMES: usize = 160;
/// Distance between neighbours in a row, metres.
const APART_M: f32 = 2.0;
/// One of this number of objects is a wall.
const WALL_EVERY: usize = 500;

struct World {
    boxes: Vec<Aabb>,
    walls: Vec<Option<[Vec3; 4]>>,
}

impl Geometry for World {
    fn id_end(&self) -> usize {
        self.boxes.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.boxes.len()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.boxes[id.index()]
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        self.walls[id.index()].map(ConvexPolygon::quad)
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        self.walls[id.index()].is_some()
    }
}

fn world(objects: usize, is_ordered: bool) -> World {
    let side = objects.isqrt().max(1);
    let mut rng = osp_testkit::boxes::Rng(1);
    let mut places: Vec<usize> = (0..objects).collect();
    if !is_ordered {
        (1..objects).rev().for_each(|i| places.swap(i, rng.below(i + 1)));
    }
    let at = |place: usize| {
        let (row, column) = (place / side, place % side);
        Vec3::new(column as f32, 0.0, row as f32) * APART_M
            - Vec3::new(side as f32, 0.0, side as f32) * APART_M * 0.5
    };
    let walls: Vec<_> = places
        .iter()
        .enumerate()
        .map(|(i, &place)| {
            let foot = at(place);
            let across = if place % 2 == 0 { Vec3::X } else { Vec3::Z } * 6.0;
            let up = Vec3::Y * 5.0;
            i.is_multiple_of(WALL_EVERY).then_some([
                foot - across,
                foot + across,
                foot + across + up,
                foot - across + up,
            ])
        })
        .collect();
    let object = |(wall, &place): (&Option<[Vec3; 4]>, &usize)| match wall {
        Some(corners) => Aabb::from_points(corners),
        None => {
            let foot = at(place);
            Aabb::new(
                foot - Vec3::new(0.4, 0.0, 0.4),
                foot + Vec3::new(0.4, 0.5 + (place % 7) as f32 * 0.25, 0.4),
            )
        }
    };
    let boxes = walls.iter().zip(&places).map(object).collect();
    World { boxes, walls }
}

/// Returns the numbers of the objects that move in a frame, and of the replaced objects.
fn changed(world: &World, frame: usize, is_still: bool) -> (Vec<usize>, Vec<usize>) {
    let is_of = |i: &usize, part: usize| (i / 32 + frame).is_multiple_of(part) && world.walls[*i].is_none();
    let all = || 0..world.boxes.len();
    if is_still {
        return (Vec::new(), Vec::new());
    }
    (
        all().filter(|i| is_of(i, 10)).collect(),
        all().filter(|i| (i / 32 + frame) % 100 == 55 && world.walls[*i].is_none()).collect(),
    )
}

/// One measured method.
trait Method {
    /// Returns the time to apply the changes, cull and list, microseconds, and the number of objects to draw in all
    /// views.
    fn frame(&mut self, world: &World, moved: &[usize], replaced: &[usize], views: &[View]) -> (f64, usize);
}

struct OnPipeline {
    pipeline: Pipeline,
    changes: Vec<Change>,
    list: Vec<u32>,
}

impl OnPipeline {
    fn new(world: &World, hides: bool) -> Self {
        let root = world.boxes.iter().fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let index = Osp::new(&IndexConfig { root, capacity: world.boxes.len() });
        let mut pipeline = Pipeline::new(Box::new(index), world.boxes.len());
        if hides {
            let config = PassConfig::new(Occlusion::Msvbsp);
            pipeline = pipeline.with_occlusion(config);
        }
        let all = (0..world.boxes.len() as u32).map(|id| Change::Insert(PolygonId(id)));
        Self { pipeline, changes: all.collect(), list: Vec::new() }
    }
}

impl Method for OnPipeline {
    fn frame(&mut self, world: &World, moved: &[usize], replaced: &[usize], views: &[View]) -> (f64, usize) {
        let start = Instant::now();
        let id = |i: &usize| PolygonId(*i as u32);
        self.changes.extend(moved.iter().map(|i| Change::Update(id(i))));
        self.changes.extend(replaced.iter().map(|i| Change::Remove(id(i))));
        self.changes.extend(replaced.iter().map(|i| Change::Insert(id(i))));
        self.pipeline.frame_of_views(world, &self.changes, views);
        self.changes.clear();
        self.list.clear();
        for drawn in self.pipeline.draw_lists() {
            self.list.extend(drawn.ids().map(|id| id.0));
        }
        (start.elapsed().as_nanos() as f64 * 1.0e-3, self.list.len())
    }
}

struct OnCuller<K: Key> {
    culler: Culler<K>,
    key: fn(usize) -> K,
    hides: bool,
    list: Vec<K>,
}

impl<K: Key> OnCuller<K> {
    fn new(world: &World, hides: bool, key: fn(usize) -> K) -> Self {
        let mut culler = Culler::new();
        for (i, bounds) in world.boxes.iter().enumerate() {
            culler.set(key(i), [bounds.min, bounds.max]);
            if let Some(corners) = world.walls[i].filter(|_| hides) {
                culler.set_occluder(key(i), Occluder::quad(corners).expect("a rectangle"));
            }
        }
        Self { culler, key, hides, list: Vec::new() }
    }
}

impl<K: Key> Method for OnCuller<K> {
    fn frame(&mut self, world: &World, moved: &[usize], replaced: &[usize], views: &[View]) -> (f64, usize) {
        let cameras: Vec<_> = views
            .iter()
            .map(Camera::from)
            .map(|camera| if self.hides { camera.hide_by_occluders() } else { camera })
            .collect();
        let start = Instant::now();
        for &i in moved {
            let Aabb { min, max } = world.boxes[i];
            self.culler.set((self.key)(i), [min, max]);
        }
        replaced.iter().for_each(|&i| self.culler.remove((self.key)(i)));
        for &i in replaced {
            let Aabb { min, max } = world.boxes[i];
            self.culler.set((self.key)(i), [min, max]);
        }
        self.list.clear();
        for seen in self.culler.cull(&cameras).iter() {
            self.list.extend(seen.iter());
        }
        (start.elapsed().as_nanos() as f64 * 1.0e-3, self.list.len())
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    // Cargo adds an option of its own.
    let args = std::env::args().skip(1).filter(|arg| !arg.starts_with('-'));
    let (sizes, words): (Vec<_>, Vec<_>) = args.partition(|arg| arg.parse::<usize>().is_ok());
    let sizes: Vec<usize> = sizes.iter().filter_map(|size| size.parse().ok()).collect();
    println!("{:<44} {:>9} {:>9} {:>6} {:>9} {:>6}", "", "pipeline", "numbers", "", "keys", "");
    for objects in if sizes.is_empty() { vec![100_000] } else { sizes } {
        for (is_ordered, order) in [(true, "in rows"), (false, "in no order")] {
            for (is_still, changes) in [(true, "still"), (false, "a tenth moves")] {
                for (eyes, hides, view) in
                    [(1, false, "a camera"), (2, false, "two eyes"), (1, true, "walls hide")]
                {
                    let name = format!("{objects} {order}, {changes}, {view}");
                    if !words.iter().all(|word| name.contains(word)) {
                        continue;
                    }
                    let mut world = world(objects, is_ordered);
                    let mut methods: [Box<dyn Method>; 3] = [
                        Box::new(OnPipeline::new(&world, hides)),
                        Box::new(OnCuller::new(&world, hides, |i| Dense(i as u32))),
                        Box::new(OnCuller::new(&world, hides, |i| (i as u64) << 33 | 1)),
                    ];
                    let mut times = [const { Vec::new() }; 3];
                    let mut ratios = [const { Vec::new() }; 3];
                    for frame in 0..FRAMES {
                        let (moved, replaced) = changed(&world, frame, is_still);
                        for &i in &moved {
                            let by = Vec3::new(0.3, 0.0, 0.2)
                                * if (frame / 10).is_multiple_of(2) { 1.0 } else { -1.0 };
                            let Aabb { min, max } = world.boxes[i];
                            world.boxes[i] = Aabb::new(min + by, max + by);
                        }
                        let angle = frame as f32 * 0.04;
                        let projection = Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 150.0);
                        let ahead = Vec3::new(angle.sin(), 0.0, angle.cos());
                        let view = |aside: f32| {
                            let eye = Vec3::new(aside, 1.7, 0.0);
                            View::look_at(eye, eye + ahead, projection)
                        };
                        let views: Vec<_> = (0..eyes).map(|eye| view(eye as f32 * 0.064)).collect();
                        let mut frame_us = [0.0; 3];
                        let mut drawn = [0; 3];
                        for turn in 0..3 {
                            let method = (frame + turn) % 3;
                            (frame_us[method], drawn[method]) =
                                methods[method].frame(&world, &moved, &replaced, &views);
                        }
                        assert!(hides || drawn[1..].iter().all(|&count| count == drawn[0]), "{drawn:?}");
                        if frame >= FRAMES / 8 {
                            for method in 0..3 {
                                times[method].push(frame_us[method]);
                                ratios[method].push(frame_us[method] / frame_us[0]);
                            }
                        }
                    }
                    let [pipeline, numbers, keys] = times.each_mut().map(|times| median(times));
                    let [_, of_numbers, of_keys] = ratios.each_mut().map(|ratios| median(ratios));
                    println!(
                        "{name:<44} {pipeline:>9.1} {numbers:>9.1} {of_numbers:>6.2} {keys:>9.1} {of_keys:>6.2}"
                    );
                }
            }
        }
    }
}
