use super::VisibleBlocks;
use crate::math::Aabb;

/// The polygons in a view that are in no index, because the space that they lie in moves as a whole: space by space.
#[derive(Clone, Debug, Default)]
pub struct SpacesInView {
    /// The box around each space, world space, and where its blocks end.
    spaces: Vec<(Aabb, usize)>,
    blocks: Vec<(usize, u16)>,
}

impl SpacesInView {
    /// Empties it; keeps the memory.
    pub fn clear(&mut self) {
        self.spaces.clear();
        self.blocks.clear();
    }

    /// Adds polygons of a block to the space that [`SpacesInView::end_space`] ends.
    pub fn push_block(&mut self, block: usize, mask: u16) {
        if mask != 0 {
            self.blocks.push((block, mask));
        }
    }

    /// Ends a space. `bounds` holds all its polygons, world space. Returns how many of these are in view.
    pub fn end_space(&mut self, bounds: &Aabb) -> usize {
        let begin = self.spaces.last().map_or(0, |&(_, end)| end);
        if begin < self.blocks.len() {
            self.spaces.push((*bounds, self.blocks.len()));
        }
        count(&self.blocks[begin..])
    }

    /// Each space with its box and its blocks of polygons: number and mask.
    pub fn iter(&self) -> impl Iterator<Item = (&Aabb, &[(usize, u16)])> {
        let begins = std::iter::once(0).chain(self.spaces.iter().map(|&(_, end)| end));
        self.spaces.iter().zip(begins).map(|((bounds, end), begin)| (bounds, &self.blocks[begin..*end]))
    }

    /// Adds all polygons to a set.
    pub fn add_to(&self, visible: &mut VisibleBlocks) {
        self.blocks.iter().for_each(|&(block, mask)| visible.insert_block(block, mask));
    }
}

/// Polygons of blocks.
pub(crate) fn count(blocks: &[(usize, u16)]) -> usize {
    blocks.iter().map(|(_, mask)| mask.count_ones() as usize).sum()
}
