/// A growing array in pages of fixed size: pushing never copies what is already there.
#[derive(Clone, Debug)]
pub struct Paged<T> {
    pages: Vec<Vec<T>>,
}

impl<T> Paged<T> {
    /// Entries of a page.
    pub const PAGE: usize = 4096;

    /// An empty array.
    pub const fn new() -> Self {
        Self { pages: Vec::new() }
    }

    /// Appends an entry; allocates once every [`Paged::PAGE`] entries.
    pub fn push(&mut self, value: T) {
        match self.pages.last_mut() {
            Some(page) if page.len() < Self::PAGE => page.push(value),
            _ => {
                let mut page = Vec::with_capacity(Self::PAGE);
                page.push(value);
                self.pages.push(page);
            }
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.pages.last().map_or(0, |last| (self.pages.len() - 1) * Self::PAGE + last.len())
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    /// The entry, if it exists.
    pub fn get(&self, i: usize) -> Option<&T> {
        self.pages.get(i / Self::PAGE)?.get(i % Self::PAGE)
    }

    /// The entry, if it exists.
    pub fn get_mut(&mut self, i: usize) -> Option<&mut T> {
        self.pages.get_mut(i / Self::PAGE)?.get_mut(i % Self::PAGE)
    }

    /// All entries in order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.pages.iter().flatten()
    }
}

impl<T> Default for Paged<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> std::ops::Index<usize> for Paged<T> {
    type Output = T;

    fn index(&self, i: usize) -> &T {
        &self.pages[i / Self::PAGE][i % Self::PAGE]
    }
}

impl<T> std::ops::IndexMut<usize> for Paged<T> {
    fn index_mut(&mut self, i: usize) -> &mut T {
        &mut self.pages[i / Self::PAGE][i % Self::PAGE]
    }
}
