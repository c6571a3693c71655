//! Undoable edits in session order. Scene state = all active edits applied in order.
//!
//! The author of an arrangement is irrelevant here: all active arrangements take effect in order. Moves add up; if
//! several arrangements set the group, transform or layer of a stroke or group, only the last counts. Each active
//! arrangement stores the state before it. So undoing the last arrangement of a stroke or group is cheap. Undoing an
//! earlier arrangement changes the state that the next one stores.
//!
//! An arrangement that undo no longer reaches is permanent and becomes part of the base, which precedes all others.

use std::collections::{BTreeMap, BTreeSet};

use super::edit::{Arrangement, Named, Parent, Way};
use crate::recording::Transform;

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    /// Active arrangements by index.
    active: BTreeMap<u64, Arrangement>,
    /// Undone arrangements that can be redone, by index.
    taken_back: BTreeMap<u64, Arrangement>,
    /// Indices of arrangements, by the properties that they set.
    index: BTreeSet<(Turn, Key, u64)>,
    /// Indices of arrangements of more than [`MOST_INDEXED`] strokes. `index` does not contain their strokes.
    broad: BTreeSet<(Turn, u64)>,
    next: u64,
    looked_at: u64,
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

/// Largest number of strokes of an arrangement that are entered into the index. Undo stores at most a thousand larger
/// arrangements, which are searched one by one. A larger value needs more memory for the index.
const MOST_INDEXED: usize = 1024;

/// Next state of an arrangement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Turn {
    TakenBack,
    MadeAgain,
}

/// Pairs of positions of the strokes that are in both lists, ascending.
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
pub(super) trait Settled: Copy {
    fn key(stroke: u32) -> Key;

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>>;
}

impl Settled for Option<usize> {
    fn key(stroke: u32) -> Key {
        Key::Membership(stroke)
    }

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Group(grouping) = what { Some(&mut grouping.members) } else { None }
    }
}

impl Settled for u32 {
    fn key(stroke: u32) -> Key {
        Key::Layer(stroke)
    }

    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Assign { strokes, .. } = what { Some(strokes) } else { None }
    }
}

impl Log {
    /// Adds an arrangement that took effect; returns its index.
    pub(super) fn add(&mut self, what: Arrangement) -> u64 {
        let at = self.next;
        self.next += 1;
        self.put(at, what, Turn::MadeAgain);
        at
    }

    /// Removes an arrangement, which the caller returns with [`Log::put`].
    pub(super) fn take(&mut self, at: u64) -> Arrangement {
        let (what, turn) = match self.active.remove(&at) {
            Some(what) => (what, Turn::MadeAgain),
            None => (self.taken_back.remove(&at).unwrap_or_default(), Turn::TakenBack),
        };
        let is_broad = self.broad.remove(&(turn, at));
        for_each_key(&what, !is_broad, |key| _ = self.index.remove(&(turn, key, at)));
        what
    }

    pub(super) fn put(&mut self, at: u64, what: Arrangement, turn: Turn) {
        let is_broad = what.named() as usize > MOST_INDEXED;
        if is_broad {
            self.broad.insert((turn, at));
        }
        for_each_key(&what, !is_broad, |key| _ = self.index.insert((turn, key, at)));
        self.of_mut(turn).insert(at, what);
    }

    fn of_mut(&mut self, turn: Turn) -> &mut BTreeMap<u64, Arrangement> {
        match turn {
            Turn::MadeAgain => &mut self.active,
            Turn::TakenBack => &mut self.taken_back,
        }
    }

    /// Removes an undone arrangement that cannot be redone any more.
    pub(super) fn remove(&mut self, at: u64) {
        self.take(at);
    }

    /// At most `most` arrangement indices under a key, ascending, from `first` to `last`.
    fn in_index(&mut self, turn: Turn, key: Key, [first, last]: [u64; 2], most: usize) -> Vec<u64> {
        let places = self.index.range((turn, key, first)..=(turn, key, last)).map(|&(.., at)| at);
        let found: Vec<u64> = places.take(most).collect();
        self.looked_at += 1 + found.len() as u64;
        found
    }

    /// The indices of arrangements that set one of these properties, ascending; at most `most` for each property. The
    /// result may contain other arrangements, too. The cost grows with the number of keys and of indices found.
    fn sharing(
        &mut self,
        turn: Turn,
        keys: impl ExactSizeIterator<Item = Key>,
        places: [u64; 2],
        most: usize,
    ) -> Vec<u64> {
        let ([first, last], mut found) = (places, Vec::new());
        if keys.len() > self.of_mut(turn).len() / 8 {
            found.extend(self.of_mut(turn).range(first..=last).map(|(&at, _)| at));
        } else if keys.len() > 0 {
            found.extend(self.broad.range((turn, first)..=(turn, last)).map(|&(_, at)| at));
            keys.for_each(|key| found.extend(self.in_index(turn, key, places, most)));
            found.sort_unstable();
            found.dedup();
        }
        self.looked_at += found.len() as u64;
        found
    }

    /// Number of arrangements and strokes visited so far.
    pub(super) fn looked_at(&self) -> u64 {
        self.looked_at
    }

    /// The index of the next arrangement to be added.
    pub(super) fn next_place(&self) -> u64 {
        self.next
    }

    /// The group whose parent an active arrangement sets, and that parent.
    pub(super) fn new_parent(&self, at: u64) -> Option<(usize, Parent)> {
        match self.active.get(&at)? {
            Arrangement::Group(grouping) => Some((grouping.group, grouping.new_parent?)),
            _ => None,
        }
    }

    /// Computes the offsets of strokes after their move is undone or redone. `now` returns a stroke's current offset.
    pub(super) fn turn_moves(
        &mut self,
        at: u64,
        moved: &mut [Named<Way>],
        turn: Turn,
        now: impl Fn(u32) -> glam::Vec3,
    ) -> Vec<glam::Vec3> {
        let mut offsets: Vec<Option<glam::Vec3>> = match turn {
            Turn::TakenBack => moved.iter().map(|moved| Some(moved.of.before)).collect(),
            Turn::MadeAgain => vec![None; moved.len()],
        };
        let keys = moved.iter().map(|named| Key::Offset(named.stroke));
        for at in self.sharing(Turn::MadeAgain, keys, [at + 1, u64::MAX], usize::MAX) {
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

    /// Undoes or redoes a list of values. `own` is the arrangement's value, `now` returns a stroke's current value.
    /// Returns the strokes whose value no later arrangement sets, with their new values.
    pub(super) fn turn_settled<T: Settled>(
        &mut self,
        at: u64,
        list: &mut [Named<T>],
        turn: Turn,
        own: T,
        now: impl Fn(u32) -> T,
    ) -> Vec<(u32, T)> {
        let mut is_settled = vec![false; list.len()];
        let keys = list.iter().map(|named| T::key(named.stroke));
        for at in self.sharing(Turn::MadeAgain, keys, [at + 1, u64::MAX], 1) {
            let Some(later) = self.active.get_mut(&at).and_then(T::list) else { continue };
            for (i, j) in common(list, later) {
                if std::mem::replace(&mut is_settled[i], true) {
                    continue;
                }
                match turn {
                    Turn::TakenBack => later[j].of = list[i].of,
                    Turn::MadeAgain => list[i].of = std::mem::replace(&mut later[j].of, own),
                }
            }
        }
        let open = list.iter_mut().zip(is_settled).filter(|(_, is_settled)| !is_settled);
        open.map(|(named, _)| match turn {
            Turn::TakenBack => (named.stroke, named.of),
            Turn::MadeAgain => {
                named.of = now(named.stroke);
                (named.stroke, own)
            }
        })
        .collect()
    }

    /// Undoes or redoes the name of a group. Returns the new name, unless a later arrangement sets one.
    pub(super) fn turn_name(
        &mut self,
        at: u64,
        group: usize,
        names: &mut [Option<String>; 2],
        turn: Turn,
        now: impl FnOnce() -> Option<String>,
    ) -> Option<Option<String>> {
        let later = match self.next_of(Key::Name(group), at) {
            Some(Arrangement::Group(grouping)) => grouping.names.as_mut().map(|names| &mut names[0]),
            _ => None,
        };
        let [before, own] = names;
        turn_one(later, before, turn, own, now)
    }

    /// Undoes or redoes the transform of a group. Returns the new transform, unless a later arrangement sets one.
    pub(super) fn turn_place(
        &mut self,
        at: u64,
        group: usize,
        before: &mut Transform,
        turn: Turn,
        own: Transform,
        now: Transform,
    ) -> Option<Transform> {
        let later = match self.next_of(Key::Transform(group), at) {
            Some(Arrangement::Place { before, .. }) => Some(before),
            _ => None,
        };
        turn_one(later, before, turn, &own, || now)
    }

    /// The next active arrangement that sets the same property.
    fn next_of(&mut self, key: Key, at: u64) -> Option<&mut Arrangement> {
        let next = self.in_index(Turn::MadeAgain, key, [at + 1, u64::MAX], 1).pop()?;
        self.active.get_mut(&next)
    }

    /// Makes an active arrangement part of the base. Earlier arrangements lose the values that this arrangement
    /// replaces, and its moves are applied before the moves of earlier ones. Returns the strokes whose offsets change,
    /// even if only in the last bit. `hangs` states whether the arrangement has set a parent.
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

    /// Removes a property from all arrangements before `at`. `change` removes it from an arrangement; this function then
    /// removes the entry of the index.
    fn change_earlier(&mut self, at: u64, key: Key, change: impl Fn(&mut Arrangement)) {
        for turn in [Turn::MadeAgain, Turn::TakenBack] {
            for at in self.in_index(turn, key, [0, at - 1], usize::MAX) {
                self.index.remove(&(turn, key, at));
                self.of_mut(turn).get_mut(&at).into_iter().for_each(&change);
            }
        }
    }

    /// Removes these strokes from all arrangements of this kind before `at`.
    fn drop_earlier<T: Settled>(&mut self, at: u64, strokes: &[Named<T>]) {
        for turn in [Turn::MadeAgain, Turn::TakenBack] {
            let keys = strokes.iter().map(|named| T::key(named.stroke));
            for at in self.sharing(turn, keys, [0, at - 1], usize::MAX) {
                let Some(earlier) = self.of_mut(turn).get_mut(&at).and_then(T::list) else { continue };
                let dropped = common(strokes, earlier);
                drop_common(earlier, strokes);
                for (i, _) in dropped {
                    self.index.remove(&(turn, T::key(strokes[i].stroke), at));
                }
            }
        }
    }

    fn forget_moves(&mut self, at: u64, moved: &[Named<Way>]) -> Vec<(u32, glam::Vec3)> {
        let mut offsets: Vec<Option<glam::Vec3>> = vec![None; moved.len()];
        let keys = moved.iter().map(|named| Key::Offset(named.stroke));
        for place in self.sharing(Turn::MadeAgain, keys, [0, u64::MAX], usize::MAX) {
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

/// Calls `each` with every property that an arrangement sets, including those of strokes only if `of_strokes`.
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

/// Undoes or redoes a single value. `later` is the value that the next arrangement replaced, `now` the current value.
/// Returns the value to set, unless a later arrangement determines it.
fn turn_one<T: Clone>(
    later: Option<&mut T>,
    before: &mut T,
    turn: Turn,
    own: &T,
    now: impl FnOnce() -> T,
) -> Option<T> {
    match (later, turn) {
        (Some(later), Turn::TakenBack) => {
            *later = before.clone();
            None
        }
        (Some(later), Turn::MadeAgain) => {
            *before = std::mem::replace(later, own.clone());
            None
        }
        (None, Turn::TakenBack) => Some(before.clone()),
        (None, Turn::MadeAgain) => {
            *before = now();
            Some(own.clone())
        }
    }
}

#[cfg(test)]
mod tests;
