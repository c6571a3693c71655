use glam::{Quat, Vec3};

use super::{
    Drops, Sample, StrokeSettings, frame,
    knots::{Knot, Knots, Spacing},
};
use crate::brush::Brush;
use osp::math::rotate;

/// Consecutive samples nearer than this are not joined; metres at scale 1.
const LEAST_MOVE_M: f32 = 0.0005;

/// A control point of a welded ribbon.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    pub position: Vec3,
    orientation: Quat,
    /// Full width for the hand's pressure, metres.
    pub size_m: f32,
    /// Drawn full width, metres.
    pub width_m: f32,
    pub opacity: f32,
    /// Distance from the previous node, metres.
    pub length_m: f32,
    /// Whether a piece of ribbon ends at this node. Otherwise the ribbon is broken before it.
    pub is_linked: bool,
    /// Unit directions of the width and of the normal; zero if the ribbon is broken before the node.
    pub right: Vec3,
    pub normal: Vec3,
    /// Number of vertices of the ribbon up to this node. It is the seed of the next segment's random numbers.
    pub vertices: u32,
}

/// The control points of a ribbon whose pieces share their edges, each with its frame.
#[derive(Clone, Debug)]
pub(super) struct Track {
    brush: &'static Brush,
    scale: f32,
    knots: Knots,
    /// Whether the brush is of the old kind. For such a brush, a node's frame does not depend on the next node, and the
    /// largest turn depends on the width.
    pub(super) is_old: bool,
    /// Number of vertices at each end of a piece.
    vertices_at_end: u32,
    /// The nodes that may still change, then a provisional end if there is one.
    pub(super) nodes: Vec<Node>,
    pub(super) kept: usize,
    is_begun: bool,
}

impl Track {
    pub(super) fn new(
        settings: &StrokeSettings,
        brush: &'static Brush,
        is_old: bool,
        vertices_at_end: u32,
    ) -> Self {
        let spacing = Spacing { length_m: 0.002, part_of_size: 0.2 };
        Self {
            brush,
            scale: settings.scale,
            knots: Knots::new(settings, brush, spacing),
            is_old,
            vertices_at_end,
            nodes: Vec::new(),
            kept: 0,
            is_begun: false,
        }
    }

    /// Processes a sample and returns the index of the first changed node.
    pub(super) fn push(&mut self, sample: Sample, drops: &mut Drops) -> Option<usize> {
        let step = self.knots.push(sample, drops);
        if self.nodes.is_empty() {
            let Sample { position, orientation, .. } = sample;
            self.nodes.push(Node { position, orientation, ..Node::default() });
            self.kept = 1;
            return None;
        }
        let step = step?;
        if !self.is_begun {
            let opacity = self.brush.opacity(step.from.smoothed);
            (self.nodes[0].size_m, self.nodes[0].opacity) = (step.from.size_m, opacity);
        }
        self.nodes.truncate(self.kept);
        self.nodes.push(self.node(&step.to));
        let last = self.nodes.len() - 1;
        // The frame of the previous node turns half-way to that of the new node.
        let first = if self.is_old || last < 2 { last } else { last - 1 };
        (first..=last).for_each(|i| self.link(i));
        if step.is_kept {
            self.kept = last + 1;
            self.is_begun = true;
        }
        Some(first)
    }

    pub(super) fn truncate(&mut self, len: usize) {
        self.nodes.truncate(len);
        self.kept = self.kept.min(len);
    }

    /// Drops at most the first `count` nodes, so that at least four kept nodes remain. Returns the number of dropped
    /// nodes.
    pub(super) fn forget(&mut self, count: usize) -> usize {
        let count = count.min(self.kept.saturating_sub(4));
        self.nodes.drain(..count);
        self.kept -= count;
        count
    }

    fn node(&self, knot: &Knot) -> Node {
        Node {
            position: knot.sample.position,
            orientation: knot.sample.orientation,
            size_m: knot.size_m,
            width_m: knot.size_m,
            opacity: self.brush.opacity(knot.smoothed),
            ..Node::default()
        }
    }

    /// Joins a node to the previous node, or breaks the ribbon before it.
    fn link(&mut self, i: usize) {
        let (before, node, after) = (self.nodes[i - 1], self.nodes[i], self.nodes.get(i + 1).copied());
        let step = node.position - before.position;
        let length_m = step.length();
        let mut breaks = !(length_m >= LEAST_MOVE_M * self.scale && length_m > 0.0);
        let mut travel = step.normalize_or_zero();
        if let Some(after) = after.filter(|_| !self.is_old) {
            breaks |= step.dot(after.position - node.position) < 0.0;
            travel = (after.position - before.position).normalize_or(travel);
        }
        if self.is_old && before.is_linked && i >= 2 {
            let step_before = before.position - self.nodes[i - 2].position;
            let turn = libm::atan2f(step_before.cross(step).length(), step_before.dot(step));
            breaks |= turn > 2.0 * libm::atan2f(length_m, node.size_m);
        }
        let previous = if self.brush.back_is_invisible {
            travel.cross(rotate(node.orientation, Vec3::NEG_Z))
        } else {
            before.right
        };
        let [right, normal] = match breaks {
            true => [Vec3::ZERO; 2],
            false => frame::ribbon(previous, travel, node.orientation),
        };
        let vertices = match (breaks, before.is_linked) {
            (true, _) => 0,
            (false, true) => self.vertices_at_end,
            (false, false) => 2 * self.vertices_at_end,
        };
        let node = Node {
            length_m,
            is_linked: !breaks,
            right,
            normal,
            vertices: before.vertices.wrapping_add(vertices),
            ..node
        };
        let width_m = if self.is_old { node.size_m } else { width_m(&before, &node) };
        self.nodes[i] = Node { width_m, ..node };
    }
}

/// The width of a node. It is reduced if its section would cross the previous section, and its growth is limited.
fn width_m(before: &Node, node: &Node) -> f32 {
    let width_before_m = if before.is_linked { before.width_m } else { before.size_m };
    let forward = before.normal.cross(before.right);
    let half = 0.5 * node.size_m * node.right;
    let ahead_right = forward.dot(node.position + half - before.position);
    let ahead_left = forward.dot(node.position - half - before.position);
    let half_before = 0.5 * width_before_m * before.right;
    let width_m = if ahead_right * ahead_left >= 0.0 {
        node.size_m
    } else if ahead_left < 0.0 {
        node.position.distance(before.position - half_before)
    } else {
        node.position.distance(before.position + half_before)
    };
    width_m.min(width_before_m + node.length_m)
}
