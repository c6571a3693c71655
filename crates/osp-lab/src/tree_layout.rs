//! Positions of the nodes of a tree in a picture.

/// A layout of a tree. Leaves stand side by side, and each other node stands above the middle of its
/// descendants.
#[derive(Clone, Debug)]
pub struct TreeLayout {
    /// For each node, the smallest and the largest horizontal position of its subtree, and the node's level.
    spans: Vec<(f32, f32, u32)>,
    /// Number of leaves.
    pub places: usize,
    margin: f32,
    step: (f32, f32),
}

impl TreeLayout {
    /// Makes the layout of nodes in a picture of this size with this margin, pixels. Each node has the index of its
    /// parent, which comes before it, and its level from 0.
    pub fn new(
        nodes: impl Iterator<Item = (Option<usize>, u32)>,
        (width, height): (u32, u32),
        margin: f32,
    ) -> Self {
        let nodes: Vec<(Option<usize>, u32)> = nodes.collect();
        let mut has_child = vec![false; nodes.len()];
        nodes.iter().filter_map(|node| node.0).for_each(|parent| has_child[parent] = true);
        let mut spans: Vec<(f32, f32, u32)> =
            nodes.iter().map(|node| (f32::INFINITY, f32::NEG_INFINITY, node.1)).collect();
        let mut next = 0.5;
        for (span, _) in spans.iter_mut().zip(&has_child).filter(|&(_, &has)| !has) {
            (span.0, span.1) = (next, next);
            next += 1.0;
        }
        for i in (0..nodes.len()).rev() {
            if let Some(parent) = nodes[i].0 {
                let middle = f32::midpoint(spans[i].0, spans[i].1);
                spans[parent].0 = spans[parent].0.min(middle);
                spans[parent].1 = spans[parent].1.max(middle);
            }
        }
        let places = has_child.iter().filter(|&&has| !has).count().max(1);
        let levels = nodes.iter().map(|node| node.1 + 1).max().unwrap_or(1);
        let between = |pixels: u32, many: f32| (pixels as f32 - 2.0 * margin) / many;
        let step = (between(width, places as f32), between(height, levels as f32));
        Self { spans, places, margin, step }
    }

    /// Distance between two neighbouring leaves, pixels.
    pub fn step_x(&self) -> f32 {
        self.step.0
    }

    /// Position of a node, pixels.
    pub fn pixel(&self, node: usize) -> (i32, i32) {
        let (low, high, level) = self.spans[node];
        let x = self.margin + f32::midpoint(low, high) * self.step.0;
        let y = self.margin + (level as f32 + 0.5) * self.step.1;
        (x as i32, y as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_stands_in_the_middle_above_those_below_it() {
        let nodes = [(None, 0), (Some(0), 1), (Some(1), 2), (Some(1), 2), (Some(0), 1)];
        let layout = TreeLayout::new(nodes.into_iter(), (320, 320), 10.0);
        assert_eq!((layout.places, layout.step_x()), (3, 100.0));
        let at: Vec<_> = (0..nodes.len()).map(|node| layout.pixel(node)).collect();
        assert_eq!(at, [(185, 60), (110, 160), (60, 260), (160, 260), (260, 160)]);
    }
}
