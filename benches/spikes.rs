//! Frames that take longer than their neighbours while a model grows.
//!
//! `cargo bench --bench spikes [-- [drawn | shuffled] SIZE...]`. Each frame inserts eight polygons, then a query with a
//! slowly turning view returns blocks. The bench repeats the growth seven times, and uses the shortest time of each
//! frame, which other programs disturb least. `drawn`: a synthetic session; `shuffled`: small boxes in no spatial
//! order.
//!
//! The column `memory` is `first` if every growth begins with memory that was never written to, and `again` if a growth
//! reuses the memory of the previous growth. The table has the time of a frame in microseconds. It counts the spikes,
//! i.e. frames that take more than five times the median of the fifty frames around them. `worst frame` is the largest
//! of these ratios with its frame. In the first frame the caches are cold.

#[path = "support/models.rs"]
mod models;

use std::time::Instant;

use models::Cases;
use osp::{
    glam::Vec3,
    index::IndexConfig,
    math::{Aabb, Frustum},
    polygon::{PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_rivals::IndexKind;

const A_FRAME: usize = 8;
const GROWTHS: usize = 7;
const NEIGHBOURS: usize = 50;
const SPIKE: f64 = 5.0;

/// Returns a slowly turning view from the centre of the model.
fn view(around: &Aabb, frame: usize) -> Frustum {
    let (size_m, angle) = (around.extent().max_element(), frame as f32 * 0.002);
    let eye = around.center();
    let projection = Projection::symmetric(60.0, 1.6, 0.01 * size_m, 2.0 * size_m);
    View::look_at(eye, eye + Vec3::new(angle.cos(), 0.1, angle.sin()), projection).frustum()
}

/// Returns the shortest time of each frame over all growths, microseconds.
fn grow(kind: IndexKind, boxes: &[Aabb], is_first: bool) -> Vec<f64> {
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    let around = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let mut shortest_us = vec![f64::INFINITY; boxes.len() / A_FRAME];
    let mut index = kind.create(&config);
    let mut visible = VisibleBlocks::with_capacity(boxes.len());
    for _ in 0..GROWTHS {
        if is_first {
            index = kind.create(&config);
        } else {
            index.clear();
        }
        for (frame, (inserted, shortest_us)) in boxes.chunks_exact(A_FRAME).zip(&mut shortest_us).enumerate()
        {
            let view = view(&around, frame);
            visible.clear();
            let start = Instant::now();
            for (at, bounds) in inserted.iter().enumerate() {
                let id = PolygonId((frame * A_FRAME + at) as u32);
                index.insert(id, bounds).expect("a finite box, each id once");
            }
            index.commit();
            index.frustum_cull_blocks(&view, &mut visible);
            *shortest_us = shortest_us.min(start.elapsed().as_nanos() as f64 * 1.0e-3);
        }
    }
    shortest_us
}

fn part(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * part) as usize]
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn report(kind: IndexKind, order: &str, boxes: &[Aabb], is_first: bool) {
    let us = grow(kind, boxes, is_first);
    let ratios = us.iter().enumerate().map(|(frame, us_here)| {
        let from = frame.saturating_sub(NEIGHBOURS / 2);
        us_here / part(&us[from..(frame + NEIGHBOURS / 2).min(us.len())], 0.5)
    });
    let ratios: Vec<f64> = ratios.collect();
    let worst = part(&ratios, 1.0);
    println!(
        "{:>8} {order:<8} {:<11} {:<6} {:>7.2} {:>7.2} {:>7.2} {:>7.2} {:>6} {:>6.1} {:>6}",
        boxes.len(),
        kind.name(),
        if is_first { "first" } else { "again" },
        part(&us, 0.5),
        part(&us, 0.99),
        part(&us, 0.999),
        part(&us, 1.0),
        ratios.iter().filter(|ratio| **ratio > SPIKE).count(),
        worst,
        ratios.iter().position(|&ratio| ratio == worst).unwrap_or_default(),
    );
}

#[expect(clippy::print_stdout, reason = "a bench prints its table")]
fn main() {
    let cases = Cases::of_command_line();
    println!(
        "{:>8} {:<8} {:<11} {:<6} {:>7} {:>7} {:>7} {:>7} {:>6} {:>13}",
        "polygons", "order", "structure", "memory", "p50 us", "p99", "p99.9", "most", "spikes", "worst frame"
    );
    for (order, boxes) in cases.orders() {
        for size in cases.sizes(&[3_000, 10_000, 100_000]) {
            let boxes = boxes(size);
            for (kind, is_first) in
                [(IndexKind::Osp, false), (IndexKind::Osp, true), (IndexKind::BruteSimd, false)]
            {
                report(kind, order, &boxes, is_first);
            }
        }
    }
}
