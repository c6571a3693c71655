//! The inputs of Fig. 2: how deep the tree is made, and how large its cube.

use osp_session::platform::time::Instant;

use serde::Serialize;

use super::input::{PaperConfig, PaperInput, mean};
use crate::bench::Estimate;
use osp::{
    index::{BruteForce, DrawList, SpatialIndex, WorkCounts},
    view::View,
};
use osp_rivals::{CutNodes, OspGrid, OspPaper};

/// The paper's tree with one depth and cube, filled with the finished model.
#[derive(Clone, Debug, Serialize)]
pub struct CubeRow {
    /// Edge of the cube, as a multiple of the session's.
    pub cube: f32,
    /// The same, metres.
    pub cube_m: f32,
    /// Maximum depth, binary levels.
    pub depth: u32,
    /// Nodes of the tree: all of them are made before the first polygon comes.
    pub nodes: u64,
    /// Planes that a polygon is compared with when it is filed, mean.
    pub planes_per_polygon: f64,
    /// Polygons that are not wholly in the cube.
    pub outside: u64,
    /// Boxes tested in a frame of the flight, mean.
    pub tests: f64,
    /// Polygons drawn, mean.
    pub drawn: f64,
    /// Polygons in view, mean.
    pub in_view: f64,
    /// Culling, microseconds.
    pub cull_us: Estimate,
    /// Memory, bytes.
    pub bytes: u64,
}

/// Fills a tree for each depth and cube, and culls it along these views.
pub(super) fn measure(input: &PaperInput<'_>, config: &PaperConfig, views: &[View]) -> Vec<CubeRow> {
    let frames = (config.frames as usize).min(views.len());
    let views: Vec<View> = (0..frames).map(|i| views[i * views.len() / frames]).collect();
    let mut exact = BruteForce::with_capacity(input.scene.polygon_count());
    for id in input.scene.visible_ids() {
        // What is beyond all range cannot be drawn and stays out.
        let _ = exact.insert(id, &input.scene.bounds(id));
    }
    let mut list = DrawList::new();
    let in_view: u64 = views
        .iter()
        .map(|view| {
            list.clear();
            exact.frustum_cull(&view.frustum(), &mut list);
            list.len() as u64
        })
        .sum();
    let mut rows = Vec::new();
    for &cube in &config.cubes {
        for &depth in &config.depths {
            rows.push(CubeRow { in_view: mean(in_view, frames), ..row(input, &views, cube, depth) });
        }
    }
    rows
}

fn row(input: &PaperInput<'_>, views: &[View], factor: f32, depth: u32) -> CubeRow {
    let cube = input.cube(factor);
    let cube_m = cube.extent().max_element();
    let grid = OspGrid::new(cube.center(), cube_m, depth);
    let mut tree = OspPaper::new(grid, input.scene.polygon_count()).with_cut_nodes(CutNodes::Drawn);
    for id in input.scene.visible_ids() {
        // What is beyond all range cannot be drawn and stays out.
        let _ = tree.insert(id, &input.scene.bounds(id));
    }
    let (mut work, mut list, mut us) = (WorkCounts::default(), DrawList::new(), Vec::new());
    list.reserve(tree.len());
    for view in views {
        let frustum = view.frustum();
        list.clear();
        let start = Instant::now();
        work += tree.frustum_cull(&frustum, &mut list);
        us.push(start.elapsed().as_nanos() as f64 / 1000.0);
    }
    let filing = tree.filing();
    CubeRow {
        cube: factor,
        cube_m,
        depth: tree.grid().max_depth(),
        nodes: (2 << tree.grid().max_depth()) - 1,
        planes_per_polygon: filing.planes as f64 / filing.polygons.max(1) as f64,
        outside: tree.outside_root() as u64,
        tests: mean(work.boxes, views.len()),
        drawn: mean(work.reported, views.len()),
        in_view: 0.0,
        cull_us: Estimate::of(&mut us).unwrap_or_default(),
        bytes: tree.bytes() as u64,
    }
}
