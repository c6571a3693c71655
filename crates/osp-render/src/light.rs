//! A budget of light. Additive polygons may cover [`FULL_LAYERS`] times the picture's pixels in full resolution. The
//! largest polygons beyond this are drawn at half resolution: their shaders run once for two by two pixels. The four samples
//! of such a pixel lie in the four pixels of the picture and have their depths, so edges stay where they are.
//!
//! The budget counts pixels, not time. So a frame looks the same on every run.

use super::{
    Gpu, Target, descriptors,
    formats::{COLOR_FORMAT, DEPTH_FORMAT, SAMPLES},
    pipelines::sum,
    shaders,
    target::FARTHEST,
};
use osp::{polygon::PolygonId, view::View};
use osp_session::scene::Scene;

/// Largest number of additive layers over the whole picture that are drawn in full resolution.
const FULL_LAYERS: f64 = 4.0;

/// Number of bits of an area that do not count when areas are compared: an eighth of an octave remains.
const DROPPED_BITS: u32 = 20;

/// For more polygons than this, the areas of a sample decide whether all areas are computed. They are if the sample suggests
/// more than half of the budget.
const MANY: usize = 1 << 12;
const SAMPLED: usize = 16;

#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    view: View,
    picture: (u32, u32),
}

impl Budget {
    pub(super) fn new(view: &View, picture: (u32, u32)) -> Self {
        Self { view: *view, picture }
    }

    fn picture_px(&self) -> f32 {
        self.picture.0 as f32 * self.picture.1 as f32
    }

    /// Area of a polygon in the picture, pixels, if nothing hides it and it faces the eye.
    fn area_px(&self, scene: &Scene, id: PolygonId) -> f32 {
        let of = &self.view.projection;
        let polygon = scene.polygon(id);
        let corners = polygon.vertices();
        let (a, c) = (corners[0], corners[2]);
        let area_m2 = (c - a).cross(corners[corners.len() - 1] - corners[1]).length() * 0.5;
        let depth_m = ((a + c) * 0.5 - self.view.eye_in_world).dot(self.view.forward_in_world());
        // Area of the picture at a depth of one metre.
        let picture_m2 = (of.right - of.left) * (of.top - of.bottom);
        let part = area_m2 / (picture_m2 * depth_m.max(of.near_m).powi(2));
        // The result is not NaN, because `min` and `max` ignore NaN.
        (part * self.picture_px()).max(0.0).min(self.picture_px())
    }

    /// For each polygon, whether it is drawn at half resolution; `None` if none is.
    pub(super) fn beyond(&self, scene: &Scene, polygons: &[PolygonId]) -> Option<Vec<bool>> {
        let budget_px = f64::from(self.picture_px()) * FULL_LAYERS;
        let area_px = |&id: &PolygonId| self.area_px(scene, id);
        if polygons.len() > MANY {
            let sampled_px: f64 = polygons.iter().step_by(SAMPLED).map(|id| f64::from(area_px(id))).sum();
            if sampled_px * SAMPLED as f64 * 2.0 < budget_px {
                return None;
            }
        }
        let areas_px: Vec<f32> = polygons.iter().map(area_px).collect();
        let first = first_beyond(&areas_px, budget_px)?;
        Some(areas_px.iter().map(|area| area.to_bits() >> DROPPED_BITS >= first).collect())
    }
}

/// The smallest size of areas beyond a budget: the areas of smaller sizes are within the budget together. A size is the
/// upper bits of an area, which sort like the area.
fn first_beyond(areas_px: &[f32], budget_px: f64) -> Option<u32> {
    let mut of_size = vec![0.0; 1 << (32 - DROPPED_BITS)];
    for area in areas_px {
        of_size[(area.to_bits() >> DROPPED_BITS) as usize] += f64::from(*area);
    }
    let mut left_px = budget_px;
    let is_beyond = |px: f64| {
        left_px -= px;
        left_px < 0.0
    };
    of_size.into_iter().position(is_beyond).map(|size| size as u32)
}

#[derive(Debug)]
pub(super) struct HalfImages {
    pub(super) samples: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    pub(super) scene_depth: wgpu::BindGroup,
    pub(super) light: wgpu::BindGroup,
}

/// Draws light at half resolution.
#[derive(Debug)]
pub(super) struct LightPass {
    depth_layout: wgpu::BindGroupLayout,
    light_layout: wgpu::BindGroupLayout,
    depth: wgpu::RenderPipeline,
    compose: wgpu::RenderPipeline,
}

impl LightPass {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let stage = wgpu::ShaderStages::FRAGMENT;
        let depth = (stage, descriptors::samples(wgpu::TextureSampleType::Depth));
        let light = (stage, descriptors::samples(wgpu::TextureSampleType::Float { filterable: false }));
        let depth_layout = gpu.bind_layout("depth of the picture", &[depth]);
        let light_layout = gpu.bind_layout("light", &[light]);
        let module = gpu.module("light", shaders::LIGHT);
        let pipeline = |fragment, groups: &[Option<&wgpu::BindGroupLayout>], writes_depth: bool| {
            let write_mask = if writes_depth { wgpu::ColorWrites::empty() } else { wgpu::ColorWrites::ALL };
            let blend = (!writes_depth).then(sum);
            let target = wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask };
            gpu.render_pipeline(
                fragment,
                Some(&gpu.pipeline_layout(fragment, groups)),
                descriptors::vertex(&module, "vertex"),
                Some(descriptors::depth(wgpu::CompareFunction::Always, writes_depth)),
                SAMPLES,
                Some(descriptors::fragment(&module, fragment, &[Some(target)])),
            )
        };
        Self {
            depth: pipeline("depth", &[Some(&depth_layout)], true),
            compose: pipeline("compose", &[None, Some(&light_layout)], false),
            depth_layout,
            light_layout,
        }
    }

    fn images<'a>(&self, gpu: &Gpu, target: &'a Target) -> &'a HalfImages {
        target.half.get_or_init(|| {
            let (width, height) = target.size();
            let size = (width.div_ceil(2), height.div_ceil(2));
            let view = |label, format, usage| gpu.image(label, format, SAMPLES, usage, size);
            let samples = view("samples of light", COLOR_FORMAT, descriptors::DRAWN_AND_READ);
            let of = wgpu::BindingResource::TextureView;
            let group = |label, layout, resources: &[wgpu::BindingResource<'_>]| {
                gpu.bind_group(label, layout, resources)
            };
            HalfImages {
                depth: view("depth of light", DEPTH_FORMAT, wgpu::TextureUsages::RENDER_ATTACHMENT),
                scene_depth: group("depth of the picture", &self.depth_layout, &[of(&target.depth)]),
                light: group("light", &self.light_layout, &[of(&samples)]),
                samples,
            }
        })
    }

    /// Encodes the pass that draws light at half resolution, behind the stored depth of a target.
    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let images = self.images(gpu, target);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("light"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &images.samples,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &images.depth,
                depth_ops: Some(wgpu::Operations { load: FARTHEST, store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.depth);
        pass.set_bind_group(0, &images.scene_depth, &[]);
        pass.draw(0..3, 0..SAMPLES);
        // A pixel of light covers two by two pixels of the picture, beyond its border if a side is odd.
        let (width, height) = target.size();
        pass.set_viewport(0.0, 0.0, width as f32 * 0.5, height as f32 * 0.5, 0.0, 1.0);
        draw(&mut pass);
    }

    pub(super) fn compose(&self, gpu: &Gpu, pass: &mut wgpu::RenderPass<'_>, target: &Target) {
        pass.set_pipeline(&self.compose);
        pass.set_bind_group(1, &self.images(gpu, target).light, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_areas_are_beyond_the_budget() {
        let areas_px = [1.0, 8.0, 2.0, 64.0, 0.0, 8.0];
        assert_eq!(first_beyond(&areas_px, 83.0), None);
        let beyond = |budget_px| first_beyond(&areas_px, budget_px).expect("a size") << DROPPED_BITS;
        assert_eq!(f32::from_bits(beyond(82.9)), 64.0);
        assert_eq!(f32::from_bits(beyond(19.0)), 64.0);
        assert_eq!(f32::from_bits(beyond(18.9)), 8.0, "polygons of one size are drawn alike");
        assert_eq!(f32::from_bits(beyond(0.0)), 1.0);
    }
}
