//! Pictures of brushes for the list in which a person chooses one.

use std::{f32::consts::TAU, sync::Arc};

use glam::{Quat, Vec3};

use super::ui::PreviewGrid;
use crate::{
    polygon::{Change, VisibleBlocks},
    recording::{Event, NormalRule, Paint, StrokeId, Tool},
    render::{Gpu, Image, Layer, Offscreen, RenderError, RendererConfig},
    scene::Scene,
    view::{Projection, View},
};

/// A cell of the grid in the model, metres: about what a hand draws at once, so that brushes look as they are used.
const CELL_M: (f32, f32) = (0.4, 0.12);
/// Between the ends of a stroke and the edges of its cell.
const MARGIN_M: f32 = 0.04;
const WIDTH_M: f32 = 0.03;
const HEIGHT_M: f32 = 0.022;
const SAMPLES: u16 = 60;
/// Nearly parallel, so that every cell is seen from the front.
const FOV_DEGREES: f32 = 6.0;

/// Draws a wave with every brush that can be chosen, white on black.
pub(super) fn draw(gpu: &Arc<Gpu>, grid: &PreviewGrid) -> Result<Image, RenderError> {
    let (width_px, height_px) = grid.size_px();
    let config = RendererConfig { background: [0.0; 3], chunk_len: 1 << 14 };
    let mut drawer = Offscreen::on(Arc::clone(gpu), width_px, height_px, &config)?;
    let size_m = (grid.columns() as f32 * CELL_M.0, grid.rows() as f32 * CELL_M.1);
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for (i, brush) in grid.brushes().enumerate() {
        let (column, row) = (i % grid.columns(), i / grid.columns());
        let left_m = column as f32 * CELL_M.0 - size_m.0 * 0.5;
        let middle_m = size_m.1 * 0.5 - (row as f32 + 0.5) * CELL_M.1;
        sample(i as u32, &brush.name, left_m, middle_m, &mut scene, &mut changes);
    }
    drawer.follow(&changes);
    let distance_m = size_m.1 * 0.5 / (FOV_DEGREES * 0.5).to_radians().tan();
    let projection = Projection::symmetric(FOV_DEGREES, drawer.aspect(), distance_m * 0.5, distance_m * 2.0);
    let view = View::look_at(Vec3::Z * distance_m, Vec3::ZERO, projection);
    let every: VisibleBlocks = scene.visible_ids().collect();
    drawer.draw(&scene, &view, &[Layer::plain(&every)])?;
    drawer.image()
}

/// One wave, pressed harder in the middle.
fn sample(
    number: u32,
    brush: &str,
    left_m: f32,
    middle_m: f32,
    scene: &mut Scene,
    changes: &mut Vec<Change>,
) {
    let (t, stroke) = (0.0, StrokeId(number));
    let begin = Event::Begin {
        t,
        stroke,
        tool: Tool::Ribbon,
        width: WIDTH_M,
        color: (1.0, 1.0, 1.0, 1.0),
        normal: NormalRule::Travel,
        thinnest: 0.0,
        paint: Some(Box::new(Paint::new(brush, 1))),
    };
    scene.apply(&begin, changes);
    for i in 0..SAMPLES {
        let part = f32::from(i) / f32::from(SAMPLES - 1);
        let x = left_m + MARGIN_M + part * (CELL_M.0 - 2.0 * MARGIN_M);
        let p = Vec3::new(x, middle_m + HEIGHT_M * (part * TAU).sin(), 0.0);
        let pressure = 0.35 + 0.65 * (part * TAU * 0.5).sin();
        scene.apply(&Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure }, changes);
    }
    scene.apply(&Event::End { t, stroke }, changes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_brush_that_can_be_chosen_leaves_something_in_its_cell_and_little_beside() {
        let gpu = match Gpu::headless() {
            Ok(gpu) => Arc::new(gpu),
            Err(error) => {
                let must = std::env::var_os("OSP_GPU_TESTS").is_some_and(|value| value == "1");
                assert!(!must, "{error}");
                return;
            }
        };
        let grid = PreviewGrid::default();
        let image = draw(&gpu, &grid).expect("a picture");
        let (cell_px, row_px) = (grid.cell_px(), image.width() as usize * 4);
        for (i, brush) in grid.brushes().enumerate() {
            let (x, y) = (i % grid.columns() * cell_px.0, i / grid.columns() * cell_px.1);
            let lit = (y..y + cell_px.1)
                .flat_map(|y| image.rgba()[y * row_px + x * 4..][..cell_px.0 * 4].chunks(4))
                .filter(|pixel| pixel[..3].iter().any(|&c| c > 40))
                .count();
            assert!(lit > 25, "{}: {lit} pixels", brush.name);
        }
    }
}
