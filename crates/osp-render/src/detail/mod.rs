//! Level of detail: one merged quad replaces several polygons of a stroke if no point of the picture then moves by half
//! a pixel.
//!
//! When polygons are sent, each cluster gets the quads that [`merge`] finds: two neighbours become one quad, two such
//! quads become one, and so on. Each quad has an error, in metres. A frame draws the largest quads whose error is less
//! than half a pixel at the near side of the cluster. Polygons without such a quad are drawn themselves.

mod merge;
#[cfg(test)]
mod tests;

use bytemuck::Zeroable as _;

use super::{
    Classes, Colors, Gpu,
    chunks::Chunks,
    gpu::CHUNKS_A_PAGE,
    listing::{Numbers, Sink},
    record::PolygonRecord,
    run::CLUSTER,
};
use merge::{Look, Source, merge};
use osp::{
    math::Aabb,
    polygon::{PolygonId, bits},
    view::View,
};
use osp_session::scene::Scene;

/// A merged quad is drawn if its error in the picture is below this number of pixels.
const MOST_PIXELS: f32 = 0.5;

/// Memory for merged quads is reserved in blocks of this number of quads.
const ROOM: usize = 8;

/// The merged quads of one cluster, at most 64. If two quads share polygons, the larger one comes first.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    /// Bounds of the polygons that the quads replace.
    bounds: Aabb,
    first: u32,
    count: u32,
}

#[derive(Debug)]
pub(super) struct MergedQuads {
    chunks: Chunks,
    errors_m: Vec<f32>,
    /// For each quad, a bit for each polygon of its cluster that it replaces.
    masks: Vec<u64>,
    clusters: Vec<Option<Cluster>>,
    /// A bit for each cluster whose polygons have changed since the last merge. Such a cluster has no quads.
    stale: Vec<u64>,
    any_stale: bool,
    /// `unused[n]` lists the first quad numbers of unused ranges of `n` blocks.
    unused: [Vec<u32>; CLUSTER / ROOM + 1],
}

impl MergedQuads {
    /// Creates the store for a scene of `count` polygons that lie in `chunks`. All clusters count as changed.
    pub(super) fn new(chunks: &Chunks, count: usize) -> Self {
        let chunks = chunks.alike();
        let (errors_m, masks, clusters, stale) = Default::default();
        let (any_stale, unused) = Default::default();
        let mut new = Self { chunks, errors_m, masks, clusters, stale, any_stale, unused };
        (0..count).step_by(CLUSTER).for_each(|polygon| new.note(polygon));
        new
    }

    pub(super) fn bytes(&self) -> u64 {
        self.chunks.bytes()
    }

    pub(super) fn page(&self, page: u32) -> Option<&wgpu::BindGroup> {
        self.chunks.page(page)
    }

    /// Records that a polygon is new or has changed. Its cluster has no quads until the next [`MergedQuads::send`].
    pub(super) fn note(&mut self, polygon: usize) {
        let cluster = polygon / CLUSTER;
        if cluster >= self.clusters.len() {
            self.clusters.resize(cluster + 1, None);
            self.stale.resize(bits::words_for(cluster + 1), 0);
        }
        bits::insert(&mut self.stale, cluster);
        self.any_stale = true;
        self.drop_quads(cluster);
    }

    /// Drops the quads of polygons from number `count` on.
    pub(super) fn truncate(&mut self, count: usize) {
        for cluster in count / CLUSTER..self.clusters.len() {
            self.drop_quads(cluster);
        }
        if !count.is_multiple_of(CLUSTER) {
            self.note(count);
        }
    }

    fn drop_quads(&mut self, cluster: usize) {
        if let Some(Cluster { first, count, .. }) = self.clusters[cluster].take() {
            self.unused[(count as usize).div_ceil(ROOM)].push(first);
        }
    }

    /// Merges the polygons of at most `most` changed clusters and sends the quads; returns the number of bytes sent.
    /// `classes_of` returns the drawing classes of 64 polygons.
    pub(super) fn send(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        colors: Colors,
        most: usize,
        classes_of: impl Fn(usize) -> Classes,
    ) -> u64 {
        if !self.any_stale {
            return 0;
        }
        let stale: Vec<usize> = bits::iter(&self.stale).take(most.saturating_add(1)).collect();
        self.any_stale = stale.len() > most;
        let mut sources = Vec::new();
        let mut pending = (0, Vec::new());
        let mut bytes = 0;
        for &cluster in stale.iter().take(most) {
            bits::remove(&mut self.stale, cluster);
            let first = cluster * CLUSTER;
            collect(scene, colors, first, classes_of(first), &mut sources);
            let (quads, bounds) = merge(&sources);
            if quads.is_empty() {
                continue;
            }
            let at = self.reserve(quads.len());
            self.chunks.grow(gpu, self.masks.len());
            let is_next = at == pending.0 + pending.1.len() && !at.is_multiple_of(self.chunks.len);
            if !is_next {
                bytes += self.write(gpu, &mut pending);
                pending.0 = at;
            }
            pending.1.extend(quads.iter().map(|quad| quad.record));
            pending.1.resize(pending.1.len().next_multiple_of(ROOM), PolygonRecord::zeroed());
            for (number, quad) in (at..).zip(&quads) {
                (self.errors_m[number], self.masks[number]) = (quad.error_m, quad.mask);
            }
            self.clusters[cluster] = Some(Cluster { bounds, first: at as u32, count: quads.len() as u32 });
        }
        bytes + self.write(gpu, &mut pending)
    }

    fn write(&mut self, gpu: &Gpu, (first, records): &mut (usize, Vec<PolygonRecord>)) -> u64 {
        let bytes = records.len() as u64 * PolygonRecord::SIZE;
        if bytes > 0 {
            self.chunks.write(gpu, *first, records);
            records.clear();
        }
        bytes
    }

    /// Reserves memory for `count` quads in one chunk; returns the number of the first quad.
    fn reserve(&mut self, count: usize) -> usize {
        let blocks = count.div_ceil(ROOM);
        if let Some(first) = self.unused[blocks].pop() {
            return first as usize;
        }
        let (end, len) = (self.masks.len(), self.chunks.len);
        let left = len - end % len;
        let first = if left < blocks * ROOM { end + left } else { end };
        self.errors_m.resize(first + blocks * ROOM, 0.0);
        self.masks.resize(first + blocks * ROOM, 0);
        first
    }
}

/// Collects the opaque polygons of a cluster that may be merged.
fn collect(scene: &Scene, colors: Colors, first: usize, classes: Classes, sources: &mut Vec<Source>) {
    sources.clear();
    let count = scene.polygon_count().saturating_sub(first).min(CLUSTER);
    for bit in 0..count as u32 {
        let id = PolygonId(first as u32 + bit);
        let stroke = scene.stroke_of(id);
        let is_opaque = (classes.additive | classes.transparent) >> bit & 1 == 0;
        if let Some(look) =
            Look::of(stroke).filter(|_| is_opaque && !scene.are_freed(id.index()..id.index() + 1))
        {
            let record = PolygonRecord::of(scene, id, colors);
            sources.push(Source { bit, stroke: std::ptr::from_ref(stroke).addr(), look, record });
        }
    }
}

/// The view of a frame, which determines the size of an error in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detail<'a> {
    merged: &'a MergedQuads,
    view: View,
    /// Number of pixels per metre at a depth of 1 m.
    pixels_a_m: f32,
}

impl<'a> Detail<'a> {
    pub(super) fn new(merged: &'a MergedQuads, view: &View, size: (u32, u32)) -> Self {
        let of = &view.projection;
        let pixels_a_m = (size.0 as f32 / (of.right - of.left)).max(size.1 as f32 / (of.top - of.bottom));
        Self { merged, view: *view, pixels_a_m }
    }

    /// Largest error that a merged quad within these bounds may have, metres: half a pixel in the picture. 0 if the bounds
    /// reach the near plane.
    fn most_m(&self, bounds: &Aabb) -> f32 {
        let middle = bounds.center() - self.view.eye_in_world;
        let radius_m = bounds.extent().length() * 0.5;
        let depth_m = middle.dot(self.view.forward_in_world());
        let beside_m = (middle.length_squared() - depth_m * depth_m).max(0.0).sqrt() + radius_m;
        let near_m = depth_m - radius_m;
        if near_m <= self.view.projection.near_m {
            return 0.0;
        }
        // Towards the picture's border, a perspective projection stretches lengths by up to 1 / `cos`.
        let cos = near_m / near_m.hypot(beside_m);
        MOST_PIXELS * near_m * cos / self.pixels_a_m
    }
}

/// Lists opaque polygons, or the merged quads that replace them.
pub(super) struct Coarsened<'a> {
    pub(super) numbers: Numbers<'a>,
    pub(super) detail: Detail<'a>,
    /// Receives the numbers of merged quads.
    pub(super) quads: &'a mut Vec<PolygonId>,
}

impl Sink for Coarsened<'_> {
    fn takes_chunk(&mut self, first: usize, words: &[u64]) -> bool {
        let clusters = &self.detail.merged.clusters;
        let range =
            (first / CLUSTER).min(clusters.len())..(first / CLUSTER + words.len()).min(clusters.len());
        clusters[range].iter().all(Option::is_none) && self.numbers.takes_chunk(first, words)
    }

    fn add(&mut self, first: usize, opaque: u64) {
        let mut left = opaque;
        if opaque != 0
            && let Some(Some(cluster)) = self.detail.merged.clusters.get(first / CLUSTER)
        {
            let most_m = self.detail.most_m(&cluster.bounds);
            let merged = self.detail.merged;
            let quads = cluster.first as usize..(cluster.first + cluster.count) as usize;
            let is_exact = |(i, error_m): (usize, &f32)| u64::from(*error_m < most_m) << i;
            let errors_m = merged.errors_m[quads.clone()].iter().enumerate();
            let exact = errors_m.map(is_exact).fold(0, |all, bit| all | bit);
            let masks = &merged.masks[quads];
            for i in bits::bits_of(exact) {
                if masks[i] & left != 0 {
                    left &= !masks[i];
                    self.quads.push(PolygonId(cluster.first + i as u32));
                    if left == 0 {
                        break;
                    }
                }
            }
        }
        self.numbers.add(first, left);
    }

    fn end_page(&mut self, page: usize) {
        self.numbers.end_page(page);
    }
}

/// Page numbers of merged quads begin at this number.
pub(super) const MERGED_PAGES: u32 = 1 << 31;

const _: () = assert!(CHUNKS_A_PAGE < MERGED_PAGES as usize && CLUSTER.is_multiple_of(ROOM));
