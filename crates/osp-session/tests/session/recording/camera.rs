//! A camera as text.

use glam::{Quat, Vec3};
use osp_session::recording::Camera;

#[test]
fn a_camera_is_read_as_it_was_written() {
    let near = Camera {
        p: Vec3::new(0.1, -2.0e-7, 3.0e6),
        q: Quat::from_xyzw(0.1, 0.2, 0.3, 0.927_361_85),
        fov_degrees: 55.000_004,
        near_m: Some(0.012_345_67),
    };
    for camera in [near, Camera { near_m: None, ..near }] {
        assert_eq!(camera.to_string().parse(), Ok(camera));
    }
    let by_hand = "(p: (0, 1.6, 3), q: (0, 0, 0, 1), fov_degrees: 60, near_m: 0.1)".parse::<Camera>();
    assert_eq!(by_hand.map(|camera| (camera.p.y, camera.near_m)), Ok((1.6, Some(0.1))));
}

#[test]
fn what_is_no_camera_is_refused_with_what_was_expected() {
    let texts = [
        "",
        "whole",
        "(p: (0, 0, 0), q: (0, 0, 0, 1))",
        "(p: (0, 0, 0), q: (0, 0, 0, 1), fov_degrees: 180)",
        "(p: (0, 0, 0), q: (0, 0, 0, 1), fov_degrees: NaN)",
        "(p: (0, 0, 0), q: (0, 0, 0, 1), fov_degrees: 60, near_m: 0)",
        "(p: (0, inf, 0), q: (0, 0, 0, 1), fov_degrees: 60)",
        "(p: (0, 0, 0), q: (0, 0, 0, 1), fov_degrees: 60) and more",
    ];
    insta::assert_snapshot!(texts.map(|text| text.parse::<Camera>().expect_err(text)).join("\n"));
}
