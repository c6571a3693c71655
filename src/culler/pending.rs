use super::keys::Slot;
use crate::{math::Aabb, polygon::ById};

/// The state of an object in the culler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct State {
    /// Index in [`PendingChanges::changes`] of the object's change. If the entry there belongs to another object, or is
    /// missing, no change is pending.
    change: u32,
    /// Whether the object has a box after its last change.
    has_box: bool,
}

/// State of a slot without an object.
const VACANT: State = State { change: u32::MAX, has_box: false };

/// The last change of each object since the last commit.
#[derive(Debug)]
pub(super) struct PendingChanges {
    states: ById<State>,
    /// The new box of each object; [`Aabb::EMPTY`] for a removed object.
    changes: Vec<(Slot, Aabb)>,
    /// Number of changes that remove an object.
    gone: usize,
    /// Number of objects with a box.
    count: usize,
}

impl Default for PendingChanges {
    fn default() -> Self {
        Self { states: ById::new(VACANT), changes: Vec::new(), gone: 0, count: 0 }
    }
}

impl PendingChanges {
    /// Sets an object's box. Returns false, without effect, if the box is invalid ([`Aabb::is_valid`]).
    pub(super) fn set(&mut self, slot: Slot, bounds: Aabb) -> bool {
        if !bounds.is_valid() {
            return false;
        }
        let before = self.states.get(slot);
        let change = self.put(before, slot, bounds);
        let state = State { change, has_box: true };
        if state != before {
            self.count += usize::from(!before.has_box);
            self.states.set(slot, state);
        }
        true
    }

    /// Removes an object's box.
    pub(super) fn remove(&mut self, slot: Slot) {
        let before = self.states.get(slot);
        if before.has_box {
            self.count -= 1;
            self.gone += 1;
            let change = self.put(before, slot, Aabb::EMPTY);
            self.states.set(slot, State { change, has_box: false });
        }
    }

    /// Stores the change of an object; returns its position in the list.
    #[inline]
    fn put(&mut self, before: State, slot: Slot, bounds: Aabb) -> u32 {
        match self.changes.get_mut(before.change as usize) {
            Some(pending) if pending.0 == slot => {
                // The object was removed, and comes again.
                self.gone -= usize::from(pending.1.is_empty());
                pending.1 = bounds;
                before.change
            }
            _ => {
                self.changes.push((slot, bounds));
                self.changes.len() as u32 - 1
            }
        }
    }

    pub(super) fn has_box(&self, slot: Slot) -> bool {
        self.states.get(slot).has_box
    }

    /// The new box of an object whose change has not been committed; [`Aabb::EMPTY`] if the object is to be
    /// removed.
    pub(super) fn pending_box(&self, slot: Slot) -> Option<Aabb> {
        let change = self.changes.get(self.states.get(slot).change as usize);
        change.filter(|pending| pending.0 == slot).map(|(_, bounds)| *bounds)
    }

    /// Number of objects with a box.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// Passes all changes to `take`, in the order in which their objects first changed, and clears the list.
    pub(super) fn take_all(&mut self, take: impl FnOnce(&[(Slot, Aabb)])) {
        take(&self.changes);
        if self.gone > 0 {
            for (slot, _) in self.changes.iter().filter(|(_, bounds)| bounds.is_empty()) {
                self.states.set(*slot, VACANT);
            }
        }
        self.changes.clear();
        self.gone = 0;
    }
}
