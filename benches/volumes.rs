//! Bounding volumes of pieces of ribbons: their tightness, and the time to test them against a frustum.
//!
//! `cargo bench --bench volumes`. A block has sixteen consecutive polygons of a synthetic session. A block is outside the
//! frustum if the planes clip all of its polygons away. The bench first prints the tightness of each volume: the
//! percentage of these blocks whose volume is outside, too. Further benches: rays against the same volumes, transformed
//! objects in world space and in object space, and matrix arithmetic. docs/volumes.md has the results.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, EulerRot, Mat4, Quat, Vec3, Vec4};
use osp::{
    math::{Aabb, Capsule, Containment, Frustum, Obb, Ray, Sphere, Volume},
    polygon::PolygonId,
};
use osp_session::{
    recording::{SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Number of polygons of the session, and of a block.
const POLYGONS: u32 = 50_000;
const BLOCK: usize = 16;
/// Number of views of each camera.
const VIEWS: u64 = 24;

struct Block {
    polygons: Vec<Vec<Vec3>>,
    aabb: Aabb,
    around_aabb: Sphere,
    sphere: Sphere,
    capsule: Capsule,
    obb: Obb,
}

fn blocks() -> Vec<Block> {
    let mut scene = Scene::new();
    for event in synthesize(SynthKind::Scribble, POLYGONS, 1) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut Vec::new());
    }
    let corners = |id: u32| scene.polygon(PolygonId(id)).vertices().to_vec();
    let ids: Vec<u32> = (0..scene.polygon_count() as u32).collect();
    let block = |ids: &[u32]| {
        let polygons: Vec<Vec<Vec3>> = ids.iter().map(|&id| corners(id)).collect();
        let points = polygons.concat();
        let aabb = Aabb::from_points(&points);
        Block {
            aabb,
            around_aabb: Sphere::around(&aabb),
            sphere: Sphere::from_points(&points),
            capsule: Capsule::from_points(&points).expect("finite points"),
            obb: Obb::from_points(&points).expect("finite points"),
            polygons,
        }
    };
    ids.chunks(BLOCK).map(block).collect()
}

fn frusta(blocks: &[Block], camera: CameraChoice) -> Vec<Frustum> {
    let bounds = blocks.iter().fold(Aabb::EMPTY, |all, block| all.union(&block.aabb));
    let path = CameraPath::new(camera, None, &bounds);
    (0..VIEWS).map(|i| path.view(&Moment { frame: i * 30, ..Moment::default() }).frustum()).collect()
}

/// Returns whether the clipped polygon is not empty.
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

type Test = fn(&Frustum, &Block) -> Containment;

const VOLUMES: [(&str, Test); 6] = [
    ("sphere of the box", |f, block| f.classify_volume(&block.around_aabb)),
    ("sphere", |f, block| f.classify_volume(&block.sphere)),
    ("capsule", |f, block| f.classify_volume(&block.capsule)),
    ("aabb", |f, block| f.classify(&block.aabb)),
    ("aabb by radius", |f, block| f.classify_volume(&block.aabb)),
    ("obb", |f, block| f.classify_volume(&block.obb)),
];

#[allow(clippy::print_stdout, reason = "a bench prints its results")]
fn tightness(blocks: &[Block]) {
    let surface = |block: &Block| {
        let half = block.obb.half_sides_m();
        8.0 * (half.x * half.y + half.y * half.z + half.z * half.x)
    };
    let aabb: f32 = blocks.iter().map(|block| block.aabb.surface_area()).sum();
    let obb: f32 = blocks.iter().map(surface).sum();
    let sphere: f32 =
        blocks.iter().map(|block| 4.0 * std::f32::consts::PI * block.sphere.size_m().powi(2)).sum();
    println!(
        "{} blocks; surface against the aabb's: obb {:.2}, sphere {:.2}",
        blocks.len(),
        obb / aabb,
        sphere / aabb
    );
    for camera in [CameraChoice::Orbit, CameraChoice::Inside] {
        let frusta = frusta(blocks, camera);
        let mut outside = 0;
        let mut found_outside = [0; VOLUMES.len()];
        for (frustum, block) in frusta.iter().flat_map(|f| blocks.iter().map(move |block| (f, block))) {
            let is_outside = !block.polygons.iter().any(|polygon| is_in_view(frustum, polygon));
            outside += u32::from(is_outside);
            for ((name, test), count) in VOLUMES.iter().zip(&mut found_outside) {
                let is_found = test(frustum, block) == Containment::Outside;
                assert!(is_outside || !is_found, "{name}: a block in view counts as outside");
                *count += u32::from(is_found);
            }
        }
        println!("{}: {outside} of {} are outside", camera.name(), blocks.len() * frusta.len());
        for ((name, _), count) in VOLUMES.iter().zip(found_outside) {
            println!(
                "  {name}: {:.2} % of them recognised",
                100.0 * f64::from(count) / f64::from(outside.max(1))
            );
        }
    }
}

fn classify(c: &mut Criterion) {
    let blocks = blocks();
    tightness(&blocks);
    let frusta = frusta(&blocks, CameraChoice::Inside);
    let mut group = c.benchmark_group("classify");
    group.sample_size(20).throughput(Throughput::Elements(blocks.len() as u64 * VIEWS));
    for (name, test) in VOLUMES {
        group.bench_function(name, |b| {
            b.iter(|| {
                for frustum in &frusta {
                    for block in &blocks {
                        black_box(test(frustum, block));
                    }
                }
            });
        });
    }
    group.finish();
    let mut group = c.benchmark_group("fit");
    let points: Vec<Vec<Vec3>> = blocks.iter().map(|block| block.polygons.concat()).collect();
    group.sample_size(20).throughput(Throughput::Elements(blocks.len() as u64));
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
    group.bench_function("capsule", |b| {
        b.iter(|| {
            points.iter().for_each(|p| {
                black_box(Capsule::from_points(p));
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

type Hit = fn(&Ray, &Block) -> Option<f32>;

const HIT: [(&str, Hit); 3] = [
    ("sphere", |ray, block| ray.enter_sphere(&block.sphere, f32::INFINITY)),
    ("capsule", |ray, block| ray.enter_capsule(&block.capsule, f32::INFINITY)),
    ("aabb", |ray, block| ray.enter_box(&block.aabb, f32::INFINITY)),
];

/// Returns the ray's parameter at the nearest polygon of a block.
fn meet_polygons(ray: &Ray, block: &Block) -> Option<f32> {
    let fans = block.polygons.iter().flat_map(|p| (2..p.len()).map(|i| [p[0], p[i - 1], p[i]]));
    fans.filter_map(|triangle| ray.meet_triangle(triangle)).reduce(f32::min)
}

/// Returns rays from points around the model to the centres of blocks.
fn rays_at(blocks: &[Block]) -> Vec<Ray> {
    let bounds = blocks.iter().fold(Aabb::EMPTY, |all, block| all.union(&block.aabb));
    let around = |i: usize| {
        let turn = Quat::from_euler(EulerRot::YXZ, i as f32 * 2.4, i as f32 * 0.7, 0.0);
        bounds.center() + turn * Vec3::Z * bounds.extent().length()
    };
    (0..64).map(|i| Ray::new(around(i), blocks[i * 7919 % blocks.len()].aabb.center() - around(i))).collect()
}

#[allow(clippy::print_stdout, reason = "a bench prints its results")]
fn rays(c: &mut Criterion) {
    let blocks = blocks();
    let rays = rays_at(&blocks);
    let tests = || rays.iter().flat_map(|ray| blocks.iter().map(move |block| (ray, block)));
    let met = tests().filter(|(ray, block)| meet_polygons(ray, block).is_some()).count();
    println!("{} rays against {} blocks: {met} meet a polygon", rays.len(), blocks.len());
    for (name, hit) in HIT {
        let entered = tests().filter(|(ray, block)| hit(ray, block).is_some()).count();
        let is_missed =
            |(ray, block): &(&Ray, &Block)| meet_polygons(ray, block).is_some() && hit(ray, block).is_none();
        assert_eq!(tests().filter(is_missed).count(), 0, "{name} misses a polygon in it");
        println!("  {name}: {:.1} times as many enter it", entered as f64 / met.max(1) as f64);
    }
    let mut group = c.benchmark_group("ray");
    group.sample_size(20).throughput(Throughput::Elements((blocks.len() * rays.len()) as u64));
    for (name, hit) in HIT {
        group.bench_function(name, |b| {
            b.iter(|| {
                tests().for_each(|(ray, block)| {
                    black_box(hit(ray, block));
                })
            });
        });
    }
    group.finish();
}

/// Returns a transform for each block: rotation, scale and translation.
fn places(blocks: &[Block]) -> Vec<Affine3A> {
    let place = |i: usize| {
        let turn = Quat::from_euler(EulerRot::YXZ, i as f32 * 1.7, i as f32 * 0.6, i as f32 * 0.3);
        let size = 0.5 + (i % 7) as f32 * 0.25;
        Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, Vec3::splat((i % 5) as f32 * 0.2))
    };
    (0..blocks.len()).map(place).collect()
}

/// Returns a box around a transformed box. James Arvo, "Transforming Axis-Aligned Bounding Boxes", Graphics Gems, 1990.
fn transform_box(place: &Affine3A, bounds: &Aabb) -> Aabb {
    let (middle, half) = (place.transform_point3(bounds.center()), bounds.extent() * 0.5);
    let m = place.matrix3;
    let half = Vec3::from(m.x_axis.abs()) * half.x
        + Vec3::from(m.y_axis.abs()) * half.y
        + Vec3::from(m.z_axis.abs()) * half.z;
    Aabb::new(middle - half, middle + half)
}

/// Tests objects with transforms: the volume is transformed to world space, or the frustum to object space.
fn objects(c: &mut Criterion) {
    type Test = fn(&Frustum, &Affine3A, &Block) -> Containment;
    const METHODS: [(&str, Test); 4] = [
        ("sphere in world space", |f, place, block| {
            let size = place.matrix3.x_axis.length();
            let center = place.transform_point3(block.sphere.center);
            f.classify_volume(&Sphere { center, radius_m: block.sphere.radius_m * size * 1.000_01 })
        }),
        ("box around the box in world space", |f, place, block| {
            f.classify(&transform_box(place, &block.aabb))
        }),
        ("box in its own space", |f, place, block| f.in_space(place).classify(&block.aabb)),
        ("obb in its own space", |f, place, block| f.in_space(place).classify_volume(&block.obb)),
    ];
    let blocks = blocks();
    let places = places(&blocks);
    let frusta = frusta(&blocks, CameraChoice::Inside);
    let mut group = c.benchmark_group("object");
    group.sample_size(20).throughput(Throughput::Elements(blocks.len() as u64 * VIEWS));
    for (name, test) in METHODS {
        let all = || {
            frusta
                .iter()
                .flat_map(|f| blocks.iter().zip(&places).map(move |(block, place)| (f, place, block)))
        };
        let outside = all().filter(|(f, place, block)| test(f, place, block) == Containment::Outside).count();
        note(&format!(
            "{name}: {:.2} % outside",
            100.0 * outside as f64 / (blocks.len() * frusta.len()) as f64
        ));
        group.bench_function(name, |b| {
            b.iter(|| {
                all().for_each(|(f, place, block)| {
                    black_box(test(f, place, block));
                })
            });
        });
    }
    group.finish();
}

#[allow(clippy::print_stdout, reason = "a bench prints its results")]
fn note(line: &str) {
    println!("{line}");
}

/// Matrices by columns, in scalar arithmetic.
mod scalar {
    pub(super) type Matrix = [f32; 16];

    pub(super) fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
        let mut out = [0.0; 16];
        for column in 0..4 {
            for row in 0..4 {
                out[column * 4 + row] = (0..4).map(|k| a[k * 4 + row] * b[column * 4 + k]).sum();
            }
        }
        out
    }

    pub(super) fn transform(m: &Matrix, v: [f32; 4]) -> [f32; 4] {
        std::array::from_fn(|row| (0..4).map(|k| m[k * 4 + row] * v[k]).sum())
    }

    /// Returns the inverse: the adjugate from 2 x 2 minors of the first and the last two columns, divided by the
    /// determinant.
    pub(super) fn inverse(m: &Matrix) -> Matrix {
        let minor = |a: usize, b: usize, row: usize, other: usize| {
            m[a * 4 + row] * m[b * 4 + other] - m[b * 4 + row] * m[a * 4 + other]
        };
        let s = [
            minor(0, 1, 0, 1),
            minor(0, 1, 0, 2),
            minor(0, 1, 0, 3),
            minor(0, 1, 1, 2),
            minor(0, 1, 1, 3),
            minor(0, 1, 2, 3),
        ];
        let c = [
            minor(2, 3, 0, 1),
            minor(2, 3, 0, 2),
            minor(2, 3, 0, 3),
            minor(2, 3, 1, 2),
            minor(2, 3, 1, 3),
            minor(2, 3, 2, 3),
        ];
        let det = s[0] * c[5] - s[1] * c[4] + s[2] * c[3] + s[3] * c[2] - s[4] * c[1] + s[5] * c[0];
        let over = 1.0 / det;
        let of = |column: usize, p: [(usize, f32); 3]| {
            p.iter().map(|&(row, by)| m[column * 4 + row] * by).sum::<f32>() * over
        };
        [
            of(1, [(1, c[5]), (2, -c[4]), (3, c[3])]),
            of(0, [(1, -c[5]), (2, c[4]), (3, -c[3])]),
            of(3, [(1, s[5]), (2, -s[4]), (3, s[3])]),
            of(2, [(1, -s[5]), (2, s[4]), (3, -s[3])]),
            of(1, [(0, -c[5]), (2, c[2]), (3, -c[1])]),
            of(0, [(0, c[5]), (2, -c[2]), (3, c[1])]),
            of(3, [(0, -s[5]), (2, s[2]), (3, -s[1])]),
            of(2, [(0, s[5]), (2, -s[2]), (3, s[1])]),
            of(1, [(0, c[4]), (1, -c[2]), (3, c[0])]),
            of(0, [(0, -c[4]), (1, c[2]), (3, -c[0])]),
            of(3, [(0, s[4]), (1, -s[2]), (3, s[0])]),
            of(2, [(0, -s[4]), (1, s[2]), (3, -s[0])]),
            of(1, [(0, -c[3]), (1, c[1]), (2, -c[0])]),
            of(0, [(0, c[3]), (1, -c[1]), (2, c[0])]),
            of(3, [(0, -s[3]), (1, s[1]), (2, -s[0])]),
            of(2, [(0, s[3]), (1, -s[1]), (2, s[0])]),
        ]
    }
}

fn matrices(c: &mut Criterion) {
    let blocks = blocks();
    let simd: Vec<Mat4> = places(&blocks).into_iter().map(Mat4::from).collect();
    let plain: Vec<scalar::Matrix> = simd.iter().map(Mat4::to_cols_array).collect();
    for (simd, plain) in simd.iter().zip(&plain) {
        let close = |a: Mat4, b: scalar::Matrix| {
            assert!(a.abs_diff_eq(Mat4::from_cols_array(&b), 1.0e-3), "{a} {b:?}")
        };
        close(*simd * *simd, scalar::multiply(plain, plain));
        close(simd.inverse(), scalar::inverse(plain));
    }
    let mut group = c.benchmark_group("matrix");
    group.sample_size(20).throughput(Throughput::Elements(simd.len() as u64));
    group.bench_function("multiply, glam", |b| {
        b.iter(|| {
            simd.windows(2).for_each(|pair| {
                black_box(pair[0] * pair[1]);
            })
        });
    });
    group.bench_function("multiply, scalar", |b| {
        b.iter(|| {
            plain.windows(2).for_each(|pair| {
                black_box(scalar::multiply(&pair[0], &pair[1]));
            })
        });
    });
    group.bench_function("inverse, glam", |b| {
        b.iter(|| {
            simd.iter().for_each(|m| {
                black_box(m.inverse());
            })
        });
    });
    group.bench_function("inverse, scalar", |b| {
        b.iter(|| {
            plain.iter().for_each(|m| {
                black_box(scalar::inverse(m));
            })
        });
    });
    let point = Vec4::new(1.0, 2.0, 3.0, 1.0);
    group.bench_function("point, glam", |b| {
        b.iter(|| {
            simd.iter().for_each(|m| {
                black_box(*m * black_box(point));
            })
        });
    });
    group.bench_function("point, scalar", |b| {
        b.iter(|| {
            plain.iter().for_each(|m| {
                black_box(scalar::transform(m, black_box(point.to_array())));
            })
        });
    });
    let affine = places(&blocks);
    group.bench_function("box by its middle and half sides, glam", |b| {
        b.iter(|| {
            affine.iter().zip(&blocks).for_each(|(place, block)| {
                black_box(transform_box(place, &block.aabb));
            })
        });
    });
    group.bench_function("box by its corners, glam", |b| {
        b.iter(|| {
            affine.iter().zip(&blocks).for_each(|(place, block)| {
                black_box(Aabb::from_points(&block.aabb.corners().map(|p| place.transform_point3(p))));
            })
        });
    });
    group.bench_function("box by its corners, scalar", |b| {
        b.iter(|| {
            plain.iter().zip(&blocks).for_each(|(m, block)| {
                let mut bounds = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
                for p in block.aabb.corners() {
                    let moved = scalar::transform(m, [p.x, p.y, p.z, 1.0]);
                    for ((low, high), at) in bounds.0.iter_mut().zip(&mut bounds.1).zip(moved) {
                        (*low, *high) = (low.min(at), high.max(at));
                    }
                }
                black_box(bounds);
            })
        });
    });
    group.finish();
}

criterion_group!(benches, classify, rays, objects, matrices);
criterion_main!(benches);
