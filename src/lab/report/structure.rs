//! Pictures of an index: its cells in projection, and its tree.

use std::{error::Error, fmt::Write, path::Path};

use plotters::{coord::Shift, prelude::*};

use super::{
    ChartFormat,
    chart::register_font,
    picture::{Picture, encode},
    printable::one_line,
    table::thousands,
};
use crate::{
    atomic_file::write_atomically,
    index::{Node, SpatialIndex, Visit, Visitor},
    math::{Aabb, Frustum},
    polygon::PolygonId,
    scene::Scene,
};

/// Size of a picture, pixels.
const SIZE: (u32, u32) = (1280, 960);
/// Room around what is drawn, pixels.
const MARGIN: f32 = 40.0;
/// Nodes that a picture of cells shows at most.
const MOST_CELLS: usize = 20_000;
/// Nodes that a picture of a tree shows at most.
const MOST_TREE_NODES: usize = 500;
/// Places side by side up to which the nodes of a tree bear numbers.
const MOST_LABELS: usize = 24;

/// A node of an index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StructureNode {
    /// A box around every polygon of the node and of those below it.
    pub bounds: Aabb,
    /// 0 at the top.
    pub depth: u32,
    /// Polygons in the node and below, as the index says.
    pub polygons: usize,
    /// Number of the node above.
    pub parent: Option<usize>,
    /// Nodes below that were left out by [`Structure::collapsed`].
    pub left_out: usize,
}

/// The nodes of an index, as a visitor meets them: each before those below it.
#[derive(Clone, Debug, Default)]
pub struct Structure {
    nodes: Vec<StructureNode>,
}

/// The side from which a picture shows the cells of an index, without perspective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Along -z: x to the right, y up.
    Front,
    /// From above: x to the right, z down.
    Top,
    /// Along -x: z to the left, y up.
    Right,
}

impl Side {
    /// All sides.
    pub const ALL: [Self; 3] = [Self::Front, Self::Top, Self::Right];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Top => "top",
            Self::Right => "right",
        }
    }

    /// Right and up in the picture.
    fn project(self, p: glam::Vec3) -> (f32, f32) {
        match self {
            Self::Front => (p.x, p.y),
            Self::Top => (p.x, -p.z),
            Self::Right => (-p.z, p.y),
        }
    }
}

/// The two kinds of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StructureView {
    /// Cells over the polygons, in projection.
    Space(Side),
    /// The tree, with the root at the top.
    Tree,
}

struct Collector(Structure);

impl Visitor for Collector {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        let nodes = &mut self.0.nodes;
        // The last node met that is higher; nodes come depth first.
        let mut parent = nodes.len().checked_sub(1);
        while let Some(at) = parent
            && nodes[at].depth >= node.depth
        {
            parent = nodes[at].parent;
        }
        nodes.push(StructureNode {
            bounds: *node.bounds,
            depth: node.depth,
            polygons: node.polygons,
            parent,
            left_out: 0,
        });
        Visit::Descend
    }

    fn polygons(&mut self, _ids: &[PolygonId], _asked: Visit) {}
}

impl Structure {
    /// The nodes of an index that are not empty.
    pub fn of(index: &dyn SpatialIndex) -> Self {
        let mut collector = Collector(Self::default());
        index.traverse(&Frustum::everything(), &mut collector);
        collector.0
    }

    /// The nodes.
    pub fn nodes(&self) -> &[StructureNode] {
        &self.nodes
    }

    /// Depth of the deepest node.
    pub fn depth(&self) -> u32 {
        self.nodes.iter().map(|node| node.depth).max().unwrap_or(0)
    }

    /// The upper part of the tree: as many whole levels as have at most `most` nodes, and always the first.
    #[must_use]
    pub fn collapsed(&self, most: usize) -> Self {
        let mut counts = vec![0; self.depth() as usize + 1];
        self.nodes.iter().for_each(|node| counts[node.depth as usize] += 1);
        let mut sum = 0;
        let levels = counts.iter().take_while(|&&count| {
            sum += count;
            sum <= most
        });
        let levels = levels.count().max(1) as u32;
        let mut kept = Self::default();
        // For each node: its place among those kept, or that of the one that it is collapsed into.
        let mut place = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let parent = node.parent.map(|at| place[at]);
            match parent {
                Some(above) if node.depth >= levels => {
                    let above: usize = above;
                    kept.nodes[above].left_out += 1;
                    place.push(above);
                }
                _ => {
                    place.push(kept.nodes.len());
                    kept.nodes.push(StructureNode { parent, ..*node });
                }
            }
        }
        kept
    }

    /// The tree in the language of Graphviz' `dot`, collapsed where it is large.
    pub fn to_dot(&self, name: &str) -> String {
        let mut dot = String::from("digraph index {\n  node [shape=box, fontname=\"sans-serif\"];\n");
        // Writing to a string does not fail.
        let _ = writeln!(dot, "  label=\"{}\";", name.replace('\\', "\\\\").replace('"', "\\\""));
        for (i, node) in self.collapsed(MOST_TREE_NODES).nodes.iter().enumerate() {
            let mut label = format!("{} polygons", thousands(node.polygons as u64));
            if node.left_out > 0 {
                let _ = write!(label, "\\n+{} nodes", thousands(node.left_out as u64));
            }
            let _ = writeln!(dot, "  n{i} [label=\"{label}\"];");
            if let Some(parent) = node.parent {
                let _ = writeln!(dot, "  n{parent} -> n{i};");
            }
        }
        dot.push_str("}\n");
        dot
    }

    /// Draws the structure to an `.svg` or `.png` file, with `title` above; the file is whole or not there.
    ///
    /// # Errors
    /// The name ends otherwise, or the file cannot be written.
    pub fn draw(
        &self,
        view: StructureView,
        scene: &Scene,
        title: &str,
        path: &Path,
    ) -> Result<(), Box<dyn Error>> {
        register_font();
        let title = one_line(title);
        let picture = StructurePicture { structure: self, view, scene, title: &title };
        let bytes = encode(&picture, ChartFormat::of(path)?, SIZE)?;
        Ok(write_atomically(path, |out| out.write_all(&bytes))?)
    }

    fn draw_on<B: DrawingBackend>(
        &self,
        view: StructureView,
        scene: &Scene,
        title: &str,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        area.fill(&WHITE)?;
        let shown = self.collapsed(match view {
            StructureView::Space(_) => MOST_CELLS,
            StructureView::Tree => MOST_TREE_NODES,
        });
        let mut title = format!(
            "{title}: {} nodes, {} levels",
            thousands(self.nodes.len() as u64),
            if self.nodes.is_empty() { 0 } else { self.depth() + 1 }
        );
        if shown.nodes.len() < self.nodes.len() {
            let _ = write!(title, "; the upper {} are shown", shown.depth() + 1);
        }
        let area = area.titled(&title, ("sans-serif", 22))?;
        match view {
            StructureView::Space(side) => shown.draw_cells(side, scene, &area)?,
            StructureView::Tree => shown.draw_tree(&area)?,
        }
        area.present()?;
        Ok(())
    }

    fn draw_cells<B: DrawingBackend>(
        &self,
        side: Side,
        scene: &Scene,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        let all = self.nodes.iter().fold(Aabb::EMPTY, |all, node| all.union(&node.bounds));
        if all.is_empty() {
            return Ok(());
        }
        let (a, b) = (side.project(all.min), side.project(all.max));
        let (left, bottom) = (a.0.min(b.0), a.1.min(b.1));
        let (width, height) = ((a.0 - b.0).abs().max(1.0e-9), (a.1 - b.1).abs().max(1.0e-9));
        let (w, h) = area.dim_in_pixel();
        let (w, h) = (w as f32, h as f32);
        let scale = ((w - 2.0 * MARGIN) / width).min((h - 2.0 * MARGIN) / height);
        let (x0, y0) = ((w - width * scale) * 0.5, (h + height * scale) * 0.5);
        let pixel = |p: glam::Vec3| {
            let (x, y) = side.project(p);
            ((x0 + (x - left) * scale) as i32, (y0 - (y - bottom) * scale) as i32)
        };
        for id in scene.visible_ids() {
            let polygon = scene.polygon(id);
            let outline: Vec<(i32, i32)> = polygon.vertices().iter().map(|&corner| pixel(corner)).collect();
            area.draw(&Polygon::new(outline, RGBColor(190, 190, 190).mix(0.6)))?;
        }
        // The lowest first, so that the few high ones stay to be seen.
        let mut order: Vec<&StructureNode> = self.nodes.iter().collect();
        order.sort_by_key(|node| std::cmp::Reverse(node.depth));
        for node in order {
            let corners = [pixel(node.bounds.min), pixel(node.bounds.max)];
            area.draw(&Rectangle::new(corners, color_of_depth(node.depth).mix(0.8)))?;
        }
        Ok(())
    }

    fn draw_tree<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        let mut has_child = vec![false; self.nodes.len()];
        self.nodes.iter().filter_map(|node| node.parent).for_each(|parent| has_child[parent] = true);
        let places = has_child.iter().filter(|&&has| !has).count().max(1);
        let (w, h) = area.dim_in_pixel();
        let step_x = (w as f32 - 2.0 * MARGIN) / places as f32;
        let step_y = (h as f32 - 2.0 * MARGIN) / (self.depth() + 1) as f32;
        // Ends stand side by side, others in the middle above those below them.
        let mut spans: Vec<(f32, f32)> = vec![(f32::INFINITY, f32::NEG_INFINITY); self.nodes.len()];
        let mut next = 0.5;
        for (span, _) in spans.iter_mut().zip(&has_child).filter(|&(_, &has)| !has) {
            *span = (next, next);
            next += 1.0;
        }
        for i in (0..self.nodes.len()).rev() {
            if let Some(parent) = self.nodes[i].parent {
                let middle = f32::midpoint(spans[i].0, spans[i].1);
                spans[parent] = (spans[parent].0.min(middle), spans[parent].1.max(middle));
            }
        }
        let pixel = |i: usize| {
            let x = MARGIN + f32::midpoint(spans[i].0, spans[i].1) * step_x;
            let y = MARGIN + (self.nodes[i].depth as f32 + 0.5) * step_y;
            (x as i32, y as i32)
        };
        for (i, node) in self.nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                area.draw(&PathElement::new([pixel(parent), pixel(i)], RGBColor(170, 170, 170)))?;
            }
        }
        let most = self.nodes.iter().map(|node| node.polygons).max().unwrap_or(1).max(2);
        for (i, node) in self.nodes.iter().enumerate() {
            // By the logarithm of what is below, as far as there is room.
            let share = (node.polygons.max(1) as f32).ln() / (most as f32).ln();
            let radius = (2.0 + 8.0 * share).min(step_x.max(3.0) * 0.45) as i32;
            let (x, y) = pixel(i);
            area.draw(&Circle::new((x, y), radius, color_of_depth(node.depth).filled()))?;
            if places <= MOST_LABELS {
                let mut label = thousands(node.polygons as u64);
                if node.left_out > 0 {
                    let _ = write!(label, " (+{})", thousands(node.left_out as u64));
                }
                area.draw(&Text::new(label, (x + radius + 3, y - 6), ("sans-serif", 13)))?;
            }
        }
        Ok(())
    }
}

struct StructurePicture<'a> {
    structure: &'a Structure,
    view: StructureView,
    scene: &'a Scene,
    title: &'a str,
}

impl Picture for StructurePicture<'_> {
    fn draw_on<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        self.structure.draw_on(self.view, self.scene, self.title, area)
    }
}

fn color_of_depth(depth: u32) -> HSLColor {
    // Neighbouring levels lie far apart on the colour wheel.
    HSLColor((0.6 + f64::from(depth) * 0.382).fract(), 0.75, 0.42)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{index::IndexConfig, rivals::IndexKind};

    fn filled(kind: IndexKind) -> Box<dyn SpatialIndex> {
        let mut index = kind.create(&IndexConfig::default());
        for i in 0..4000u32 {
            let at = Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32) * 0.2 - Vec3::ONE;
            index.insert(PolygonId(i), &Aabb::cube(at, 0.02)).expect("finite boxes, each id once");
        }
        index.commit();
        index
    }

    #[test]
    fn children_lie_below_and_within_their_parents() {
        for &kind in IndexKind::ALL {
            let structure = Structure::of(&*filled(kind));
            for (i, node) in structure.nodes().iter().enumerate() {
                let Some(parent) = node.parent else { continue };
                let above = structure.nodes()[parent];
                assert!(parent < i && above.depth < node.depth, "{}: node {i}", kind.name());
                assert!(above.bounds.contains(&node.bounds), "{}: node {i}", kind.name());
            }
        }
    }

    #[test]
    fn whole_levels_are_left_out_and_counted() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian));
        let all = structure.nodes().len();
        assert!(all > 50, "{all}");
        for most in [0, 1, 2, 3, 10, 30, all, all + 1] {
            let upper = structure.collapsed(most);
            let kept = upper.nodes().len();
            assert!(kept <= most.max(1) && (most < all || kept == all), "{kept} of at most {most}");
            let left_out: usize = upper.nodes().iter().map(|node| node.left_out).sum();
            assert_eq!(kept + left_out, all);
            let whole = structure.nodes().iter().filter(|node| node.depth <= upper.depth()).count();
            assert_eq!(kept, whole, "levels are kept whole");
        }
        assert_eq!(Structure::default().collapsed(5).nodes().len(), 0);
    }

    #[test]
    fn dot_has_a_line_for_each_node_and_edge_and_quotes_its_name() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian)).collapsed(7);
        let dot = structure.to_dot("a \"name\"");
        assert!(dot.contains(r#"label="a \"name\"";"#), "{dot}");
        assert_eq!(dot.matches(" polygons").count(), 7);
        assert_eq!(dot.matches(" -> ").count(), 6);
        assert!(dot.contains("4,000 polygons") && dot.contains(r"\n+"), "{dot}");
    }
}
