use std::ops::Range;

use glam::DVec3;

use super::{Facet, MOST_PARTS, PainterError, facets, tolerance_m};
use osp::{
    math::{Part, split_convex},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_session::scene::Scene;

/// Planes of polygons that are tried for a node.
const CANDIDATES: usize = 6;
/// Parts by which they are judged.
const SAMPLE: usize = 48;
/// A part more costs as much as so much of imbalance.
const CUT_COST: usize = 6;
/// With more parts than this a node may also take a plane across their middle: long strokes have no plane that divides them.
const LEAST_ACROSS: usize = 24;

/// Where nothing is.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    d: f64,
}

impl Plane {
    fn distance(&self, p: DVec3) -> f64 {
        self.normal.dot(p) + self.d
    }
}

/// A convex part of a polygon.
#[derive(Clone, Debug)]
struct Piece {
    facet: u32,
    corners: Range<u32>,
}

/// On which side of a plane a part lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    On,
    Front,
    Back,
    Both,
}

#[derive(Clone, Debug)]
struct Node {
    plane: Plane,
    /// Places in the list of pieces on a plane.
    on: Range<u32>,
    front: u32,
    back: u32,
}

/// A binary space partition of polygons: each node divides what is left of them by a plane, mostly that of one of them.
/// From any eye it lists them back to front.
#[derive(Debug)]
pub struct BspTree {
    facets: Vec<Facet>,
    planes: Vec<Plane>,
    pieces: Vec<Piece>,
    corners: Vec<DVec3>,
    nodes: Vec<Node>,
    /// The pieces on the planes of the nodes.
    on: Vec<u32>,
    tolerance_m: f64,
    parts: usize,
    depth: usize,
    state: u64,
}

/// Pieces that become a node, and where it is hung up.
struct Task {
    pieces: Vec<u32>,
    parent: u32,
    is_front: bool,
    depth: usize,
}

impl BspTree {
    /// The tree of these polygons.
    ///
    /// # Errors
    /// They cut each other into more than [`MOST_PARTS`] parts.
    pub fn new(scene: &Scene, polygons: &VisibleBlocks) -> Result<Self, PainterError> {
        let tolerance_m = tolerance_m(scene, polygons);
        let facets = facets(scene, polygons, tolerance_m);
        let mut tree = Self {
            planes: Vec::with_capacity(facets.len()),
            pieces: Vec::with_capacity(facets.len()),
            corners: Vec::with_capacity(facets.len() * 4),
            nodes: Vec::new(),
            on: Vec::with_capacity(facets.len()),
            tolerance_m,
            parts: facets.len(),
            depth: 0,
            state: 1,
            facets,
        };
        for (i, facet) in tree.facets.iter().enumerate() {
            let normal = facet.normal();
            let middle = facet.corners().iter().map(|p| p.as_dvec3()).sum::<DVec3>() / facet.count as f64;
            tree.planes.push(Plane { normal, d: -normal.dot(middle) });
            let first = tree.corners.len() as u32;
            tree.corners.extend(facet.corners().iter().map(|p| p.as_dvec3()));
            tree.pieces.push(Piece { facet: i as u32, corners: first..tree.corners.len() as u32 });
        }
        tree.build()?;
        Ok(tree)
    }

    /// Parts that the polygons were cut into.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Polygons and triangles before cutting.
    pub fn facets(&self) -> usize {
        self.facets.len()
    }

    /// Nodes.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Nodes on the longest way down.
    pub fn depth(&self) -> usize {
        self.depth
    }

    fn build(&mut self) -> Result<(), PainterError> {
        let all: Vec<u32> = (0..self.pieces.len() as u32).collect();
        let mut tasks = vec![Task { pieces: all, parent: NONE, is_front: false, depth: 1 }];
        while let Some(Task { pieces, parent, is_front, depth }) = tasks.pop() {
            if pieces.is_empty() {
                continue;
            }
            let (plane, of_facet) = self.choose(&pieces);
            let first = self.on.len() as u32;
            let (mut front, mut back) = (Vec::new(), Vec::new());
            for piece in pieces {
                // Whatever rounding says, what is cut from a facet lies in its plane.
                let side = match self.pieces[piece as usize].facet == of_facet {
                    true => Side::On,
                    false => self.side(&plane, piece),
                };
                match side {
                    Side::On => self.on.push(piece),
                    Side::Front => front.push(piece),
                    Side::Back => back.push(piece),
                    Side::Both => {
                        let (in_front, behind) = self.cut(&plane, piece)?;
                        front.push(in_front);
                        back.push(behind);
                    }
                }
            }
            let number = self.nodes.len() as u32;
            let on = first..self.on.len() as u32;
            // Of two in one plane the later is seen.
            let (pieces, facets) = (&self.pieces, &self.facets);
            let order = |piece: &u32| {
                let facet = pieces[*piece as usize].facet;
                (facets[facet as usize].polygon.0, facet, *piece)
            };
            self.on[first as usize..].sort_unstable_by_key(order);
            self.nodes.push(Node { plane, on, front: NONE, back: NONE });
            if parent != NONE {
                let parent = &mut self.nodes[parent as usize];
                *(if is_front { &mut parent.front } else { &mut parent.back }) = number;
            }
            self.depth = self.depth.max(depth);
            let depth = depth + 1;
            tasks.push(Task { pieces: back, parent: number, is_front: false, depth });
            tasks.push(Task { pieces: front, parent: number, is_front: true, depth });
        }
        Ok(())
    }

    fn corners_of(&self, piece: u32) -> &[DVec3] {
        let Range { start, end } = self.pieces[piece as usize].corners;
        &self.corners[start as usize..end as usize]
    }

    fn side(&self, plane: &Plane, piece: u32) -> Side {
        let (mut front, mut back) = (false, false);
        for corner in self.corners_of(piece) {
            let distance = plane.distance(*corner);
            front |= distance > self.tolerance_m;
            back |= distance < -self.tolerance_m;
        }
        match (front, back) {
            (false, false) => Side::On,
            (true, false) => Side::Front,
            (false, true) => Side::Back,
            (true, true) => Side::Both,
        }
    }

    /// Cuts a piece in two. What lies on the plane belongs to both.
    fn cut(&mut self, plane: &Plane, piece: u32) -> Result<(u32, u32), PainterError> {
        self.parts += 1;
        if self.parts > MOST_PARTS {
            return Err(PainterError::TooManyParts);
        }
        let tolerance_m = self.tolerance_m;
        let snapped = |p: DVec3| {
            let distance = plane.distance(p);
            if distance.abs() <= tolerance_m { 0.0 } else { distance }
        };
        let (mut front, mut back) = (Vec::with_capacity(8), Vec::with_capacity(8));
        // Where an edge ends on the plane, it crosses the plane at its end, but for rounding.
        let is_same = |a: DVec3, b: DVec3| a.distance_squared(b) <= (tolerance_m * 1.0e-3).powi(2);
        let add = |corners: &mut Vec<DVec3>, p: DVec3| {
            if corners.last().is_none_or(|last| !is_same(*last, p)) {
                corners.push(p);
            }
        };
        split_convex(self.corners_of(piece), snapped, |part, p| match part {
            Part::Front => {
                add(&mut front, p);
                // It may be on the plane.
                if snapped(p) == 0.0 {
                    add(&mut back, p);
                }
            }
            Part::Back => add(&mut back, p),
            Part::Crossing => {
                add(&mut front, p);
                add(&mut back, p);
            }
        });
        let facet = self.pieces[piece as usize].facet;
        let parts = [front, back].map(|mut corners| {
            if let [first, .., last] = corners[..]
                && is_same(first, last)
            {
                corners.pop();
            }
            let first = self.corners.len() as u32;
            self.corners.extend(corners);
            self.pieces.push(Piece { facet, corners: first..self.corners.len() as u32 });
            self.pieces.len() as u32 - 1
        });
        let [front, back] = parts;
        Ok((front, back))
    }

    /// A plane that cuts few of the pieces and leaves as many on one side as on the other, and the facet whose plane it is.
    fn choose(&mut self, pieces: &[u32]) -> (Plane, u32) {
        let facet_of = |tree: &Self, piece: u32| tree.pieces[piece as usize].facet;
        let first = facet_of(self, pieces[0]);
        let mut best = (usize::MAX, self.planes[first as usize], first);
        if pieces.len() == 1 {
            return (best.1, best.2);
        }
        let sample: Vec<u32> = match pieces.len() <= SAMPLE {
            true => pieces.to_vec(),
            false => (0..SAMPLE).map(|_| pieces[self.random(pieces.len())]).collect(),
        };
        for _ in 0..CANDIDATES.min(pieces.len()) {
            let at = self.random(pieces.len());
            let facet = facet_of(self, pieces[at]);
            let plane = self.planes[facet as usize];
            let (cost, _) = self.cost(&plane, &sample);
            if cost < best.0 {
                best = (cost, plane, facet);
            }
        }
        if pieces.len() > LEAST_ACROSS {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let mut at: Vec<f64> =
                    sample.iter().map(|&piece| axis.dot(self.corners_of(piece)[0])).collect();
                at.sort_unstable_by(f64::total_cmp);
                let plane = Plane { normal: axis, d: -at[at.len() / 2] };
                let (cost, divides) = self.cost(&plane, &sample);
                // Only so are there fewer on each side than here.
                if divides && cost < best.0 {
                    best = (cost, plane, NONE);
                }
            }
        }
        (best.1, best.2)
    }

    /// What a plane costs, by a sample of the pieces, and whether some are before it and some behind.
    fn cost(&self, plane: &Plane, sample: &[u32]) -> (usize, bool) {
        let (mut front, mut back, mut cut) = (0usize, 0usize, 0usize);
        for &piece in sample {
            match self.side(plane, piece) {
                Side::On => {}
                Side::Front => front += 1,
                Side::Back => back += 1,
                Side::Both => cut += 1,
            }
        }
        (cut * CUT_COST + front.abs_diff(back), front > 0 && back > 0)
    }

    /// The same numbers in every run: a linear congruential generator.
    fn random(&mut self, end: usize) -> usize {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 33) as usize % end
    }

    /// Lists the parts from the farthest to the nearest: each polygon with the corners of its part.
    pub fn back_to_front(&self, eye: DVec3, mut list: impl FnMut(PolygonId, &[DVec3])) {
        enum Step {
            Walk(u32),
            List(u32),
        }
        let mut steps = Vec::new();
        if !self.nodes.is_empty() {
            steps.push(Step::Walk(0));
        }
        while let Some(step) = steps.pop() {
            match step {
                Step::Walk(NONE) => {}
                Step::Walk(number) => {
                    let node = &self.nodes[number as usize];
                    let is_before = node.plane.distance(eye) > 0.0;
                    let (near, far) =
                        if is_before { (node.front, node.back) } else { (node.back, node.front) };
                    // The last is taken first.
                    steps.extend([Step::Walk(near), Step::List(number), Step::Walk(far)]);
                }
                Step::List(number) => {
                    let Range { start, end } = self.nodes[number as usize].on;
                    for &piece in &self.on[start as usize..end as usize] {
                        let facet = self.pieces[piece as usize].facet;
                        list(self.facets[facet as usize].polygon, self.corners_of(piece));
                    }
                }
            }
        }
    }
}
