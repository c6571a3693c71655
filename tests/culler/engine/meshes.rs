//! Occluders of many triangles, which may move: what they hide, judged by rays.

use osp::{
    Camera, Culler, Depth, Occluder,
    glam::{DMat4, DVec3, DVec4, Quat, Vec3},
    math::Aabb,
    oracle::Oracle,
};
use osp_testkit::boxes::Rng;

type Columns = [[f32; 3]; 4];

/// A mesh in its own space.
#[derive(Clone, Default)]
struct Mesh {
    vertices: Vec<Vec3>,
    indices: Vec<u32>,
}

impl Mesh {
    fn quad(&mut self, corners: [Vec3; 4], is_turned: bool) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners);
        let order = if is_turned { [0, 2, 1, 0, 3, 2] } else { [0, 1, 2, 0, 2, 3] };
        self.indices.extend(order.map(|i| first + i));
    }

    /// A sheet of `n` x `n` quads, each with its own vertices. `at` places its points.
    fn sheet(&mut self, n: u32, rng: &mut Rng, at: impl Fn(f32, f32) -> Vec3) {
        for i in 0..n * n {
            let (x, y) = (i % n, i / n);
            let corner = |x, y| at(x as f32 / n as f32, y as f32 / n as f32);
            let corners = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            // A hole, a quad of its own orientation, or a T-junction: the next quad has a corner that this one has not.
            match rng.below(40) {
                0 => {}
                1 => self.quad(corners, true),
                2 => {
                    let middle = (corners[0] + corners[1]) * 0.5;
                    self.quad([corners[0], middle, corners[2], corners[3]], false);
                    self.quad([middle, corners[1], corners[2], corners[2]], false);
                }
                _ => self.quad(corners, false),
            }
        }
    }

    fn any(rng: &mut Rng) -> Self {
        let mut mesh = Self::default();
        let n = [1, 2, 5, 12, 24][rng.below(5)];
        let bumps = rng.range(0.0, 0.4);
        match rng.below(4) {
            0 => mesh.sheet(n, rng, |x, y| {
                Vec3::new(x * 2.0 - 1.0, y * 2.0 - 1.0, bumps * ((x * 9.0).sin() + (y * 7.0).cos()))
            }),
            1 => mesh.sheet(n + 2, rng, |x, y| {
                // A ball, closed where its parts meet bit for bit.
                let (a, b) = (x.fract() * std::f32::consts::TAU, y * std::f32::consts::PI);
                Vec3::new(a.cos() * b.sin(), b.cos(), a.sin() * b.sin())
            }),
            2 => {
                for axis in 0..3 {
                    for side in [-1.0, 1.0] {
                        mesh.sheet(n, rng, |x, y| {
                            let (x, y) = (x * 2.0 - 1.0, y * 2.0 - 1.0);
                            [Vec3::new(side, x, y), Vec3::new(y, side, x), Vec3::new(x, y, side)][axis]
                        });
                    }
                }
            }
            _ => {
                for _ in 0..rng.below(60) + 1 {
                    let center = rng.direction();
                    mesh.quad([0; 4].map(|_| center + rng.direction() * 0.5), false);
                }
            }
        }
        mesh
    }

    /// Its triangles at a place.
    fn placed(&self, columns: &Columns) -> Vec<[[f32; 3]; 3]> {
        let [x, y, z, origin] = columns.map(|column| Vec3::from(column).as_dvec3());
        let at = |i: &u32| {
            let p = self.vertices[*i as usize].as_dvec3();
            (x * p.x + y * p.y + z * p.z + origin).as_vec3().to_array()
        };
        self.indices.as_chunks::<3>().0.iter().map(|t| t.each_ref().map(at)).collect()
    }
}

fn any_place(rng: &mut Rng, at: Vec3) -> Columns {
    let turn = Quat::from_axis_angle(rng.direction(), rng.range(0.0, 6.0));
    let size = Vec3::new(rng.range(1.0, 6.0), rng.range(1.0, 6.0), rng.range(-4.0, 4.0));
    let columns = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z].map(|axis| turn * axis);
    [columns[0].into(), columns[1].into(), columns[2].into(), at.into()]
}

fn cube(bounds: &Aabb) -> Vec<[[f32; 3]; 3]> {
    let corners = bounds.corners();
    let sides = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]: &[usize; 4]| [[a, b, c], [a, c, d]]);
    triangles.map(|t| t.map(|i| corners[i].to_array())).collect()
}

/// A camera that looks from `eye` along `forward`: reversed depth without a far plane, a finite one, or a parallel one.
fn any_camera(rng: &mut Rng, eye: DVec3, forward: DVec3, scale: f64) -> Camera {
    let right = forward.cross(DVec3::Y).normalize();
    let axes = DMat4::from_cols(
        right.extend(0.0),
        right.cross(forward).extend(0.0),
        (-forward).extend(0.0),
        DVec4::W,
    );
    let view = axes.transpose() * DMat4::from_translation(-eye);
    let near = [0.01, 0.3, 2.0][rng.below(3)] * scale;
    let (wide, high) = (f64::from(rng.range(0.6, 2.0)), f64::from(rng.range(0.6, 2.0)));
    let (clip, depth) = match rng.below(5) {
        0 => {
            let scale = DVec4::new(0.1 * wide / scale, 0.1 * high / scale, -0.01 / scale, 1.0);
            (DMat4::from_diagonal(scale), Depth::ZeroToOne)
        }
        1 => {
            let far = 80.0 * scale;
            let (a, b) = (far / (near - far), near * far / (near - far));
            let mut clip = DMat4::from_diagonal(DVec4::new(wide, -high, a, 0.0));
            (clip.z_axis.w, clip.w_axis.z) = (-1.0, b);
            (clip, Depth::ZeroToOne)
        }
        _ => {
            let mut clip = DMat4::from_diagonal(DVec4::new(wide, high, 0.0, 0.0));
            (clip.z_axis.w, clip.w_axis.z) = (-1.0, near);
            // Off-axis.
            (clip.z_axis.x, clip.z_axis.y) =
                (f64::from(rng.range(-0.3, 0.3)), f64::from(rng.range(-0.3, 0.3)));
            (clip, Depth::OneToZero)
        }
    };
    Camera::from_matrix((clip * view).to_cols_array(), depth).expect("a camera")
}

#[test]
fn no_object_behind_moving_meshes_is_hidden_while_a_ray_reaches_it() {
    const MESHES: usize = 12;
    let mut rng = Rng(9);
    let mut hidden = 0;
    for scene in 0..40 {
        let scale = [1.0_f32, 1.0, 1.0e-2, 30.0][scene % 4];
        let origin = [Vec3::ZERO, Vec3::new(300.0, -20.0, 100.0)][scene % 2] * scale;
        let mut culler = Culler::<u32>::new();
        let mut world: Vec<Vec<[[f32; 3]; 3]>> = Vec::new();
        let mut shapes: Vec<Mesh> = Vec::new();
        for key in 0..MESHES {
            let shape = match shapes.last() {
                Some(last) if rng.below(3) == 0 => last.clone(),
                _ => Mesh::any(&mut rng),
            };
            let own = Aabb::from_points(&shape.vertices);
            culler.set(key as u32, [own.min, own.max]);
            if let Ok(occluder) = Occluder::mesh(&shape.vertices, &shape.indices) {
                culler.set_occluder(key as u32, occluder);
            }
            world.push(Vec::new());
            shapes.push(shape);
        }
        let room = Aabb::new(Vec3::splat(-12.0), Vec3::splat(12.0));
        for key in MESHES..400 {
            let center = origin + rng.point(&room) * scale;
            let bounds = Aabb::cube(center, rng.range(0.02, 0.5) * scale);
            culler.set(key as u32, [bounds.min, bounds.max]);
            world.push(cube(&bounds));
        }
        for _ in 0..4 {
            for key in 0..MESHES {
                if world[key].is_empty() || rng.below(2) == 0 {
                    let at = rng.point(&room);
                    let mut columns = any_place(&mut rng, at);
                    columns.iter_mut().flatten().for_each(|v| *v *= scale);
                    columns[3] = (origin + Vec3::from(columns[3])).into();
                    culler.set_transform(key as u32, columns);
                    world[key] = shapes[key].placed(&columns);
                }
            }
            let mut oracle = Oracle::new();
            for (key, triangles) in world.iter().enumerate() {
                oracle.add(key as u32, triangles.iter().copied()).expect("finite");
            }
            let eye = (origin + rng.point(&room) * scale).as_dvec3();
            let forward = rng.direction().as_dvec3();
            let camera = any_camera(&mut rng, eye, forward, f64::from(scale)).hide_by_occluders();
            let frame = culler.cull(&[camera]);
            let seen = &frame[0];
            hidden += seen.hidden();
            let is_drawn = |key| seen.contains(key) || !seen.is_in_view(key);
            let missing = oracle.missing(&camera, is_drawn, 12);
            assert!(missing.is_empty(), "scene {scene}: {missing:?}");
        }
    }
    assert!(hidden > 1500, "{hidden}");
}

/// A wall of `n` x `n` quads before a camera at the origin that looks along -z.
fn wall(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n * n {
        let at = |x: u32, y: u32| {
            Vec3::new(x as f32 / n as f32 * 20.0 - 10.0, y as f32 / n as f32 * 10.0 - 5.0, -10.0)
        };
        let (x, y) = (i % n, i / n);
        mesh.quad([at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)], false);
    }
    mesh
}

fn ahead() -> Camera {
    let mut clip = DMat4::from_diagonal(DVec4::new(0.9, 1.6, 0.0, 0.0));
    (clip.z_axis.w, clip.w_axis.z) = (-1.0, 0.1);
    Camera::from_matrix(clip.to_cols_array(), Depth::OneToZero).expect("a camera").hide_by_occluders()
}

#[test]
fn a_wall_hides_as_much_however_finely_it_is_divided_and_wherever_it_moves() {
    let mut culler = Culler::<u32>::new();
    for i in 0..4000 {
        let min = Vec3::new((i % 80) as f32 * 0.4 - 16.0, (i / 80) as f32 * 0.4 - 10.0, -40.0);
        culler.set(i, [min, min + 0.2]);
    }
    let hidden = |culler: &mut Culler<u32>| culler.cull(&[ahead()])[0].hidden();
    culler.set_occlusion_budget(2_000_000);
    let mut first = None;
    for n in [1, 7, 30, 158] {
        let mesh = wall(n);
        let occluder = Occluder::mesh(&mesh.vertices, &mesh.indices).expect("a wall");
        culler.set_occluder(9000, occluder.clone());
        let found = hidden(&mut culler);
        let first = *first.get_or_insert(found);
        assert!(found * 100 >= first * 96, "{n}: {found} of {first}");
        let report = culler.occlusion();
        assert_eq!((report.considered, report.drawn, report.over_budget), (1, 1, 0));
        assert!(report.triangles * 100 >= 198 * (n * n) as usize, "{report:?}");
        let again = hidden(&mut culler);
        assert_eq!((again, culler.occlusion()), (found, report), "the work is counted");

        // The same mesh, moved: a copy shares it.
        culler.remove(9000);
        culler.set_occluder(9001, occluder);
        let beside = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 100.0, 0.0_f32]];
        culler.set_transform(9001, beside);
        assert_eq!(hidden(&mut culler), 0);
        // Twice as far and twice as large, as a mirror image.
        let twice = [[-2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.0, 0.0_f32]];
        culler.set_transform(9001, twice);
        assert!(hidden(&mut culler) * 100 >= first * 96);
        let mut other = Culler::<u32>::new();
        other.set_occlusion_budget(2_000_000);
        other.set(1, [[-0.5, -0.5, -41.0], [0.5, 0.5, -40.0_f32]]);
        other.append(culler);
        assert!(other.cull(&[ahead()])[0].hidden() * 100 >= first * 96, "it came with its place");
        other.remove(9001);
        other.remove(1);
        assert_eq!(hidden(&mut other), 0);
        culler = other;
    }
}

#[test]
fn a_budget_too_small_and_a_small_mesh_are_reported() {
    let mut culler = Culler::<u32>::new();
    let mesh = wall(30);
    let occluder = Occluder::mesh(&mesh.vertices, &mesh.indices).expect("a wall");
    culler.set(1, [[-0.5, -0.5, -41.0], [0.5, 0.5, -40.0_f32]]);
    culler.set_occluder(9000, occluder.clone());
    culler.set_occluder(9001, occluder);
    culler.set_transform(
        9001,
        [[1.0e-3, 0.0, 0.0], [0.0, 1.0e-3, 0.0], [0.0, 0.0, 1.0e-3], [0.0, 0.0, -30.0_f32]],
    );
    assert_eq!(culler.cull(&[ahead()])[0].hidden(), 1);
    let report = culler.occlusion();
    assert_eq!((report.considered, report.drawn, report.too_small), (2, 1, 1), "{report:?}");
    culler.set_occlusion_budget(0);
    assert_eq!(culler.cull(&[ahead()])[0].hidden(), 0);
    let report = culler.occlusion();
    assert_eq!((report.drawn, report.over_budget, report.triangles), (0, 1, 0), "{report:?}");
    let mut parallel = [0.0_f32; 16];
    (parallel[0], parallel[5], parallel[10], parallel[15]) = (0.1, 0.1, -0.01, 1.0);
    let parallel = Camera::from_matrix(parallel, Depth::ZeroToOne).expect("a camera").hide_by_occluders();
    culler.set_layers(9000, 2);
    culler.cull(&[parallel, ahead().on_layers(1)]);
    let report = culler.occlusion();
    assert_eq!((report.unsupported, report.unseen, report.considered), (1, 1, 0), "{report:?}");
}

/// A gap far narrower than a pixel lets light through, so what is behind it is visible. So is what is just beside the
/// border of a mesh.
#[test]
fn nothing_behind_a_gap_or_a_border_is_hidden() {
    let mut rng = Rng(3);
    let mut near_misses = 0;
    for _ in 0..600 {
        let turn = Quat::from_rotation_z(rng.range(0.0, 6.3)) * Quat::from_rotation_y(rng.range(-1.0, 1.0));
        let middle = Vec3::new(rng.range(-3.0, 3.0), rng.range(-1.5, 1.5), -10.0);
        let gap = [0.0, 1.0e-4, 1.0e-3, 1.0e-2][rng.below(4)];
        let n = [1, 3, 9][rng.below(3)];
        // Two sheets with a gap between them, or one that ends there.
        let mut mesh = Mesh::default();
        let parts = if gap == 0.0 { 1 } else { 2 };
        for part in 0..parts {
            let side = if part == 0 { 1.0 } else { -1.0 };
            mesh.sheet(n, &mut rng, |x, y| {
                let own = Vec3::new(side * (x * 6.0 + 0.5 * gap), y * 12.0 - 6.0, 0.0);
                middle + turn * own
            });
        }
        let mut culler = Culler::<u32>::new();
        let Ok(occluder) = Occluder::mesh(&mesh.vertices, &mesh.indices) else { continue };
        culler.set_occluder(1, occluder);
        culler.set_transform(1, [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ZERO]);
        let frame = culler.cull(&[ahead()]);
        for _ in 0..20 {
            // Points of the gap or just beyond the border, and far behind.
            let on = middle + turn * Vec3::new(-0.25 * gap.max(1.0e-5), rng.range(-6.0, 6.0), 0.0);
            let p = on * rng.range(1.5, 4.0);
            let point = Aabb::cube(p, 1.0e-6);
            assert!(!frame[0].hides_box([point.min, point.max]), "gap {gap}, at {p}");
            let inside = (middle + turn * Vec3::new(1.0, rng.range(-5.0, 5.0), 0.0)) * 2.0;
            near_misses += usize::from(frame[0].hides_box([inside - 1.0e-3, inside + 1.0e-3]));
        }
    }
    assert!(near_misses > 2000, "{near_misses}");
}

#[test]
fn appending_keeps_transforms_and_the_budget_and_endless_depths_are_drawn_as_unknown() {
    let quad = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let occluder = || Occluder::mesh(&quad, &[0, 1, 2]).expect("a triangle");
    let to = |scale: f32, z: f32| [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale], [0.0, 0.0, z]];
    let mut level = Culler::<u32>::new();
    level.set(1, [[-1.0, -1.0, -5.0], [1.0, 1.0, -4.0_f32]]);
    level.set_occluder(2, occluder());
    let mut culler = Culler::<u32>::new();
    culler.set_transform(7, to(1.0, -10.0));
    culler.set_occlusion_budget(0);
    culler.append(level);
    culler.set(7, [[-1.0_f32; 3], [1.0; 3]]);
    assert!(culler.bounds(7).is_some_and(|[min, max]| min[2] < -10.9 && max[2] < -8.9));
    let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.0_f32];
    let camera = || Camera::from_matrix(matrix, Depth::OneToZero).expect("a camera").hide_by_occluders();
    culler.cull(&[camera()]);
    assert_eq!(culler.occlusion().drawn, 0);
    let mut far = Culler::<u32>::new();
    let mesh = Mesh::any(&mut Rng(3));
    let vertices: Vec<Vec3> = mesh.vertices.iter().map(|v| *v * 1e10).collect();
    far.set_occluder(1, Occluder::mesh(&vertices, &mesh.indices).expect("a mesh"));
    far.set_transform(1, to(1e37, -1e37));
    far.set(2, [[-1.0, -1.0, -5.0], [1.0, 1.0, -4.0_f32]]);
    assert_eq!(far.cull(&[camera()])[0].len(), 1);
}
