//! A culler with an engine's own keys, in a frame with a camera and a sun: `cargo run --example culler`.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{Camera, Culler, Depth, Occluder, math::Aabb};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut culler = Culler::<&str>::new();
    culler.set("table", [[-1.0_f32, 0.0, -4.0], [1.0, 1.0, -3.0]]);
    culler.set("cupboard", [[-1.0_f32, 0.0, -9.0], [1.0, 2.0, -8.0]]);
    culler.set("wall", [[-4.0_f32, 0.0, -6.0], [4.0, 3.0, -5.9]]);
    let corners = [[-4.0_f32, 0.0, -6.0], [4.0, 0.0, -6.0], [4.0, 3.0, -6.0], [-4.0, 3.0, -6.0]];
    culler.set_occluder("wall", Occluder::quad(corners)?);
    // The eye is at a height of 1 m and looks along -z: 90 degrees, reversed depth, no far plane. The sun looks down.
    let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.1, 0.0_f32];
    let ortho = [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0_f32];
    let eye = Camera::from_matrix(clip, Depth::OneToZero)?.hide_by_occluders();
    let frame = culler.cull(&[eye, Camera::from_matrix(ortho, Depth::ZeroToOne)?]);
    println!("the eye sees {:?}", frame[0].iter().collect::<Vec<_>>());
    println!("the sun sees {:?}", frame[1].iter().collect::<Vec<_>>());
    assert!(!frame[0].contains("cupboard") && frame[1].contains("cupboard"));
    for (key, why) in culler.refused() {
        println!("{key}: {why}");
    }
    let hit = culler.pick(eye.ray(0.1, -0.2), |key, ray| {
        let [min, max] = culler.bounds(key)?;
        ray.enter_box(&Aabb::new(min.into(), max.into()), f32::INFINITY)
    });
    println!("under the cursor: {hit:?}");
    Ok(())
}
