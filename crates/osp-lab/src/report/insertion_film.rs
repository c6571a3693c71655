//! A film that compares insertion into the paper's two trees. Polygons descend through the OSP tree one by one. The
//! octree is filled again for each polygon.

use std::{error::Error, io};

use glam::{DVec2, Vec3};
use plotters::prelude::*;

use super::{
    numbers::thousands,
    palette::{BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION},
    picture::{Area, Backend, Drawn, Picture, fill, middle, pixels, point, stroke, write_at},
    printable::one_line,
    structure::{Structure, plane_corners},
};
use crate::TreeLayout;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex},
    math::Aabb,
    polygon::PolygonId,
};
use osp_rivals::{OctreePaper, OctreePaperConfig, OspGrid, OspNode, OspPaper};
use osp_session::scene::Scene;

const SIZE: (u32, u32) = (960, 640);
/// Height of the upper half of the film, pixels.
const UPPER: u32 = 410;
const MARGIN: f64 = 34.0;
/// Duration of a picture, hundredths of a second.
const STEP: u16 = 45;
/// Duration of the last picture of each polygon, hundredths of a second.
const REST: u16 = 130;
/// Direction from the cube to the viewer.
const FROM: Vec3 = Vec3::new(0.5, 0.42, 1.0);
const PALE: RGBColor = RGBColor(200, 200, 200);
/// Colours of planes across x, y and z.
const OF_AXIS: [RGBColor; 3] = [ORANGE, GREEN, PURPLE];

/// The first polygons of a model, which are inserted into the two trees one after the other.
#[derive(Clone, Debug)]
pub struct InsertionFilm<'a> {
    pub title: String,
    pub scene: &'a Scene,
    /// The ids of the polygons that are inserted, in order.
    pub polygons: Vec<PolygonId>,
    /// The cube of the paper's tree, metres.
    pub root: Aabb,
    /// Number of levels of planes of that tree.
    pub levels: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InsertionWork {
    /// Number of planes that the paper's OSP tree tests.
    pub osp_planes: u64,
    /// Number of planes that the octree tests.
    pub octree_planes: u64,
    /// Number of polygons that the octree inserts again, including the new one.
    pub octree_inserted: u64,
}

struct Trees {
    paper: OspPaper,
    octree: OctreePaper,
}

impl Trees {
    fn new(film: &InsertionFilm<'_>) -> Self {
        let config = IndexConfig { root: film.root, capacity: film.polygons.len() };
        let size_m = film.root.extent().max_element();
        let grid = OspGrid::new(film.root.center(), size_m, film.levels);
        let octree = OctreePaperConfig { leaf_capacity: 1, max_depth: film.levels.div_ceil(3) };
        Self { paper: OspPaper::new(grid, config.capacity), octree: OctreePaper::new(octree, &config) }
    }

    fn insert(&mut self, scene: &Scene, id: PolygonId) -> Result<InsertionWork, IndexError> {
        let before = (self.paper.insertions(), self.octree.insertions());
        self.paper.insert(id, &scene.bounds(id))?;
        self.octree.insert(id, &scene.bounds(id))?;
        self.octree.commit();
        Ok(InsertionWork {
            osp_planes: self.paper.insertions().planes - before.0.planes,
            octree_planes: self.octree.insertions().planes - before.1.planes,
            octree_inserted: self.octree.insertions().polygons - before.1.polygons,
        })
    }

    /// The numbers of the nodes through which a polygon descends, from the root. Empty if the polygon lies outside the
    /// cube.
    fn path(&self, id: PolygonId) -> Vec<usize> {
        let Some(place) = self.paper.place_of(id) else { return Vec::new() };
        (0..=place.depth)
            .map(|depth| (1 << depth) - 1 + (place.path >> (place.depth - depth)) as usize)
            .collect()
    }
}

impl InsertionFilm<'_> {
    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        SIZE
    }

    /// Returns the work of each insertion, in order.
    ///
    /// # Errors
    /// The trees refuse a polygon that is not finite.
    pub fn work(&self) -> Result<Vec<InsertionWork>, IndexError> {
        let mut trees = Trees::new(self);
        self.polygons.iter().map(|&id| trees.insert(self.scene, id)).collect()
    }

    /// Calls `take` for each picture. It gets the red, green and blue bytes, row by row from the top, and the time to
    /// show the picture, hundredths of a second.
    ///
    /// # Errors
    /// A polygon is refused, a picture is not drawn, or `take` fails.
    pub fn draw(&self, mut take: impl FnMut(&[u8], u16) -> io::Result<()>) -> Result<(), Box<dyn Error>> {
        let work = self.work()?;
        let mut trees = Trees::new(self);
        for (nth, &id) in self.polygons.iter().enumerate() {
            trees.insert(self.scene, id)?;
            let path = trees.path(id);
            let cells = Structure::of(&trees.octree);
            for step in 0..path.len().max(1) {
                let picture =
                    Step { film: self, trees: &trees, cells: &cells, work: &work, nth, path: &path, step };
                let is_last = step + 1 >= path.len();
                take(&pixels(&picture, SIZE)?, if is_last { REST } else { STEP })?;
            }
        }
        Ok(())
    }
}

/// A picture of the film: polygon number `nth` at node number `step` of its path.
struct Step<'a> {
    film: &'a InsertionFilm<'a>,
    trees: &'a Trees,
    cells: &'a Structure,
    work: &'a [InsertionWork],
    nth: usize,
    path: &'a [usize],
    step: usize,
}

impl Step<'_> {
    fn node(&self) -> Option<&OspNode> {
        self.trees.paper.node(*self.path.get(self.step)?)
    }

    /// Describes the result of the test at the node in words.
    fn event(&self) -> String {
        let Some(node) = self.node() else {
            return "it lies outside the cube: a list beside the tree".to_owned();
        };
        if node.is_leaf {
            return "no plane is left: it stays in this leaf".to_owned();
        }
        let plane = format!("{} = {:.1}", ["x", "y", "z"][node.axis], node.plane_m());
        match self.path.get(self.step + 1) {
            Some(child) if child % 2 == 0 => format!("{plane}: it is in front, and descends"),
            Some(_) => format!("{plane}: it is behind, and descends"),
            None => format!("{plane} cuts it: it stays here"),
        }
    }

    /// Draws a polygon with its number.
    fn polygon<B: Backend>(&self, area: &Area<B>, cube: &Cube, nth: usize, color: RGBColor) -> Drawn {
        let polygon = self.film.scene.polygon(self.film.polygons[nth]);
        let outline: Vec<DVec2> = polygon.vertices().iter().map(|&p| cube.pixel(p)).collect();
        fill(area, &outline, color.mix(0.75))?;
        stroke(area, &outline, color.to_rgba(), 2)?;
        match middle(&outline) {
            Some(middle) => write_at(area, &(nth + 1).to_string(), middle, 15, &INK),
            None => Ok(()),
        }
    }

    fn draw_osp<B: Backend>(&self, area: &Area<B>) -> Drawn {
        let cube = Cube::new(&self.film.root, area.dim_in_pixel());
        area.draw(&Text::new(
            "OSP tree: its planes exist before the polygons",
            (14, 10),
            ("sans-serif", 20),
        ))?;
        cube.edges(area, &self.film.root, PALE.to_rgba(), 1)?;
        for nth in 0..self.nth {
            self.polygon(area, &cube, nth, SKY)?;
        }
        if let Some(node) = self.node() {
            if !node.is_leaf {
                let color = OF_AXIS[node.axis];
                let outline: Vec<DVec2> =
                    plane_corners(&node.bounds(), node.axis, node.plane_m()).map(|p| cube.pixel(p)).to_vec();
                fill(area, &outline, color.mix(0.3))?;
                stroke(area, &outline, color.to_rgba(), 2)?;
            }
            cube.edges(area, &node.bounds(), INK.to_rgba(), 2)?;
        }
        self.polygon(area, &cube, self.nth, VERMILION)?;
        let bottom = area.dim_in_pixel().1 as i32;
        let level = format!("polygon {}, level {}: {}", self.nth + 1, self.step, self.event());
        area.draw(&Text::new(level, (14, bottom - 44), ("sans-serif", 17)))?;
        let planes: u64 = self.work[..self.nth].iter().map(|work| work.osp_planes).sum();
        let now = self.work[self.nth].osp_planes.min(self.step as u64 + 1);
        let sum = format!("planes tested: {now}, {} in all; polygons moved: 0", thousands(planes + now));
        area.draw(&Text::new(sum, (14, bottom - 22), ("sans-serif", 17)))?;
        Ok(())
    }

    fn draw_octree<B: Backend>(&self, area: &Area<B>) -> Drawn {
        let cube = Cube::new(&self.film.root, area.dim_in_pixel());
        area.draw(&Text::new("octree: filled again for each polygon", (14, 10), ("sans-serif", 20)))?;
        cube.edges(area, &self.film.root, PALE.to_rgba(), 1)?;
        for cell in &self.cells.nodes {
            cube.edges(area, &cell.bounds, INK.mix(0.35), 1)?;
        }
        let work = self.work[self.nth];
        // The rebuild continues while the polygon on the left descends.
        let inserted = work.octree_inserted as usize * (self.step + 1) / self.path.len().max(1);
        for nth in 0..=self.nth {
            self.polygon(area, &cube, nth, if nth < inserted { VERMILION } else { SKY })?;
        }
        let bottom = area.dim_in_pixel().1 as i32;
        let (before, now) = (&self.work[..self.nth], self.nth + 1);
        let line = format!(
            "polygon {now} comes: {inserted} of {} polygons are inserted again",
            work.octree_inserted
        );
        area.draw(&Text::new(line, (14, bottom - 44), ("sans-serif", 17)))?;
        let moved: u64 = before.iter().map(|work| work.octree_inserted - 1).sum();
        let moved = moved + (inserted as u64).min(work.octree_inserted - 1);
        let planes: u64 = before.iter().map(|work| work.octree_planes).sum();
        let is_last = self.step + 1 >= self.path.len();
        let planes = planes + if is_last { work.octree_planes } else { 0 };
        let sum =
            format!("planes tested: {} in all; polygons moved: {}", thousands(planes), thousands(moved));
        area.draw(&Text::new(sum, (14, bottom - 22), ("sans-serif", 17)))?;
        Ok(())
    }

    /// Draws all nodes of the paper's tree, and the path of the polygon.
    fn draw_tree<B: Backend>(&self, area: &Area<B>) -> Drawn {
        let paper = &self.trees.paper;
        let tree = Structure::with_empty_nodes(paper);
        let nodes = &tree.nodes;
        let inside = nodes.iter().take_while(|node| node.fields.is_some()).count();
        let levels = nodes[..inside].iter().map(|node| (node.parent, node.depth));
        let layout = TreeLayout::new(levels, area.dim_in_pixel(), 26.0);
        // Converts the structure's indices, which are depth first, to the node numbers of the path.
        let mut numbers = vec![0; inside];
        for at in 1..inside {
            let parent = nodes[at].parent.unwrap_or(0);
            numbers[at] = 2 * numbers[parent] + if at == parent + 1 { 1 } else { 2 };
        }
        let way = &self.path[..self.path.len().min(self.step + 1)];
        for at in 1..inside {
            let parent = nodes[at].parent.unwrap_or(0);
            let is_way = way.contains(&numbers[at]);
            let (color, width) = if is_way { (VERMILION, 3) } else { (PALE, 1) };
            let line = [layout.pixel(parent), layout.pixel(at)];
            area.draw(&PathElement::new(line, color.stroke_width(width)))?;
        }
        let radius = (layout.step_x() * 0.4).clamp(2.0, 5.0) as i32;
        let last = way.last().copied();
        for (at, &number) in numbers.iter().enumerate() {
            let place = layout.pixel(at);
            // The descending polygon is not in its node yet.
            let own = paper.node(number).map_or(0, |node| node.tri_names.len());
            let is_end = self.path.last() == Some(&number) && self.step + 1 < self.path.len();
            let own = own - usize::from(is_end && own > 0);
            area.draw(&Circle::new(place, radius, WHITE.filled()))?;
            match (last == Some(number), own > 0) {
                (true, _) => area.draw(&Circle::new(place, radius + 2, VERMILION.filled()))?,
                (false, true) => area.draw(&Circle::new(place, radius, BLUE.filled()))?,
                (false, false) => area.draw(&Circle::new(place, radius, PALE.stroke_width(1)))?,
            }
        }
        let line = format!("all {} nodes exist; blue: nodes with polygons", thousands(inside as u64));
        area.draw(&Text::new(line, (14, 4), ("sans-serif", 16)))?;
        Ok(())
    }

    /// Draws a bar for each polygon so far: the number of planes tested.
    fn draw_bars<B: Backend>(&self, area: &Area<B>) -> Drawn {
        let (w, h) = area.dim_in_pixel();
        let most =
            self.work.iter().map(|work| work.osp_planes.max(work.octree_planes)).max().unwrap_or(1).max(1);
        let (bottom, high) = (h as i32 - 26, f64::from(h) - 62.0);
        let slot = (f64::from(w) - 40.0) / self.work.len().max(1) as f64;
        let is_last = self.step + 1 >= self.path.len();
        for (nth, work) in self.work.iter().enumerate().take(self.nth + usize::from(is_last)) {
            let left = 20.0 + slot * nth as f64;
            for (part, (planes, color)) in
                [(work.osp_planes, BLUE), (work.octree_planes, ORANGE)].into_iter().enumerate()
            {
                let x = left + slot * (0.12 + 0.38 * part as f64);
                let top = f64::from(bottom) - high * planes as f64 / most as f64;
                let bar =
                    [point(&DVec2::new(x, top)), point(&DVec2::new(x + slot * 0.36, f64::from(bottom)))];
                area.draw(&Rectangle::new(bar, color.filled()))?;
                let above = DVec2::new(x + slot * 0.18, top - 9.0);
                write_at(area, &thousands(planes), above, 13, &INK)?;
            }
            let below = DVec2::new(left + slot * 0.5, f64::from(bottom) + 11.0);
            write_at(area, &(nth + 1).to_string(), below, 14, &INK)?;
        }
        area.draw(&PathElement::new([(14, bottom), (w as i32 - 14, bottom)], INK.mix(0.5)))?;
        area.draw(&Text::new("planes tested for each polygon that comes:", (14, 4), ("sans-serif", 16)))?;
        area.draw(&Text::new("OSP tree", (310, 4), ("sans-serif", 16).into_font().color(&BLUE)))?;
        area.draw(&Text::new("octree", (390, 4), ("sans-serif", 16).into_font().color(&ORANGE)))?;
        Ok(())
    }
}

impl Picture for Step<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        area.fill(&WHITE)?;
        let (upper, lower) = area.split_vertically(UPPER);
        let (left, right) = upper.split_horizontally(SIZE.0 / 2);
        self.draw_osp(&left)?;
        self.draw_octree(&right)?;
        let (left, right) = lower.split_horizontally(SIZE.0 / 2);
        self.draw_tree(&left)?;
        self.draw_bars(&right)?;
        let title = one_line(&self.film.title).into_owned();
        area.draw(&Text::new(
            title,
            (14, SIZE.1 as i32 - 18),
            ("sans-serif", 13).into_font().color(&INK.mix(0.6)),
        ))?;
        area.present()?;
        Ok(())
    }
}

/// A parallel projection in which a cube has three visible sides.
struct Cube {
    right: Vec3,
    up: Vec3,
    center: Vec3,
    scale: f64,
    middle: DVec2,
}

impl Cube {
    fn new(root: &Aabb, (width, height): (u32, u32)) -> Self {
        let back = FROM.normalize();
        let right = Vec3::Y.cross(back).normalize();
        let up = back.cross(right);
        let size = DVec2::new(f64::from(width), f64::from(height) - 70.0);
        let mut cube = Self { right, up, center: root.center(), scale: 1.0, middle: DVec2::ZERO };
        let reach = root.corners().map(|p| cube.pixel(p).abs()).into_iter().fold(DVec2::ZERO, DVec2::max);
        cube.scale = ((size * 0.5 - MARGIN) / reach.max(DVec2::splat(1.0e-9))).min_element();
        cube.middle = size * 0.5 + DVec2::new(0.0, 16.0);
        cube
    }

    fn pixel(&self, p: Vec3) -> DVec2 {
        let from = p - self.center;
        let flat = DVec2::new(f64::from(self.right.dot(from)), -f64::from(self.up.dot(from)));
        self.middle + flat * self.scale
    }

    fn edges<B: Backend>(&self, area: &Area<B>, bounds: &Aabb, color: RGBAColor, width: u32) -> Drawn {
        // The bits of a corner's number choose its side on x, y, z.
        let corners = bounds.corners().map(|p| self.pixel(p));
        for from in 0..8_usize {
            for to in [from | 1, from | 2, from | 4].into_iter().filter(|to| *to != from) {
                stroke(area, &[corners[from], corners[to]], color, width)?;
            }
        }
        Ok(())
    }
}
