use glam::Vec3;

use super::*;
use merge::{Merged, place};
use osp_session::recording::{SynthKind, synthesize};

/// Number of sample steps along each side of a triangle.
const STEPS: usize = 4;

fn triangles(record: &PolygonRecord) -> [[Vec3; 3]; 2] {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| place(record, corner));
    [[a, b, c], [a, c, d]]
}

fn samples(record: &PolygonRecord) -> Vec<Vec3> {
    let steps = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |k| (i as f32, k as f32)));
    let of = |[a, b, c]: [Vec3; 3]| {
        steps.clone().map(move |(i, k)| a + (b - a) * (i / STEPS as f32) + (c - a) * (k / STEPS as f32))
    };
    triangles(record).into_iter().flat_map(of).collect()
}

fn distance_m(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let edge = |from: Vec3, to: Vec3| {
        let way = to - from;
        let part = ((p - from).dot(way) / way.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        p.distance(from + way * part)
    };
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let is_above = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) >= 0.0;
    if normal != Vec3::ZERO && is_above(a, b) && is_above(b, c) && is_above(c, a) {
        return (p - a).dot(normal).abs();
    }
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

fn distance_to_all_m(p: Vec3, records: &[PolygonRecord]) -> f32 {
    records.iter().flat_map(triangles).map(|triangle| distance_m(p, triangle)).fold(f32::INFINITY, f32::min)
}

fn clusters() -> Vec<(Vec<Source>, Vec<Merged>)> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, 4000, 7) {
        scene.apply(&event.expect("an event"), &mut changes);
    }
    let mut clusters = Vec::new();
    for first in (0..scene.polygon_count()).step_by(CLUSTER) {
        let mut sources = Vec::new();
        collect(&scene, Colors::Own, first, Classes::default(), &mut sources);
        let (merged, _) = merge(&sources);
        clusters.push((sources, merged));
    }
    clusters
}

#[test]
fn merged_quads_are_as_near_as_their_error_tells() {
    let (mut quads, mut polygons) = (0, 0);
    for (sources, merged) in clusters() {
        polygons += sources.len();
        for quad in merged {
            quads += 1;
            let own = |source: &&Source| quad.mask >> source.bit & 1 == 1;
            let all: Vec<PolygonRecord> = sources.iter().filter(own).map(|source| source.record).collect();
            assert_eq!(all.len() as u32, quad.mask.count_ones());
            let most_m = quad.error_m + 1.0e-5;
            for p in all.iter().flat_map(samples) {
                let off_m = distance_to_all_m(p, &[quad.record]);
                assert!(off_m <= most_m, "a polygon is {off_m} m from its quad, {quad:?}");
            }
            for p in samples(&quad.record) {
                let off_m = distance_to_all_m(p, &all);
                assert!(off_m <= most_m, "a quad is {off_m} m from its polygons, {quad:?}");
            }
        }
    }
    assert!(quads > polygons / 2, "{quads} quads of {polygons} polygons");
}

#[test]
fn larger_quads_come_first_and_never_overlap_in_part() {
    for (_, merged) in clusters() {
        for (i, quad) in merged.iter().enumerate() {
            for later in &merged[i + 1..] {
                let common = quad.mask & later.mask;
                assert!(common == 0 || common == later.mask, "{:x} and {:x}", quad.mask, later.mask);
            }
        }
    }
}
