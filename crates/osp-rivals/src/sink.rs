use osp::{
    index::{
        Visit, Visitor,
        kernels::{IdWriter, Kernel},
    },
    polygon::PolygonId,
};

/// The receiver of a query's results: a draw list, or a visitor of [`osp::index::SpatialIndex::traverse`].
pub(super) trait Sink {
    fn put(&mut self, ids: &[PolygonId]);

    /// Adds the ids in `lanes` among sixteen ids.
    #[inline(always)]
    fn put_lanes<K: Kernel>(&mut self, _kernel: K, ids: &[u32; 16], lanes: u32) {
        let (mut seen, mut count, mut left) = ([PolygonId(0); 16], 0, lanes & 0xFFFF);
        while left != 0 {
            seen[count] = PolygonId(ids[left.trailing_zeros() as usize]);
            count += 1;
            left &= left - 1;
        }
        self.put(&seen[..count]);
    }
}

impl Sink for IdWriter<'_> {
    #[inline]
    fn put(&mut self, ids: &[PolygonId]) {
        self.push_slice(ids);
    }

    #[inline(always)]
    fn put_lanes<K: Kernel>(&mut self, kernel: K, ids: &[u32; 16], lanes: u32) {
        self.push_packed(kernel, ids, lanes);
    }
}

impl Sink for Vec<PolygonId> {
    #[inline]
    fn put(&mut self, ids: &[PolygonId]) {
        self.extend_from_slice(ids);
    }
}

/// Passes all ids to a visitor, together with the visitor's decision about their node.
pub(super) struct VisitorSink<'a> {
    pub(super) visitor: &'a mut dyn Visitor,
    pub(super) decision: Visit,
}

impl Sink for VisitorSink<'_> {
    fn put(&mut self, ids: &[PolygonId]) {
        if !ids.is_empty() {
            self.visitor.polygons(ids, self.decision);
        }
    }
}

/// Collects single ids into slices for a [`Sink`], on the stack.
pub(super) struct Gather {
    ids: [PolygonId; 64],
    len: usize,
}

impl Gather {
    pub(super) const fn new() -> Self {
        Self { ids: [PolygonId(0); 64], len: 0 }
    }

    #[inline]
    pub(super) fn push(&mut self, id: PolygonId, sink: &mut impl Sink) {
        if self.len == self.ids.len() {
            self.flush(sink);
        }
        self.ids[self.len] = id;
        self.len += 1;
    }

    pub(super) fn flush(&mut self, sink: &mut impl Sink) {
        sink.put(&self.ids[..self.len]);
        self.len = 0;
    }
}
