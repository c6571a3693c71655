//! Polygons that move: each told of by itself, against all of a frame at once (`SpatialIndex::update_all`).
//!
//! `cargo bench --bench moving [-- SIZE...]`. Of a synthetic session (100,000 polygons unless told) 1, 10 or 100 % move in every
//! frame, in pieces of 32 that follow each other, each on its own small circle. In every frame each structure follows, in turns that
//! begin with another one each time, and all are asked what a box holds, which has to be the same. The table has medians of following
//! a frame with the commit, nanoseconds a polygon that moves, and of its ratio to `osp` told of each polygon, frame by frame.

use std::time::Instant;

use osp::{
    glam::Vec3,
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::{Change, PolygonId},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{SynthKind, synthesize},
    scene::Scene,
};

/// Polygons of a piece, radius of its circle (of the model's diagonal) and angle of a step, as in `osp bench`.
const PIECE: usize = 32;
const RADIUS: f32 = 0.02;
const TURN: f32 = 0.125;
const FRAMES: usize = 120;

/// How a structure is told.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    OfEach,
    Together,
}

struct Follower {
    name: String,
    index: Box<dyn SpatialIndex>,
    told: Told,
    refused: Vec<IndexError>,
    times_ns: Vec<f64>,
}

impl Follower {
    fn new(name: &str, mut index: Box<dyn SpatialIndex>, told: Told, boxes: &[Aabb]) -> Self {
        for (id, bounds) in boxes.iter().enumerate() {
            index.insert(PolygonId(id as u32), bounds).expect("a finite box, each id once");
            if id % 64 == 63 {
                index.commit();
            }
        }
        index.commit();
        Self { name: name.to_owned(), index, told, refused: Vec::new(), times_ns: Vec::new() }
    }

    fn follow(&mut self, moved: &[(PolygonId, Aabb)]) {
        let start = Instant::now();
        match self.told {
            Told::Together => self.index.update_all(moved, &mut self.refused),
            Told::OfEach => {
                for (id, bounds) in moved {
                    self.refused.extend(self.index.update(*id, bounds).err());
                }
            }
        }
        self.index.commit();
        self.times_ns.push(start.elapsed().as_nanos() as f64);
        assert_eq!(self.refused, [], "{}", self.name);
    }

    fn held_by(&self, bounds: &Aabb) -> Vec<PolygonId> {
        let mut held = Vec::new();
        self.index.box_query(bounds, &mut held);
        held.sort_unstable();
        held
    }
}

fn session(polygons: u32) -> Vec<Aabb> {
    let (mut scene, mut changes, mut boxes) = (Scene::new(), Vec::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, polygons, 1) {
        changes.clear();
        scene.apply(&event.expect("a synthetic session is whole"), &mut changes);
        for change in &changes {
            if let Change::Insert(PolygonId(id)) = *change
                && id as usize == boxes.len()
            {
                boxes.push(scene.bounds(PolygonId(id)));
            }
        }
    }
    boxes
}

/// The boxes of what moves in a frame.
fn moved(boxes: &[Aabb], around: &Aabb, share: f64, frame: usize, out: &mut Vec<(PolygonId, Aabb)>) {
    out.clear();
    let before = |piece: usize| (piece as f64 * share).ceil() as usize;
    for (piece, of) in boxes.chunks(PIECE).enumerate().filter(|(at, _)| before(at + 1) > before(*at)) {
        let angle = frame as f32 * TURN + piece as f32;
        let circle = Vec3::new(angle.cos(), angle.sin(), (angle + piece as f32).cos());
        let by = circle * RADIUS * around.extent().length();
        let ids = (piece * PIECE..).map(|id| PolygonId(id as u32));
        out.extend(ids.zip(of.iter().map(|b| Aabb { min: b.min + by, max: b.max + by })));
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

fn followers(boxes: &[Aabb]) -> Vec<Follower> {
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    let osp = || Box::new(Osp::new(&config));
    let mut all = vec![
        Follower::new("osp, of each", osp(), Told::OfEach, boxes),
        Follower::new("osp, together", osp(), Told::Together, boxes),
    ];
    for name in ["time-order", "loose-octree", "bvh-sah", "lbvh", "brute-simd"] {
        let kind = IndexKind::from_name(name).expect("a structure");
        all.push(Follower::new(name, kind.create(&config), Told::Together, boxes));
    }
    all
}

#[expect(clippy::print_stdout, reason = "the table is what this is for")]
fn measure(boxes: &[Aabb], share: f64) {
    let around = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let asked = Aabb::cube(around.center(), 0.3 * around.extent().max_element());
    let mut followers = followers(boxes);
    let mut changes = Vec::new();
    for frame in 1..=FRAMES {
        moved(boxes, &around, share, frame, &mut changes);
        let count = followers.len();
        for turn in 0..count {
            followers[(frame + turn) % count].follow(&changes);
        }
        let expected = followers[0].held_by(&asked);
        for other in &followers[1..] {
            assert_eq!(other.held_by(&asked), expected, "{}", other.name);
        }
    }
    // The first frame fills caches and brings what is built late.
    let reference = followers[0].times_ns[1..].to_vec();
    for of in &followers {
        let each: Vec<f64> = of.times_ns[1..].iter().map(|ns| ns / changes.len() as f64).collect();
        let ratio = median(of.times_ns[1..].iter().zip(&reference).map(|(ns, of)| ns / of).collect());
        println!(
            "{:>9} {:>9} {:<14} {:>8.1} {ratio:>6.3}",
            boxes.len(),
            changes.len(),
            of.name,
            median(each)
        );
    }
}

#[expect(clippy::print_stdout, reason = "the table is what this is for")]
fn main() {
    let sizes: Vec<u32> = std::env::args().skip(1).filter_map(|size| size.parse().ok()).collect();
    println!("{:>9} {:>9} {:<14} {:>8} {:>6}", "polygons", "moving", "structure", "ns each", "ratio");
    for size in if sizes.is_empty() { vec![100_000] } else { sizes } {
        let boxes = session(size);
        for share in [0.01, 0.1, 1.0] {
            measure(&boxes, share);
        }
    }
}
