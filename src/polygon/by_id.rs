use super::PolygonId;

/// Number of entries of a page of [`ById`]. If it is larger, a single large number takes more memory. If it is smaller,
/// the list of pages is longer.
const PAGE: usize = 1024;

/// One small value for every polygon number, in pages. A page exists while one of its values is not vacant. Setting a
/// value never copies the others, and a single large number takes a page, not an array up to this number. Vacant pages
/// are reused.
#[derive(Clone, Debug)]
pub struct ById<T> {
    pages: Vec<Option<Page<T>>>,
    /// Vacant pages.
    spare: Vec<Box<[T]>>,
    vacant: T,
}

#[derive(Clone, Debug)]
struct Page<T> {
    values: Box<[T]>,
    /// Number of values of the page that are not vacant, at least one.
    used: u32,
}

impl<T: Copy + PartialEq> ById<T> {
    /// No values. Numbers without a value read as `vacant`.
    pub const fn new(vacant: T) -> Self {
        Self { pages: Vec::new(), spare: Vec::new(), vacant }
    }

    /// Makes room for the numbers below `count`.
    pub fn reserve(&mut self, count: usize) {
        let pages = count.min(PolygonId::LIMIT as usize).div_ceil(PAGE);
        self.pages.reserve(pages.saturating_sub(self.pages.len()));
        let there = self.spare.len() + self.pages.iter().flatten().count();
        self.spare.reserve(pages.max(there));
        for _ in there..pages {
            self.spare.push(vec![self.vacant; PAGE].into_boxed_slice());
        }
    }

    /// The value of a number; `vacant` for a number without a value.
    #[inline]
    pub fn get(&self, id: PolygonId) -> T {
        match self.pages.get(id.index() / PAGE) {
            Some(Some(page)) => page.values[id.index() % PAGE],
            _ => self.vacant,
        }
    }

    /// Sets the value of a number below [`PolygonId::LIMIT`].
    #[inline]
    pub fn set(&mut self, id: PolygonId, value: T) {
        let (number, is_vacant) = (id.index() / PAGE, value == self.vacant);
        let Some(Some(page)) = self.pages.get_mut(number) else {
            if !is_vacant {
                self.add_page(number).values[id.index() % PAGE] = value;
            }
            return;
        };
        let before = std::mem::replace(&mut page.values[id.index() % PAGE], value);
        page.used = page.used + u32::from(!is_vacant) - u32::from(before != self.vacant);
        if page.used == 0 {
            self.spare.extend(self.pages[number].take().map(|page| page.values));
        }
    }

    /// Adds a page for the first value of its numbers.
    #[cold]
    fn add_page(&mut self, number: usize) -> &mut Page<T> {
        if number >= self.pages.len() {
            self.pages.resize_with(number + 1, || None);
        }
        let values = self.spare.pop().unwrap_or_else(|| vec![self.vacant; PAGE].into_boxed_slice());
        self.pages[number].insert(Page { values, used: 1 })
    }

    /// The values that are not vacant, ascending by number.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (PolygonId, &T)> {
        let pages = self.pages.iter().enumerate().filter_map(|(n, page)| Some((n, page.as_ref()?)));
        pages
            .flat_map(|(n, page)| page.values.iter().enumerate().map(move |(i, value)| (n * PAGE + i, value)))
            .filter(|(_, value)| **value != self.vacant)
            .map(|(number, value)| (PolygonId(number as u32), value))
    }

    /// Makes every value vacant; keeps the memory.
    pub fn clear(&mut self) {
        for mut page in self.pages.iter_mut().filter_map(Option::take) {
            page.values.fill(self.vacant);
            self.spare.push(page.values);
        }
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        let pages = self.spare.len() + self.pages.iter().flatten().count();
        self.pages.capacity() * size_of::<Option<Page<T>>>()
            + self.spare.capacity() * size_of::<Box<[T]>>()
            + pages * PAGE * size_of::<T>()
    }
}
