//! What is known of the frames before saves work in choosing occluders, and loses next to nothing.

use glam::Quat;
use osp::{
    math::Aabb,
    occlusion::{OccluderPool, PoolConfig, SelectConfig, Selector},
    view::View,
};
use osp_lab::scenes::TestScene;
use osp_session::{
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

fn looked(scene: TestScene) -> (Scene, OccluderPool, Vec<View>) {
    let (mut model, mut changes, mut heads) = (Scene::new(), Vec::new(), Vec::new());
    for event in scene.events() {
        model.apply(&event, &mut changes);
        let mut moment = Moment::default();
        moment.note(&event);
        heads.extend(moment.head.is_some().then_some(moment));
    }
    let mut pool = OccluderPool::new(PoolConfig::default());
    pool.follow(&model, &changes);
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let views = heads.iter().map(|head| camera.view(head)).collect();
    (model, pool, views)
}

#[test]
fn candidates_of_no_use_are_not_measured_in_every_frame() {
    // (In wide ribbons nearly every candidate that is measured is large enough.)
    for scene in [TestScene::Rooms, TestScene::Panels] {
        let (model, pool, views) = looked(scene);
        let config = SelectConfig { occluders: 16, ..SelectConfig::default() };
        let (mut selector, mut forgetful) = (Selector::new(config), Selector::new(config));
        let (mut measured, mut all, mut solid_angle, mut whole) = (0, 0, 0.0, 0.0);
        for view in views.iter().step_by(4) {
            for frame in 0..40 {
                // A head that turns by 20 degrees a second, and walks half a metre.
                let mut view = *view;
                view.world_from_view = Quat::from_rotation_y(frame as f32 * 0.0039) * view.world_from_view;
                view.eye_in_world.x += frame as f32 * 0.0055;
                let window = view.window().expect("a pointed cone");
                let sum = |selector: &Selector| -> f64 {
                    selector.chosen().iter().map(|shadow| shadow.solid_angle_in(&window)).sum()
                };
                forgetful.forget();
                let without = forgetful.select(&pool, &model, &window);
                assert_eq!(without.known, 0);
                let with = selector.select(&pool, &model, &window);
                if frame == 0 {
                    assert_eq!(selector.chosen(), forgetful.chosen(), "a jump begins anew");
                }
                assert!(with.measured + with.known >= without.measured, "{with:?} {without:?}");
                (measured, all) = (measured + with.measured, all + without.measured);
                (solid_angle, whole) = (solid_angle + sum(&selector), whole + sum(&forgetful));
            }
        }
        assert!(measured * 20 < all * 17, "{}: {measured} of {all} measured", scene.name());
        assert!(solid_angle > 0.99 * whole, "{}: {solid_angle} of {whole} sr", scene.name());
    }
}
