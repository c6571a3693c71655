//! Pictures of occlusion culling by shadow volumes: the window with the planes, the shadows from one side, and the tree.

use std::{error::Error, io};

use glam::{DVec2, DVec3};
use plotters::prelude::*;

use super::{
    numbers::thousands,
    palette::{BLUE, INK, ORANGE},
    picture::{
        Area, Backend, ChartFormat, Drawn, LegendLine, Picture, Plan, Side, encode, fill, legend, middle,
        pixels, point, stroke, write_at,
    },
    printable::one_line,
    shadow_look::{ShadowLook, ShadowPanel},
};
use crate::{
    TreeLayout,
    oracle::Sight,
    shadows::{ShadowHolds, ShadowNode, occluder_name, occluder_names},
};
use osp::{
    math::{Aabb, clip_convex},
    occlusion::raster::Raster,
    polygon::PolygonId,
};
use osp_session::scene::Scene;

/// Width of a form's column, pixels.
const WIDTH: u32 = 960;
/// Heights of the three parts, pixels: first the title with the window, then the shadows and the tree, then the legend
/// below all columns.
const HEIGHTS: [u32; 3] = [572, 430, 128];
const PLAN_WIDTH: u32 = 430;
const MARGIN: f32 = 24.0;
const MOST_NUMBERS: usize = 60;
/// Least distance between two leaves of a tree for which its nodes have numbers, pixels.
const LEAST_STEP: f32 = 15.0;
/// Largest number of occluders for which a picture writes their names and shares.
const MOST_NAMES: usize = 24;

const VISIBLE: RGBColor = RGBColor(205, 205, 205);
const NOT_FOUND: RGBColor = RGBColor(120, 120, 120);
const WRONG: RGBColor = RGBColor(225, 0, 20);
const SHADOW: RGBColor = RGBColor(40, 60, 110);

/// A picture of a view's occluders and of the tree of each form, with a column for each form.
#[derive(Clone, Debug)]
pub struct ShadowPicture<'a> {
    pub title: String,
    pub look: &'a ShadowLook<'a>,
    /// The forms, from left to right.
    pub panels: Vec<ShadowPanel>,
    pub side: Side,
}

impl ShadowPicture<'_> {
    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (WIDTH * self.panels.len().max(1) as u32, HEIGHTS.iter().sum())
    }

    /// The bytes of the picture's file.
    ///
    /// # Errors
    /// The picture cannot be drawn.
    pub fn encode(&self, format: ChartFormat) -> io::Result<Vec<u8>> {
        encode(self, format, self.size())
    }

    /// The pixels of the picture: red, green and blue, row by row from the top.
    ///
    /// # Errors
    /// The picture cannot be drawn.
    pub fn rgb(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        pixels(self, self.size())
    }

    fn draw_panel<B: Backend>(&self, panel: &ShadowPanel, area: &Area<B>) -> Drawn {
        let counts = self.look.counts(panel);
        let (planes, all) = (panel.step.structure.planes, panel.step.planes_in_all);
        let title = format!(
            "{}: {} of {} planes, {} levels; hides {} of {} hidden polygons and {} visible ones",
            panel.step.form.name(),
            thousands(planes as u64),
            thousands(all as u64),
            panel.step.structure.levels(),
            thousands(counts.hidden_culled as u64),
            thousands(self.look.hidden() as u64),
            thousands(counts.visible_culled as u64),
        );
        let area = area.titled(&title, ("sans-serif", 20))?;
        let (above, below) = area.split_vertically(HEIGHTS[0] - 32);
        self.draw_window(panel, &above)?;
        let (plan, tree) = below.split_horizontally(PLAN_WIDTH);
        self.draw_plan(panel, &plan)?;
        draw_tree(panel, &tree)
    }

    /// The polygons in view with their colours, in drawing order, and whether the tree culls them. Culled polygons come
    /// last; the others are sorted by distance, the farthest first.
    fn in_order(&self, panel: &ShadowPanel) -> Vec<(PolygonId, RGBColor, bool)> {
        let in_view = self.look.in_view.iter().zip(&panel.culled);
        let mut order: Vec<(PolygonId, RGBColor, bool)> =
            in_view.map(|(&(id, sight), &culled)| (id, color_of(sight, culled), culled)).collect();
        let eye = self.look.view.window.eye_in_world().as_vec3();
        let away = |id: PolygonId| self.look.scene.bounds(id).center().distance_squared(eye);
        let rank = |color: RGBColor| [BLUE, WRONG].iter().position(|of| *of == color);
        order.sort_by(|a, b| rank(a.1).cmp(&rank(b.1)).then(away(b.0).total_cmp(&away(a.0))));
        order
    }

    /// Draws the eye's view through the window. A plane through the eye is a line in this view.
    fn draw_window<B: Backend>(&self, panel: &ShadowPanel, area: &Area<B>) -> Drawn {
        let (w, h) = area.dim_in_pixel();
        let window = WindowPixels::new(self.look, w, h);
        let order = self.in_order(panel);
        let found = order.iter().position(|of| of.2).unwrap_or(order.len());
        for &(id, color, _) in &order[..found] {
            let outline = window.polygon(self.look.scene, id);
            fill(area, &outline, color.to_rgba())?;
            stroke(area, &outline, WHITE.mix(0.8), 1)?;
        }
        let nodes = &panel.step.structure.nodes;
        for node in nodes {
            if matches!(&node.holds, ShadowHolds::Leaf { occluders } if !occluders.is_empty()) {
                fill(area, &window.directions(&node.cell), SHADOW.mix(0.3))?;
            }
        }
        for occluder in &self.look.view.occluders {
            stroke(area, &window.clipped(occluder.corners()), ORANGE.to_rgba(), 3)?;
        }
        for &(id, color, _) in &order[found..] {
            let outline = window.polygon(self.look.scene, id);
            fill(area, &outline, color.mix(0.75))?;
            stroke(area, &outline, color.to_rgba(), 1)?;
        }
        let planes = nodes.iter().filter_map(|node| match &node.holds {
            ShadowHolds::Plane { number, cut: Some(cut), .. } => Some((*number, *cut)),
            _ => None,
        });
        let latest = panel.step.structure.planes.checked_sub(1);
        for (number, cut) in planes.clone() {
            let is_latest = latest == Some(number) && panel.step.structure.planes < panel.step.planes_in_all;
            stroke(area, &window.directions(&cut), INK.to_rgba(), if is_latest { 4 } else { 1 })?;
        }
        if panel.step.structure.planes <= MOST_NUMBERS {
            for (number, cut) in planes {
                for at in window.directions(&[cut[0] + cut[1]]) {
                    let (least, most) = (DVec2::splat(11.0), DVec2::new(f64::from(w), f64::from(h)) - 11.0);
                    number_at(area, at.max(least).min(most), number)?;
                }
            }
        }
        if self.look.view.occluders.len() <= MOST_NAMES {
            for (i, occluder) in self.look.view.occluders.iter().enumerate() {
                let outline = window.clipped(occluder.corners());
                let Some(middle) = middle(&outline) else { continue };
                let text = format!("{} {:.1} %", occluder_name(i), 100.0 * self.look.view.share(occluder));
                let half = (text.len() as i32 * 5, 10);
                let (x, y) = point(&middle);
                let back = [(x - half.0, y - half.1), (x + half.0, y + half.1)];
                area.draw(&Rectangle::new(back, WHITE.mix(0.75).filled()))?;
                write_at(area, &text, middle, 19, &RGBColor(150, 80, 0))?;
            }
        }
        area.draw(&Rectangle::new([(0, 0), (w as i32 - 1, h as i32 - 1)], INK.mix(0.6)))?;
        Ok(())
    }

    /// Draws the shadows in parallel projection.
    fn draw_plan<B: Backend>(&self, panel: &ShadowPanel, area: &Area<B>) -> Drawn {
        let look = self.look;
        let eye = look.view.window.eye_in_world().as_vec3();
        let bounds =
            look.scene.visible_ids().fold(Aabb::new(eye, eye), |all, id| all.union(&look.scene.bounds(id)));
        let plan = Plan::new(self.side, &bounds, area.dim_in_pixel(), f64::from(MARGIN));
        let outline =
            |id| -> Vec<DVec2> { look.scene.polygon(id).vertices().iter().map(|&p| plan.pixel(p)).collect() };
        for id in look.scene.visible_ids() {
            fill(area, &outline(id), VISIBLE.mix(0.35))?;
        }
        // More shadows are more transparent, so that the polygons stay visible.
        let opacity = (1.6 / look.view.occluders.len().max(1) as f64).min(0.13);
        // The shadows extend beyond the picture.
        let reach_m = f64::from(bounds.extent().length());
        let far =
            |direction: DVec3| plan.pixel(eye + (direction.normalize_or_zero() * reach_m * 2.0).as_vec3());
        for occluder in &look.view.occluders {
            let corners = occluder.corners();
            let at = |v: &DVec3| plan.pixel(eye + v.as_vec3());
            let shadow = corners.iter().map(at).chain(corners.iter().map(|v| far(*v)));
            fill(area, &plan.clipped(&hull(shadow.collect())), ORANGE.mix(opacity))?;
        }
        for (id, color, culled) in self.in_order(panel) {
            // A polygon seen edge-on is drawn as a line.
            let outline = outline(id);
            fill(area, &outline, color.mix(0.8))?;
            stroke(area, &outline, color.mix(0.8), if culled { 2 } else { 1 })?;
        }
        for (i, occluder) in look.view.occluders.iter().enumerate() {
            let outline: Vec<DVec2> =
                occluder.corners().iter().map(|v| plan.pixel(eye + v.as_vec3())).collect();
            stroke(area, &outline, ORANGE.to_rgba(), 3)?;
            if look.view.occluders.len() <= MOST_NAMES
                && let Some(middle) = middle(&outline)
            {
                write_at(area, &occluder_name(i), middle, 17, &RGBColor(150, 80, 0))?;
            }
        }
        let at = plan.pixel(eye);
        for corner in look.view.window.corners() {
            stroke(area, &plan.clipped_line(at, far(*corner)), INK.mix(0.4), 1)?;
        }
        let at = point(&at);
        area.draw(&Circle::new(at, 5, INK.filled()))?;
        area.draw(&Text::new("eye", (at.0 + 8, at.1 - 8), ("sans-serif", 15)))?;
        let name = match self.side {
            Side::Top => "shadows from above",
            Side::Front => "shadows from the front",
            Side::Right => "shadows from the right",
        };
        area.draw(&Text::new(name, (6, 6), ("sans-serif", 16)))?;
        Ok(())
    }

    fn legend_lines(&self) -> Vec<LegendLine> {
        let line = |color: RGBColor, text: &str| (Some(color.to_rgba()), text.to_owned());
        vec![
            (None, one_line(&self.title).into_owned()),
            line(ORANGE, "occluder, the share of the window that it fills (its score), and its shadow"),
            (
                Some(SHADOW.mix(0.6)),
                "cells that the tree puts in a shadow; numbered lines: its planes, all through the eye"
                    .to_owned(),
            ),
            line(BLUE, "polygon that the tree hides"),
            line(WRONG, "polygon that the tree hides although the eye sees it"),
            line(NOT_FOUND, "hidden polygon that the tree does not find; light grey: visible"),
        ]
    }
}

fn draw_tree<B: Backend>(panel: &ShadowPanel, area: &Area<B>) -> Drawn {
    let nodes = &panel.step.structure.nodes;
    let layout = TreeLayout::new(
        nodes.iter().map(|node| (node.parent.map(|of| of.0), node.depth)),
        area.dim_in_pixel(),
        MARGIN,
    );
    for (i, node) in nodes.iter().enumerate() {
        if let Some((parent, _)) = node.parent {
            area.draw(&PathElement::new([layout.pixel(parent), layout.pixel(i)], NOT_FOUND.stroke_width(1)))?;
        }
    }
    let has_numbers = panel.step.structure.planes <= MOST_NUMBERS && layout.step_x() >= LEAST_STEP;
    let radius = (layout.step_x() * 0.45).clamp(2.0, if has_numbers { 11.0 } else { 6.0 }) as i32;
    for (i, node) in nodes.iter().enumerate() {
        draw_node(area, node, layout.pixel(i), radius, has_numbers)?;
    }
    area.draw(&Text::new("the tree: to the left what is in front of a plane", (6, 6), ("sans-serif", 16)))?;
    Ok(())
}

fn draw_node<B: Backend>(
    area: &Area<B>,
    node: &ShadowNode,
    (x, y): (i32, i32),
    radius: i32,
    has_numbers: bool,
) -> Drawn {
    let place = DVec2::new(f64::from(x), f64::from(y));
    match &node.holds {
        ShadowHolds::Plane { number, occluder, .. } => {
            area.draw(&Circle::new((x, y), radius, ORANGE.mix(0.85).filled()))?;
            if has_numbers {
                write_at(area, &(number + 1).to_string(), place, 14, &INK)?;
                if let Some(of) = occluder {
                    area.draw(&Text::new(occluder_name(*of), (x + radius + 2, y - 7), ("sans-serif", 14)))?;
                }
            }
        }
        ShadowHolds::Leaf { occluders } => {
            let half = (radius * 2 / 3).max(2);
            let square = [(x - half, y - half), (x + half, y + half)];
            if occluders.is_empty() {
                area.draw(&Rectangle::new(square, INK.mix(0.5)))?;
            } else {
                area.draw(&Rectangle::new(square, SHADOW.filled()))?;
                if has_numbers {
                    let below = place + DVec2::new(0.0, f64::from(half) + 9.0);
                    write_at(area, &occluder_names(occluders), below, 13, &SHADOW)?;
                }
            }
        }
    }
    Ok(())
}

impl Picture for ShadowPicture<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        area.fill(&WHITE)?;
        let (columns, below) = area.split_vertically(HEIGHTS[0] + HEIGHTS[1]);
        let areas = columns.split_evenly((1, self.panels.len().max(1)));
        for (panel, area) in self.panels.iter().zip(&areas) {
            self.draw_panel(panel, &area.margin(0, 0, 4, 4))?;
        }
        legend(&self.legend_lines(), &below)?;
        area.present()?;
        Ok(())
    }
}

fn color_of(sight: Sight, culled: bool) -> RGBColor {
    match (sight, culled) {
        (Sight::Visible, true) => WRONG,
        (_, true) => BLUE,
        (Sight::Hidden, false) => NOT_FOUND,
        (Sight::Visible | Sight::Outside, false) => VISIBLE,
    }
}

/// The transform from the space of the eye to pixels of a picture of the window.
struct WindowPixels<'a> {
    look: &'a ShadowLook<'a>,
    raster: Raster,
    height: f64,
}

impl<'a> WindowPixels<'a> {
    fn new(look: &'a ShadowLook<'a>, width: u32, height: u32) -> Self {
        let height = f64::from(height);
        Self { look, raster: Raster::new(&look.view.window, f64::from(width), height), height }
    }

    fn directions(&self, directions: &[DVec3]) -> Vec<DVec2> {
        directions
            .iter()
            .map(|v| self.raster.project(*v))
            .map(|p| DVec2::new(p.x, self.height - p.y))
            .collect()
    }

    /// The part of an outline in the window and beyond the near plane.
    fn clipped(&self, outline: &[DVec3]) -> Vec<DVec2> {
        let window = &self.look.view.window;
        let corners = window.corners();
        let sides = (0..4).map(|i| (corners[i].cross(corners[(i + 1) % 4]), 0.0));
        let mut kept = outline.to_vec();
        for (normal, distance) in sides.chain([(window.forward(), window.near_m())]) {
            if kept.len() < 3 {
                return Vec::new();
            }
            let mut part = Vec::new();
            clip_convex(&kept, |p: DVec3| normal.dot(p) - distance, |p| part.push(p));
            kept = part;
        }
        self.directions(&kept)
    }

    fn polygon(&self, scene: &Scene, id: PolygonId) -> Vec<DVec2> {
        let outline: Vec<DVec3> =
            scene.polygon(id).vertices().iter().map(|&p| self.look.view.window.from_eye(p)).collect();
        self.clipped(&outline)
    }
}

impl Plan {
    /// The part of a convex outline inside the picture.
    fn clipped(&self, outline: &[DVec2]) -> Vec<DVec2> {
        let mut kept = outline.to_vec();
        let sides = [(DVec2::X, 0.0), (-DVec2::X, -self.size.x), (DVec2::Y, 0.0), (-DVec2::Y, -self.size.y)];
        for (normal, distance) in sides {
            if kept.len() < 3 {
                return Vec::new();
            }
            let mut part = Vec::new();
            clip_convex(&kept, |p: DVec2| normal.dot(p) - distance, |p| part.push(p));
            kept = part;
        }
        kept
    }

    fn clipped_line(&self, from: DVec2, to: DVec2) -> Vec<DVec2> {
        let along = to - from;
        let until = |from: f64, along: f64, size: f64| match along {
            along if along > 0.0 => (size - from) / along,
            along if along < 0.0 => -from / along,
            _ => 1.0,
        };
        let part =
            until(from.x, along.x, self.size.x).min(until(from.y, along.y, self.size.y)).clamp(0.0, 1.0);
        vec![from, from + along * part]
    }
}

/// The convex hull of points, by Andrew's monotone chain. O(n log n).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut around = half(&mut points.iter());
    around.extend(half(&mut points.iter().rev()));
    around
}

/// Writes a plane's number so that it is legible on a line.
fn number_at<B: Backend>(area: &Area<B>, at: DVec2, number: usize) -> Drawn {
    area.draw(&Circle::new(point(&at), 9, WHITE.filled()))?;
    area.draw(&Circle::new(point(&at), 9, INK.mix(0.6)))?;
    write_at(area, &(number + 1).to_string(), at, 13, &INK)
}
