use std::sync::Arc;

use glam::Vec3;

use crate::{Gpu, GpuOcclusion, Image, Layer, Offscreen, RendererConfig, test_scene};
use osp::{
    polygon::VisibleBlocks,
    view::{Projection, View},
};
use osp_session::scene::Scene;

const SIDE: u32 = 96;

fn squares_before_a_wall() -> Scene {
    let square = |center: Vec3, half_m: f32| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(x, y)| center + Vec3::new(x, y, 0.0) * half_m;
        (corners.map(corner).to_vec(), (0.9, 0.2 * half_m, 0.3, 1.0))
    };
    let squares =
        (0..9_u8).map(|i| square(Vec3::new(f32::from(i % 3) - 1.0, f32::from(i / 3) - 1.0, 0.0), 0.4));
    test_scene::of(squares.chain([square(Vec3::new(0.0, 0.0, -0.2), 4.0)]))
}

/// The third frame of a view at rest. It is the first frame that recalls the results of a test.
fn third_frame(gpu: &Arc<Gpu>, occlusion: GpuOcclusion, is_wrong: bool) -> Image {
    let scene = squares_before_a_wall();
    let mut drawer =
        Offscreen::on(Arc::clone(gpu), SIDE, SIDE, &RendererConfig::default()).expect("a drawer");
    drawer.set_occlusion(occlusion).expect("an adapter that can cull");
    if is_wrong {
        drawer.use_wrong_bounds();
    }
    let view =
        View::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Projection::symmetric(50.0, 1.0, 0.1, 100.0));
    let all: VisibleBlocks = scene.visible_ids().collect();
    for _ in 0..3 {
        drawer.draw(&scene, &view, &[Layer::plain(&all)]).expect("a frame");
    }
    drawer.image().expect("a picture")
}

/// With a bound that is too far away, polygons count as hidden by the wall behind them. A comparison of pictures must
/// detect this.
#[test]
fn a_bound_that_is_too_far_is_noticed() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => Arc::new(gpu),
        Err(error) => {
            assert!(std::env::var_os("OSP_GPU_TESTS").is_none(), "{error}");
            eprintln!("skipped: {error}");
            return;
        }
    };
    let whole = third_frame(&gpu, GpuOcclusion::None, false);
    assert!(whole.drawn_pixels() > 1000);
    assert_eq!(third_frame(&gpu, GpuOcclusion::Hzb, false).differing_pixels(&whole), 0);
    assert!(third_frame(&gpu, GpuOcclusion::Hzb, true).differing_pixels(&whole) > 1000);
}
