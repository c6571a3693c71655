//! An engine's own wgpu renderer. A buffer contains the polygons in the order of their ids. Each frame draws the
//! visible polygons, with one indirect draw for each sequence of consecutive ids. `cargo run -p osp-render --example
//! custom_wgpu [OUT.png]`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use osp::{
    glam::Vec3,
    index::{IndexConfig, Osp, SpatialIndex},
    math::Aabb,
    polygon::{BLOCK, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_render::{Gpu, RenderError};
use wgpu::util::{BufferInitDescriptor, DeviceExt, DrawIndirectArgs};

const SIDE: u32 = 512;
const QUADS: u32 = 20_000;
const SHADER: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(0) @binding(1) var<storage, read> corners: array<vec4<f32>>;
struct Out { @builtin(position) position: vec4<f32>, @location(0) color: vec3<f32> }
@vertex fn vertex(@builtin(vertex_index) i: u32) -> Out {
    var order = array<u32, 6>(0u, 1u, 2u, 0u, 2u, 3u);
    let id = i / 6u;
    let shade = f32(id % 97u) / 97.0;
    return Out(clip_from_world * corners[id * 4u + order[i % 6u]], vec3(shade, 0.5, 1.0 - shade));
}
@fragment fn fragment(in: Out) -> @location(0) vec4<f32> { return vec4(in.color, 1.0); }
";

/// Returns the corners of an upright quad of 20 cm. The quads stand on a spiral.
fn quad(i: u32) -> [Vec3; 4] {
    let (angle, radius) = (i as f32 * 0.05, 1.0 + i as f32 * 0.001);
    let foot = Vec3::new(angle.sin() * radius, (i % 7) as f32 * 0.2, angle.cos() * radius);
    let across = Vec3::new(angle.cos(), 0.0, -angle.sin()) * 0.1;
    [foot - across, foot + across, foot + across + Vec3::Y * 0.2, foot - across + Vec3::Y * 0.2]
}

/// Returns a draw for each sequence of consecutive visible ids.
fn draws(visible: &VisibleBlocks) -> Vec<DrawIndirectArgs> {
    let mut draws: Vec<DrawIndirectArgs> = Vec::new();
    for (block, mask) in visible.blocks() {
        let mut left = u32::from(mask);
        while left != 0 {
            let skip = left.trailing_zeros();
            let run = (left >> skip).trailing_ones();
            left &= !(((1 << run) - 1) << skip);
            let first_vertex = ((block * BLOCK) as u32 + skip) * 6;
            match draws.last_mut() {
                Some(last) if last.first_vertex + last.vertex_count == first_vertex => {
                    last.vertex_count += run * 6
                }
                _ => draws.push(DrawIndirectArgs {
                    vertex_count: run * 6,
                    instance_count: 1,
                    first_vertex,
                    first_instance: 0,
                }),
            }
        }
    }
    draws
}

struct Engine {
    gpu: Gpu,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    picture: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Engine {
    fn new(gpu: Gpu, view: &View) -> Self {
        let device = &gpu.device;
        let matrix = bytemuck::bytes_of(&view.clip_from_world()).to_vec();
        let corners: Vec<[f32; 4]> = (0..QUADS).flat_map(quad).map(|p| p.extend(1.0).to_array()).collect();
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let matrix = buffer(&matrix, wgpu::BufferUsages::UNIFORM);
        let corners = buffer(bytemuck::cast_slice(&corners), wgpu::BufferUsages::STORAGE);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                // osp's matrix has reversed depth: 1 at the near plane.
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: corners.as_entire_binding() },
            ],
        });
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let picture = texture(wgpu::TextureFormat::Rgba8Unorm, drawn | wgpu::TextureUsages::COPY_SRC);
        let depth = texture(wgpu::TextureFormat::Depth32Float, drawn);
        Self { gpu, pipeline, group, picture, depth }
    }

    /// Draws the visible polygons, and reads the picture back, RGBA.
    fn draw(&self, visible: &VisibleBlocks) -> Result<Vec<u8>, Box<dyn Error>> {
        let (device, draws) = (&self.gpu.device, draws(visible));
        let bytes: Vec<u8> = draws.iter().flat_map(|draw| draw.as_bytes().to_vec()).collect();
        let indirect = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &bytes,
            usage: wgpu::BufferUsages::INDIRECT,
        });
        let [picture, depth] =
            [&self.picture, &self.depth].map(|texture| texture.create_view(&Default::default()));
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &picture,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        for i in 0..draws.len() {
            pass.draw_indirect(&indirect, (i * size_of::<DrawIndirectArgs>()) as u64);
        }
        drop(pass);
        let copy = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(SIDE * SIDE * 4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &copy,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(SIDE * 4),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
        self.gpu.queue.submit([encoder.finish()]);
        copy.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.gpu.wait()?;
        println!("{} quads in {} draws", visible.len(), draws.len());
        Ok(copy.slice(..).get_mapped_range()?.to_vec())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(error @ RenderError::NoAdapter) => {
            println!("skipped: {error}");
            return Ok(());
        }
        Err(error) => return Err(error.into()),
    };
    let mut index = Osp::new(&IndexConfig::default());
    for i in 0..QUADS {
        index.insert(PolygonId(i), &Aabb::from_points(&quad(i)))?;
    }
    index.commit();
    let projection = Projection::symmetric(50.0, 1.0, 0.05, 100.0);
    let view = View::look_at(Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.3, 0.8, -5.0), projection);
    let mut visible = VisibleBlocks::new();
    index.frustum_cull_blocks(&view.frustum(), &mut visible);

    let engine = Engine::new(gpu, &view);
    let culled = engine.draw(&visible)?;
    let whole = engine.draw(&(0..QUADS).map(PolygonId).collect())?;
    assert!(visible.len() < QUADS as usize / 2 && culled == whole, "culling changes no pixel");
    assert!(culled.chunks_exact(4).filter(|pixel| pixel[..3] != [255; 3]).count() > 10_000);
    if let Some(path) = std::env::args().nth(1) {
        let mut png = png::Encoder::new(std::fs::File::create(&path)?, SIDE, SIDE);
        png.set_color(png::ColorType::Rgba);
        png.write_header()?.write_image_data(&culled)?;
        println!("{path}");
    }
    Ok(())
}
