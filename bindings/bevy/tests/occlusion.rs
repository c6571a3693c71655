//! Tests that occluders hide the entities behind them, and no entity that can be seen.

#[expect(dead_code, reason = "these tests do not compare with Bevy")]
mod twins;

use std::any::TypeId;

use bevy_app::App;
use bevy_camera::{
    Camera, OrthographicProjection, PerspectiveProjection, Projection,
    primitives::Aabb,
    visibility::{
        NoFrustumCulling, RenderLayers, Visibility, VisibilityClass, VisibilityRange, VisibleEntities,
    },
};
use bevy_ecs::{bundle::Bundle, entity::Entity, system::RunSystemOnce};
use bevy_math::{DVec3, Quat, Vec3, primitives::Cuboid};
use bevy_mesh::Mesh;
use bevy_osp::{Occluder, OccluderSides, OspCulling, OspCullingSettings, OspHidden};
use bevy_transform::components::{GlobalTransform, Transform};
use rand_pcg::{
    Pcg64Mcg,
    rand_core::{Rng, SeedableRng},
};
use twins::new_app;

struct Thing;

fn class() -> VisibilityClass {
    let mut class = VisibilityClass::default();
    class.push(TypeId::of::<Thing>());
    class
}

/// A thing with sides of one metre.
fn thing(place: Vec3) -> impl Bundle {
    let aabb = Aabb::from_min_max(Vec3::splat(-0.5), Vec3::splat(0.5));
    (Transform::from_translation(place), Visibility::default(), class(), aabb)
}

/// Returns the corners of a wall in the plane z = 0, with its front towards +z.
fn corners(width: f32, height: f32) -> [Vec3; 4] {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]: [f32; 2]| Vec3::new(x * width * 0.5, y * height * 0.5, 0.0))
}

fn wall(place: Transform) -> (Occluder, Transform, Visibility) {
    (Occluder::quad(corners(8.0, 6.0)).expect("a wall is flat and convex"), place, Visibility::default())
}

fn perspective() -> Projection {
    Projection::Perspective(PerspectiveProjection { aspect_ratio: 1.6, ..Default::default() })
}

/// Returns an app in which a camera looks along -z from the origin, and that camera.
fn app_with_camera(projection: Projection) -> (App, Entity) {
    let mut app = new_app(Some(OspCullingSettings::always()));
    let camera = app.world_mut().spawn((Camera::default(), projection, Transform::default())).id();
    (app, camera)
}

fn seen(app: &App, camera: Entity) -> Vec<Entity> {
    app.world()
        .get::<VisibleEntities>(camera)
        .expect("a camera has a list")
        .get(TypeId::of::<Thing>())
        .to_vec()
}

fn occluded(app: &App) -> usize {
    app.world().resource::<OspCulling>().counts().occluded
}

#[test]
fn a_wall_hides_what_is_behind_it() {
    let (mut app, camera) = app_with_camera(perspective());
    let spawn = |app: &mut App, place: [f32; 3]| app.world_mut().spawn(thing(Vec3::from(place))).id();
    let behind = spawn(&mut app, [0.0, 0.0, -20.0]);
    let before = spawn(&mut app, [0.0, 0.0, -5.0]);
    let beside = spawn(&mut app, [9.0, 0.0, -20.0]);
    let at_the_edge = spawn(&mut app, [7.9, 0.0, -20.0]);
    let through = spawn(&mut app, [0.0, 0.0, -10.2]);
    let all = [behind, before, beside, at_the_edge, through];
    app.update();
    let mut expected = all.to_vec();
    expected.sort_unstable();
    assert_eq!(seen(&app, camera), expected);

    let mut expected = vec![before, beside, at_the_edge, through];
    expected.sort_unstable();
    let wall_id = app.world_mut().spawn((wall(Transform::from_xyz(0.0, 0.0, -10.0)), class())).id();
    app.update();
    let with_wall = [expected.clone(), vec![wall_id]].concat();
    assert_eq!(seen(&app, camera).len(), with_wall.len());
    assert!(with_wall.iter().all(|id| seen(&app, camera).contains(id)), "the wall does not hide itself");
    assert_eq!(occluded(&app), 1);

    // The wall moves away. In the same frame all things are seen, and the wall, too, because it is loose.
    app.world_mut().get_mut::<Transform>(wall_id).unwrap().translation.x = 100.0;
    app.update();
    assert_eq!((seen(&app, camera).len(), occluded(&app)), (6, 0));
    app.world_mut().get_mut::<Transform>(wall_id).unwrap().translation.x = 0.0;
    app.update();
    assert_eq!(occluded(&app), 1);
    app.world_mut().despawn(wall_id);
    app.update();
    assert_eq!((seen(&app, camera).len(), occluded(&app)), (5, 0));
}

#[test]
fn a_place_behind_a_wall_is_hidden_from_a_camera() {
    let (mut app, camera) = app_with_camera(perspective());
    let parallel = Projection::Orthographic(OrthographicProjection::default_3d());
    let parallel = app.world_mut().spawn((Camera::default(), parallel, Transform::default())).id();
    let wall_id = app.world_mut().spawn(wall(Transform::from_xyz(0.0, 0.0, -10.0))).id();
    app.update();
    let hidden = |app: &mut App, camera: Entity| {
        let test = move |hidden: OspHidden<'_, '_>| {
            let occluders = hidden.from_camera(camera)?;
            let cube = |x: f32, z: f32| {
                let middle = Vec3::new(x, 0.0, z);
                let by_box = occluders.hides_box(middle - 0.5, middle + 0.5);
                assert_eq!(occluders.hides_sphere(middle, 0.5), by_box, "at {middle}");
                by_box
            };
            assert!(!occluders.hides_box(Vec3::NAN, Vec3::NAN) && !occluders.hides_sphere(Vec3::NAN, 1.0));
            Some([cube(0.0, -20.0), cube(0.0, -5.0), cube(9.0, -20.0), cube(0.0, -10.2), cube(0.0, 20.0)])
        };
        app.world_mut().run_system_once(test).expect("the system runs")
    };
    assert_eq!(hidden(&mut app, camera), Some([true, false, false, false, false]));
    assert_eq!(hidden(&mut app, parallel), None, "a parallel projection");
    assert_eq!(hidden(&mut app, wall_id), None, "no camera");
    app.world_mut().despawn(wall_id);
    assert_eq!(hidden(&mut app, camera), Some([false; 5]), "without occluders");
}

#[test]
fn walls_that_are_not_drawn_hide_nothing() {
    let front = Transform::from_xyz(0.0, 0.0, -10.0);
    let back = front.with_rotation(Quat::from_rotation_y(std::f32::consts::PI));
    let cases: [(&str, usize, &dyn Fn(&mut App)); 9] = [
        ("a wall", 1, &|app| {
            app.world_mut().spawn(wall(front));
        }),
        ("from behind", 0, &|app| {
            app.world_mut().spawn(wall(back));
        }),
        ("of two sides", 1, &|app| {
            let (occluder, place, visibility) = wall(back);
            app.world_mut().spawn((occluder.with_sides(OccluderSides::Both), place, visibility));
        }),
        ("mirrored", 0, &|app| {
            app.world_mut().spawn(wall(front.with_scale(Vec3::new(-1.0, 1.0, 1.0))));
        }),
        ("hidden", 0, &|app| {
            app.world_mut().spawn(wall(front)).insert(Visibility::Hidden);
        }),
        ("in another layer", 0, &|app| {
            app.world_mut().spawn((wall(front), RenderLayers::layer(3)));
        }),
        ("with a range", 0, &|app| {
            app.world_mut().spawn((wall(front), VisibilityRange::abrupt(0.0, 100.0)));
        }),
        ("a stand-in", 1, &|app| {
            let (occluder, place, _) = wall(front);
            app.world_mut().spawn((occluder, place));
        }),
        ("not finite", 0, &|app| {
            app.world_mut().spawn(wall(front.with_scale(Vec3::splat(f32::NAN))));
        }),
    ];
    for (what, hidden, spawn) in cases {
        let (mut app, _) = app_with_camera(perspective());
        app.world_mut().spawn(thing(Vec3::new(0.0, 0.0, -20.0)));
        app.world_mut().spawn((thing(Vec3::new(0.0, 1.0, -20.0)), NoFrustumCulling));
        spawn(&mut app);
        app.update();
        assert_eq!(occluded(&app), hidden, "{what}");
    }
}

#[test]
fn only_plain_perspectives_leave_something_out() {
    let oblique = PerspectiveProjection {
        near_clip_plane: Vec3::new(0.1, 0.0, -1.0).normalize().extend(-0.1),
        ..Default::default()
    };
    let cases = [
        (perspective(), Transform::default(), 1),
        (Projection::Orthographic(OrthographicProjection::default_3d()), Transform::default(), 0),
        (Projection::Perspective(oblique), Transform::default(), 0),
        (perspective(), Transform::from_scale(Vec3::new(1.0, 2.0, 1.0)), 0),
    ];
    for (projection, place, hidden) in cases {
        let (mut app, camera) = app_with_camera(projection.clone());
        app.world_mut().entity_mut(camera).insert(place);
        app.world_mut().spawn(thing(Vec3::new(0.0, 0.0, -20.0)));
        app.world_mut().spawn(wall(Transform::from_xyz(0.0, 0.0, -10.0)));
        app.update();
        assert_eq!(occluded(&app), hidden, "{projection:?} {place:?}");
    }
}

#[test]
fn a_solid_hides_by_the_faces_of_its_mesh() {
    let (mut app, _) = app_with_camera(perspective());
    app.world_mut().spawn(thing(Vec3::new(0.5, 0.3, -20.0)));
    let cube = Occluder::from_mesh(&Mesh::from(Cuboid::from_length(6.0))).unwrap();
    let place = Transform::from_xyz(0.0, 0.0, -10.0).with_rotation(Quat::from_rotation_y(0.6));
    let house = app.world_mut().spawn((cube, place, Visibility::default())).id();
    app.update();
    assert_eq!(occluded(&app), 1, "behind two faces together");
    // The eye is in the house. Back faces are not drawn, so things outside are seen.
    app.world_mut().entity_mut(house).insert(Transform::default());
    app.update();
    assert_eq!(occluded(&app), 0);
}

/// Whether one of the walls lies between two points, seen from its front; computed in `f64`.
fn is_between(eye: DVec3, point: DVec3, walls: &[[DVec3; 4]]) -> bool {
    walls.iter().any(|corners| {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let (from_eye, from_point) = ((eye - corners[0]).dot(normal), (point - corners[0]).dot(normal));
        if from_eye <= 0.0 || from_point >= 0.0 {
            return false;
        }
        let hit = eye + (point - eye) * (from_eye / (from_eye - from_point));
        (0..4).all(|i| (corners[(i + 1) % 4] - corners[i]).cross(hit - corners[i]).dot(normal) >= 0.0)
    })
}

#[test]
fn nothing_that_can_be_seen_is_hidden() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut unit = move || random.next_u32() as f32 / u32::MAX as f32;
    let mut hidden = 0;
    for round in 0..30 {
        let mut vector = |reach: f32| (Vec3::new(unit(), unit(), unit()) * 2.0 - 1.0) * reach;
        // The same world with and without walls.
        let mut apps = [(); 2].map(|()| app_with_camera(perspective()));
        let eye = vector(10.0);
        let camera_place = Transform::from_translation(eye).looking_at(vector(5.0), Vec3::Y);
        let things = (0..150)
            .map(|_| {
                let rotation = Quat::from_rotation_z(vector(3.0).x) * Quat::from_rotation_x(vector(3.0).x);
                Transform { translation: vector(40.0), rotation, scale: Vec3::ONE + vector(0.8) }
            })
            .collect::<Vec<_>>();
        let walls = (0..6)
            .map(|_| {
                let looking_back = Transform::from_translation(vector(20.0)).looking_at(eye, Vec3::Y);
                // The front of the wall is +z, but `looking_at` turns -z.
                let turned =
                    looking_back.rotation * Quat::from_rotation_y(std::f32::consts::PI + vector(1.0).x);
                looking_back.with_rotation(turned).with_scale(Vec3::ONE + vector(0.5).abs())
            })
            .collect::<Vec<_>>();
        for (app, camera) in &mut apps {
            app.world_mut().entity_mut(*camera).insert(camera_place);
            for place in &things {
                app.world_mut().spawn(thing(Vec3::ZERO)).insert(*place);
            }
        }
        let (app, camera) = &mut apps[1];
        let camera = *camera;
        let walls =
            walls.into_iter().map(|place| app.world_mut().spawn(wall(place)).id()).collect::<Vec<_>>();
        apps.iter_mut().for_each(|(app, _)| app.update());
        let (all, left) = (seen(&apps[0].0, apps[0].1), seen(&apps[1].0, camera));
        assert!(left.iter().all(|id| all.contains(id)));

        let world = apps[1].0.world();
        let walls = walls
            .into_iter()
            .map(|id| {
                let transform = world.get::<GlobalTransform>(id).unwrap();
                corners(8.0, 6.0).map(|corner| transform.transform_point(corner).as_dvec3())
            })
            .collect::<Vec<_>>();
        let view = world.get::<GlobalTransform>(camera).unwrap();
        for id in all.iter().filter(|id| !left.contains(id)) {
            hidden += 1;
            let transform = world.get::<GlobalTransform>(*id).unwrap();
            for i in 0..64 {
                // Corners first, then points inside.
                let corner = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) - 0.5;
                let point = transform.transform_point(if i < 8 { corner } else { vector(0.5) });
                let in_view = view.affine().inverse().transform_point3(point);
                let tangent = (std::f32::consts::PI / 8.0).tan();
                let is_in_window = -in_view.z > 0.1
                    && in_view.y.abs() < tangent * -in_view.z
                    && in_view.x.abs() < 1.6 * tangent * -in_view.z;
                assert!(
                    !is_in_window || is_between(eye.as_dvec3(), point.as_dvec3(), &walls),
                    "round {round}: {point} of {id} can be seen"
                );
            }
        }
    }
    assert!(hidden > 50, "{hidden} hidden");
}
