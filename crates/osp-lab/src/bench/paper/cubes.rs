//! The parameters of Fig. 2: depth of the tree, and size of its cube.

use osp_session::platform::time::Instant;

use super::input::{PaperConfig, PaperInput, mean};
use crate::rows::Rows;
use osp::{
    index::{BruteForce, SpatialIndex, WorkCounts},
    view::View,
};
use osp_rivals::{CutNodes, OspGrid, OspPaper};

const PART: &str = "paper-cube";

/// Fills a tree for each depth and cube, and culls it for these views.
pub(super) fn measure(rows: &mut Rows, input: &PaperInput<'_>, config: &PaperConfig, views: &[View]) {
    let frames = (config.frames as usize).min(views.len());
    let views: Vec<View> = (0..frames).map(|i| views[i * views.len() / frames]).collect();
    let mut exact = BruteForce::with_capacity(input.scene.polygon_count());
    for id in input.scene.visible_ids() {
        // A polygon with an invalid box cannot be drawn and is left out.
        let _ = exact.insert(id, &input.scene.bounds(id));
    }
    let mut list = Vec::new();
    let in_view: u64 = views
        .iter()
        .map(|view| {
            list.clear();
            exact.frustum_cull(&view.frustum(), &mut list);
            list.len() as u64
        })
        .sum();
    rows.part(PART, "The paper: depth of its tree and edge of its cube (Fig. 2)");
    rows.note(PART, "As in Fig. 6 all polygons of a node that the frustum cuts are drawn.");
    rows.of(PART, input.recording, "").value("in_view", "polygons", mean(in_view, frames));
    for &cube in &config.cubes {
        for &depth in &config.depths {
            add(rows, input, &views, cube, depth);
        }
    }
}

fn add(rows: &mut Rows, input: &PaperInput<'_>, views: &[View], factor: f32, depth: u32) {
    let cube = input.cube(factor);
    let cube_m = cube.extent().max_element();
    let grid = OspGrid::new(cube.center(), cube_m, depth);
    let mut tree = OspPaper::new(grid, input.scene.polygon_count()).with_cut_nodes(CutNodes::Drawn);
    for id in input.scene.visible_ids() {
        // A polygon with an invalid box cannot be drawn and is left out.
        let _ = tree.insert(id, &input.scene.bounds(id));
    }
    let (mut work, mut list, mut us) = (WorkCounts::default(), Vec::with_capacity(tree.len()), Vec::new());
    for view in views {
        let frustum = view.frustum();
        list.clear();
        let start = Instant::now();
        work += tree.frustum_cull(&frustum, &mut list);
        us.push(start.elapsed().as_nanos() as f64 / 1000.0);
    }
    let insertions = tree.insertions();
    let depth = tree.grid().max_depth();
    rows.of(PART, input.recording, format!("cube x {factor}, depth {depth}"))
        .value("edge", "m", f64::from(cube_m))
        .value("nodes", "", f64::from((2_u32 << depth) - 1))
        .value("planes", "1/polygon", insertions.planes as f64 / insertions.polygons.max(1) as f64)
        .value("outside", "polygons", tree.outside().0.len() as f64)
        .value("boxes", "1/frame", mean(work.boxes, views.len()))
        .median("cull", "µs", us)
        .value("drawn", "polygons", mean(work.reported, views.len()))
        .value("memory", "MB", tree.bytes() as f64 / 1.0e6);
}
