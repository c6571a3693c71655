//! `osp draw-index`: a picture of an index's structure.

use anyhow::ensure;

use super::{
    draw_args::{Colors, DrawIndexArgs, Shown, SideArg},
    output::{Outcome, file_name, one_line, print_result, warn},
    outputs::ending,
    played::Played,
    query::ray_of,
};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
};
use osp_lab::report::{
    CellColors, ChartFormat, Side, SplitOutline, Structure, StructurePanel, StructurePicture, StructureView,
    thousands,
};
use osp_rivals::{Bsp, BspConfig, IndexKind};
use osp_session::scene::Scene;

/// Largest number of planes that are drawn.
const MOST_PLANES: usize = 2000;
/// Largest number of indexes side by side.
const MOST_PANELS: usize = 6;
/// Largest number of polygons in a picture with their numbers.
const MOST_NAMED: u64 = 500;

/// Returns the planes of the upper `levels` levels of a BSP tree of the visible polygons.
fn splits(scene: &Scene, levels: Option<u32>) -> anyhow::Result<Vec<SplitOutline>> {
    let mut tree = Bsp::new(BspConfig::default(), &IndexConfig::default());
    let mut bounds = Aabb::EMPTY;
    for id in scene.visible_ids() {
        tree.insert(id, &scene.bounds(id))?;
        tree.shape(id, &scene.polygon(id));
        bounds = bounds.union(&scene.bounds(id));
    }
    tree.commit();
    let mut outlines = Vec::new();
    tree.splits(&bounds, MOST_PLANES, &mut |depth, corners| {
        if levels.is_none_or(|levels| depth < levels) {
            outlines.push(SplitOutline { depth, corners: corners.to_vec() });
        }
    });
    Ok(outlines)
}

fn first_hit(index: &dyn SpatialIndex, scene: &Scene, ray: &Ray) -> Option<f32> {
    let hit = index.ray_nearest(ray, f32::INFINITY, &mut |id| scene.polygon(id).meet(ray));
    hit.map(|(_, t)| t)
}

pub(super) fn run(args: &DrawIndexArgs) -> anyhow::Result<Outcome> {
    let is_dot = ending(&args.out) == "dot";
    ensure!(
        !is_dot || args.shown == Shown::Tree,
        "{}: .dot is for a tree: add --as tree",
        args.out.display()
    );
    let output =
        args.force.outputs().reads([&args.session.file]).add(&args.out, &[".svg", ".png", ".dot"])?;
    ensure!(
        !args.planes || (args.shown == Shown::Space && args.index.iter().all(|&index| has_planes(index))),
        "--planes: expected with --index bsp or osp-paper and a picture of cells"
    );
    ensure!(
        args.index.len() == 1 || !is_dot,
        "{}: a .dot holds one tree: expected one index",
        args.out.display()
    );
    ensure!(args.index.len() <= MOST_PANELS, "--index: expected at most {MOST_PANELS} indexes");
    let ray = args.ray.as_deref().map(ray_of).transpose()?;
    let settings = args.settings.settings(&args.index)?;
    let name = file_name(&args.session.file);
    let is_tree = args.shown == Shown::Tree;
    let Played { scene, pipelines, moment, .. } = Played::in_indexes(&args.session, &args.index, &settings)?;
    let polygons = scene.counts().visible;
    ensure!(
        !args.names || polygons <= MOST_NAMED,
        "--names: expected at most {MOST_NAMED} polygons; found {polygons}"
    );
    let mut panels = Vec::new();
    for (&index, pipeline) in args.index.iter().zip(&pipelines) {
        let drawn = pipeline.index();
        let structure =
            if is_tree || args.planes { Structure::with_empty_nodes(drawn) } else { Structure::of(drawn) };
        let splits = match index {
            _ if !args.planes => Vec::new(),
            IndexKind::Bsp => splits(&scene, args.levels)?,
            _ => structure.upper(args.levels.unwrap_or(u32::MAX)).splits(MOST_PLANES),
        };
        let title = format!("{name}, frame {}, {}", moment.frame, index.name());
        panels.push(StructurePanel { title, structure, levels: args.levels, splits });
    }
    if is_dot {
        let StructurePanel { title, structure, levels, .. } = &panels[0];
        let structure = structure.upper(levels.unwrap_or(u32::MAX));
        output.write(structure.to_dot(title, args.names).as_bytes())?;
    } else {
        let view = match (args.shown, args.from) {
            (Shown::Tree, _) => StructureView::Tree,
            (Shown::Space, from) => StructureView::Space(from.side()),
        };
        let colors = match args.colors {
            Colors::Level => CellColors::Level,
            Colors::Leaf => CellColors::Leaf,
        };
        let hit = |ray: &Ray| first_hit(pipelines.first()?.index(), &scene, ray);
        let ray = ray.map(|ray| (ray, hit(&ray)));
        let picture =
            StructurePicture { panels: &panels, view, scene: &scene, colors, ray, named: args.names };
        output.write_by(|file| file.write_all(&picture.encode(ChartFormat::of(output.path()))?))?;
    }
    for (panel, index) in panels.iter().zip(&args.index) {
        let nodes = &panel.structure.nodes;
        if nodes.is_empty() {
            warn(&format!("warning: {} has no nodes to show", index.name()));
        }
        print_result(&format!(
            "{}: {} nodes, {} levels, {} polygons -> {}",
            one_line(&panel.title),
            thousands(nodes.len() as u64),
            if nodes.is_empty() { 0 } else { panel.structure.depth() + 1 },
            thousands(polygons),
            one_line(&args.out.to_string_lossy())
        ))?;
    }
    Ok(Outcome::Done)
}

impl SideArg {
    pub(super) fn side(self) -> Side {
        match self {
            Self::Front => Side::Front,
            Self::Top => Side::Top,
            Self::Right => Side::Right,
        }
    }
}

/// Whether each inner node of an index has a splitting plane.
fn has_planes(index: IndexKind) -> bool {
    matches!(index, IndexKind::Bsp | IndexKind::OspPaper)
}
