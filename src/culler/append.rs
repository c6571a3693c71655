use std::hash::BuildHasher;

use super::{
    culler::{Culler, Placement},
    hiding::BUDGET,
    keys::{Key, Places},
};

impl<K: Key, S: BuildHasher> Culler<K, S> {
    /// Moves all objects of `other` into this culler, with their occluders and layers. If both cullers have an object
    /// with the same key, the object of `other` replaces the object of `self`.
    ///
    /// Use it to load a level in the background: another thread fills and commits `other`. That commit checks and sorts
    /// the objects. If `self` is empty, it becomes `other`, in O(1). Otherwise the next commit of `self` inserts the
    /// objects in the spatial order of `other`, in O(objects of `other`).
    ///
    /// ```
    /// use osp::Culler;
    ///
    /// let loading = std::thread::spawn(|| {
    ///     let mut level = Culler::<u64>::new();
    ///     (0..1000).for_each(|i| level.set(i, [[i as f32, 0.0, 0.0], [i as f32 + 1.0, 1.0, 1.0]]));
    ///     level.commit();
    ///     level
    /// });
    /// let mut culler = Culler::<u64>::new();
    /// culler.set(5000, [[0.0_f32, 0.0, -9.0], [1.0, 1.0, -8.0]]);
    /// culler.append(loading.join().unwrap());
    /// assert_eq!(culler.len(), 1001);
    /// ```
    pub fn append(&mut self, mut other: Self) {
        other.commit();
        let refused: Vec<_> = other.refused.drain(..).chain(other.refused_since.drain(..)).collect();
        if self.has_nothing() {
            // `self` keeps its own refusals.
            std::mem::swap(&mut self.refused, &mut other.refused);
            std::mem::swap(&mut self.refused_since, &mut other.refused_since);
            std::mem::swap(self, &mut other);
            // Not the results of `other`.
            self.cameras = 0;
        } else {
            self.insert_all(&other);
        }
        for (key, why) in refused {
            self.refuse(key, why);
        }
    }

    /// Whether there is no object, no occluder, no budget of its own, no transform, no layer, no detail and no pending change.
    fn has_nothing(&self) -> bool {
        let hides_nothing =
            self.hiding.as_ref().is_none_or(|hiding| hiding.is_empty() && hiding.budget == BUDGET);
        let is_plain =
            self.layers.iter().next().is_none() && self.placements.is_empty() && self.details.is_empty();
        self.is_empty() && !self.is_changed && hides_nothing && is_plain
    }

    fn insert_all(&mut self, other: &Self) {
        for (key, bounds) in other.iter() {
            self.remove(key);
            if bounds[0][0].is_finite() { self.set(key, bounds) } else { self.set_everywhere(key) }
        }
        let mut placements: Vec<_> = other.placements.iter().collect();
        placements.sort_unstable_by_key(|&(slot, _)| *slot);
        for (&slot, &Placement { bounds, columns }) in placements {
            let Some(key) = other.keys.key_in(slot) else { continue };
            // Also where the moved box was refused, so that no transform of `self` applies.
            self.remove(key);
            if !bounds.is_empty() {
                self.set(key, [bounds.min, bounds.max]);
            }
            self.set_transform(key, columns);
        }
        for (slot, occluder) in other.hiding.iter().flat_map(|hiding| hiding.iter()) {
            let Some(key) = other.keys.key_in(slot) else { continue };
            if other.bounds_of(slot).is_none() {
                // The object of `other` has no box, so the object of `self` loses its box, too.
                self.remove(key);
            }
            self.set_occluder(key, occluder.clone());
        }
        let mut details: Vec<_> = other.details.iter().collect();
        details.sort_unstable_by_key(|&(slot, _)| *slot);
        for (&slot, &detail) in details {
            if let Some(key) = other.keys.key_in(slot) {
                self.set_detail(key, detail);
            }
        }
        for (slot, &layers) in other.layers.iter() {
            if let Some(key) = other.keys.key_in(slot) {
                self.set_layers(key, layers);
            }
        }
    }
}
