use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Vec3};

use crate::{
    Classes, Gpu, ViewSlot, descriptors,
    formats::DEPTH_FORMAT,
    gpu_scene::GpuScene,
    record::DrawClass,
    view_slot::{Place, Uniforms},
};
use osp::{math::Aabb, polygon::VisibleBlocks};
use osp_session::{
    brush::{Brush, Effect, Lighting},
    scene::{Scene, Stroke},
};

const SIDE: u32 = 2048;
/// Smallest distance from a surface at which a caster shadows it, texels. Strokes that touch therefore cast no shadow
/// on each other. The unit is a texel, because both the thickness of paint and the size of a texel grow with the model.
const NEAREST: f32 = 20.0;
/// With `is_patient`, the map waits one frame for each group of this many polygons before it is drawn again.
const PATIENCE: usize = 1 << 13;

/// The depth map of all shadow casters as seen from the first light. It is drawn again when the scene or the light has
/// changed. It does not depend on views and their culling.
#[derive(Debug)]
pub(super) struct Shadow {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    uniforms: wgpu::Buffer,
    /// The depth map; a single texel until a shadow is needed.
    map: wgpu::TextureView,
    is_whole: bool,
    /// Bind group of the pipelines that sample the map.
    pub(super) group: wgpu::BindGroup,
    slot: ViewSlot,
    casters: VisibleBlocks,
    /// Direction of the light in the map. `None` if the light casts no shadows.
    way: Option<Vec3>,
    is_stale: bool,
    is_patient: bool,
    frames_waited: usize,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Shade {
    clip_from_middle: [[f32; 4]; 4],
    middle: [f32; 4],
    numbers: [f32; 4],
}

impl Shadow {
    pub(super) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
        let uniform = descriptors::uniform(size_of::<Shade>() as u64);
        let map = descriptors::texture(wgpu::TextureSampleType::Depth);
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let bindings = [uniform, map, sampler].map(|ty| (wgpu::ShaderStages::FRAGMENT, ty));
        gpu.bind_layout("shadow", &bindings)
    }

    /// A map without any shadow. `layouts` are the layouts of a view, of a page of polygons and of the paint.
    pub(super) fn new(
        gpu: &Gpu,
        module: &wgpu::ShaderModule,
        layout: wgpu::BindGroupLayout,
        layouts: [&wgpu::BindGroupLayout; 3],
        chunk_len: usize,
    ) -> Self {
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("nearer"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let uniforms = gpu.buffer("shade", size_of::<Shade>() as u64, descriptors::UNIFORM);
        let map = create_map(gpu, 1);
        let group = bind(gpu, &layout, &uniforms, &map, &sampler);
        let pipeline = create_pipeline(gpu, module, layouts, chunk_len);
        let slot = ViewSlot::new(gpu, layouts[0]);
        let casters = VisibleBlocks::default();
        Self {
            layout,
            pipeline,
            sampler,
            uniforms,
            map,
            is_whole: false,
            group,
            slot,
            casters,
            way: None,
            is_stale: true,
            is_patient: false,
            frames_waited: 0,
        }
    }

    pub(super) fn note_change(&mut self) {
        self.is_stale = true;
    }

    /// Sets whether the map may lag behind the scene. It lags more frames if it has more polygons.
    pub(super) fn set_patient(&mut self, is_patient: bool) {
        self.is_patient = is_patient;
    }

    /// Draws the map if its contents have changed. `way` is the direction of the first light, if this light is on.
    /// Returns whether the bind group has changed.
    pub(super) fn send(
        &mut self,
        gpu: &Gpu,
        view_layout: &wgpu::BindGroupLayout,
        paint: &wgpu::BindGroup,
        scene: &Scene,
        on_gpu: &GpuScene,
        way: Option<Vec3>,
    ) -> bool {
        let has_turned = self.way != way;
        self.frames_waited += 1;
        let is_due = !self.is_patient || self.frames_waited > self.casters.len() / PATIENCE;
        let is_wanted = has_turned || self.is_stale && is_due;
        if !is_wanted {
            return false;
        }
        (self.way, self.is_stale, self.frames_waited) = (way, false, 0);
        self.casters.clear();
        let bounds = way.and_then(|way| self.collect(scene, LightSpace::new(way), on_gpu.uploaded));
        let Some((space, bounds)) = bounds else {
            gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&Shade::zeroed()));
            return false;
        };
        let is_other = !self.is_whole;
        if is_other {
            self.map = create_map(gpu, SIDE);
            self.group = bind(gpu, &self.layout, &self.uniforms, &self.map, &self.sampler);
            self.is_whole = true;
        }
        let middle = space.to_world(bounds.center());
        // The margin keeps casters at the rim in the map, and gives a flat box some thickness.
        let half = bounds.extent() * 0.505 + 1.0e-3;
        let texel = 2.0 * half.x.max(half.y) / SIDE as f32;
        let clip_from_middle = Mat4::from_scale(half.recip()) * space.from_world;
        // Depth goes from 0 at the light to 1.
        let clip_from_middle = Mat4::from_translation(Vec3::Z * 0.5)
            * Mat4::from_scale(Vec3::new(1.0, 1.0, -0.5))
            * clip_from_middle;
        let shade = Shade {
            clip_from_middle: clip_from_middle.to_cols_array_2d(),
            middle: middle.extend(1.0).to_array(),
            numbers: [NEAREST * texel, texel, 0.0, 0.0],
        };
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&shade));

        self.slot.order.clear();
        self.slot.order.add(scene, &self.casters, 0, middle, on_gpu.page_len(), |_| Classes::default());
        self.slot.order.finish(on_gpu.page_len());
        let uniforms = Uniforms::of_matrix(shade.clip_from_middle, shade.middle);
        self.slot.send_uniforms(gpu, view_layout, uniforms, Place::ALONE);
        self.draw(gpu, paint, on_gpu);
        is_other
    }

    /// Collects the shadow casters; returns their bounds in the space of the light.
    fn collect(&mut self, scene: &Scene, space: LightSpace, count: usize) -> Option<(LightSpace, Aabb)> {
        let axes = Mat3::from_mat4(space.from_world);
        let widths = Mat3::from_cols(axes.x_axis.abs(), axes.y_axis.abs(), axes.z_axis.abs());
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for stroke in scene.strokes().iter().filter(|stroke| throws_shadows(stroke)) {
            for id in stroke.polygon_ids().filter(|id| id.index() < count) {
                self.casters.insert(id);
                let bounds = scene.bounds(id);
                let (middle, half) = (axes * bounds.center(), widths * (bounds.extent() * 0.5));
                (low, high) = (low.min(middle - half), high.max(middle + half));
            }
        }
        let bounds = Aabb::new(low, high);
        (!self.casters.is_empty() && bounds.is_valid()).then_some((space, bounds))
    }

    fn draw(&self, gpu: &Gpu, paint: &wgpu::BindGroup, on_gpu: &GpuScene) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let nothing = wgpu::LoadOp::Clear(1.0);
        let mut pass = descriptors::depth_pass(&mut encoder, "shadow", &self.map, nothing, None, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.slot.bind_group, &[]);
        pass.set_bind_group(2, paint, &[]);
        for run in &self.slot.order.runs {
            if on_gpu.bind(&mut pass, run.page) {
                on_gpu.draw(&mut pass, run.places(0, self.slot.all_from), 0);
            }
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}

/// Whether a stroke casts a shadow. Unlit strokes cast none, except those of Toon, as in the program that the brushes
/// come from.
fn throws_shadows(stroke: &Stroke) -> bool {
    let casts = |brush: &Brush| brush.lighting != Lighting::Unlit || brush.effect == Effect::Toon;
    stroke.brush().is_some_and(casts) && stroke.is_visible() && DrawClass::of(stroke) == DrawClass::Solid
}

/// The axes of a light, which shines along -z.
struct LightSpace {
    from_world: Mat4,
}

impl LightSpace {
    fn new(way: Vec3) -> Self {
        let z = -way;
        let (x, y) = z.any_orthonormal_pair();
        Self { from_world: Mat4::from_mat3(Mat3::from_cols(x, y, z).transpose()) }
    }

    fn to_world(&self, p: Vec3) -> Vec3 {
        self.from_world.transpose().transform_vector3(p)
    }
}

fn create_map(gpu: &Gpu, side: u32) -> wgpu::TextureView {
    let usage = descriptors::DRAWN_AND_READ;
    gpu.image("shadow map", DEPTH_FORMAT, 1, usage, (side, side))
}

fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    map: &wgpu::TextureView,
    sampler: &wgpu::Sampler,
) -> wgpu::BindGroup {
    gpu.bind_group(
        "shadow",
        layout,
        &[
            uniforms.as_entire_binding(),
            wgpu::BindingResource::TextureView(map),
            wgpu::BindingResource::Sampler(sampler),
        ],
    )
}

fn create_pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layouts: [&wgpu::BindGroupLayout; 3],
    chunk_len: usize,
) -> wgpu::RenderPipeline {
    let layout = gpu.pipeline_layout("shadow", &layouts.map(Some));
    let constants = [("CHUNK_LEN", chunk_len as f64)];
    // The bias keeps a surface that is steep to the light from casting a shadow on itself. Both sides of a polygon cast
    // shadows.
    let depth = wgpu::DepthStencilState {
        bias: wgpu::DepthBiasState { constant: 0, slope_scale: 1.5, clamp: 0.0 },
        ..descriptors::depth(wgpu::CompareFunction::Less, true)
    };
    gpu.render_pipeline(
        "shadow",
        Some(&layout),
        descriptors::with_chunk_len(descriptors::vertex(module, "vertex_shadow"), &constants),
        Some(depth),
        1,
        Some(descriptors::fragment(module, "fragment_shadow", &[])),
    )
}
