//! Undoable arrangements in the order of the session. The state of the scene is the result of all active arrangements,
//! in this order.
//!
//! The author of an arrangement is irrelevant here. Moves add up. If several arrangements set the group, transform or
//! layer of a stroke or group, only the last counts. Each active arrangement stores the state before it, so undoing the
//! last arrangement of a stroke or group is cheap. Undoing an earlier arrangement changes the state that the next
//! arrangement stores.
//!
//! An arrangement that undo no longer reaches is permanent. It becomes part of the base, the state before all
//! arrangements in the log.

use std::collections::{BTreeMap, BTreeSet};

use super::edit::{Arrangement, Named, Translation};
use crate::recording::Transform;

/// The log of arrangements; see the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    /// Active arrangements by index.
    active: BTreeMap<u64, Arrangement>,
    undone: BTreeMap<u64, Arrangement>,
    /// Indices of arrangements, by the properties that they set.
    index: BTreeSet<(State, Key, u64)>,
    /// Indices of arrangements of more than [`MOST_INDEXED`] strokes. `index` does not contain their strokes.
    broad: BTreeSet<(State, u64)>,
    /// The index that the next added arrangement gets.
    pub(super) next: u64,
    /// Number of arrangements and strokes visited so far.
    pub(super) looked_at: u64,
}

/// A property of a stroke or group that an arrangement sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    Offset(u32),
    Membership(u32),
    Layer(u32),
    Parent(usize),
    Name(usize),
    Transform(usize),
}

/// An arrangement of more strokes is not in the index by its strokes. The histories have at most a few thousand such
/// arrangements, which are searched one by one. A larger number would need more memory for the index.
const MOST_INDEXED: usize = 1024;

/// State of an arrangement: undone, or active.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum State {
    Undone,
    Active,
}

/// For each stroke that is in both lists, its positions in both lists, ascending.
fn common<A, B>(a: &[Named<A>], b: &[Named<B>]) -> Vec<(usize, usize)> {
    let find = |of: u32, i: usize| b.binary_search_by_key(&of, |of| of.stroke).ok().map(|j| (i, j));
    if a.len() <= b.len() {
        return a.iter().zip(0..).filter_map(|(of, i)| find(of.stroke, i)).collect();
    }
    let find = |of: u32, j: usize| a.binary_search_by_key(&of, |of| of.stroke).ok().map(|i| (i, j));
    b.iter().zip(0..).filter_map(|(of, j)| find(of.stroke, j)).collect()
}

/// Removes the strokes of one list from another.
fn drop_common<A, B>(from: &mut Vec<Named<A>>, of: &[Named<B>]) {
    if !from.is_empty() && !of.is_empty() {
        from.retain(|named| of.binary_search_by_key(&named.stroke, |of| of.stroke).is_err());
    }
}

/// A property of a stroke, such as its group or layer, that an arrangement sets. The arrangement stores each stroke's
/// former value.
pub(super) trait StrokeValue: Copy {
    fn key(stroke: u32) -> Key;

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>>;
}

impl StrokeValue for Option<usize> {
    fn key(stroke: u32) -> Key {
        Key::Membership(stroke)
    }

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Group(grouping) = what { Some(&mut grouping.members) } else { None }
    }
}

impl StrokeValue for u32 {
    fn key(stroke: u32) -> Key {
        Key::Layer(stroke)
    }

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Assign { strokes, .. } = what { Some(strokes) } else { None }
    }
}

impl Log {
    pub(super) fn add(&mut self, what: Arrangement) -> u64 {
        let at = self.next;
        self.next += 1;
        self.put(at, what, State::Active);
        at
    }

    /// Removes an arrangement. The caller puts it back with [`Log::put`].
    pub(super) fn take(&mut self, at: u64) -> Arrangement {
        let (what, state) = match self.active.remove(&at) {
            Some(what) => (what, State::Active),
            None => (self.undone.remove(&at).unwrap_or_default(), State::Undone),
        };
        let is_broad = self.broad.remove(&(state, at));
        for_each_key(&what, !is_broad, |key| _ = self.index.remove(&(state, key, at)));
        what
    }

    pub(super) fn put(&mut self, at: u64, what: Arrangement, state: State) {
        let is_broad = what.named() as usize > MOST_INDEXED;
        if is_broad {
            self.broad.insert((state, at));
        }
        for_each_key(&what, !is_broad, |key| _ = self.index.insert((state, key, at)));
        self.of_mut(state).insert(at, what);
    }

    fn of_mut(&mut self, state: State) -> &mut BTreeMap<u64, Arrangement> {
        match state {
            State::Active => &mut self.active,
            State::Undone => &mut self.undone,
        }
    }

    /// Removes an undone arrangement that can no longer be redone.
    pub(super) fn remove(&mut self, at: u64) {
        self.take(at);
    }

    /// At most `most` indices, from `first` to `last`, of arrangements that set a property, ascending.
    fn in_index(&mut self, state: State, key: Key, [first, last]: [u64; 2], most: usize) -> Vec<u64> {
        let places = self.index.range((state, key, first)..=(state, key, last)).map(|&(.., at)| at);
        let found: Vec<u64> = places.take(most).collect();
        self.looked_at += 1 + found.len() as u64;
        found
    }

    /// The indices of arrangements that set one of these properties, ascending, at most `most` for each property. The
    /// result may contain other arrangements, too. The cost grows with the number of properties and of found indices.
    fn sharing(
        &mut self,
        state: State,
        keys: impl ExactSizeIterator<Item = Key>,
        places: [u64; 2],
        most: usize,
    ) -> Vec<u64> {
        let ([first, last], mut found) = (places, Vec::new());
        if keys.len() > self.of_mut(state).len() / 8 {
            found.extend(self.of_mut(state).range(first..=last).map(|(&at, _)| at));
        } else if keys.len() > 0 {
            found.extend(self.broad.range((state, first)..=(state, last)).map(|&(_, at)| at));
            keys.for_each(|key| found.extend(self.in_index(state, key, places, most)));
            found.sort_unstable();
            found.dedup();
        }
        self.looked_at += found.len() as u64;
        found
    }

    /// Whether an active arrangement sets a parent.
    pub(super) fn sets_parent(&self, at: u64) -> bool {
        matches!(self.active.get(&at), Some(Arrangement::Group(of)) if of.new_parent.is_some())
    }

    /// Computes the offsets of strokes after their move is undone or redone. `now` returns a stroke's current offset.
    pub(super) fn set_state_of_moves(
        &mut self,
        at: u64,
        moved: &mut [Named<Translation>],
        state: State,
        now: impl Fn(u32) -> glam::Vec3,
    ) -> Vec<glam::Vec3> {
        let mut offsets: Vec<Option<glam::Vec3>> = match state {
            State::Undone => moved.iter().map(|moved| Some(moved.of.before)).collect(),
            State::Active => vec![None; moved.len()],
        };
        let keys = moved.iter().map(|named| Key::Offset(named.stroke));
        for at in self.sharing(State::Active, keys, [at + 1, u64::MAX], usize::MAX) {
            let Some(Arrangement::Move(later)) = self.active.get_mut(&at) else { continue };
            for (i, j) in common(moved, later) {
                let offset = offsets[i].unwrap_or_else(|| {
                    moved[i].of.before = later[j].of.before;
                    moved[i].of.before + moved[i].of.by
                });
                later[j].of.before = offset;
                offsets[i] = Some(offset + later[j].of.by);
            }
        }
        let turned = moved.iter_mut().zip(offsets).map(|(moved, offset)| {
            offset.unwrap_or_else(|| {
                moved.of.before = now(moved.stroke);
                moved.of.before + moved.of.by
            })
        });
        turned.collect()
    }

    /// Undoes or redoes the values that an arrangement sets for strokes. `own` is the arrangement's value, and `now`
    /// returns a stroke's current value. Returns the strokes whose value no later arrangement sets, with their new
    /// values.
    pub(super) fn set_state_of_values<T: StrokeValue>(
        &mut self,
        at: u64,
        list: &mut [Named<T>],
        state: State,
        own: T,
        now: impl Fn(u32) -> T,
    ) -> Vec<(u32, T)> {
        let mut is_settled = vec![false; list.len()];
        let keys = list.iter().map(|named| T::key(named.stroke));
        for at in self.sharing(State::Active, keys, [at + 1, u64::MAX], 1) {
            let Some(later) = self.active.get_mut(&at).and_then(T::list) else { continue };
            for (i, j) in common(list, later) {
                if std::mem::replace(&mut is_settled[i], true) {
                    continue;
                }
                match state {
                    State::Undone => later[j].of = list[i].of,
                    State::Active => list[i].of = std::mem::replace(&mut later[j].of, own),
                }
            }
        }
        let open = list.iter_mut().zip(is_settled).filter(|(_, is_settled)| !is_settled);
        open.map(|(named, _)| match state {
            State::Undone => (named.stroke, named.of),
            State::Active => {
                named.of = now(named.stroke);
                (named.stroke, own)
            }
        })
        .collect()
    }

    /// Undoes or redoes the name of a group. Returns the new name; `None` if a later arrangement sets the name.
    pub(super) fn set_state_of_name(
        &mut self,
        at: u64,
        group: usize,
        names: &mut [Option<String>; 2],
        state: State,
        now: impl FnOnce() -> Option<String>,
    ) -> Option<Option<String>> {
        let later = match self.next_of(Key::Name(group), at) {
            Some(Arrangement::Group(grouping)) => grouping.names.as_mut().map(|names| &mut names[0]),
            _ => None,
        };
        let [before, own] = names;
        set_state_of_value(later, before, state, own, now)
    }

    /// Undoes or redoes the transform of a group. Returns the new transform; `None` if a later arrangement sets the
    /// transform.
    pub(super) fn set_state_of_place(
        &mut self,
        at: u64,
        group: usize,
        before: &mut Transform,
        state: State,
        own: Transform,
        now: Transform,
    ) -> Option<Transform> {
        let later = match self.next_of(Key::Transform(group), at) {
            Some(Arrangement::Place { before, .. }) => Some(before),
            _ => None,
        };
        set_state_of_value(later, before, state, &own, || now)
    }

    /// The next active arrangement after `at` that sets the property.
    fn next_of(&mut self, key: Key, at: u64) -> Option<&mut Arrangement> {
        let next = self.in_index(State::Active, key, [at + 1, u64::MAX], 1).pop()?;
        self.active.get_mut(&next)
    }

    /// Makes an active arrangement part of the base. Earlier arrangements lose the values that this arrangement
    /// replaces. Its moves are applied before the moves of earlier arrangements, which may change offsets in the last
    /// bit. Returns the strokes whose offsets change. `hangs` states whether the arrangement has set a parent.
    pub(super) fn forget(&mut self, at: u64, hangs: bool) -> Vec<(u32, glam::Vec3)> {
        if !self.active.contains_key(&at) {
            return Vec::new();
        }
        let what = self.take(at);
        if at == 0 {
            return Vec::new();
        }
        match &what {
            Arrangement::Nothing => {}
            Arrangement::Move(moved) => return self.forget_moves(at, moved),
            Arrangement::Group(forgotten) => {
                self.drop_earlier(at, &forgotten.members);
                if hangs {
                    self.change_earlier(at, Key::Parent(forgotten.group), |what| {
                        if let Arrangement::Group(grouping) = what {
                            grouping.new_parent = None;
                        }
                    });
                }
                if forgotten.names.is_some() {
                    self.change_earlier(at, Key::Name(forgotten.group), |what| {
                        if let Arrangement::Group(grouping) = what {
                            grouping.names = None;
                        }
                    });
                }
            }
            Arrangement::Place { group, .. } => {
                self.change_earlier(at, Key::Transform(*group), |what| *what = Arrangement::Nothing);
            }
            Arrangement::Assign { strokes, .. } => self.drop_earlier(at, strokes),
        }
        Vec::new()
    }

    /// Removes a property from all arrangements before `at`. `change` removes it from an arrangement, and this function
    /// removes the index entry.
    fn change_earlier(&mut self, at: u64, key: Key, change: impl Fn(&mut Arrangement)) {
        for state in [State::Active, State::Undone] {
            for at in self.in_index(state, key, [0, at - 1], usize::MAX) {
                self.index.remove(&(state, key, at));
                self.of_mut(state).get_mut(&at).into_iter().for_each(&change);
            }
        }
    }

    /// Removes these strokes from all arrangements of this kind before `at`.
    fn drop_earlier<T: StrokeValue>(&mut self, at: u64, strokes: &[Named<T>]) {
        for state in [State::Active, State::Undone] {
            let keys = strokes.iter().map(|named| T::key(named.stroke));
            for at in self.sharing(state, keys, [0, at - 1], usize::MAX) {
                let Some(earlier) = self.of_mut(state).get_mut(&at).and_then(T::list) else { continue };
                let dropped = common(strokes, earlier);
                drop_common(earlier, strokes);
                for (i, _) in dropped {
                    self.index.remove(&(state, T::key(strokes[i].stroke), at));
                }
            }
        }
    }

    fn forget_moves(&mut self, at: u64, moved: &[Named<Translation>]) -> Vec<(u32, glam::Vec3)> {
        let mut offsets: Vec<Option<glam::Vec3>> = vec![None; moved.len()];
        let keys = moved.iter().map(|named| Key::Offset(named.stroke));
        for place in self.sharing(State::Active, keys, [0, u64::MAX], usize::MAX) {
            let Some(Arrangement::Move(list)) = self.active.get_mut(&place) else { continue };
            for (i, j) in common(moved, list) {
                // A stroke without an earlier move keeps its offset.
                if offsets[i].is_none() && place > at {
                    continue;
                }
                let offset = offsets[i].unwrap_or(list[j].of.before + moved[i].of.by);
                list[j].of.before = offset;
                offsets[i] = Some(offset + list[j].of.by);
            }
        }
        moved.iter().zip(offsets).filter_map(|(moved, offset)| Some((moved.stroke, offset?))).collect()
    }
}

/// Calls `each` with every property that an arrangement sets. Without `of_strokes`, properties of strokes are skipped.
fn for_each_key(what: &Arrangement, of_strokes: bool, mut each: impl FnMut(Key)) {
    fn strokes<T>(list: &[Named<T>], of_strokes: bool) -> impl Iterator<Item = u32> + '_ {
        list.iter().filter(move |_| of_strokes).map(|named| named.stroke)
    }
    match what {
        Arrangement::Nothing => {}
        Arrangement::Move(moved) => strokes(moved, of_strokes).map(Key::Offset).for_each(each),
        Arrangement::Group(grouping) => {
            if grouping.new_parent.is_some() {
                each(Key::Parent(grouping.group));
            }
            if grouping.names.is_some() {
                each(Key::Name(grouping.group));
            }
            strokes(&grouping.members, of_strokes).map(Key::Membership).for_each(each);
        }
        Arrangement::Place { group, .. } => each(Key::Transform(*group)),
        Arrangement::Assign { strokes: named, .. } => {
            strokes(named, of_strokes).map(Key::Layer).for_each(each)
        }
    }
}

/// Undoes or redoes a single value. `later` is the value that the next arrangement stores as its former value, and
/// `now` returns the current value. Returns the value to set; `None` if a later arrangement determines it.
fn set_state_of_value<T: Clone>(
    later: Option<&mut T>,
    before: &mut T,
    state: State,
    own: &T,
    now: impl FnOnce() -> T,
) -> Option<T> {
    match (later, state) {
        (Some(later), State::Undone) => {
            *later = before.clone();
            None
        }
        (Some(later), State::Active) => {
            *before = std::mem::replace(later, own.clone());
            None
        }
        (None, State::Undone) => Some(before.clone()),
        (None, State::Active) => {
            *before = now();
            Some(own.clone())
        }
    }
}

#[cfg(test)]
mod tests;
