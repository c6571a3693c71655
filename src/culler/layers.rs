use crate::polygon::ById;

use super::keys::Slot;

/// The layer of an object whose layers the engine has not set.
const FIRST_LAYER: u32 = 1;

/// The layers of each object.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    masks: ById<u32>,
    /// Number of objects whose mask is not [`FIRST_LAYER`].
    not_first: usize,
    /// Number of objects on no layer.
    unseen: usize,
}

impl Default for Layers {
    fn default() -> Self {
        Self { masks: ById::new(FIRST_LAYER), not_first: 0, unseen: 0 }
    }
}

impl Layers {
    pub(super) fn set(&mut self, slot: Slot, layers: u32) {
        let before = self.masks.get(slot);
        self.masks.set(slot, layers);
        self.not_first =
            self.not_first + usize::from(layers != FIRST_LAYER) - usize::from(before != FIRST_LAYER);
        self.unseen = self.unseen + usize::from(layers == 0) - usize::from(before == 0);
    }

    /// The objects whose mask is not [`FIRST_LAYER`], with their masks.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Slot, &u32)> {
        self.masks.iter()
    }

    /// Puts a removed object back on the first layer.
    pub(super) fn forget(&mut self, slot: Slot) {
        if self.not_first > 0 {
            self.set(slot, FIRST_LAYER);
        }
    }

    /// Whether a camera on these layers may see an object.
    pub(super) fn sees(&self, slot: Slot, layers: u32) -> bool {
        self.masks.get(slot) & layers != 0
    }

    /// Whether a camera on these layers may see every object.
    pub(super) fn sees_all(&self, layers: u32) -> bool {
        if self.not_first > 0 { layers == u32::MAX && self.unseen == 0 } else { layers & FIRST_LAYER != 0 }
    }
}
