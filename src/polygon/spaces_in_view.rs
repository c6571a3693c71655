use super::VisibleBlocks;
use crate::math::Aabb;

/// The polygons in a view that move with a space, grouped by space. They are not in the index of the world.
#[derive(Clone, Debug, Default)]
pub struct SpacesInView {
    /// For each space, its box in the world, and the end of its part of `blocks`.
    spaces: Vec<(Aabb, usize)>,
    blocks: Vec<(usize, u16)>,
}

impl SpacesInView {
    /// Removes all spaces; keeps the memory.
    pub fn clear(&mut self) {
        self.spaces.clear();
        self.blocks.clear();
    }

    /// Adds polygons of a block to the current space. [`SpacesInView::end_space`] ends this space.
    pub fn push_block(&mut self, block: usize, mask: u16) {
        if mask != 0 {
            self.blocks.push((block, mask));
        }
    }

    /// Ends the current space. `bounds` is a box around all its polygons, in the world. Returns the number of the space's
    /// polygons in view.
    pub fn end_space(&mut self, bounds: &Aabb) -> usize {
        let begin = self.spaces.last().map_or(0, |&(_, end)| end);
        if begin < self.blocks.len() {
            self.spaces.push((*bounds, self.blocks.len()));
        }
        count(&self.blocks[begin..])
    }

    /// The box of each space, and its blocks of polygons as pairs of number and mask.
    pub fn iter(&self) -> impl Iterator<Item = (&Aabb, &[(usize, u16)])> {
        let begins = std::iter::once(0).chain(self.spaces.iter().map(|&(_, end)| end));
        self.spaces.iter().zip(begins).map(|((bounds, end), begin)| (bounds, &self.blocks[begin..*end]))
    }

    /// Adds all polygons to a set.
    pub fn add_to(&self, visible: &mut VisibleBlocks) {
        self.blocks.iter().for_each(|&(block, mask)| visible.insert_block(block, mask));
    }
}

/// The number of polygons in blocks.
pub(crate) fn count(blocks: &[(usize, u16)]) -> usize {
    blocks.iter().map(|(_, mask)| mask.count_ones() as usize).sum()
}
