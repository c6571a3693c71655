use bytemuck::{Pod, Zeroable};

use super::HzbView;
use crate::{Area, Gpu, ViewSlot, descriptors, pipelines::of_whole_picture, shaders};

/// Shows levels of depth pyramids in a window.
#[derive(Debug)]
pub struct PyramidPass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    encodes: bool,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Level {
    first: u32,
    width: u32,
    height: u32,
    encodes: u32,
}

impl PyramidPass {
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let bindings =
            [descriptors::read(0), descriptors::uniform(0)].map(|ty| (wgpu::ShaderStages::FRAGMENT, ty));
        let layout = gpu.bind_layout("depth pyramid in a window", &bindings);
        let module = gpu.module("depth pyramid in a window", shaders::PYRAMID);
        let pipeline_layout = gpu.pipeline_layout("depth pyramid in a window", &[Some(&layout)]);
        let target = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL };
        let pipeline = of_whole_picture(gpu, &module, &pipeline_layout, "fragment", target);
        Self { layout, pipeline, encodes: format.is_srgb() }
    }

    /// Draws a level of the pyramid that culls the current frame, in an area of the pass's target. The area must lie
    /// within the target. A texel of level n covers 2^n pixels in each direction. For level 0, level 1 is drawn; for a
    /// level beyond the last, the last level. Returns whether the view has a pyramid; only views that are culled by a
    /// pyramid have one.
    pub fn draw(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        slot: &ViewSlot,
        level: u32,
        area: Area,
    ) -> bool {
        let Some(view) = slot.hzb.as_ref().filter(|view| slot.culls() && view.has_pyramid()) else {
            return false;
        };
        if !(area.width >= 1.0 && area.height >= 1.0) {
            return true;
        }
        let Some((first, width, height)) = view.level(level as usize) else { return false };
        let level = Level { first, width, height, encodes: u32::from(self.encodes) };
        let uniform = gpu.buffer("level of a depth pyramid", size_of::<Level>() as u64, descriptors::UNIFORM);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&level));
        let group = gpu.bind_group(
            "depth pyramid in a window",
            &self.layout,
            &[view.buffers.pyramid.as_entire_binding(), uniform.as_entire_binding()],
        );
        pass.set_viewport(area.x, area.y, area.width, area.height, 0.0, 1.0);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        true
    }
}

impl HzbView {
    fn has_pyramid(&self) -> bool {
        self.queries.is_none() && self.size != (0, 0)
    }

    /// First texel, width and height of a level. Level 0 counts as level 1. A level beyond the last level counts as the
    /// last.
    fn level(&self, level: usize) -> Option<(u32, u32, u32)> {
        self.levels.iter().take(level.max(1)).last()
    }
}
