use std::sync::LazyLock;

use wgpu::util::DeviceExt as _;

use super::relief;
use crate::Gpu;
use osp_session::brush::texture::{SIDE, picture::Picture};

/// Number of levels of each texture, down to a single texel.
const LEVELS: u32 = SIDE.ilog2() + 1;

/// All levels of all textures, computed once.
static TEXELS: LazyLock<Vec<u8>> = LazyLock::new(make);

pub(super) fn upload(gpu: &Gpu) -> wgpu::TextureView {
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("textures"),
            size: wgpu::Extent3d {
                width: SIDE as u32,
                height: SIDE as u32,
                depth_or_array_layers: (Picture::ALL.len() + Picture::WITH_RELIEF.len()) as u32,
            },
            mip_level_count: LEVELS,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &TEXELS,
    );
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

fn make() -> Vec<u8> {
    let mut bytes = Vec::new();
    for picture in Picture::ALL {
        push(&mut bytes, |u, v| picture.texel(u, v));
    }
    for picture in Picture::WITH_RELIEF {
        push(&mut bytes, |u, v| relief::texel(picture, u, v, SIDE));
    }
    bytes
}

/// Appends a texture and its levels, each of half the size.
fn push(bytes: &mut Vec<u8>, texel: impl Fn(f32, f32) -> [f32; 4]) {
    let place = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    let mut level: Vec<[f32; 4]> = (0..SIDE * SIDE)
        .map(|i| texel(place(i % SIDE), place(i / SIDE)).map(|c| c.clamp(0.0, 1.0)))
        .collect();
    let mut side = SIDE;
    loop {
        bytes.extend(level.as_flattened().iter().map(|c| (c * 255.0).round() as u8));
        if side == 1 {
            return;
        }
        side /= 2;
        let mean = |i: usize| {
            let (x, y) = (i % side * 2, i / side * 2);
            let of = |x: usize, y: usize| level[y * side * 2 + x];
            let four = [of(x, y), of(x + 1, y), of(x, y + 1), of(x + 1, y + 1)];
            std::array::from_fn(|channel| four.iter().map(|texel| texel[channel]).sum::<f32>() * 0.25)
        };
        level = (0..side * side).map(mean).collect();
    }
}
