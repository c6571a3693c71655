//! What the culler refuses, and several threads that ask it.

use osp::{
    Camera, Culler, Dense, Depth, Detail, Key, Occluder, OccluderError, ViewState,
    glam::{DMat4, Vec3},
    math::Ray,
    view::{Projection, View},
};

#[test]
fn refusals_name_the_object_and_what_was_expected() {
    let mut culler = Culler::<Dense>::new();
    culler.set(Dense(4), [[0.0_f32; 3], [1.0; 3]]);
    culler.set_layers(Dense(4), 2);
    culler.set(Dense(4), [[0.0_f32, 0.0, 2.0], [1.0; 3]]);
    culler.set(Dense(u32::MAX), [[0.0_f32; 3], [1.0; 3]]);
    culler.set_layers(Dense(1 << 27), 2);
    culler.remove(Dense(u32::MAX));
    culler.cull(&[]);
    let why: Vec<_> = culler.refused().map(|(Dense(number), why)| format!("{number}: {why}")).collect();
    assert_eq!(
        why,
        [
            "4: bounds: expected finite corners with min <= max, found [[0.0, 0.0, 2.0], [1.0, 1.0, 1.0]]",
            "4294967295: key: expected a number below 134217728, and at most as many objects",
            "134217728: key: expected a number below 134217728, and at most as many objects",
        ]
    );
    assert!(culler.is_empty(), "where it was, it is no more");
    assert_eq!(culler.bounds(Dense(4)), None);
    culler.set(Dense(4), [[0.0_f32; 3], [1.0; 3]]);
    let camera = Camera::from_matrix(DMat4::IDENTITY.to_cols_array(), Depth::ZeroToOne).expect("a camera");
    let frame = culler.cull(&[camera.on_layers(1), camera.on_layers(2)]);
    assert_eq!((frame[0].len(), frame[1].len()), (0, 1), "it keeps its layers");
}

#[test]
fn a_stray_number_and_a_hundred_thousand_refusals_take_little_memory() {
    let mut culler = Culler::<Dense>::new();
    culler.set(Dense((1 << 27) - 1), [[0.0_f32; 3], [1.0; 3]]);
    for _ in 0..100_000 {
        culler.set(Dense(0), [[f32::INFINITY; 3], [1.0; 3]]);
    }
    let camera = Camera::from(&View::look_at(
        Vec3::new(0.0, 0.0, 5.0),
        Vec3::ZERO,
        Projection::symmetric(60.0, 1.0, 0.1, 100.0),
    ));
    assert!(culler.cull(&[camera])[0].iter().eq([Dense((1 << 27) - 1)]));
    assert!(culler.refused().count() <= 5000);
}

#[test]
fn what_is_no_occluder_says_why() {
    let square = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert!(Occluder::quad(square).is_ok());
    let with = |at: usize, corner: [f32; 3]| {
        let mut corners = square;
        corners[at] = corner;
        Occluder::quad(corners)
    };
    assert_eq!(with(2, [f32::NAN, 1.0, 0.0]), Err(OccluderError::NotFinite(2)));
    assert_eq!(with(2, [1.0, 1.0, 0.5]), Err(OccluderError::NotFlatAndConvex));
    assert_eq!(with(2, [0.1, 0.1, 0.0]), Err(OccluderError::NotFlatAndConvex));
    assert_eq!(Occluder::quad([[1.0_f32; 3]; 4]), Err(OccluderError::NotFlatAndConvex));
    assert!(Occluder::mesh(&square, &[0, 1, 2, 0, 2, 3]).is_ok());
    assert_eq!(Occluder::mesh(&square, &[0, 1, 2, 0]), Err(OccluderError::NotTriangles(4)));
    let no_vertex = OccluderError::NoVertex { at: 1, found: 4, vertices: 4 };
    assert_eq!(Occluder::mesh(&square, &[0, 4, 2]), Err(no_vertex));
    assert_eq!(no_vertex.to_string(), "indices[1]: expected less than 4, found 4");
    assert_eq!(Occluder::mesh(&square, &[0, 0, 2]), Err(OccluderError::NoArea));
    assert_eq!(Occluder::mesh::<[f32; 3]>(&[], &[]), Err(OccluderError::NoArea));
    assert!(Occluder::cuboid([[0.0_f32; 3], [1.0; 3]]).is_ok());
    assert_eq!(Occluder::cuboid([[0.0_f32; 3]; 2]), Err(OccluderError::NoArea));
    let turned = Occluder::cuboid([[0.0_f32; 3], [-1.0; 3]]).expect_err("max, min");
    assert_eq!(turned.to_string(), "bounds: expected min <= max");
}

#[test]
fn several_threads_ask_one_culler() {
    fn shared<T: Send + Sync>() {}
    shared::<Culler<u64>>();
    shared::<Camera>();
    fn asked<K: Key + PartialEq + std::fmt::Debug + Send + Sync>(culler: &mut Culler<K>, keys: [K; 2])
    where
        Culler<K>: Sync,
    {
        let boxes = [[[0.0_f32; 3], [1.0; 3]], [[4.0; 3], [5.0; 3]]];
        keys.iter().zip(boxes).for_each(|(&key, bounds)| culler.set(key, bounds));
        culler.commit();
        let culler = &*culler;
        std::thread::scope(|scope| {
            for (key, [min, max]) in keys.into_iter().zip(boxes) {
                scope.spawn(move || {
                    let ray = Ray::new(Vec3::from(max) + 1.0, Vec3::splat(-1.0));
                    assert!(culler.in_box([min, max]).eq([key]));
                    let touching = [max[0] + 0.25, max[1], max[2]];
                    assert!(culler.in_sphere(touching, 0.25).eq([key]));
                    let hit = culler.pick(ray, |asked, _| (asked == key).then_some(1.0));
                    assert_eq!(hit, Some((key, 1.0)));
                });
            }
        });
    }
    asked(&mut Culler::<u64>::new(), [1 << 60, 7]);
    asked(&mut Culler::<Dense>::new(), [Dense(1), Dense(0)]);
}

/// Looks along -z from the origin, 90 degrees wide, without a far plane.
fn ahead() -> Camera {
    let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.0_f32];
    Camera::from_matrix(clip, Depth::OneToZero).expect("a camera")
}

#[test]
fn an_object_that_is_everywhere_is_drawn_by_every_camera_on_its_layers_and_found_by_queries() {
    let mut culler = Culler::<u64>::new();
    let (sky, fog, thing) = (1, 2, 3);
    let behind = [[-1.0_f32, -1.0, 8.0], [1.0, 1.0, 9.0]];
    culler.set_everywhere(sky);
    culler.set(fog, behind);
    culler.commit();
    culler.set_everywhere(fog);
    culler.set(thing, behind);
    culler.set_layers(fog, 2);
    let cameras = [ahead(), ahead().on_layers(1), ahead().on_layers(2).hide_by_occluders()];
    let drawn = |culler: &mut Culler<u64>| {
        let frame = culler.cull(&cameras);
        let keys = |i: usize| {
            let mut keys: Vec<_> = frame[i].iter().collect();
            assert!(keys.iter().all(|&key| frame[i].contains(key) && frame[i].is_in_view(key)));
            keys.sort_unstable();
            keys
        };
        [keys(0), keys(1), keys(2)]
    };
    assert_eq!(drawn(&mut culler), [vec![1, 2], vec![1], vec![2]]);
    assert_eq!((culler.len(), culler.iter().count()), (3, 3));
    assert!(culler.in_box([[0.0_f32, 8.5, 0.0], [1.0, 8.5, 1.0]]).eq([sky, fog]));
    assert!(culler.in_sphere([0.0_f32, -7.0, 0.0], 0.5).eq([sky, fog]));
    assert!(culler.nearest([0.0_f32; 3], 3).eq([(sky, 0.0), (fog, 0.0), (thing, 8.0)]));
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(culler.on_ray(ray, 20.0).eq([(sky, 0.0), (fog, 0.0), (thing, 8.0)]));
    assert_eq!(culler.pick(ray, |key, _| (key != sky).then_some(key as f32)), Some((fog, 2.0)));
    // One ends, and another begins; a number that was everywhere is not another object's.
    culler.set(sky, behind);
    culler.set_everywhere(thing);
    assert_eq!(drawn(&mut culler), [vec![2, 3], vec![3], vec![2]]);
    culler.remove(fog);
    culler.set(9, [[-1.0_f32, -1.0, -9.0], [1.0, 1.0, -8.0]]);
    assert_eq!(drawn(&mut culler), [vec![3, 9], vec![3, 9], vec![]]);
    let mut other = Culler::new();
    other.set(3, behind);
    other.append(culler.clone());
    assert_eq!((drawn(&mut other), other.len()), (drawn(&mut culler), 3));
    culler.clear();
    assert_eq!((drawn(&mut culler), culler.len()), ([vec![], vec![], vec![]], 0));
}

#[test]
fn distance_and_size_choose_what_is_drawn_in_which_level_and_a_margin_keeps_it() {
    let mut culler = Culler::<Dense>::new();
    let at = |distance_m: f32| [[-1.0, -1.0, -distance_m - 2.0], [1.0, 1.0, -distance_m]];
    culler.set_detail(Dense(0), Detail::default().levels(&[10.0, 20.0]).within(50.0).margin(0.1));
    culler.set_detail(Dense(1), Detail::default().beyond(10.0));
    // At 100 m, the sphere is as high as 3.46 / 200 of the screen.
    culler.set_detail(Dense(2), Detail::default().at_least(0.0175));
    let mut state = ViewState::default();
    let mut levels = |culler: &mut Culler<Dense>, distance_m: f32| {
        (0..4).for_each(|i| culler.set(Dense(i), at(distance_m)));
        culler.commit();
        let seen = culler.cull_view(&ahead(), &mut state);
        assert_eq!((seen.hidden(), seen.len()), (0, seen.levels().count()));
        let level_of = |i| seen.levels().find(|(key, _)| *key == Dense(i)).map(|(_, level)| level);
        (0..4).for_each(|i| assert_eq!(seen.contains(Dense(i)), level_of(i).is_some()));
        assert_eq!(level_of(3), Some(0), "an object without settings is drawn");
        [level_of(0), level_of(1), level_of(2)]
    };
    for (distance_m, expected) in [
        (5.0, [Some(0), None, Some(0)]),
        (10.5, [Some(0), Some(0), Some(0)]),
        (11.5, [Some(1), Some(0), Some(0)]),
        (9.5, [Some(1), None, Some(0)]),
        (9.0, [Some(0), None, Some(0)]),
        (30.0, [Some(2), Some(0), Some(0)]),
        (54.0, [Some(2), Some(0), Some(0)]),
        (56.0, [None, Some(0), Some(0)]),
        (54.0, [None, Some(0), Some(0)]),
        (98.0, [None, Some(0), Some(0)]),
        (100.0, [None, Some(0), None]),
        (49.0, [Some(2), Some(0), Some(0)]),
    ] {
        assert_eq!(levels(&mut culler, distance_m), expected, "{distance_m}");
    }
}

#[test]
fn an_occluder_that_may_not_be_drawn_hides_nothing() {
    let mut culler = Culler::<Dense>::new();
    let wall =
        Occluder::quad([[-9.0_f32, -9.0, -5.0], [9.0, -9.0, -5.0], [9.0, 9.0, -5.0], [-9.0, 9.0, -5.0]])
            .unwrap();
    culler.set(Dense(0), [[-9.0_f32, -9.0, -5.1], [9.0, 9.0, -5.0]]);
    culler.set(Dense(1), [[-1.0_f32, -1.0, -20.0], [1.0, 1.0, -19.0]]);
    culler.set_occluder(Dense(0), wall);
    let camera = ahead().hide_by_occluders();
    let behind = [[-1.0_f32, -1.0, -9.0], [1.0, 1.0, -8.0]];
    let mut sees = |detail: Detail| {
        culler.set_detail(Dense(0), detail);
        let is_hidden = culler.are_hidden(&camera, &[behind]) == [true];
        let is_drawn = culler.cull(&[camera])[0].contains(Dense(1));
        assert_ne!(is_hidden, is_drawn);
        is_drawn
    };
    assert!(!sees(Detail::default()) && !sees(Detail::default().levels(&[1.0])));
    for limited in
        [Detail::default().within(4.0), Detail::default().beyond(9.0), Detail::default().at_least(9.0)]
    {
        assert!(sees(limited), "{limited:?}");
    }
    assert!(!sees(Detail::default()));
}
