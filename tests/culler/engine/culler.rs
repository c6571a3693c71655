//! What the culler refuses, and several threads that ask it.

use osp::{
    Camera, Culler, Dense, Depth, Key, Occluder, OccluderError,
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
