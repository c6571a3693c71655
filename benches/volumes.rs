//! Bounding volumes of pages of ribbons: what a test against a frustum costs, and how much it lets through.
//!
//! `cargo bench --bench volumes`. A page is a run of sixteen polygons of a synthetic session, as they were drawn. How
//! tight the volumes are is printed before the times: of the pages that no frustum plane set leaves in view (each polygon
//! clipped by all planes), the share that a volume recognises.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use osp::{
    math::{Aabb, Containment, Frustum, Obb, Sphere, Volume},
    polygon::PolygonId,
    recording::{SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Polygons of the session, and of a page.
const POLYGONS: u32 = 50_000;
const PAGE: usize = 16;
/// Views of each camera.
const VIEWS: u64 = 24;

struct Page {
    polygons: Vec<Vec<Vec3>>,
    aabb: Aabb,
    around_aabb: Sphere,
    sphere: Sphere,
    obb: Obb,
}

fn pages() -> Vec<Page> {
    let mut scene = Scene::new();
    for event in synthesize(SynthKind::Scribble, POLYGONS, 1) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut Vec::new());
    }
    let corners = |id: u32| scene.polygon(PolygonId(id)).vertices().to_vec();
    let ids: Vec<u32> = (0..scene.polygon_count() as u32).collect();
    let page = |ids: &[u32]| {
        let polygons: Vec<Vec<Vec3>> = ids.iter().map(|&id| corners(id)).collect();
        let points = polygons.concat();
        let aabb = Aabb::from_points(&points);
        Page {
            aabb,
            around_aabb: Sphere::around(&aabb),
            sphere: Sphere::from_points(&points),
            obb: Obb::from_points(&points).expect("finite points"),
            polygons,
        }
    };
    ids.chunks(PAGE).map(page).collect()
}

fn frusta(pages: &[Page], camera: CameraChoice) -> Vec<Frustum> {
    let bounds = pages.iter().fold(Aabb::EMPTY, |all, page| all.union(&page.aabb));
    let path = CameraPath::new(camera, None, &bounds);
    (0..VIEWS).map(|i| path.view(&Moment { frame: i * 30, ..Moment::default() }).frustum()).collect()
}

/// Whether any of a polygon lies in the frustum: what the planes leave of it.
fn is_in_view(frustum: &Frustum, polygon: &[Vec3]) -> bool {
    let mut left = polygon.to_vec();
    for plane in frustum.planes() {
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (i, &to) in left.iter().enumerate() {
            let from = left[(i + left.len() - 1) % left.len()];
            let (a, b) = (plane.signed_distance(from), plane.signed_distance(to));
            if (a < 0.0) != (b < 0.0) {
                kept.push(from + (to - from) * (a / (a - b)));
            }
            if b >= 0.0 {
                kept.push(to);
            }
        }
        left = kept;
    }
    !left.is_empty()
}

type Test = fn(&Frustum, &Page) -> Containment;

const VOLUMES: [(&str, Test); 5] = [
    ("sphere of the box", |f, page| f.classify_volume(&page.around_aabb)),
    ("sphere", |f, page| f.classify_volume(&page.sphere)),
    ("aabb", |f, page| f.classify(&page.aabb)),
    ("aabb by radius", |f, page| f.classify_volume(&page.aabb)),
    ("obb", |f, page| f.classify_volume(&page.obb)),
];

#[allow(clippy::print_stdout, reason = "the figures of a benchmark")]
fn tightness(pages: &[Page]) {
    let surface = |page: &Page| {
        let half = page.obb.half_sides_m();
        8.0 * (half.x * half.y + half.y * half.z + half.z * half.x)
    };
    let aabb: f32 = pages.iter().map(|page| page.aabb.surface_area()).sum();
    let obb: f32 = pages.iter().map(surface).sum();
    let sphere: f32 =
        pages.iter().map(|page| 4.0 * std::f32::consts::PI * page.sphere.size_m().powi(2)).sum();
    println!(
        "{} pages; surface against the aabb's: obb {:.2}, sphere {:.2}",
        pages.len(),
        obb / aabb,
        sphere / aabb
    );
    for camera in [CameraChoice::Orbit, CameraChoice::Inside] {
        let frusta = frusta(pages, camera);
        let mut outside = 0;
        let mut seen_to_be = [0; VOLUMES.len()];
        for (frustum, page) in frusta.iter().flat_map(|f| pages.iter().map(move |page| (f, page))) {
            let is_outside = !page.polygons.iter().any(|polygon| is_in_view(frustum, polygon));
            outside += u32::from(is_outside);
            for ((name, test), count) in VOLUMES.iter().zip(&mut seen_to_be) {
                let says = test(frustum, page) == Containment::Outside;
                assert!(is_outside || !says, "{name} calls what is in view outside");
                *count += u32::from(says);
            }
        }
        println!("{}: {outside} of {} are outside", camera.name(), pages.len() * frusta.len());
        for ((name, _), count) in VOLUMES.iter().zip(seen_to_be) {
            println!(
                "  {name}: {:.2} % of them recognised",
                100.0 * f64::from(count) / f64::from(outside.max(1))
            );
        }
    }
}

fn classify(c: &mut Criterion) {
    let pages = pages();
    tightness(&pages);
    let frusta = frusta(&pages, CameraChoice::Inside);
    let mut group = c.benchmark_group("classify");
    group.sample_size(20).throughput(Throughput::Elements(pages.len() as u64 * VIEWS));
    for (name, test) in VOLUMES {
        group.bench_function(name, |b| {
            b.iter(|| {
                for frustum in &frusta {
                    for page in &pages {
                        black_box(test(frustum, page));
                    }
                }
            });
        });
    }
    group.finish();
    let mut group = c.benchmark_group("fit");
    let points: Vec<Vec<Vec3>> = pages.iter().map(|page| page.polygons.concat()).collect();
    group.sample_size(20).throughput(Throughput::Elements(pages.len() as u64));
    group.bench_function("aabb", |b| {
        b.iter(|| {
            points.iter().for_each(|p| {
                black_box(Aabb::from_points(p));
            })
        })
    });
    group.bench_function("sphere", |b| {
        b.iter(|| {
            points.iter().for_each(|p| {
                black_box(Sphere::from_points(p));
            })
        })
    });
    group.bench_function("obb", |b| {
        b.iter(|| {
            points.iter().for_each(|p| {
                black_box(Obb::from_points(p));
            })
        })
    });
    group.finish();
}

criterion_group!(benches, classify);
criterion_main!(benches);
