//! Pictures of brushes for the list of brushes.

use std::{f32::consts::TAU, sync::Arc};

use glam::{Quat, Vec3};

use super::ui::PreviewGrid;
use osp::{
    polygon::{Change, VisibleBlocks},
    view::{Projection, View},
};
use osp_render::{Gpu, Layer, Offscreen, RenderError, RendererConfig};
use osp_session::{
    recording::{Author, Event, NormalRule, Paint, StrokeId, Tool},
    scene::Scene,
};

const PIXEL_BYTES: usize = 4;
/// Width and height of the pictured part of the model, metres. A usual stroke has about this size.
const CELL_M: (f32, f32) = (0.4, 0.12);
/// Margin between the ends of a stroke and the edges of its picture, metres.
const MARGIN_M: f32 = 0.04;
const WIDTH_M: f32 = 0.03;
const HEIGHT_M: f32 = 0.022;
const SAMPLES: u16 = 60;
/// A narrow field of view, so that the projection is nearly parallel and every stroke is seen from the front.
const FOV_DEGREES: f32 = 6.0;

/// Draws a wave with every offered brush, white on black. Returns the rows of the grid's texture as bytes: red, green,
/// blue and opacity. Each brush is drawn separately, because some brushes place polygons far from the stroke.
pub(super) fn draw(gpu: &Arc<Gpu>, grid: &PreviewGrid) -> Result<Vec<u8>, RenderError> {
    let (width_px, height_px) = grid.cell_px();
    let row_bytes = grid.size_px().0 as usize * PIXEL_BYTES;
    let mut texture = vec![0; row_bytes * grid.size_px().1 as usize];
    let config = RendererConfig { background: [0.0; 3], chunk_len: 1 << 14, draw_len: 1 << 14 };
    let mut drawer = Offscreen::on(Arc::clone(gpu), width_px as u32, height_px as u32, &config)?;
    let distance_m = CELL_M.1 * 0.5 / (FOV_DEGREES * 0.5).to_radians().tan();
    let projection = Projection::symmetric(FOV_DEGREES, drawer.aspect(), distance_m * 0.5, distance_m * 2.0);
    let view = View::look_at(Vec3::Z * distance_m, Vec3::ZERO, projection);
    for (i, brush) in grid.brushes().enumerate() {
        let (mut scene, mut changes) = (Scene::new(), Vec::new());
        sample(&brush.name, &mut scene, &mut changes);
        drawer.renderer.forget_from(0);
        drawer.renderer.follow(&changes);
        let every: VisibleBlocks = scene.visible_ids().collect();
        drawer.draw(&scene, &view, &[Layer::plain(&every)])?;
        let image = drawer.image()?;
        let (column, row) = (i % grid.columns(), i / grid.columns());
        let left = column * width_px * PIXEL_BYTES;
        for (y, line) in image.rgba().chunks(width_px * PIXEL_BYTES).enumerate() {
            let at = (row * height_px + y) * row_bytes + left;
            texture[at..at + line.len()].copy_from_slice(line);
        }
    }
    Ok(texture)
}

/// Draws one wave, with more pressure in the middle.
fn sample(brush: &str, scene: &mut Scene, changes: &mut Vec<Change>) {
    let (t, stroke) = (0.0, StrokeId(0));
    let begin = Event::Begin {
        author: Author::SOLE,
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
        let x = (part - 0.5) * (CELL_M.0 - 2.0 * MARGIN_M);
        let p = Vec3::new(x, HEIGHT_M * (part * TAU).sin(), 0.0);
        let pressure = 0.35 + 0.65 * (part * TAU * 0.5).sin();
        scene.apply(&Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure }, changes);
    }
    scene.apply(&Event::End { t, stroke }, changes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_brush_that_can_be_chosen_leaves_something_in_its_cell() {
        let gpu = match Gpu::headless() {
            Ok(gpu) => Arc::new(gpu),
            Err(error) => {
                let must = std::env::var_os("OSP_GPU_TESTS").is_some_and(|value| value == "1");
                assert!(!must, "{error}");
                return;
            }
        };
        let grid = PreviewGrid::default();
        let texture = draw(&gpu, &grid).expect("a picture");
        let (cell_px, row_px) = (grid.cell_px(), grid.size_px().0 as usize * PIXEL_BYTES);
        for (i, brush) in grid.brushes().enumerate() {
            let (x, y) = (i % grid.columns() * cell_px.0, i / grid.columns() * cell_px.1);
            let lit = (y..y + cell_px.1)
                .flat_map(|y| texture[y * row_px + x * 4..][..cell_px.0 * 4].chunks(4))
                .filter(|pixel| pixel[..3].iter().any(|&c| c > 40))
                .count();
            assert!(lit > 5, "{}: {lit} pixels", brush.name);
        }
    }
}
