use super::{
    HzbView, PyramidLevel,
    frame::Frame,
    pyramid::Levels,
    queries::HzbViewParts,
    span::{LANES, Params, SPAN_STRIDE, Span, with_offsets},
    state::Groups,
};
use crate::{
    Blend, Gpu, GpuTimer, RenderError,
    read_back::read_buffer,
    run::{CLUSTER, Handle},
    target::DepthBefore,
    timer::{Ends, Stamps},
};

const POLYGONS_OF_TEST: u32 = CLUSTER as u32;
/// Largest number of workgroups of the fine test. They share its candidates.
const GROUPS_OF_REFINEMENT: u32 = 2048;
/// Width and height of the area of the pyramid that a workgroup computes, texels.
const TEXELS_OF_PYRAMID: u32 = 8;

impl HzbView {
    /// Encodes the drawing of prepared views: one, or both eyes. `more` draws over the polygons of a view.
    pub(in super::super) fn encode(
        views: &mut [(Box<Self>, Frame<'_>)],
        encoder: &mut wgpu::CommandEncoder,
        timer: &GpuTimer,
        more: &mut dyn FnMut(usize, &mut wgpu::RenderPass<'_>),
    ) {
        for (view, frame) in &mut *views {
            view.is_encoded = true;
            view.fit(frame);
            let light = frame.order.light().len() as u64 * 4;
            if frame.of_second.is_some() && light > 0 {
                // The test removes hidden polygons from the list, so each eye needs its own.
                let at = u64::from(frame.order.opaque_count()) * 4;
                encoder.copy_buffer_to_buffer(frame.list_of_order, at, frame.list, at, light);
            }
        }
        // After a jump, all polygons in view are drawn, and tested afterwards; see `prepare`.
        let recalls = views.iter().any(|(view, _)| !view.has_jumped);
        let ends = if recalls { Ends::Begin } else { Ends::Both };
        let mut pass = begin_compute(encoder, "recall", timer.stamps(0, ends));
        for (view, frame) in &*views {
            match view.has_jumped {
                true => view.compact(frame, &mut pass),
                false => view.recall(frame, &mut pass),
            }
        }
        drop(pass);
        let last = views.iter().rposition(|(view, _)| !view.has_jumped);
        for (i, (view, frame)) in views.iter_mut().enumerate().filter(|(_, (view, _))| !view.has_jumped) {
            let stamps = if last == Some(i) { timer.stamps(0, Ends::End) } else { None };
            view.draw_depth(frame, encoder, stamps);
            view.query(frame, encoder);
        }
        if recalls {
            let mut pass = begin_compute(encoder, "occlusion test", timer.stamps(1, Ends::Both));
            for (view, frame) in views.iter().filter(|(view, _)| !view.has_jumped) {
                view.test(frame, &mut pass);
                view.compact(frame, &mut pass);
            }
        }
        let count = views.len();
        for (i, (view, frame)) in views.iter().enumerate() {
            let begin = if i == 0 { timer.stamps(2, Ends::Begin) } else { None };
            let end = if i + 1 == count { timer.stamps(2, Ends::End) } else { None };
            view.draw(frame, encoder, [begin, end], |pass| more(i, pass));
        }
        if views.iter().any(|(view, _)| view.has_jumped) {
            let stamps = if recalls { None } else { timer.stamps(1, Ends::Both) };
            let mut pass = begin_compute(encoder, "visible polygons", stamps);
            for (view, frame) in views.iter().filter(|(view, _)| view.has_jumped) {
                view.remember(frame, &mut pass);
            }
        }
        for (view, _) in views {
            view.begin_results();
            let bytes = view.result_bytes();
            view.ring.copy(encoder, &view.buffers.args, 0, bytes);
        }
    }

    /// Creates the pyramid and the bind groups again if the target has changed.
    fn fit(&mut self, frame: &Frame<'_>) {
        let gpu = frame.gpu;
        if self.size != frame.target.size() {
            self.size = frame.target.size();
            self.levels = Levels::of(self.size.0, self.size.1);
            if gpu.grow(&mut self.buffers.pyramid, u64::from(self.levels.texels) * 4) {
                self.groups = None;
            }
            let params = Params::new(self.size, &self.levels, self.is_wrong);
            gpu.queue.write_buffer(&self.buffers.params, 0, bytemuck::bytes_of(&params));
        }
        let fits = |groups: &Groups| {
            let is_same_list = groups.list == *frame.list && groups.handles == self.handles;
            is_same_list && groups.depth == frame.target.depth
        };
        if !self.groups.as_ref().is_some_and(fits) {
            self.groups = Some(self.bind(frame));
        }
    }

    fn bind(&self, frame: &Frame<'_>) -> Groups {
        let (gpu, hzb, buffers) = (frame.gpu, frame.hzb, &self.buffers);
        let whole = wgpu::Buffer::as_entire_binding;
        let span = span_of(&buffers.spans);
        let depth = wgpu::BindingResource::TextureView(&frame.target.depth);
        Groups {
            recall: gpu.bind_group(
                "recall",
                &hzb.recall_layout,
                &[
                    span.clone(),
                    whole(&self.handles),
                    whole(&buffers.remembered),
                    whole(&buffers.recalled),
                    whole(&buffers.args),
                ],
            ),
            pyramid: gpu.bind_group(
                "depth pyramid",
                &hzb.pyramid_layout,
                &[span.clone(), whole(&buffers.params), depth.clone(), whole(&buffers.pyramid)],
            ),
            test: gpu.bind_group(
                "occlusion test",
                &hzb.test_layout,
                &[
                    span.clone(),
                    whole(&buffers.params),
                    whole(frame.uniforms),
                    whole(&self.handles),
                    whole(&buffers.remembered),
                    whole(&buffers.kept),
                    whole(&buffers.pyramid),
                    whole(&buffers.candidates),
                    depth,
                ],
            ),
            transparent: gpu.bind_group(
                "transparent polygons",
                &hzb.transparent_layout,
                &[whole(frame.list), whole(&buffers.args)],
            ),
            compact: gpu.bind_group(
                "compaction",
                &hzb.compact_layout,
                &[
                    span,
                    whole(&self.handles),
                    whole(&buffers.kept),
                    whole(&buffers.sums),
                    whole(frame.list),
                    whole(&buffers.args),
                ],
            ),
            draw_recalled: gpu.bind_group(
                "recalled polygons",
                frame.view_layout,
                &[whole(frame.uniforms), whole(&buffers.recalled)],
            ),
            handles: self.handles.clone(),
            list: frame.list.clone(),
            depth: frame.target.depth.clone(),
        }
    }

    /// Lists the polygons that were visible in the last frame.
    fn recall(&self, frame: &Frame<'_>, pass: &mut wgpu::ComputePass<'_>) {
        let Some(groups) = &self.groups else { return };
        pass.set_pipeline(&frame.hzb.recall);
        for (span, offset) in with_offsets(&self.pages, self.first_span[0]) {
            pass.set_bind_group(0, &groups.recall, &[offset]);
            pass.dispatch_workgroups(span.len().div_ceil(LANES), 1, 1);
        }
    }

    /// Draws the depth of the polygons that were visible in the last frame.
    fn draw_depth(&self, frame: &Frame<'_>, encoder: &mut wgpu::CommandEncoder, stamps: Option<Stamps<'_>>) {
        let Some(groups) = &self.groups else { return };
        let mut pass = frame.target.begin_depth(encoder, stamps.map(Stamps::of_render));
        frame.pipelines.begin_depth(&mut pass, &groups.draw_recalled);
        for (span, run) in self.pages.iter().zip(&frame.order.handle_runs) {
            if frame.scene.bind(&mut pass, run.page) {
                let [depth, _] = span.draw_calls();
                pass.multi_draw_indexed_indirect(&self.buffers.args, depth, span.draws);
            }
        }
    }

    fn query(&mut self, frame: &Frame<'_>, encoder: &mut wgpu::CommandEncoder) {
        let parts = HzbViewParts {
            span: span_of(&self.buffers.spans),
            handles: &self.handles,
            remembered: &self.buffers.remembered,
            kept: &self.buffers.kept,
            pages: &self.pages,
            first_page: self.first_span[0],
        };
        if let Some(queries) = &mut self.queries {
            queries.encode(frame, &parts, encoder);
        }
    }

    fn test(&self, frame: &Frame<'_>, pass: &mut wgpu::ComputePass<'_>) {
        let Some(groups) = self.groups.as_ref().filter(|_| self.queries.is_none()) else { return };
        self.build_pyramid(frame, groups, pass);
        self.test_opaque(frame, groups, pass, [&frame.hzb.test, &frame.hzb.refine]);
        pass.set_pipeline(&frame.hzb.test_transparent);
        pass.set_bind_group(2, &groups.transparent, &[]);
        for (span, offset) in with_offsets(&self.transparent, self.first_span[2]) {
            if bind_span(frame, groups, pass, span, offset) {
                // Polygons beyond the limit of a dispatch are drawn without a test.
                dispatch(pass, span.len().div_ceil(POLYGONS_OF_TEST).min(65_535));
            }
        }
    }

    fn test_opaque(
        &self,
        frame: &Frame<'_>,
        groups: &Groups,
        pass: &mut wgpu::ComputePass<'_>,
        [coarse, fine]: [&wgpu::ComputePipeline; 2],
    ) {
        for (span, offset) in with_offsets(&self.chunks, self.first_span[1]) {
            if !bind_span(frame, groups, pass, span, offset) {
                continue;
            }
            pass.set_pipeline(coarse);
            dispatch(pass, span.len());
            pass.set_pipeline(fine);
            dispatch(pass, span.len().min(GROUPS_OF_REFINEMENT));
        }
    }

    /// Builds the pyramid of the drawn polygons, and tests these polygons against it, to record the visible ones for the
    /// next frame.
    fn remember(&self, frame: &Frame<'_>, pass: &mut wgpu::ComputePass<'_>) {
        let Some(groups) = &self.groups else { return };
        self.build_pyramid(frame, groups, pass);
        self.test_opaque(frame, groups, pass, [&frame.hzb.remember, &frame.hzb.refine_remembered]);
    }

    fn build_pyramid(&self, frame: &Frame<'_>, groups: &Groups, pass: &mut wgpu::ComputePass<'_>) {
        for (level, (_, width, height)) in (1..).zip(self.levels.iter()) {
            let (pipeline, texels) = match level {
                1 => (&frame.hzb.base, 2 * TEXELS_OF_PYRAMID),
                // Level 2 is built together with level 1.
                2 => continue,
                _ => (&frame.hzb.reduce, TEXELS_OF_PYRAMID),
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &groups.pyramid, &[level * SPAN_STRIDE]);
            let [x, y] = [width, height].map(|side| side.div_ceil(texels));
            pass.dispatch_workgroups(x, y, 1);
        }
    }

    /// Writes the polygons that are not hidden to the draw list.
    fn compact(&self, frame: &Frame<'_>, pass: &mut wgpu::ComputePass<'_>) {
        let Some(groups) = &self.groups else { return };
        for (pipeline, is_one) in
            [(&frame.hzb.count, false), (&frame.hzb.scan, true), (&frame.hzb.scatter, false)]
        {
            pass.set_pipeline(pipeline);
            for (span, offset) in with_offsets(&self.pages, self.first_span[0]) {
                pass.set_bind_group(0, &groups.compact, &[offset]);
                dispatch(pass, if is_one { 1 } else { span.len().div_ceil(LANES) });
            }
        }
    }

    /// Draws the colours of the compacted list, over the depth of the first pass if the frame had one.
    fn draw(
        &self,
        frame: &Frame<'_>,
        encoder: &mut wgpu::CommandEncoder,
        [begin, end]: [Option<Stamps<'_>>; 2],
        more: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let depth = if self.has_jumped { DepthBefore::NothingAndKept } else { DepthBefore::Kept };
        let mut pass = frame.target.begin(encoder, frame.background, depth, begin.map(Stamps::of_render));
        frame.pipelines.begin(&mut pass, frame.draw);
        pass.set_pipeline(frame.pipelines.with_colors(Blend::Opaque));
        for (span, run) in self.pages.iter().zip(&frame.order.handle_runs) {
            if frame.scene.bind(&mut pass, run.page) {
                let [_, colors] = span.draw_calls();
                pass.multi_draw_indexed_indirect(&self.buffers.args, colors, span.draws);
            }
        }
        let first = frame.order.opaque_count();
        let runs = frame.of_second.map_or(&frame.order.runs[..], |_| frame.order.common_runs());
        frame.pipelines.draw_runs(&mut pass, frame.scene, runs, first, first);
        if let Some(own) = frame.of_second {
            let first = first + frame.order.light().len() as u32;
            frame.pipelines.draw_runs(&mut pass, frame.scene, &own.runs, first, first);
        }
        more(&mut pass);
        drop(pass);
        frame.finish.encode(frame.gpu, encoder, frame.target, frame.bloom, end.map(Stamps::of_render));
    }

    /// Reads back the pyramid of the last frame.
    pub(in super::super) fn read_pyramid(&self, gpu: &Gpu) -> Result<Vec<PyramidLevel>, RenderError> {
        let bytes = read_buffer(gpu, &self.buffers.pyramid, u64::from(self.levels.texels) * 4)?;
        let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        let level = |(first, width, height): (u32, u32, u32)| {
            let depths = texels[first as usize..][..(width * height) as usize].to_vec();
            PyramidLevel { width, height, depths }
        };
        Ok(self.levels.iter().map(level).collect())
    }

    /// Reads back the opaque polygons of the last frame that were not proven hidden, in ascending order.
    pub(in super::super) fn read_kept(&self, gpu: &Gpu) -> Result<Vec<Handle>, RenderError> {
        let handles = &self.last.handles;
        let bytes = read_buffer(gpu, &self.buffers.kept, handles.len() as u64 * 8)?;
        let masks: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(handles.iter().zip(masks).map(|(handle, mask)| Handle { mask, ..*handle }).collect())
    }
}

fn begin_compute<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &'static str,
    stamps: Option<Stamps<'_>>,
) -> wgpu::ComputePass<'e> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: stamps.map(Stamps::of_compute),
    })
}

fn span_of(spans: &wgpu::Buffer) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: spans,
        offset: 0,
        size: wgpu::BufferSize::new(size_of::<Span>() as u64),
    })
}

/// Binds a span for a test, with its chunk. Returns `false` if the chunk does not exist.
fn bind_span(
    frame: &Frame<'_>,
    groups: &Groups,
    pass: &mut wgpu::ComputePass<'_>,
    span: &Span,
    offset: u32,
) -> bool {
    let Some(chunk) = frame.hzb.chunk(span.base as usize) else { return false };
    pass.set_bind_group(0, &groups.test, &[offset]);
    pass.set_bind_group(1, chunk, &[]);
    true
}

fn dispatch(pass: &mut wgpu::ComputePass<'_>, workgroups: u32) {
    if workgroups > 0 {
        pass.dispatch_workgroups(workgroups, 1, 1);
    }
}
