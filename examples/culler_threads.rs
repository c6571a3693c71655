//! Six cameras, the faces of a cube, culled on two threads: `cargo run --release --example culler_threads`.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{
    Camera, Culler, Dense, Depth, ViewState,
    glam::{Mat4, Vec3, Vec4},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut culler = Culler::<Dense>::new();
    for i in 0..100_000_u32 {
        let min = Vec3::new((i % 100) as f32, (i / 100 % 100) as f32, (i / 10_000) as f32) * 2.0 - 100.0;
        culler.set(Dense(i), [min, min + 1.0]);
    }
    // 90 degrees wide, near plane at 0.1 m, reversed depth, no far plane.
    let mut clip = Mat4::ZERO;
    (clip.x_axis.x, clip.y_axis.y, clip.z_axis.w, clip.w_axis.z) = (1.0, 1.0, -1.0, 0.1);
    let axes = [(Vec3::X, Vec3::Y), (Vec3::NEG_X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::NEG_Y, Vec3::Z)];
    let faces = axes.into_iter().chain([(Vec3::Z, Vec3::Y), (Vec3::NEG_Z, Vec3::Y)]);
    let camera = |(to, up): (Vec3, Vec3)| {
        let axes = [to.cross(up), up, -to].map(|axis| axis.extend(0.0));
        let turn = Mat4::from_cols(axes[0], axes[1], axes[2], Vec4::W).transpose();
        let view = turn * Mat4::from_translation(Vec3::new(0.0, 0.0, 91.0));
        Camera::from_matrix((clip * view).to_cols_array(), Depth::OneToZero)
    };
    let cameras = faces.map(camera).collect::<Result<Vec<_>, _>>()?;
    // A state and a list for each camera, kept from frame to frame, so that a frame allocates nothing.
    let mut views: Vec<_> = cameras.iter().map(|camera| (camera, ViewState::default(), Vec::new())).collect();
    for frame in 0..3 {
        culler.set(Dense(frame), [[0.0, 0.0, -95.0_f32], [1.0, 1.0, -94.0]]); // The changes of the frame,
        culler.commit(); // once, before the threads.
        let culler = &culler;
        std::thread::scope(|scope| {
            for part in views.chunks_mut(3) {
                scope.spawn(move || {
                    for (camera, state, draw) in part {
                        draw.clear();
                        draw.extend(culler.cull_view(camera, state).iter());
                    }
                });
            }
        });
    }
    for (at, (.., draw)) in views.iter().enumerate() {
        println!("face {at}: {} of {} objects", draw.len(), culler.len());
    }
    Ok(())
}
