//! `osp draw-index`: a picture of an index's structure.

use anyhow::{anyhow, ensure};

use super::{
    draw_index_args::{Colors, DrawIndexArgs, From, Shown},
    outcome::Outcome,
    output::{complain, file_name, one_line, say},
    outputs::Outputs,
    played::Played,
    query::ray_of,
};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
};
use osp_lab::report::{
    CellColors, Side, SplitOutline, Structure, StructurePanel, StructurePicture, StructureView, thousands,
};
use osp_rivals::{Bsp, BspConfig, IndexKind};
use osp_session::{output_file::OutputKind, replay::Moment, scene::Scene};

/// Largest number of planes that are drawn.
const MOST_PLANES: usize = 2000;

/// Returns the planes of a tree that cuts along the planes of the polygons.
fn splits(scene: &Scene) -> anyhow::Result<Vec<SplitOutline>> {
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
        outlines.push(SplitOutline { depth, corners: corners.to_vec() });
    });
    Ok(outlines)
}

/// Returns the distance to the first polygon that a ray hits.
fn first_hit(index: &dyn SpatialIndex, scene: &Scene, ray: &Ray) -> Option<f32> {
    let hit = index.ray_nearest(ray, f32::INFINITY, &mut |id| scene.polygon(id).meet(ray));
    hit.map(|(_, t)| t)
}

pub(super) fn run(args: &DrawIndexArgs) -> anyhow::Result<Outcome> {
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_dot = ending == "dot";
    ensure!(
        is_dot || ending == "svg" || ending == "png",
        "{}: expected a name that ends in .svg, .png or .dot",
        args.out.display()
    );
    ensure!(
        !is_dot || args.shown == Shown::Tree,
        "{}: .dot is for a tree: add --as tree",
        args.out.display()
    );
    let kind = match ending.as_str() {
        "dot" => OutputKind::Dot,
        "svg" => OutputKind::Svg,
        _ => OutputKind::Png,
    };
    let output = Outputs::new(args.force).reads([&args.frame.session.file]).add("OUT", &args.out, kind)?;
    ensure!(
        !args.planes || (args.frame.index == IndexKind::Bsp && args.shown == Shown::Space),
        "--planes: expected with --index bsp and a picture of cells"
    );
    ensure!(
        args.beside.is_none() || !is_dot,
        "{}: a .dot holds one tree: expected no --beside",
        args.out.display()
    );
    let ray = args.ray.as_deref().map(ray_of).transpose()?;
    let Played { scene, pipeline, moment, .. } = Played::in_index(&args.frame)?;
    let file = &args.frame.session.file;
    let name = file_name(file);
    let title_of =
        |moment: &Moment, index: IndexKind| format!("{name}, frame {}, {}", moment.frame, index.name());
    let title = title_of(&moment, args.frame.index);
    let structure = Structure::of(pipeline.index());
    if is_dot {
        output.write(structure.to_dot(&title).as_bytes())?;
    } else {
        let view = match (args.shown, args.from) {
            (Shown::Tree, _) => StructureView::Tree,
            (Shown::Space, From::Front) => StructureView::Space(Side::Front),
            (Shown::Space, From::Top) => StructureView::Space(Side::Top),
            (Shown::Space, From::Right) => StructureView::Space(Side::Right),
        };
        output.check()?;
        let splits = if args.planes { splits(&scene)? } else { Vec::new() };
        let mut panels = vec![StructurePanel { title: title.clone(), structure: structure.clone(), splits }];
        if let Some(other) = args.beside {
            let played = Played::up_to(&args.frame.session, other)?;
            let structure = Structure::of(played.pipeline.index());
            panels.push(StructurePanel { title: title_of(&moment, other), structure, splits: Vec::new() });
        }
        let colors = match args.colors {
            Colors::Level => CellColors::Level,
            Colors::Leaf => CellColors::Leaf,
        };
        let ray = ray.map(|ray| (ray, first_hit(pipeline.index(), &scene, &ray)));
        let picture = StructurePicture { panels: &panels, view, scene: &scene, colors, ray };
        picture.write(output.path()).map_err(|e| anyhow!("{}: {e}", output.path().display()))?;
    }
    let nodes = structure.nodes();
    if nodes.is_empty() {
        complain(&format!("warning: {} has no nodes to show", args.frame.index.name()));
    }
    say(&format!(
        "{}: {} nodes, {} levels, {} polygons -> {}",
        one_line(&title),
        thousands(nodes.len() as u64),
        if nodes.is_empty() { 0 } else { structure.depth() + 1 },
        thousands(scene.counts().visible),
        one_line(&args.out.to_string_lossy())
    ))?;
    Ok(Outcome::Done)
}
