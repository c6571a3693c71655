use std::collections::BTreeMap;

/// A set of numbers, most of them consecutive, stored as ranges.
#[derive(Clone, Debug, Default)]
pub(super) struct UsedNumbers {
    /// First and last number of each range; ranges are not adjacent.
    rows: BTreeMap<u32, u32>,
}

impl UsedNumbers {
    pub(super) fn contains(&self, number: u32) -> bool {
        self.rows.range(..=number).next_back().is_some_and(|(_, &last)| number <= last)
    }

    pub(super) fn insert(&mut self, number: u32) {
        if self.contains(number) {
            return;
        }
        let (mut first, mut last) = (number, number);
        if let Some(next) = number.checked_add(1)
            && let Some(end) = self.rows.remove(&next)
        {
            last = end;
        }
        if let Some((&start, &end)) = self.rows.range(..number).next_back()
            && end + 1 == number
        {
            first = start;
        }
        self.rows.insert(first, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_grow_together() {
        let mut used = UsedNumbers::default();
        for number in [5, 7, 6, 0, u32::MAX, u32::MAX - 1, 6, 1] {
            used.insert(number);
        }
        let is_in = |number: u32| used.contains(number);
        assert_eq!([0, 1, 5, 6, 7, u32::MAX - 1, u32::MAX].map(is_in), [true; 7]);
        assert_eq!([2, 4, 8, u32::MAX - 2].map(is_in), [false; 4]);
        assert_eq!(used.rows.len(), 3);
    }
}
