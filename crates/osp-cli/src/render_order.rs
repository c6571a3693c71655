//! `osp render --order`: measures the cost of each drawing order, in turns.

use std::sync::Arc;

use anyhow::ensure;
use comfy_table::CellAlignment;
use serde::Serialize;

use super::parsers::Size;
use osp::{
    polygon::{Change, VisibleBlocks},
    view::View,
};
use osp_lab::report::{columns_table, short, thousands};
use osp_render::{
    Gpu, Image, Layer, Offscreen, OpaqueOrder, OrderCounts, Overdraw, RenderError, RendererConfig,
};
use osp_session::{recording::Environment, scene::Scene};

/// Returns the orders with these names. `all` stands for all orders.
pub(super) fn named_orders(names: &[String]) -> Vec<OpaqueOrder> {
    let is_named = |order: &OpaqueOrder, name: &str| name == "all" || name == order.name();
    names.iter().flat_map(|name| OpaqueOrder::ALL.into_iter().filter(|order| is_named(order, name))).collect()
}

/// Draws the same picture in several orders.
pub(super) struct OrderTrials {
    drawer: Offscreen,
    orders: Vec<OpaqueOrder>,
    repeats: usize,
}

#[derive(Serialize)]
pub(super) struct FrameOrders {
    frame: u64,
    polygons: usize,
    width: u32,
    height: u32,
    adapter: String,
    /// Whether the drawing times come from the adapter's time stamps. If not, they are the CPU's times from submission
    /// to completion.
    gpu_times: bool,
    repeats: usize,
    orders: Vec<OrderFigures>,
}

#[derive(Serialize)]
struct OrderFigures {
    order: &'static str,
    sort_ms: f64,
    draw_ms: f64,
    draw_by_material_ms: f64,
    overdraw: f64,
    samples_shaded: u64,
    samples_covered: u64,
    draw_calls: u64,
    pipelines: u64,
    material_runs: u64,
    differing_pixels: usize,
}

#[derive(Default)]
struct Measured {
    sort_ns: Vec<u64>,
    draw_ns: Vec<u64>,
    by_material_ns: Vec<u64>,
    counts: OrderCounts,
    overdraw: Overdraw,
    image: Option<Image>,
}

fn median_ms(values: &mut [u64]) -> f64 {
    values.sort_unstable();
    values.get(values.len() / 2).map_or(0.0, |&ns| ns as f64 * 1.0e-6)
}

impl OrderTrials {
    pub(super) fn new(
        orders: Vec<OpaqueOrder>,
        repeats: usize,
        gpu: &Arc<Gpu>,
        Size { width, height }: Size,
        config: &RendererConfig,
        (environment, time_s): (Option<&Environment>, f32),
    ) -> anyhow::Result<Self> {
        for (i, order) in orders.iter().enumerate() {
            ensure!(!orders[..i].contains(order), "--order names {} twice", order.name());
        }
        let mut drawer = Offscreen::on(Arc::clone(gpu), width, height, config)?;
        drawer.renderer.set_environment(environment);
        drawer.renderer.set_time(time_s);
        Ok(Self { drawer, orders, repeats })
    }

    pub(super) fn follow(&mut self, changes: &[Change]) {
        self.drawer.renderer.follow(changes);
    }

    /// Draws the polygons in view in every order, in turns. The picture uses the first order.
    pub(super) fn draw(
        &mut self,
        frame: u64,
        scene: &Scene,
        view: &View,
        polygons: &VisibleBlocks,
    ) -> Result<(FrameOrders, Image), RenderError> {
        let layers = [Layer::plain(polygons)];
        let drawer = &mut self.drawer;
        drawer.set_opaque_order(OpaqueOrder::None, false);
        // The first frame uploads the polygons to the adapter. The other pictures are compared with its picture.
        let mut gpu_times = drawer.draw(scene, view, &layers)?.gpu_ns.is_some();
        let usual = drawer.image()?;
        let mut measured: Vec<Measured> = self.orders.iter().map(|_| Measured::default()).collect();
        // The first round fills the caches and does not count.
        for round in 0..=self.repeats {
            for (order, measured) in self.orders.iter().zip(&mut measured) {
                drawer.set_opaque_order(*order, true);
                let by_material = drawer.draw(scene, view, &layers)?;
                drawer.set_opaque_order(*order, false);
                let times = drawer.draw(scene, view, &layers)?;
                if round == 0 {
                    measured.counts = drawer.order_counts(scene);
                    measured.image = Some(drawer.image()?);
                    measured.overdraw = drawer.count_overdraw()?;
                    continue;
                }
                gpu_times &= times.gpu_ns.is_some();
                measured.sort_ns.push(times.prepare.ns);
                measured.draw_ns.push(times.gpu_ns.unwrap_or(times.draw.ns));
                measured.by_material_ns.push(by_material.gpu_ns.unwrap_or(by_material.draw.ns));
            }
        }
        drawer.set_opaque_order(OpaqueOrder::None, false);
        let mut orders = Vec::new();
        let mut first = None;
        for (order, mut measured) in self.orders.iter().zip(measured) {
            let image = measured.image.take();
            orders.push(OrderFigures {
                order: order.name(),
                sort_ms: median_ms(&mut measured.sort_ns),
                draw_ms: median_ms(&mut measured.draw_ns),
                draw_by_material_ms: median_ms(&mut measured.by_material_ns),
                overdraw: measured.overdraw.factor(),
                samples_shaded: measured.overdraw.shaded,
                samples_covered: measured.overdraw.covered,
                draw_calls: measured.counts.draw_calls,
                pipelines: measured.counts.pipelines,
                material_runs: measured.counts.material_runs,
                differing_pixels: image.as_ref().map_or(0, |image| image.differing_pixels(&usual)),
            });
            first = first.or(image);
        }
        let figures = FrameOrders {
            frame,
            polygons: polygons.len(),
            width: usual.width(),
            height: usual.height(),
            adapter: self.drawer.renderer.gpu.name(),
            gpu_times,
            repeats: self.repeats,
            orders,
        };
        Ok((figures, first.unwrap_or(usual)))
    }
}

impl FrameOrders {
    pub(super) fn json(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string(self)?)
    }

    pub(super) fn table(&self) -> String {
        let mut table = columns_table();
        table.set_header([
            "order",
            "sort, send\nms",
            "draw\nms",
            "a call for each\nmaterial run, ms",
            "overdraw",
            "draw calls",
            "pipelines\nbound",
            "material\nruns",
            "pixels that\ndiffer",
        ]);
        for row in &self.orders {
            table.add_row([
                row.order.to_owned(),
                short(row.sort_ms),
                short(row.draw_ms),
                short(row.draw_by_material_ms),
                format!("{:.2}", row.overdraw),
                thousands(row.draw_calls),
                thousands(row.pipelines),
                thousands(row.material_runs),
                thousands(row.differing_pixels as u64),
            ]);
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        let by = if self.gpu_times { "time stamps of the adapter" } else { "the clock" };
        format!(
            "frame {}: {} polygons, {} x {} pixels; medians of {} rounds, drawing by {by}\n{table}",
            self.frame,
            thousands(self.polygons as u64),
            self.width,
            self.height,
            self.repeats
        )
    }
}
