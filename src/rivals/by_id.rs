use crate::{
    index::{IndexError, admission::admit},
    math::Aabb,
    polygon::PolygonId,
};

/// Stands for "no polygon" where an array has a hole; it is beyond [`PolygonId::LIMIT`].
pub(super) const NO_POLYGON: PolygonId = PolygonId(u32::MAX);

/// Entries of a page of [`ById`].
const PAGE: usize = 4096;

/// One small value for every polygon id, in pages that are made when an id of theirs is first used: setting a value
/// never copies the others, and a stray large id costs a page, not an array up to it.
#[derive(Clone, Debug)]
pub(super) struct ById<T> {
    pages: Vec<Option<Box<[T]>>>,
    vacant: T,
}

impl<T: Copy> ById<T> {
    /// No values; ids without one read as `vacant`.
    pub(super) const fn new(vacant: T) -> Self {
        Self { pages: Vec::new(), vacant }
    }

    /// Makes the pages for the ids below `count`.
    pub(super) fn reserve(&mut self, count: usize) {
        let pages = count.div_ceil(PAGE);
        if self.pages.len() < pages {
            self.pages.resize_with(pages, || None);
        }
        for page in &mut self.pages[..pages] {
            page.get_or_insert_with(|| vec![self.vacant; PAGE].into_boxed_slice());
        }
    }

    #[inline]
    pub(super) fn get(&self, id: PolygonId) -> T {
        match self.pages.get(id.index() / PAGE) {
            Some(Some(page)) => page[id.index() % PAGE],
            _ => self.vacant,
        }
    }

    #[inline]
    pub(super) fn set(&mut self, id: PolygonId, value: T) {
        let number = id.index() / PAGE;
        if number >= self.pages.len() {
            self.pages.resize_with(number + 1, || None);
        }
        let page = self.pages[number].get_or_insert_with(|| vec![self.vacant; PAGE].into_boxed_slice());
        page[id.index() % PAGE] = value;
    }

    /// Every entry of every page, vacant ones too, ascending by id.
    pub(super) fn iter(&self) -> impl Iterator<Item = (PolygonId, &T)> {
        self.pages.iter().enumerate().filter_map(|(n, page)| Some((n, page.as_ref()?))).flat_map(
            |(n, page)| {
                page.iter().enumerate().map(move |(i, value)| (PolygonId((n * PAGE + i) as u32), value))
            },
        )
    }

    /// Makes every value vacant; keeps the pages.
    pub(super) fn clear(&mut self) {
        for page in self.pages.iter_mut().flatten() {
            page.fill(self.vacant);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let pages = self.pages.iter().flatten().count();
        self.pages.capacity() * size_of::<Option<Box<[T]>>>() + pages * PAGE * size_of::<T>()
    }
}

/// The boxes filed in an index, by id, and the checks that every index makes before it changes anything.
#[derive(Clone, Debug)]
pub(super) struct FiledBoxes {
    boxes: ById<Aabb>,
    len: usize,
}

impl FiledBoxes {
    pub(super) const fn new() -> Self {
        Self { boxes: ById::new(Aabb::EMPTY), len: 0 }
    }

    pub(super) fn with_capacity(capacity: usize) -> Self {
        let mut filed = Self::new();
        filed.boxes.reserve(capacity);
        filed
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The box of a polygon that is filed; [`Aabb::EMPTY`] of any other.
    #[inline]
    pub(super) fn get(&self, id: PolygonId) -> Aabb {
        self.boxes.get(id)
    }

    #[inline]
    pub(super) fn contains(&self, id: PolygonId) -> bool {
        !self.boxes.get(id).is_empty()
    }

    /// Files a box.
    pub(super) fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        if self.contains(id) {
            return Err(IndexError::Duplicate(id));
        }
        self.boxes.set(id, *bounds);
        self.len += 1;
        Ok(())
    }

    /// Takes a box out and returns it.
    pub(super) fn remove(&mut self, id: PolygonId) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        self.boxes.set(id, Aabb::EMPTY);
        self.len -= 1;
        Ok(before)
    }

    /// Replaces a box and returns the one of before.
    pub(super) fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<Aabb, IndexError> {
        let before = self.boxes.get(id);
        if before.is_empty() {
            return Err(IndexError::Unknown(id));
        }
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        self.boxes.set(id, *bounds);
        Ok(before)
    }

    /// What is filed, ascending by id.
    pub(super) fn iter(&self) -> impl Iterator<Item = (PolygonId, &Aabb)> {
        self.boxes.iter().filter(|(_, bounds)| !bounds.is_empty())
    }

    pub(super) fn clear(&mut self) {
        self.boxes.clear();
        self.len = 0;
    }

    pub(super) fn bytes(&self) -> usize {
        self.boxes.bytes()
    }
}
