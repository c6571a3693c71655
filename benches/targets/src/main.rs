//! Measures `osp` and every rival in one run: insertion, queries, whole frames, latency of every batch, memory. Every
//! round queries all rivals. All rivals must find the same polygons.
//!
//! `cargo run --release --manifest-path benches/targets/Cargo.toml [-- SIZE...]`. SIZE is a number of polygons, by
//! default 10000, 100000 and 1000000. `OSP_CORPUS` names a folder whose recorded sessions and models (`.obj`) are
//! measured, too.

mod floor;
mod peers;
mod sessions;

use std::time::Instant;

use floor::{Floor, LowerBound};
use osp::{
    index::IndexConfig,
    math::{Aabb, Frustum},
};
use osp_testkit::boxes::{Place, root, views};
use peers::{KINDS, Kind, Subject};
use sessions::Arrivals;

/// Number of rounds of queries; short queries have four times as many rounds. The result of a view is the median of its
/// rounds.
const ROUNDS: usize = 9;
/// Number of views of each camera.
const VIEWS: usize = 8;
/// Sizes of the batches, in polygons. A frame inserts one batch.
const BATCHES: [usize; 3] = [16, 256, 1024];

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|size| size.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![10_000, 100_000, 1_000_000] } else { sizes };
    println!("Box tests on {}.", osp::index::Backend::detect().name());
    for size in sizes {
        for arrivals in sessions::synthetic(size) {
            measure(&arrivals);
        }
    }
    match std::env::var_os("OSP_CORPUS") {
        Some(folder) => {
            for arrivals in sessions::recorded(folder.as_ref(), 50_000) {
                measure(&arrivals);
            }
        }
        None => println!("\nNo recorded sessions: OSP_CORPUS is not set."),
    }
}

/// A rival and its measurements.
struct Row {
    kind: &'static Kind,
    subject: Box<dyn Subject>,
    /// Insertion time per polygon for each of [`BATCHES`], nanoseconds, from the shortest time of every batch in five
    /// runs. For a rival that rebuilds, the time of a rebuild, nanoseconds.
    insert_ns: [f64; BATCHES.len()],
    /// Times of the batches of 16, microseconds: p50, p99, p99.9, maximum.
    latency_us: [f64; 4],
    /// Time of a query from outside and from inside, microseconds.
    query_us: [f64; 2],
    /// 99th percentile of all queries of all views, from outside and from inside, microseconds.
    query_p99_us: [f64; 2],
}

impl Row {
    /// Returns a row without measurements.
    fn new(kind: &'static Kind, subject: Box<dyn Subject>) -> Self {
        let (insert_ns, latency_us) = ([f64::NAN; BATCHES.len()], [f64::NAN; 4]);
        Self { kind, subject, insert_ns, latency_us, query_us: [0.0; 2], query_p99_us: [0.0; 2] }
    }

    /// Returns the time of a whole frame: 16 inserts (or a rebuild) and a query, microseconds.
    fn frame_us(&self, camera: usize) -> f64 {
        let change_ns = if self.kind.rebuilds { self.insert_ns[0] } else { 16.0 * self.insert_ns[0] };
        change_ns / 1000.0 + self.query_us[camera]
    }
}

fn measure(arrivals: &Arrivals) {
    let boxes = &arrivals.boxes;
    let mut rows: Vec<Row> = KINDS
        .iter()
        .filter(|k| if k.peer { arrivals.peers } else { arrivals.static_trees || !k.rebuilds })
        .map(|k| measure_insertion(k, boxes))
        .collect();
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let (mut seen, mut least) = ([0.0; 2], [LowerBound::default(); 2]);
    for (camera, place) in [Place::Outside, Place::Inside].into_iter().enumerate() {
        let views = views(&bounds, VIEWS, place, 7);
        (seen[camera], least[camera]) = measure_queries(&mut rows, camera, &views, boxes);
        seen[camera] /= (VIEWS * boxes.len()) as f64;
    }
    print(&arrivals.name, boxes.len(), &rows, seen, least);
}

/// Fills a rival and measures the insertion.
fn measure_insertion(kind: &'static Kind, boxes: &[Aabb]) -> Row {
    let config = IndexConfig { root: root(), capacity: boxes.len() };
    if kind.rebuilds {
        let mut times = Vec::new();
        let mut subject = (kind.make)(&config);
        for _ in 0..if boxes.len() > 200_000 { 1 } else { 3 } {
            subject = (kind.make)(&config);
            for (id, bounds) in boxes.iter().enumerate() {
                subject.insert(id as u32, bounds);
            }
            let start = Instant::now();
            subject.commit();
            times.push(start.elapsed().as_secs_f64() * 1.0e9);
        }
        let rebuild_ns = median(&mut times);
        let none = [f64::NAN; 4];
        return Row { insert_ns: [rebuild_ns; BATCHES.len()], latency_us: none, ..Row::new(kind, subject) };
    }
    let runs = if kind.peer && boxes.len() > 200_000 { 1 } else { 5 };
    let (mut insert_ns, mut latency_us) = ([f64::NAN; BATCHES.len()], [f64::NAN; 4]);
    let mut subject = None;
    for (i, batch) in BATCHES.into_iter().enumerate().rev() {
        if runs == 1 && batch != 16 {
            continue;
        }
        // Every run does the same work, so a batch's shortest time contains the least disturbance by other programs.
        let mut least = vec![f64::MAX; boxes.len().div_ceil(batch)];
        for _ in 0..runs {
            let mut filled = (kind.make)(&config);
            for (frame, chunk) in boxes.chunks(batch).enumerate() {
                let start = Instant::now();
                for (id, bounds) in (frame * batch..).zip(chunk) {
                    filled.insert(id as u32, bounds);
                }
                filled.commit();
                let ns = start.elapsed().as_secs_f64() * 1.0e9;
                least[frame] = least[frame].min(ns);
            }
            subject = Some(filled);
        }
        insert_ns[i] = least.iter().sum::<f64>() / boxes.len() as f64;
        if batch == 16 {
            least.sort_by(f64::total_cmp);
            let at = |share: f64| least[((least.len() - 1) as f64 * share) as usize] / 1000.0;
            latency_us = [at(0.5), at(0.99), at(0.999), at(1.0)];
        }
    }
    let mut subject = subject.expect("at least one run");
    subject.rest();
    Row { insert_ns, latency_us, ..Row::new(kind, subject) }
}

/// Measures the queries of all rivals, which alternate. Returns the number of polygons found, and the lower bound of
/// the time.
fn measure_queries(rows: &mut [Row], camera: usize, views: &[Frustum], boxes: &[Aabb]) -> (f64, LowerBound) {
    let mut list = Vec::new();
    let mut expected: Vec<Vec<u32>> = Vec::new();
    for row in rows.iter() {
        for (i, view) in views.iter().enumerate() {
            list.clear();
            row.subject.cull(view, &mut list);
            row.subject.list(&mut list);
            let mut ids: Vec<u32> = list.iter().map(|id| id.0).collect();
            ids.sort_unstable();
            if expected.len() == i {
                expected.push(ids);
            } else {
                assert!(ids == expected[i], "{}: found other polygons", row.kind.name);
            }
        }
    }
    let rounds = if views_are_short(&expected) { 4 * ROUNDS } else { ROUNDS };
    let mut times = vec![vec![Vec::new(); views.len()]; rows.len()];
    let mut floor = Floor::new(boxes, views, &expected);
    for _ in 0..rounds {
        floor.measure();
        for (row, times) in rows.iter().zip(&mut times) {
            for (view, times) in views.iter().zip(times) {
                list.clear();
                let start = Instant::now();
                row.subject.cull(view, &mut list);
                times.push(start.elapsed().as_secs_f64() * 1.0e6);
            }
        }
    }
    for (row, times) in rows.iter_mut().zip(&mut times) {
        row.query_us[camera] = times.iter_mut().map(|t| median(t)).sum::<f64>() / views.len() as f64;
        let mut all = times.concat();
        all.sort_by(f64::total_cmp);
        row.query_p99_us[camera] = all[(all.len() - 1) * 99 / 100];
    }
    (expected.iter().map(Vec::len).sum::<usize>() as f64, floor.lower_bound())
}

fn views_are_short(expected: &[Vec<u32>]) -> bool {
    expected.iter().all(|ids| ids.len() < 200_000)
}

pub(crate) fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

fn print(name: &str, polygons: usize, rows: &[Row], seen: [f64; 2], least: [LowerBound; 2]) {
    println!(
        "\n### {name} ({polygons} polygons; {:.0} % seen from outside, {:.0} % from inside)\n",
        seen[0] * 100.0,
        seen[1] * 100.0
    );
    println!(
        "| | insert 16 / 256 / 1,024, ns | batch p50 / p99 / p99.9 / max, µs | query out / in, µs | its p99, µs | times the floor | against osp | frame out / in, µs | against osp | B a polygon |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let [out, inside] = least;
    println!(
        "| *floor* | | | {:.1} / {:.1} ({:.0} / {:.0} kB) | | 1 / 1 | | | | |\n| *floor, as blocks* | | | {:.1} / {:.1} ({:.0} / {:.0} kB) | | 1 / 1 | | | | |",
        out.ids_us,
        inside.ids_us,
        out.ids_kb,
        inside.ids_kb,
        out.blocks_us,
        inside.blocks_us,
        out.blocks_kb,
        inside.blocks_kb,
    );
    let osp = &rows[0];
    for row in rows {
        let insert = match (row.kind.rebuilds, row.insert_ns) {
            (true, [ns, ..]) => format!("rebuild {:.0} µs", ns / 1000.0),
            (false, [a, b, _]) if b.is_nan() => format!("{a:.1}"),
            (false, [a, b, c]) => format!("{a:.1} / {b:.1} / {c:.1}"),
        };
        let [p50, p99, p999, max] = row.latency_us;
        let latency = if row.kind.rebuilds {
            String::new()
        } else {
            format!("{p50:.2} / {p99:.1} / {p999:.1} / {max:.1}")
        };
        let [outside, inside] = row.query_us;
        let floor_us = least.map(|l| if row.kind.blocks { l.blocks_us } else { l.ids_us });
        println!(
            "| {} | {insert} | {latency} | {outside:.1} / {inside:.1} | {:.1} / {:.1} | {:.1} / {:.1} | {:.2} / {:.2} | {:.1} / {:.1} | {:.2} / {:.2} | {:.0} |",
            row.kind.name,
            row.query_p99_us[0],
            row.query_p99_us[1],
            outside / floor_us[0],
            inside / floor_us[1],
            outside / osp.query_us[0],
            inside / osp.query_us[1],
            row.frame_us(0),
            row.frame_us(1),
            row.frame_us(0) / osp.frame_us(0),
            row.frame_us(1) / osp.frame_us(1),
            row.subject.bytes() as f64 / polygons as f64,
        );
    }
}
