//! What occluders of the culler hide, judged by rays.

use osp::{
    Camera, Culler, Depth, Occluder,
    glam::{DMat4, DVec3, Mat4, Vec3},
    math::{Aabb, Ray},
    view::{Projection, View},
};

use super::square;
use osp_testkit::boxes::Rng;

/// An object of the engine: a box, and triangles that hide what is behind them.
#[derive(Clone)]
struct Object {
    bounds: Aabb,
    triangles: Vec<[Vec3; 3]>,
}

fn ahead() -> View {
    View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 1.5, 0.1, 100.0))
}

fn quad_of(corners: [Vec3; 4]) -> Object {
    let [a, b, c, d] = corners;
    Object { bounds: Aabb::from_points(&corners), triangles: vec![[a, b, c], [a, c, d]] }
}

/// Points of a box that the view shows although all triangles were said to hide the box.
fn shown(view: &View, bounds: &Aabb, triangles: &[[Vec3; 3]], rng: &mut Rng) -> usize {
    let eye = view.eye_in_world;
    let clip_from_world = view.clip_from_world();
    let is_shown = |p: &Vec3| {
        let clip = clip_from_world * p.extend(1.0);
        let is_on_screen = clip.x.abs() < clip.w * 0.999 && clip.y.abs() < clip.w * 0.999;
        // What hides lies between the near plane and the point.
        let ray = Ray::new(eye, *p - eye);
        let near = view.projection.near_m / clip.w;
        let hides = |t: f32| t > near * 0.999 && t < 1.001;
        is_on_screen
            && clip.w > view.projection.near_m
            && !triangles.iter().filter_map(|&corners| ray.meet_triangle(corners)).any(hides)
    };
    let corners = bounds.corners();
    let inside = (0..20).map(|_| rng.point(bounds)).collect::<Vec<_>>();
    corners.iter().chain(&inside).filter(|p| is_shown(p)).count()
}

#[test]
fn a_wall_hides_two_thousand_meshes_in_the_first_frame() {
    let mut culler = Culler::<u32>::new();
    for i in 0..2000 {
        let at = Vec3::new((i % 50) as f32 * 0.1 - 2.45, (i / 50) as f32 * 0.05 - 1.0, -8.0);
        let bounds = Aabb::cube(at, 0.08);
        culler.set(i, [bounds.min, bounds.max]);
    }
    let wall = square(4.0, 2.0);
    culler.set(9000, [wall[0], wall[2]]);
    let camera = Camera::from(&ahead());
    culler.set_occluder(9000, Occluder::quad(wall).expect("a square"));
    let frame = culler.cull(&[camera.hide_by_occluders(), camera]);
    assert_eq!((frame[0].len(), frame[0].hidden()), (1, 2000));
    assert!(frame[0].iter().eq([9000]), "the wall itself is drawn");
    assert!(!frame[0].contains(5) && frame[0].is_in_view(5));
    assert_eq!((frame[1].len(), frame[1].hidden()), (2001, 0), "occlusion is a view's");
    let behind = [[-0.1_f32, -0.1, -6.0], [0.1, 0.1, -5.0]];
    assert!(frame[0].hides_box(behind) && frame[0].hides_sphere([0.0_f32, 0.0, -6.0], 0.5));
    assert!(!frame[1].hides_box(behind), "occlusion is a view's");
    assert!(!frame[0].hides_box([[-0.1_f32, -0.1, -4.5], [0.1, 0.1, -3.5]]), "the wall cuts it");
    assert!(!frame[0].hides_box([[f32::NAN; 3]; 2]) && !frame[0].hides_box([behind[1], behind[0]]));
    assert!(!frame[0].hides_sphere([0.0_f32, 0.0, -6.0], f32::NAN));

    // The same boxes, as if they were in no culler; one that is half behind, one before, one out of view, and one that is none.
    let mut boxes: Vec<[Vec3; 2]> =
        (0..2000).map(|i| culler.bounds(i).expect("it is there").map(Vec3::from)).collect();
    let beside = [[4.0, 0.0, -8.0], [0.0, 0.0, -3.0]].map(|at| Aabb::cube(at.into(), 1.0));
    boxes.extend(beside.map(|bounds| [bounds.min, bounds.max]));
    boxes.extend([
        [Vec3::new(0.0, 0.0, 50.0), Vec3::new(1.0, 1.0, 51.0)],
        [Vec3::NAN; 2],
        [Vec3::Z, -Vec3::Z],
    ]);
    let others = [false, false, true, false, false];
    let hidden = culler.are_hidden(&camera.hide_by_occluders(), &boxes);
    assert!(hidden[..2000].iter().all(|&is_hidden| is_hidden));
    assert_eq!(hidden[2000..], others);
    let hidden = culler.are_hidden(&camera, &boxes);
    assert!(!hidden[..2000].contains(&true), "occlusion is a view's");
    assert_eq!(hidden[2000..], others);
    assert_eq!(culler.frame().len(), 2, "the frame stays");

    // Whoever does not see the wall sees what is behind it; so does everybody once it has moved, has gone, or was refused.
    let hidden =
        |culler: &mut Culler<u32>, camera: Camera| culler.cull(&[camera.hide_by_occluders()])[0].hidden();
    culler.set_layers(9000, 2);
    assert_eq!(hidden(&mut culler, camera.on_layers(1)), 0);
    assert_eq!(hidden(&mut culler, camera.on_layers(3)), 2000);
    assert_eq!(hidden(&mut culler, camera), 2000);
    culler.set_layers(9000, 0);
    assert_eq!(hidden(&mut culler, camera), 0);
    culler.set_layers(9000, 1);
    culler.set(9000, [wall[0] * 1.1, wall[2] * 1.1]);
    assert_eq!(hidden(&mut culler, camera), 0, "it has moved, and its occluder is where it was");
    culler.set_occluder(9000, Occluder::mesh(&wall, &[0, 1, 2, 0, 2, 3]).expect("a square"));
    assert_eq!(hidden(&mut culler, camera), 2000);
    culler.set(9000, [wall[0] * 1.2 - 1.0, wall[2] * 1.2 + 1.0]);
    assert_eq!(hidden(&mut culler, camera), 2000, "it has grown");
    culler.remove_occluder(9000);
    assert_eq!(hidden(&mut culler, camera), 0);
    culler.set_occluder(9000, Occluder::cuboid([wall[0] - Vec3::Z, wall[2]]).expect("a box"));
    assert_eq!(hidden(&mut culler, camera), 2000);
    culler.set(9000, [Vec3::NAN; 2]);
    assert_eq!(hidden(&mut culler, camera), 0, "what was refused hides nothing");
    // A stand-in is never drawn.
    culler.remove(9000);
    culler.set_occluder(9000, Occluder::quad(wall).expect("a square"));
    assert_eq!(hidden(&mut culler, camera), 2000);
    assert!(culler.frame()[0].is_empty());
    culler.remove(9000);
    assert_eq!(hidden(&mut culler, camera), 0);
}

#[test]
fn a_camera_far_from_the_origin_and_one_without_a_far_plane_hide_by_a_wall() {
    for far_from in [0.0_f64, 1.0e3, 1.0e6] {
        let mut culler = Culler::<u32>::new();
        let at = Vec3::splat(far_from as f32);
        for i in 0..100 {
            let center = at + Vec3::new(i as f32 % 10.0 - 4.5, (i / 10) as f32 - 4.5, -60.0);
            culler.set(i, [center - 0.25, center + 0.25]);
        }
        let wall = square(30.0, 25.0).map(|corner| corner + at);
        culler.set_occluder(1000, Occluder::quad(wall).expect("a square"));
        // Reversed depth without end, in f64.
        let mut clip_from_world = DMat4::ZERO;
        (clip_from_world.x_axis.x, clip_from_world.y_axis.y) = (1.0, 1.0);
        (clip_from_world.z_axis.w, clip_from_world.w_axis.z) = (-1.0, 0.1);
        let clip_from_world = clip_from_world * DMat4::from_translation(-DVec3::splat(far_from));
        let camera =
            Camera::from_matrix(clip_from_world.to_cols_array(), Depth::OneToZero).expect("a camera");
        let frame = culler.cull(&[camera.hide_by_occluders(), camera]);
        assert_eq!((frame[0].hidden(), frame[1].len()), (100, 100), "{far_from}");
        let parallel = Mat4::from_cols_array_2d(&[
            [0.1, 0.0, 0.0, 0.0],
            [0.0, 0.1, 0.0, 0.0],
            [0.0, 0.0, -0.01, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]) * Mat4::from_translation(-at);
        let sun = Camera::from_matrix(parallel.to_cols_array(), Depth::ZeroToOne).expect("a camera");
        let frame = culler.cull(&[sun.hide_by_occluders()]);
        assert_eq!((frame[0].hidden(), frame[0].len()), (0, 100), "nothing hides for a parallel camera");
    }
}

#[test]
fn no_hidden_object_can_be_seen_by_a_ray() {
    let mut rng = Rng(5);
    let (mut hidden, mut hidden_boxes, mut hidden_spheres) = (0, 0, 0);
    for scene in 0..12 {
        let room = Aabb::new(Vec3::new(-8.0, -6.0, -30.0), Vec3::new(8.0, 6.0, -3.0));
        let mut culler = Culler::<usize>::new();
        let mut objects: Vec<Option<Object>> = vec![None; 500];
        for frame in 0..6 {
            for _ in 0..200 {
                let key = rng.below(objects.len());
                let center = rng.point(&room);
                match rng.below(12) {
                    0 => {
                        culler.remove(key);
                        objects[key] = None;
                    }
                    1 | 2 if key < 30 => {
                        // A wall, inclined.
                        let (u, v) = (rng.direction() * rng.range(1.0, 4.0), rng.direction() * 3.0);
                        let v = v - u * (v.dot(u) / u.length_squared());
                        let corners = [center, center + u, center + u + v, center + v];
                        let object = quad_of(corners);
                        culler.set(key, [object.bounds.min, object.bounds.max]);
                        culler.set_occluder(key, Occluder::quad(corners).expect("a rectangle"));
                        objects[key] = Some(object);
                    }
                    3 if key < 60 => {
                        // A mesh: a grid of triangles over a hill.
                        let vertices: Vec<Vec3> = (0..25)
                            .map(|i| center + Vec3::new((i % 5) as f32, (i / 5) as f32, rng.unit() * 0.2))
                            .collect();
                        let indices: Vec<u32> = (0..16)
                            .flat_map(|i| {
                                let at = i / 4 * 5 + i % 4;
                                [at, at + 1, at + 6, at, at + 6, at + 5]
                            })
                            .collect();
                        let triangles = indices.as_chunks::<3>().0.iter();
                        let triangles = triangles.map(|t| t.map(|index| vertices[index as usize])).collect();
                        let bounds = Aabb::from_points(&vertices);
                        culler.set(key, [bounds.min, bounds.max]);
                        culler.set_occluder(key, Occluder::mesh(&vertices, &indices).expect("a hill"));
                        objects[key] = Some(Object { bounds, triangles });
                    }
                    _ => {
                        // A mesh that hides nothing, or the move of a wall that leaves its occluder behind.
                        let bounds = Aabb::cube(center, rng.range(0.05, 0.8));
                        let has_grown = objects[key].as_ref().is_some_and(|o| bounds.contains(&o.bounds));
                        culler.set(key, [bounds.min, bounds.max]);
                        let kept = objects[key].take().filter(|_| has_grown).map(|o| o.triangles);
                        objects[key] = Some(Object { bounds, triangles: kept.unwrap_or_default() });
                    }
                }
            }
            let eyes = [-0.032, 0.032].map(|x| {
                let eye = Vec3::new(x + frame as f32 * 0.3, rng.unit() - 0.5, 0.0);
                View::look_at(eye, Vec3::new(0.0, 0.0, -15.0), Projection::symmetric(70.0, 1.2, 0.05, 60.0))
            });
            let cameras = eyes.each_ref().map(|eye| Camera::from(eye).hide_by_occluders());
            let found = culler.cull(&cameras);
            let triangles: Vec<_> = objects.iter().flatten().flat_map(|o| o.triangles.clone()).collect();
            for (eye, seen) in eyes.iter().zip(found.iter()) {
                let mut count = 0;
                for (key, object) in objects.iter().enumerate() {
                    let Some(object) = object else { continue };
                    assert_eq!(seen.is_in_view(key), eye.frustum().may_see(&object.bounds));
                    if seen.is_in_view(key) && !seen.contains(key) {
                        count += 1;
                        let shown = shown(eye, &object.bounds, &triangles, &mut rng);
                        assert_eq!(shown, 0, "scene {scene}, frame {frame}, object {key}");
                    }
                }
                assert_eq!(seen.hidden(), count);
                hidden += count;
                // Boxes and spheres that are no objects.
                for _ in 0..100 {
                    let (center, half_m) = (rng.point(&room), rng.range(0.0, 0.6));
                    let bounds = Aabb::cube(center, 2.0 * half_m);
                    if seen.hides_box([bounds.min, bounds.max]) {
                        hidden_boxes += 1;
                        assert_eq!(shown(eye, &bounds, &triangles, &mut rng), 0, "scene {scene}, {bounds:?}");
                    }
                    if seen.hides_sphere(center, half_m) {
                        hidden_spheres += 1;
                        let inside = Aabb::cube(center, 2.0 * half_m / 3.0_f32.sqrt());
                        assert_eq!(shown(eye, &inside, &triangles, &mut rng), 0, "scene {scene}, {inside:?}");
                    }
                }
            }
        }
    }
    assert!(hidden > 2000, "{hidden}");
    assert!(hidden_boxes > 500 && hidden_spheres > 500, "{hidden_boxes} and {hidden_spheres}");
}
