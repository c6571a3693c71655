//! The arrangements that authors can still take back or make again, in the order of the session, and what that comes to.
//!
//! Whose arrangement it is does not matter here: the state is what all active ones come to, one after the other. Moves add
//! up; of groupings, placings and layers the last one counts. Each active arrangement knows what it found, so that taking
//! back the last one that concerns a stroke or group costs no more than that. Where others have arranged the same since,
//! what they found changes with it.
//!
//! An arrangement that no undo reaches any more stays for good, and becomes part of the base: all others are after it.

use std::collections::BTreeMap;
use std::ops::Bound::{Excluded, Unbounded};

use super::edit::{Arrangement, Grouping, Named, Way};

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    /// Those that count, by their places.
    active: BTreeMap<u64, Arrangement>,
    /// Those that were taken back and can be made again.
    taken_back: BTreeMap<u64, Arrangement>,
    next: u64,
}

/// What an arrangement is to become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    TakenBack,
    MadeAgain,
}

/// The places of the strokes that are in both lists, ascending.
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

/// The list of an arrangement of which the last one counts, with what each stroke had before.
pub(super) trait Settled: Copy {
    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>>;
}

impl Settled for Option<usize> {
    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Group(grouping) = what { Some(&mut grouping.members) } else { None }
    }
}

impl Settled for u32 {
    fn list(what: &mut Arrangement) -> Option<&mut Vec<Named<Self>>> {
        if let Arrangement::Assign { strokes, .. } = what { Some(strokes) } else { None }
    }
}

impl Log {
    /// Adds an arrangement that has been made; its place.
    pub(super) fn add(&mut self, what: Arrangement) -> u64 {
        let at = self.next;
        self.next += 1;
        self.active.insert(at, what);
        at
    }

    /// Takes an arrangement out, to be given back by [`Log::put`].
    pub(super) fn take(&mut self, at: u64) -> Arrangement {
        self.active.remove(&at).or_else(|| self.taken_back.remove(&at)).unwrap_or_default()
    }

    pub(super) fn put(&mut self, at: u64, what: Arrangement, turn: Turn) {
        match turn {
            Turn::MadeAgain => self.active.insert(at, what),
            Turn::TakenBack => self.taken_back.insert(at, what),
        };
    }

    /// One that was taken back will not be made again.
    pub(super) fn remove(&mut self, at: u64) {
        self.taken_back.remove(&at);
    }

    /// The active ones after a place.
    fn later(&mut self, at: u64) -> impl Iterator<Item = &mut Arrangement> {
        self.active.range_mut((Excluded(at), Unbounded)).map(|(_, what)| what)
    }

    /// The active ones, in their order.
    pub(super) fn active_groupings(&mut self) -> impl Iterator<Item = &mut Grouping> {
        self.active.values_mut().filter_map(|what| match what {
            Arrangement::Group(grouping) => Some(&mut **grouping),
            _ => None,
        })
    }

    /// What each group that active groupings hang hung under before the first of them, and the place of that.
    pub(super) fn first_hangings(&self) -> BTreeMap<usize, (u64, Option<usize>)> {
        let mut first = BTreeMap::new();
        for (&at, what) in &self.active {
            if let Arrangement::Group(grouping) = what
                && let Some(hanging) = grouping.hanging
            {
                first.entry(grouping.group).or_insert((at, hanging.before));
            }
        }
        first
    }

    /// What the first later grouping that hangs this group found.
    pub(super) fn found_later(&mut self, at: u64, group: usize) -> Option<Option<usize>> {
        self.later(at).find_map(|what| match what {
            Arrangement::Group(grouping) if grouping.group == group => Some(grouping.hanging?.before),
            _ => None,
        })
    }

    /// Whether a later grouping depends on what this group hangs under.
    pub(super) fn is_hanging_depended_on(&mut self, at: u64, group: usize) -> bool {
        self.later(at).any(|what| match what {
            Arrangement::Group(grouping) => grouping.hanging.is_some_and(|hanging| {
                grouping.group == group || !hanging.holds || hanging.before != hanging.parent
            }),
            _ => false,
        })
    }

    /// The offsets of moved strokes, once their move is taken back or made again, in `moved[..].of.before + by` or
    /// `before`. `now` says a stroke's offset now.
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
        for what in self.later(at) {
            let Arrangement::Move(later) = what else { continue };
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

    /// Takes a list back or makes it again, of which the last arrangement of a stroke counts: `own` is what it sets.
    /// Calls `set` for the strokes that nothing later settles. `now` says what a stroke has now.
    pub(super) fn turn_settled<T: Settled>(
        &mut self,
        at: u64,
        list: &mut [Named<T>],
        turn: Turn,
        own: T,
        now: impl Fn(u32) -> T,
    ) -> Vec<(u32, T)> {
        let mut is_settled = vec![false; list.len()];
        for what in self.later(at) {
            let Some(later) = T::list(what) else { continue };
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

    /// The same for what there is one of: `find` gives what a later arrangement found. The value to set, if nothing later
    /// settles it.
    pub(super) fn turn_one<T: Clone>(
        &mut self,
        at: u64,
        before: &mut T,
        turn: Turn,
        own: &T,
        now: T,
        find: impl for<'a> Fn(&'a mut Arrangement) -> Option<&'a mut T>,
    ) -> Option<T> {
        match (self.later(at).find_map(find), turn) {
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
                *before = now;
                Some(own.clone())
            }
        }
    }

    /// An active arrangement becomes part of the base: those before it have no say any more in what it settles, and its
    /// moves come before theirs. The strokes that have another offset by that, if only in its last bit.
    pub(super) fn forget(&mut self, at: u64) -> Vec<(u32, glam::Vec3)> {
        let Some(what) = self.active.remove(&at) else { return Vec::new() };
        let (active, taken_back) = (self.active.range_mut(..at), self.taken_back.range_mut(..at));
        let mut earlier = active.chain(taken_back).map(|(_, what)| what).peekable();
        if earlier.peek().is_none() {
            return Vec::new();
        }
        match &what {
            Arrangement::Nothing => {}
            Arrangement::Move(moved) => return self.forget_moves(at, moved),
            Arrangement::Group(forgotten) => {
                for earlier in earlier {
                    let Arrangement::Group(grouping) = earlier else { continue };
                    drop_common(&mut grouping.members, &forgotten.members);
                    if grouping.group == forgotten.group {
                        let is_settled = forgotten.hanging.is_some_and(|hanging| hanging.holds);
                        grouping.hanging = grouping.hanging.filter(|_| !is_settled);
                        grouping.names = grouping.names.take().filter(|_| forgotten.names.is_none());
                    }
                }
            }
            Arrangement::Place { group, .. } => {
                let is_same =
                    |what: &Arrangement| matches!(what, Arrangement::Place { group: of, .. } if of == group);
                earlier.filter(|what| is_same(what)).for_each(|what| *what = Arrangement::Nothing);
            }
            Arrangement::Assign { strokes, .. } => {
                for earlier in earlier {
                    if let Arrangement::Assign { strokes: of, .. } = earlier {
                        drop_common(of, strokes);
                    }
                }
            }
        }
        Vec::new()
    }

    fn forget_moves(&mut self, at: u64, moved: &[Named<Way>]) -> Vec<(u32, glam::Vec3)> {
        let mut offsets: Vec<Option<glam::Vec3>> = vec![None; moved.len()];
        for (&place, what) in &mut self.active {
            let Arrangement::Move(list) = what else { continue };
            for (i, j) in common(moved, list) {
                // Where no move was before this one, nothing changes.
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
