/// A point on the timeline. Constant parents (of groups without groupings) come first, then base parents (before all
/// groupings), both ordered by group. Groupings follow, ordered by their log indices.
pub(super) type Time = (u64, usize);

pub(super) fn constant_time(group: usize) -> Time {
    (0, group)
}

pub(super) fn base_time(group: usize) -> Time {
    (1, group)
}

pub(super) fn time_of(place: u64) -> Time {
    (place + 2, 0)
}

/// The log index of the grouping at a time, if there is one.
pub(super) fn place_at(time: Time) -> Option<u64> {
    time.0.checked_sub(2)
}

pub(super) const END: Time = (u64::MAX, usize::MAX);
