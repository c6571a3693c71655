//! Pictures of indexes: cells in orthographic projection over the polygons, and trees.

use std::{fmt::Write, io};

use glam::Vec3;
use plotters::prelude::*;

use super::{
    numbers::thousands,
    picture::{Area, Backend, ChartFormat, Drawn, LegendLine, Picture, Plan, Side, encode, legend, point},
    printable::one_line,
    structure::{MOST_TREE_NODES, SplitOutline, Structure, StructureNode, coordinates},
};
use crate::TreeLayout;
use osp::math::{Aabb, Ray};
use osp_session::scene::Scene;

const SIZE: (u32, u32) = (1280, 960);
const MARGIN: f64 = 40.0;
const MOST_CELLS: usize = 20_000;
/// Largest number of leaves up to which the nodes of a tree have labels.
const MOST_LABELS: usize = 24;
/// Smallest distance between leaves for labels with centre, width and box, pixels.
const ROOM_FOR_PLACES: f32 = 150.0;
/// Width of such a label, pixels.
const PLACE_WIDTH: i32 = 128;
const MOST_LEGEND: usize = 14;

/// The two kinds of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StructureView {
    /// Cells over the polygons, in orthographic projection.
    Space(Side),
    /// The tree, with the root at the top.
    Tree,
}

/// Meaning of the colours in a picture of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellColors {
    #[default]
    Level,
    /// Polygons have the colour of the deepest node that contains them.
    Leaf,
}

#[derive(Clone, Debug)]
pub struct StructurePanel {
    pub title: String,
    /// The nodes.
    pub structure: Structure,
    pub levels: Option<u32>,
    /// Split planes of the nodes, which are drawn instead of the cells if there are any.
    pub splits: Vec<SplitOutline>,
}

/// A picture of one index, or of several side by side.
#[derive(Clone, Copy, Debug)]
pub struct StructurePicture<'a> {
    /// The indexes, from left to right.
    pub panels: &'a [StructurePanel],
    pub view: StructureView,
    pub scene: &'a Scene,
    /// Meaning of the colours.
    pub colors: CellColors,
    /// A ray, and the distance of its first hit. The nodes that the ray enters are highlighted.
    pub ray: Option<(Ray, Option<f32>)>,
    pub named: bool,
}

impl StructurePicture<'_> {
    /// The bytes of the picture's file.
    ///
    /// # Errors
    /// The picture cannot be drawn.
    pub fn encode(&self, format: ChartFormat) -> io::Result<Vec<u8>> {
        encode(self, format, (SIZE.0 * self.panels.len().max(1) as u32, SIZE.1))
    }

    fn draw_panel<B: Backend>(&self, panel: &StructurePanel, area: &Area<B>) -> Drawn {
        let structure = &panel.structure;
        let most = match self.view {
            StructureView::Space(_) => MOST_CELLS,
            StructureView::Tree => MOST_TREE_NODES,
        };
        let shown = match panel.levels {
            Some(levels) => structure.upper(levels).collapsed(most),
            None => structure.collapsed(most),
        };
        let mut title = format!(
            "{}: {} nodes, {} levels",
            one_line(&panel.title),
            thousands(structure.nodes.len() as u64),
            if structure.nodes.is_empty() { 0 } else { structure.depth() + 1 }
        );
        if shown.nodes.len() < structure.nodes.len() {
            let _ = write!(title, "; the upper {} are shown", shown.depth() + 1);
        }
        if let Some((ray, hit)) = &self.ray {
            let entered = structure.nodes.iter().filter(|node| enters(ray, node)).count();
            let _ = write!(title, "; the ray enters {}", thousands(entered as u64));
            match hit {
                Some(t) => write!(title, ", meets a polygon at {t:.2} m")?,
                None => title.push_str(", meets nothing"),
            }
        }
        let area = area.titled(&title, ("sans-serif", 22))?;
        match self.view {
            StructureView::Space(side) => {
                self.draw_cells(&shown, &panel.splits, side, &area)?;
                legend(&legend_lines(&shown, &panel.splits, self.colors), &area)?;
            }
            StructureView::Tree => {
                self.draw_tree(&shown, &area)?;
                if shown.nodes.iter().any(|node| node.fields.is_some()) {
                    legend(&field_lines(&shown), &area)?;
                }
            }
        }
        Ok(())
    }

    fn draw_cells<B: Backend>(
        &self,
        shown: &Structure,
        splits: &[SplitOutline],
        side: Side,
        area: &Area<B>,
    ) -> Drawn {
        let all = shown.nodes.iter().fold(Aabb::EMPTY, |all, node| all.union(&node.bounds));
        if all.is_empty() {
            return Ok(());
        }
        let plan = Plan::new(side, &all, area.dim_in_pixel(), MARGIN);
        let pixel = |p: Vec3| point(&plan.pixel(p));
        let outline_of = |id| -> Vec<(i32, i32)> {
            self.scene.polygon(id).vertices().iter().map(|&corner| pixel(corner)).collect()
        };
        match self.colors {
            CellColors::Level => {
                for id in self.scene.visible_ids() {
                    area.draw(&Polygon::new(outline_of(id), RGBColor(190, 190, 190).mix(0.6)))?;
                }
            }
            CellColors::Leaf => {
                for &(id, node) in &shown.members {
                    area.draw(&Polygon::new(outline_of(id), color_of_leaf(node).mix(0.8)))?;
                }
            }
        }
        if splits.is_empty() {
            // The deepest cells are drawn first, so that the few upper ones stay visible.
            let mut order: Vec<&StructureNode> = shown.nodes.iter().collect();
            order.sort_by_key(|node| std::cmp::Reverse(node.depth));
            for node in order.into_iter().filter(|node| node.polygons > 0) {
                let (a, b) = (pixel(node.bounds.min), pixel(node.bounds.max));
                let (opacity, width) = match &self.ray {
                    Some((ray, _)) if enters(ray, node) => (1.0, 2),
                    Some(_) => (0.12, 1),
                    None if self.colors == CellColors::Leaf => (0.25, 1),
                    None => (0.8, 1),
                };
                let style = color_of_depth(node.depth).mix(opacity).stroke_width(width);
                // A path, not a rectangle, because rectangles in an SVG always have thin lines.
                area.draw(&PathElement::new([a, (b.0, a.1), b, (a.0, b.1), a], style))?;
            }
        }
        for split in splits.iter().rev() {
            let mut outline: Vec<(i32, i32)> = split.corners.iter().map(|&p| pixel(p)).collect();
            outline.extend(outline.first().copied());
            let style =
                color_of_depth(split.depth).mix(0.8).stroke_width(if split.depth < 3 { 2 } else { 1 });
            area.draw(&PathElement::new(outline, style))?;
        }
        if self.named {
            for id in self.scene.visible_ids() {
                let (x, y) = pixel(self.scene.bounds(id).center());
                area.draw(&Text::new(id.0.to_string(), (x - 5, y - 8), ("sans-serif", 16)))?;
            }
        }
        if let Some((ray, hit)) = &self.ray {
            let end_m = hit.unwrap_or_else(|| {
                (all.extent().length() + all.distance_squared(ray.origin).sqrt()) / ray.direction.length()
            });
            let end = ray.origin + ray.direction * end_m;
            area.draw(&PathElement::new([pixel(ray.origin), pixel(end)], BLACK.stroke_width(3)))?;
            area.draw(&Circle::new(pixel(ray.origin), 5, BLACK.filled()))?;
            if hit.is_some() {
                area.draw(&Circle::new(pixel(end), 6, RED.filled()))?;
            }
        }
        Ok(())
    }

    fn draw_tree<B: Backend>(&self, shown: &Structure, area: &Area<B>) -> Drawn {
        let nodes = &shown.nodes;
        let layout = TreeLayout::new(
            nodes.iter().map(|node| (node.parent, node.depth)),
            area.dim_in_pixel(),
            MARGIN as f32,
        );
        let pixel = |node| layout.pixel(node);
        let is_on_the_way = |node| self.ray.as_ref().is_none_or(|(ray, _)| enters(ray, node));
        for (i, node) in nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                let style = match self.ray.is_some() && is_on_the_way(node) {
                    true => BLACK.stroke_width(2),
                    false => RGBColor(170, 170, 170).stroke_width(1),
                };
                area.draw(&PathElement::new([pixel(parent), pixel(i)], style))?;
            }
        }
        let names = if self.named { shown.names() } else { Vec::new() };
        let most = nodes.iter().map(|node| node.polygons).max().unwrap_or(1).max(2);
        for (i, node) in nodes.iter().enumerate() {
            // The radius grows with the logarithm of the number of polygons, up to a part of the distance between
            // leaves.
            let share = (node.polygons.max(1) as f32).ln() / (most as f32).ln();
            let radius = (2.0 + 8.0 * share).min(layout.step_x().max(3.0) * 0.45) as i32;
            let (x, y) = pixel(i);
            let opacity = if is_on_the_way(node) { 1.0 } else { 0.25 };
            let style = color_of_depth(node.depth).mix(opacity);
            // Only a tree whose nodes exist before its polygons has empty nodes.
            let style = if node.polygons == 0 { style.stroke_width(1) } else { style.filled() };
            area.draw(&Circle::new((x, y), radius, style))?;
            if layout.places <= MOST_LABELS {
                let (mut left, mut top) = (x + radius + 3, y - 6);
                let mut lines = vec![thousands(node.polygons as u64)];
                if node.left_out > 0 {
                    let _ = write!(lines[0], " (+{})", thousands(node.left_out as u64));
                }
                lines.extend(node.fields.map(|fields| fields.label()));
                if let Some(fields) = node.fields.filter(|_| layout.step_x() >= ROOM_FOR_PLACES) {
                    let Aabb { min, max } = node.bounds;
                    lines.extend(fields.place());
                    lines.extend([format!("box {}", coordinates(min)), format!("to {}", coordinates(max))]);
                    // The label stays in the picture, and above its legend.
                    left = left.min(area.dim_in_pixel().0 as i32 - PLACE_WIDTH);
                    top -= 28;
                }
                lines.extend(names.get(i).filter(|name| !name.is_empty()).map(|name| format!("#{name}")));
                for (line, text) in lines.into_iter().enumerate() {
                    let at = (left, top + 14 * line as i32);
                    area.draw(&Text::new(text, at, ("sans-serif", 13)))?;
                }
            }
        }
        Ok(())
    }
}

impl Picture for StructurePicture<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        area.fill(&WHITE)?;
        let areas = area.split_evenly((1, self.panels.len().max(1)));
        for (panel, area) in self.panels.iter().zip(&areas) {
            self.draw_panel(panel, area)?;
        }
        area.present()?;
        Ok(())
    }
}

fn enters(ray: &Ray, node: &StructureNode) -> bool {
    ray.enter_box(&node.bounds, f32::INFINITY).is_some()
}

fn legend_lines(shown: &Structure, splits: &[SplitOutline], colors: CellColors) -> Vec<LegendLine> {
    let plural =
        |n: usize, one: &str| format!("{} {one}{}", thousands(n as u64), if n == 1 { "" } else { "s" });
    let mut lines = Vec::new();
    if colors == CellColors::Leaf {
        let mut held = std::collections::BTreeMap::<usize, usize>::new();
        shown.members.iter().for_each(|&(_, node)| *held.entry(node).or_default() += 1);
        let mut counts: Vec<usize> = held.values().copied().collect();
        counts.sort_unstable();
        lines.push((
            None,
            format!("a colour for each of {} that {}", plural(counts.len(), "node"), "hold polygons"),
        ));
        if let (Some(least), Some(most)) = (counts.first(), counts.last()) {
            let middle = counts[counts.len() / 2];
            lines.push((None, format!("polygons in one: {least} to {most}, median {middle}")));
        }
        return lines;
    }
    let (what, depths): (_, Vec<u32>) = match splits.is_empty() {
        true => ("node", shown.nodes.iter().map(|node| node.depth).collect()),
        false => ("plane", splits.iter().map(|split| split.depth).collect()),
    };
    let deepest = depths.iter().copied().max().unwrap_or(0);
    for depth in (0..=deepest).take(MOST_LEGEND) {
        let count = depths.iter().filter(|&&d| d == depth).count();
        lines
            .push((Some(color_of_depth(depth).to_rgba()), format!("level {depth}: {}", plural(count, what))));
    }
    if deepest as usize >= MOST_LEGEND {
        lines.push((None, format!("and levels {MOST_LEGEND} to {deepest}")));
    }
    lines
}

/// Legend of the picture of a tree with preallocated nodes.
fn field_lines(shown: &Structure) -> Vec<LegendLine> {
    let empty = shown.nodes.iter().filter(|node| node.polygons == 0).count();
    let (shown, empty) = (thousands(shown.nodes.len() as u64), thousands(empty as u64));
    let lines = [
        format!("{empty} of the {shown} nodes shown are empty: hollow circles"),
        "x, y, z: the plane that halves a node; to the left what is behind it".to_owned(),
        "L: IsLeaf, P: IsPolygon (cut polygons stay here), S: IsSubnode (polygons below)".to_owned(),
        "numbers: polygons here and below, (+) nodes below, # own polygons".to_owned(),
    ];
    lines.into_iter().map(|text| (None, text)).collect()
}

fn color_of_depth(depth: u32) -> HSLColor {
    // Neighbouring levels have hues far apart on the colour wheel.
    HSLColor((0.6 + f64::from(depth) * 0.382).fract(), 0.75, 0.42)
}

fn color_of_leaf(node: usize) -> HSLColor {
    let lightness = [0.35, 0.5, 0.62][node % 3];
    HSLColor((node as f64 * 0.618_034).fract(), 0.7, lightness)
}
