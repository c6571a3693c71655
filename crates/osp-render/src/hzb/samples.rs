//! Positions of the samples in a pixel.
//!
//! The test of single samples assumes the standard positions of four samples in WebGPU, Vulkan, Direct3D and Metal. A
//! driver may use other positions without reporting them. So the positions are measured once. On an adapter with other
//! positions, occlusion culling is not available.

use crate::{
    Gpu, RenderError,
    descriptors::{self, written},
    formats::{DEPTH_FORMAT, SAMPLES},
    read_back::{read_buffer, read_buffer_later},
    shaders,
    target::FARTHEST,
};

/// Side of the measured picture, pixels.
const SIDE: u32 = 2;
/// Size of a measurement's result along one axis, bytes.
const BYTES: u64 = (SIDE * SIDE * SAMPLES) as u64 * 4;
/// Positions of the samples from the left and from the top, as fractions of a pixel. `hzb_test.wgsl` has the same
/// positions.
const PLACES: [[f32; 2]; SAMPLES as usize] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// Largest accepted rounding error of a measured position, pixels. The test of single samples tolerates a far larger
/// error.
const NEAR_ENOUGH: f32 = 1.0e-4;

/// Whether the samples of a pixel have the positions that the occlusion test assumes.
pub(super) fn are_in_place(gpu: &Gpu) -> Result<bool, RenderError> {
    let read = |axis| read_buffer(gpu, &measure(gpu, axis), BYTES).map(|bytes| distances(&bytes));
    Ok(are_places(&[read(0)?, read(1)?]))
}

/// Does the same as [`are_in_place`], for a caller that cannot wait.
pub(super) async fn are_in_place_later(gpu: &Gpu) -> Result<bool, RenderError> {
    let (x, y) = (measure(gpu, 0), measure(gpu, 1));
    let x = read_buffer_later(gpu, &x, BYTES).await?;
    let y = read_buffer_later(gpu, &y, BYTES).await?;
    Ok(are_places(&[distances(&x), distances(&y)]))
}

/// Converts the measured depths to distances from the left or from the top, pixels.
fn distances(bytes: &[u8]) -> Vec<f32> {
    bytemuck::pod_collect_to_vec::<u8, f32>(bytes).iter().map(|part| part * 2.0 * SIDE as f32).collect()
}

/// Whether the distances along both axes match the standard positions.
fn are_places(found: &[Vec<f32>; 2]) -> bool {
    (0..(SIDE * SIDE * SAMPLES) as usize).all(|i| {
        let pixel = i / PLACES.len();
        let pixel = [pixel as u32 % SIDE, pixel as u32 / SIDE];
        let place = PLACES[i % PLACES.len()];
        // The comparison is false for NaN.
        (0..2).all(|axis| (found[axis][i] - pixel[axis] as f32 - place[axis]).abs() < NEAR_ENOUGH)
    })
}

/// Starts to measure the distance of each sample of each pixel from the left (axis 0) or from the top.
fn measure(gpu: &Gpu, axis: u32) -> wgpu::Buffer {
    let usage = descriptors::DRAWN_AND_READ;
    let view = gpu.image("places of samples", DEPTH_FORMAT, SAMPLES, usage, (SIDE, SIDE));
    let depths = gpu.buffer("places of samples", BYTES, descriptors::STORAGE);
    let types = [descriptors::samples(wgpu::TextureSampleType::Depth), written()];
    let read_layout = gpu.compute_layout("places of samples", &types);
    let read = gpu.compute_pipeline(shaders::SAMPLE_PLACES, &[Some(&read_layout)], "read");
    let resources = [wgpu::BindingResource::TextureView(&view), depths.as_entire_binding()];
    let group = gpu.bind_group("places of samples", &read_layout, &resources);

    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = descriptors::depth_pass(&mut encoder, "places of samples", &view, FARTHEST, None, None);
    pass.set_pipeline(&growing_depth(gpu));
    pass.draw(0..3, axis..axis + 1);
    drop(pass);
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&read);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    depths
}

fn growing_depth(gpu: &Gpu) -> wgpu::RenderPipeline {
    let module = gpu.module("places of samples", shaders::SAMPLE_PLACES);
    let vertex = descriptors::vertex(&module, "grow");
    let depth = Some(descriptors::depth(wgpu::CompareFunction::Always, true));
    gpu.render_pipeline("places of samples", None, vertex, depth, SAMPLES, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usual() -> [Vec<f32>; 2] {
        let of = |axis: usize| {
            let pixels = (0..SIDE * SIDE).map(move |pixel| [pixel % SIDE, pixel / SIDE][axis] as f32);
            pixels.flat_map(move |first| PLACES.map(|place| first + place[axis])).collect()
        };
        [of(0), of(1)]
    }

    #[test]
    fn a_sample_elsewhere_in_any_pixel_is_noticed() {
        assert!(are_places(&usual()));
        for axis in 0..2 {
            for i in 0..usual()[axis].len() {
                for wrong in [1.0 / 16.0, -0.001, 1.0, f32::NAN] {
                    let mut found = usual();
                    found[axis][i] += wrong;
                    assert!(!are_places(&found), "axis {axis}, sample {i}, {wrong} beside");
                }
            }
        }
    }

    /// The shader has its own list of the positions.
    #[test]
    fn the_shader_takes_samples_to_be_at_the_same_places() {
        for (sample, [x, y]) in PLACES.iter().enumerate() {
            let read = format!("textureLoad(samples, pixel, {sample})");
            assert!(shaders::HZB_TEST.contains(&read), "{read}");
            let call = format!("may_win(t, at + vec2({x}, {y}), depths.{})", ["x", "y", "z", "w"][sample]);
            assert!(shaders::HZB_TEST.contains(&call), "{call}");
        }
    }
}
