//! Drawing of the views of a frame. Two neighbouring views that see nearly the same, such as the eyes of a headset, share
//! one list of opaque polygons.

use super::{Layer, Renderer};
use crate::{
    Classes, GpuOcclusion, GpuTimer, OpaqueOrder, Style, Target, ViewSlot,
    hzb::{Frame, HzbView},
    order::{Listing, Part},
    style::MAX_STYLES,
    timer::Ends,
    view_slot::Place,
};
use osp::view::View;
use osp_session::scene::Scene;

/// Two views share a list if at most one polygon in this number is in view of only one of them.
const SHARED: usize = 8;

#[derive(Debug)]
pub struct Eye<'a> {
    pub slot: &'a mut ViewSlot,
    pub view: &'a View,
    pub layers: &'a [Layer<'a>],
}

impl Eye<'_> {
    /// Whether all polygons are in a single layer in its own colours.
    fn is_plain(&self) -> bool {
        self.layers.iter().enumerate().all(|(i, layer)| match i {
            0 => layer.style == Style::PLAIN,
            _ => layer.polygons.is_empty(),
        })
    }
}

#[derive(Debug)]
pub struct EyePicture<'a> {
    pub target: &'a Target,
    pub slot: &'a mut ViewSlot,
    /// Measures the passes. The timer of an eye that shares its list returns no times: they are among the times of the
    /// other eye.
    pub timer: &'a mut GpuTimer,
}

impl Renderer {
    /// Sorts the polygons of a view and sends their order; returns the number of bytes sent. Call it after
    /// [`Renderer::send`], because polygons that are not on the GPU are skipped. Layers beyond the eighth are drawn in the
    /// style of the eighth.
    pub fn prepare(&self, slot: &mut ViewSlot, scene: &Scene, view: &View, layers: &[Layer<'_>]) -> u64 {
        self.prepare_all(scene, &mut [Eye { slot, view, layers }])
    }

    /// Does the same as [`Renderer::prepare`] for all views of a frame. Neighbouring views that see nearly the same share a
    /// list, which is sent once. Draw the views by [`Renderer::encode_all`], in the same order.
    pub fn prepare_all(&self, scene: &Scene, eyes: &mut [Eye<'_>]) -> u64 {
        let (mut bytes, mut left) = (0, eyes);
        while let [first, others @ ..] = &mut *left {
            let can_cull = first.slot.hzb.is_some() && first.is_plain();
            let in_view = first.layers.first().map_or(0, |layer| layer.polygons.len());
            let culls = can_cull && first.slot.switch.as_mut().is_none_or(|switch| switch.decide(in_view));
            let is_pair = others.first().is_some_and(|second| see_the_same(first, second));
            let (together, others) = std::mem::take(&mut left).split_at_mut(1 + usize::from(is_pair));
            bytes += self.prepare_together(scene, together, culls);
            left = others;
        }
        bytes
    }

    /// Prepares a view, or two that share a list.
    fn prepare_together(&self, scene: &Scene, eyes: &mut [Eye<'_>], culls: bool) -> u64 {
        let page_len = self.scene.page_len();
        let listing = if culls { Listing::Clusters } else { Listing::Ids };
        for (i, eye) in eyes.iter_mut().enumerate() {
            eye.slot.order.clear_for(listing);
            eye.slot.is_second = i > 0;
        }
        let [first, others @ ..] = eyes else { return 0 };
        let mut styles = [Style::PLAIN; MAX_STYLES];
        for (i, layer) in first.layers.iter().enumerate() {
            let style = i.min(MAX_STYLES - 1);
            styles[style] = layer.style;
            let is_faint = layer.style.opacity < 1.0;
            let classes_of = |first| match self.scene.classes_of(first) {
                _ if self.is_solid => Classes::default(),
                Classes { additive, .. } if is_faint => Classes { additive, transparent: !additive },
                classes => classes,
            };
            let add = |eye: &mut Eye<'_>, polygons, part| {
                let (order, at) = (&mut eye.slot.order, eye.view.eye_in_world);
                order.add_part(scene, polygons, part, style as u32, at, page_len, classes_of);
            };
            let Some(second) = others.first_mut() else {
                add(first, layer.polygons, Part::Whole);
                continue;
            };
            let mut both = std::mem::take(&mut first.slot.both);
            // `see_the_same` has united the first layers.
            if i > 0 {
                both.copy_from(layer.polygons);
                both.add(second.layers[i].polygons);
            }
            add(first, &both, Part::Common);
            add(first, layer.polygons, Part::Own);
            add(second, second.layers[i].polygons, Part::Own);
            first.slot.both = both;
        }
        first.slot.order.sort_opaque(scene, first.view.eye_in_world, page_len);
        first.slot.order.finish(page_len);
        others.iter_mut().for_each(|eye| eye.slot.order.finish(page_len));
        // The GPU lists the opaque polygons of clusters before the others.
        let before = first.slot.order.opaque_count();
        let behind = others.iter().map(|eye| eye.slot.order.ids().len() as u64).sum();
        let own = Place::Own { before, more: if culls { 0 } else { behind } };
        let before = before + first.slot.order.light().len() as u32;
        let (gpu, layout, on_gpu) = (&self.gpu, &self.view_layout, &self.scene);
        let mut bytes = first.slot.send(gpu, layout, (first.view, &styles), own);
        let ViewSlot { hzb, order, .. } = &mut *first.slot;
        if let Some(of_view) = hzb.as_mut().filter(|_| culls) {
            bytes += of_view.prepare(gpu, order, None, on_gpu, (scene, first.view));
        }
        for Eye { slot, view, .. } in others {
            let place = if culls { Place::Own { before, more: 0 } } else { Place::Behind(first.slot) };
            bytes += slot.send(gpu, layout, (view, &styles), place);
            let other = first.slot.hzb.as_deref().map(|hzb| (hzb, &first.slot.order));
            let ViewSlot { hzb, order, .. } = &mut **slot;
            if let Some(of_view) = hzb.as_mut().filter(|_| culls) {
                bytes += of_view.prepare(gpu, order, other, on_gpu, (scene, view));
            }
        }
        bytes
    }

    /// Encodes the drawing of a prepared view into `target`; `more` draws over the polygons. After submission, call both
    /// [`GpuTimer::submitted`] and [`ViewSlot::submitted`].
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &mut ViewSlot,
        timer: &mut GpuTimer,
        more: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let mut more = Some(more);
        self.encode_all(encoder, &mut [EyePicture { target, slot, timer }], &mut |_, pass| {
            if let Some(more) = more.take() {
                more(pass);
            }
        });
    }

    /// Does the same as [`Renderer::encode`] for the views of [`Renderer::prepare_all`]. `more` receives the number of the
    /// picture.
    pub fn encode_all(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pictures: &mut [EyePicture<'_>],
        more: &mut dyn FnMut(usize, &mut wgpu::RenderPass<'_>),
    ) {
        let mut at = 0;
        for together in pictures.chunk_by_mut(|_, next| next.slot.is_second) {
            let count = together.len();
            let mut more = |i: usize, pass: &mut wgpu::RenderPass<'_>| more(at + i, pass);
            together[0].timer.begin();
            let passes = match together[0].slot.culls() {
                true => self.encode_culled(encoder, together, &mut more),
                false => self.encode_whole(encoder, together, &mut more),
            };
            together[0].timer.end(encoder, passes);
            at += count;
        }
    }

    /// Encodes the drawing of views that are culled on the GPU. Returns the number of passes with time stamps.
    fn encode_culled(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pictures: &mut [EyePicture<'_>],
        more: &mut dyn FnMut(usize, &mut wgpu::RenderPass<'_>),
    ) -> u32 {
        let Some(hzb) = &self.hzb else { return 0 };
        let views: Vec<_> = pictures.iter_mut().filter_map(|picture| picture.slot.hzb.take()).collect();
        let first = &*pictures[0].slot;
        let frames = pictures.iter().map(|EyePicture { target, slot, .. }| Frame {
            gpu: &self.gpu,
            hzb,
            scene: &self.scene,
            pipelines: self.pipelines(),
            finish: &self.finish,
            bloom: self.bloom(),
            view_layout: &self.view_layout,
            target,
            background: self.background,
            uniforms: &slot.uniforms,
            list: &slot.list,
            draw: &slot.bind_group,
            order: &first.order,
            list_of_order: &first.list,
            of_second: slot.is_second.then_some(&slot.order),
        });
        let mut views: Vec<_> = views.into_iter().zip(frames).collect();
        HzbView::encode(&mut views, encoder, pictures[0].timer, more);
        let views: Vec<_> = views.into_iter().map(|(view, _)| view).collect();
        for (picture, view) in pictures.iter_mut().zip(views) {
            picture.slot.hzb = Some(view);
        }
        3
    }

    /// Encodes the drawing of views that are not culled on the GPU. Returns the number of passes with time stamps.
    fn encode_whole(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pictures: &[EyePicture<'_>],
        more: &mut dyn FnMut(usize, &mut wgpu::RenderPass<'_>),
    ) -> u32 {
        let (first, timer) = (&*pictures[0].slot, &*pictures[0].timer);
        let pipelines = self.pipelines();
        for (i, EyePicture { target, slot, .. }) in pictures.iter().enumerate() {
            let stamps = timer.stamps(0, Ends::Begin).filter(|_| i == 0).map(|stamps| stamps.of_render());
            let (depth, stamps) = self.lay_down_depth(encoder, target, slot, stamps);
            let mut pass = target.begin(encoder, self.background, depth, stamps);
            pipelines.begin(&mut pass, &slot.bind_group);
            if slot.is_second {
                let common = first.order.common_runs();
                pipelines.draw_runs(&mut pass, &self.scene, common, first.first, first.all_from);
            }
            pipelines.draw_runs(&mut pass, &self.scene, &slot.order.runs, slot.first, slot.all_from);
            more(i, &mut pass);
            drop(pass);
            let is_last = i + 1 == pictures.len();
            let stamps = timer.stamps(0, Ends::End).filter(|_| is_last).map(|stamps| stamps.of_render());
            self.finish.encode(&self.gpu, encoder, target, self.bloom(), stamps);
        }
        1
    }
}

/// Whether two views can share a list, and see nearly the same.
fn see_the_same(first: &mut Eye<'_>, second: &Eye<'_>) -> bool {
    let is_ordered = |slot: &ViewSlot| slot.order.opaque.0 != OpaqueOrder::None;
    let occlusion = first.slot.occlusion();
    if [&*first.slot, &*second.slot].into_iter().any(is_ordered)
        || occlusion == GpuOcclusion::Queries
        || occlusion != second.slot.occlusion()
        || first.is_plain() != second.is_plain()
        || !first.layers.iter().map(|layer| layer.style).eq(second.layers.iter().map(|layer| layer.style))
    {
        return false;
    }
    let ([of_first, ..], [of_second, ..]) = (first.layers, second.layers) else { return false };
    let both = &mut first.slot.both;
    both.copy_from(of_first.polygons);
    both.add(of_second.polygons);
    let of_one = 2 * both.len() - of_first.polygons.len() - of_second.polygons.len();
    of_one * SHARED <= both.len()
}
