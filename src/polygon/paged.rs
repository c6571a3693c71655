use super::bits;

/// A growing array in pages of fixed size. Pushing never copies existing entries, and entries can be released. A page with
/// less than a quarter of its entries left stores only these entries; an empty page stores none.
#[derive(Clone, Debug)]
pub struct Paged<T, const PAGE: usize = 4096> {
    pages: Vec<Page<T>>,
    len: usize,
}

/// A full page is compacted when at most 1 / THIN of its entries is left. If it is larger, pages with many holes are
/// compacted later, with less copying and more memory.
const THIN: usize = 4;

#[derive(Clone, Debug)]
struct Page<T> {
    entries: Vec<T>,
    /// The positions of the `entries` of a compacted page.
    held: Option<Box<Held>>,
    /// The positions that have not been released; `None` if none has been.
    left: Option<Box<[u64]>>,
    left_count: usize,
}

/// The positions whose entries a compacted page stores.
#[derive(Clone, Debug)]
struct Held {
    words: Box<[u64]>,
    /// Number of stored positions before each word.
    before: Box<[u16]>,
}

impl Held {
    fn rank(&self, at: usize) -> Option<usize> {
        bits::contains(&self.words, at)
            .then(|| usize::from(self.before[at / bits::WORD]) + bits::rank_in_word(&self.words, at))
    }
}

impl<T> Page<T> {
    fn with_room(entries: usize) -> Self {
        Self { entries: Vec::with_capacity(entries), held: None, left: None, left_count: 0 }
    }

    /// Index in `entries` of the entry at a position; `None` if it was released.
    fn find(&self, at: usize) -> Option<usize> {
        if let Some(left) = &self.left
            && !bits::contains(left, at)
        {
            return None;
        }
        match &self.held {
            None => Some(at),
            Some(held) => held.rank(at),
        }
    }

    /// Compacts the page: drops the released entries.
    fn thin(&mut self) {
        let Some(left) = &self.left else { return };
        if self.left_count == 0 {
            *self = Self { left: Some(Box::default()), ..Self::with_room(0) };
            return;
        }
        let mut is_kept = vec![false; self.entries.len()];
        for at in bits::iter(left) {
            if let Some(is_kept) = self.find(at).and_then(|place| is_kept.get_mut(place)) {
                *is_kept = true;
            }
        }
        let mut before = Vec::with_capacity(left.len());
        let mut count = 0;
        for word in left {
            before.push(count);
            count += word.count_ones() as u16;
        }
        self.held = Some(Box::new(Held { before: before.into_boxed_slice(), words: left.clone() }));
        let mut kept = Vec::with_capacity(self.left_count);
        let entries = std::mem::take(&mut self.entries).into_iter().zip(is_kept);
        kept.extend(entries.filter_map(|(entry, is_kept)| is_kept.then_some(entry)));
        self.entries = kept;
    }
}

impl<T, const PAGE: usize> Paged<T, PAGE> {
    /// Number of entries of a page.
    pub const PAGE: usize = PAGE;

    /// An empty array.
    pub const fn new() -> Self {
        // The ranks of a compacted page are 16 bits wide.
        const { assert!(PAGE >= 1 && PAGE <= 1 << 15) };
        Self { pages: Vec::new(), len: 0 }
    }

    /// Appends an entry; allocates once every [`Paged::PAGE`] entries.
    pub fn push(&mut self, value: T) {
        if self.len.is_multiple_of(PAGE) {
            self.pages.push(Page::with_room(PAGE));
        }
        self.len += 1;
        let at = (self.len - 1) / PAGE;
        let page = &mut self.pages[at];
        page.entries.push(value);
        page.left_count += 1;
        self.thin_if_worth_it(at);
    }

    /// Number of entries, including the released ones.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no entry was ever pushed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The entry, if it exists and was not released.
    pub fn get(&self, i: usize) -> Option<&T> {
        let page = self.pages.get(i / PAGE)?;
        page.entries.get(page.find(i % PAGE)?)
    }

    /// The entry, if it exists and was not released.
    pub fn get_mut(&mut self, i: usize) -> Option<&mut T> {
        let page = self.pages.get_mut(i / PAGE)?;
        let at = page.find(i % PAGE)?;
        page.entries.get_mut(at)
    }

    /// Releases an entry for good; its number is not reused.
    pub fn release(&mut self, i: usize) {
        if self.get(i).is_none() {
            return;
        }
        let (page, at) = (&mut self.pages[i / PAGE], i % PAGE);
        let left = page.left.get_or_insert_with(|| vec![u64::MAX; bits::words_for(PAGE)].into_boxed_slice());
        bits::remove(left, at);
        page.left_count -= 1;
        self.thin_if_worth_it(i / PAGE);
    }

    /// Compacts a page if few of its entries are left. A page that is not full stays, because it would have to be expanded
    /// again.
    fn thin_if_worth_it(&mut self, at: usize) {
        let is_full = (at + 1) * PAGE <= self.len;
        let page = &mut self.pages[at];
        if is_full && page.left.is_some() && page.left_count * THIN <= page.entries.len() {
            page.thin();
        }
    }

    /// Whether all entries of a range exist or existed, and all were released.
    pub fn all_released(&self, range: std::ops::Range<usize>) -> bool {
        let mut at = range.start;
        while at < range.end.min(self.len) {
            let is_empty = self.pages[at / PAGE].left_count == 0;
            if !is_empty && self.get(at).is_some() {
                return false;
            }
            at = if is_empty { (at / PAGE + 1) * PAGE } else { at + 1 };
        }
        range.end <= self.len
    }

    /// All entries in order, except the released ones.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        (0..self.len).filter_map(|i| self.get(i))
    }
}

impl<T, const PAGE: usize> Default for Paged<T, PAGE> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, const PAGE: usize> std::ops::Index<usize> for Paged<T, PAGE> {
    type Output = T;

    fn index(&self, i: usize) -> &T {
        self.get(i).expect("an entry that was pushed and not released")
    }
}

impl<T, const PAGE: usize> std::ops::IndexMut<usize> for Paged<T, PAGE> {
    fn index_mut(&mut self, i: usize) -> &mut T {
        self.get_mut(i).expect("an entry that was pushed and not released")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::{Pcg64, rand_core::Rng};

    fn held<T, const PAGE: usize>(paged: &Paged<T, PAGE>) -> usize {
        paged.pages.iter().map(|page| page.entries.capacity()).sum()
    }

    fn follows_a_plain_list<const PAGE: usize>(seed: u64) {
        let mut random = Pcg64::new(u128::from(seed), 1);
        let mut below = |count: usize| (random.next_u64() % count as u64) as usize;
        let (mut paged, mut plain) = (Paged::<u32, PAGE>::new(), Vec::<Option<u32>>::new());
        for _ in 0..6000 {
            if plain.is_empty() || below(10) < 4 {
                let value = plain.len() as u32 * 3;
                paged.push(value);
                plain.push(Some(value));
            } else {
                // Releases ranges, as strokes are, and single entries.
                let first = below(plain.len());
                let end = (first + 1 + below(12)).min(plain.len());
                for (i, entry) in plain.iter_mut().enumerate().take(end).skip(first) {
                    paged.release(i);
                    *entry = None;
                }
            }
            let i = below(plain.len());
            assert_eq!(paged.get(i).copied(), plain[i]);
            if let (Some(a), Some(b)) = (paged.get_mut(i), &mut plain[i]) {
                *a += 1;
                *b += 1;
            }
            assert_eq!(paged.len(), plain.len());
        }
        let all: Vec<Option<u32>> = (0..plain.len()).map(|i| paged.get(i).copied()).collect();
        assert_eq!(all, plain);
        assert!(paged.iter().copied().eq(plain.iter().flatten().copied()));
        assert_eq!(paged.get(plain.len()), None);
        for _ in 0..200 {
            let first = below(plain.len());
            let end = first + below(20);
            let none_left = plain.get(first..end).is_some_and(|range| range.iter().all(Option::is_none));
            assert_eq!(paged.all_released(first..end), none_left, "{first}..{end} of {}", plain.len());
        }
        let left = plain.iter().flatten().count();
        assert!(held(&paged) <= THIN * left + 2 * PAGE, "{left} left, room for {}", held(&paged));
        (0..plain.len()).for_each(|i| paged.release(i));
        assert!(paged.all_released(0..plain.len()) && !paged.all_released(0..plain.len() + 1));
        assert!(held(&paged) <= PAGE, "room for {} when nothing is left", held(&paged));
    }

    #[test]
    fn released_entries_are_gone_and_the_others_stay() {
        for seed in 0..4 {
            follows_a_plain_list::<64>(seed);
            follows_a_plain_list::<100>(seed);
            follows_a_plain_list::<4096>(seed);
            follows_a_plain_list::<1>(seed);
        }
    }
}
