//! Previous-frame occluders: the polygons that were visible in the last frame occlude in this frame, as a picture of
//! connected surfaces. For machines without a usable GPU.
//!
//! In a painting or a building, thousands of small polygons together hide others, not a few large ones. Most polygons
//! visible in this frame were drawn in the last frame, too (temporal coherence; N. Greene, M. Kass, G. Miller,
//! "Hierarchical Z-Buffer Visibility", 1993). The drawn polygons are only a guess at good occluders: every
//! occluder belongs to the current model. So camera moves, new strokes and sudden turns need no special treatment.
//!
//! The picture ([`super::coverage`]) counts only pixels that a surface covers wholly, so that nothing visible is culled.

use glam::DVec3;

use super::{
    CoverageBuffer, CullConfig, PolygonTest, Soundness, ViewInput, coverage::Surfaces, cull::Tests,
    culler::OcclusionCuller, view_occlusion::remove_hidden,
};
use crate::{
    polygon::{BLOCK, Change, Geometry, PolygonId, VisibleBlocks, ids_of},
    view::ViewWindow,
};

/// Counts of [`PreviousFrameOccluders::cull`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PreviousFrameCounts {
    /// Number of occluders filled.
    pub occluders: u64,
    /// Number of tiles of the picture that are covered at least partly.
    pub tiles: u64,
    /// Number of nodes and polygons tested.
    pub tests: u64,
}

impl PreviousFrameCounts {
    /// Approximate time of this work, nanoseconds, computed from the counts: the same on every machine. In Castle
    /// and Sponza, building took 330 to 660 ns an occluder, and a query 35 to 71 ns a test. The columns `build` and `query`
    /// of `osp verify FILE --whole --camera inside|orbit --views 4 --occlusion depth-last` show these times.
    pub fn work_ns(&self) -> f64 {
        self.occluders as f64 * 400.0 + self.tests as f64 * 70.0
    }
}

/// A polygon that hid nothing is useless. All useless polygons are filled again in turn, in at least [`AGAIN_EVERY`]
/// frames, at most [`MOST_AGAIN`] in a frame.
const MOST_AGAIN: usize = 256;
const AGAIN_EVERY: usize = 16;

/// Largest number of polygons for which room is reserved at first, about 100 bytes each.
const MOST_RESERVED: usize = 1 << 17;

/// Largest number of changed polygons that are read in a frame.
const MOST_READS: u32 = 1 << 14;

/// If there are more candidates than occluders, blocks take turns: candidates of a block that are not occluders are
/// tried again in one of this many frames.
const TURNS: usize = 4;

/// In a jump, the eye moves by more than this share of the mean distance of the view's occluders, or turns by more than
/// 6 degrees.
const JUMP: f64 = 0.1;
const JUMP_COSINE: f64 = 0.9945;

/// A view's eye.
#[derive(Clone, Copy, Debug)]
struct Eye {
    eye_in_world: DVec3,
    forward: DVec3,
    /// Mean distance of the occluders.
    occluders_m: f64,
}

/// The state of a view after its last frame.
#[derive(Clone, Debug, Default)]
struct Seen {
    frame: usize,
    eye: Option<Eye>,
    /// Whether the view has jumped. If so, no polygons are left for later turns.
    has_jumped: bool,
    /// Whether there were more occluders than [`PreviousFrameOccluders::MOST_OCCLUDERS`].
    is_full: bool,
    /// The block at which the next frame begins to fill useless polygons again.
    again_from: usize,
    /// Hidden polygons in the frustum.
    hidden: VisibleBlocks,
    /// Drawn polygons.
    drawn: VisibleBlocks,
    /// Drawn polygons that hid nothing when they were filled last.
    useless: VisibleBlocks,
    /// Polygons that served as occluders in the last frame.
    filled: VisibleBlocks,
}

impl Seen {
    fn with_capacity(polygons: usize) -> Self {
        let set = || VisibleBlocks::with_capacity(polygons);
        Self { hidden: set(), drawn: set(), useless: set(), filled: set(), ..Self::default() }
    }

    fn clear(&mut self) {
        self.eye = None;
        let sets = [&mut self.hidden, &mut self.drawn, &mut self.useless, &mut self.filled];
        sets.into_iter().for_each(VisibleBlocks::clear);
    }

    /// Begins a frame.
    fn begin(&mut self, window: &ViewWindow) {
        self.frame = self.frame.wrapping_add(1);
        self.has_jumped = self.eye.is_none_or(|Eye { eye_in_world, forward, occluders_m }| {
            window.eye_in_world().distance(eye_in_world) > JUMP * occluders_m
                || window.forward().dot(forward) < JUMP_COSINE
        });
    }

    /// Whether it is the turn of a block's polygons in this frame.
    fn is_turn(&self, block: usize) -> bool {
        self.has_jumped || block % TURNS == self.frame % TURNS
    }

    fn remember(&mut self, in_view: &VisibleBlocks, drawn: &VisibleBlocks) {
        self.hidden.clear();
        for (block, mask) in in_view.blocks() {
            let hidden = mask & !drawn.mask(block);
            self.hidden.insert_block(block, hidden);
            self.useless.remove_block(block, hidden);
        }
        self.drawn.copy_from(drawn);
    }
}

/// Previous-frame occluders: the polygons that were visible in the last frame are rasterised as connected surfaces and hide
/// others in this frame. This suits models of many small polygons, and machines without a usable GPU.
#[derive(Clone, Debug)]
pub struct PreviousFrameOccluders {
    surfaces: Surfaces,
    /// The polygons whose current form `surfaces` contains.
    read: VisibleBlocks,
    /// The read polygons that may hide others with their whole area, so `surfaces` contains all their corners.
    whole: VisibleBlocks,
    buffer: CoverageBuffer,
    views: Vec<Seen>,
    /// Working memory: the filled polygons, and their sizes.
    filled: Vec<PolygonId>,
    scored: Vec<(f32, PolygonId)>,
    /// Whether the last build had an occluder.
    is_built: bool,
}

impl PreviousFrameOccluders {
    /// Largest number of polygons that a frame fills for a view: the largest ones as seen from the eye.
    pub const MOST_OCCLUDERS: usize = 8192;

    /// Width and height of the picture, pixels.
    pub const PICTURE: [u32; 2] = [1024, 576];

    /// A culler without a previous frame. The picture has `width` x `height` pixels; room is reserved for `polygons`
    /// polygons.
    pub fn new([width, height]: [u32; 2], polygons: usize) -> Self {
        let mut buffer = CoverageBuffer::new(width, height);
        let reserved = polygons.min(MOST_RESERVED);
        buffer.reserve(reserved, reserved.min(Self::MOST_OCCLUDERS));
        Self {
            surfaces: Surfaces::with_capacity(reserved),
            read: VisibleBlocks::with_capacity(polygons),
            whole: VisibleBlocks::with_capacity(polygons),
            buffer,
            views: vec![Seen::with_capacity(polygons)],
            scored: Vec::with_capacity(reserved),
            filled: Vec::with_capacity(reserved),
            is_built: false,
        }
    }

    /// Whether the picture can hide a visible polygon.
    pub fn soundness(&self) -> Soundness {
        self.buffer.soundness()
    }

    fn view(&mut self, view: usize) -> &mut Seen {
        if self.views.len() <= view {
            self.views.resize_with(view + 1, Seen::default);
        }
        &mut self.views[view]
    }

    /// The picture of the last build.
    pub fn culler(&self) -> &CoverageBuffer {
        &self.buffer
    }

    /// Applies changes of the geometry. All changes must be passed before the next build. A changed polygon is read when it
    /// is filled next.
    pub fn follow(&mut self, changes: &[Change]) {
        for change in changes {
            let id = match *change {
                Change::Remove(id) => {
                    self.surfaces.take_out(id);
                    id
                }
                Change::Insert(id) | Change::Update(id) | Change::Repaint(id) => id,
                // A polygon in a moving space is no occluder.
                Change::Place(_) => continue,
            };
            for set in [&mut self.read, &mut self.whole] {
                set.remove_block(id.index() / BLOCK, 1 << (id.index() % BLOCK));
            }
        }
    }

    /// Forgets what was hidden in view number `view`; the next frame treats all in view as visible.
    pub fn forget(&mut self, view: usize) {
        self.view(view).clear();
    }

    /// Fills the picture for view number `view` with the polygons of `in_view` that were not hidden in the view's last
    /// frame.
    pub fn build(
        &mut self,
        view: usize,
        geometry: &dyn Geometry,
        window: &ViewWindow,
        in_view: &VisibleBlocks,
    ) -> PreviousFrameCounts {
        self.view(view);
        let seen = &mut self.views[view];
        seen.begin(window);
        self.filled.clear();
        // Useless polygons are filled again in turns.
        let most_again = seen.useless.len().div_ceil(AGAIN_EVERY).min(MOST_AGAIN);
        let again_from = std::mem::take(&mut seen.again_from);
        let (mut again, mut reads) = (0, 0);
        for (block, mask) in in_view.blocks() {
            let mask = mask & !seen.hidden.mask(block);
            let useless = mask & seen.useless.mask(block);
            let mut tried = mask & !useless;
            if useless != 0 && block >= again_from && again < most_again {
                again += useless.count_ones() as usize;
                tried |= useless;
                if again >= most_again {
                    seen.again_from = block + 1;
                }
            }
            if seen.is_full && !seen.is_turn(block) {
                // In an earlier frame, the other polygons were smaller than the filled ones.
                let is_new = !(seen.drawn.mask(block) & self.read.mask(block));
                tried &= seen.filled.mask(block) | is_new;
            }
            let unread = tried & !self.read.mask(block);
            if unread != 0 && reads < MOST_READS {
                reads += unread.count_ones();
                for id in ids_of(block, unread) {
                    if self.surfaces.set(geometry, id) {
                        self.whole.insert(id);
                    }
                }
                self.read.insert_block(block, unread);
            } else {
                tried &= !unread;
            }
            self.filled.extend(ids_of(block, tried).filter(|&id| self.surfaces.is_occluder(id)));
        }
        let is_over = self.filled.len() > Self::MOST_OCCLUDERS;
        seen.is_full =
            is_over || seen.is_full && !seen.has_jumped && self.filled.len() == Self::MOST_OCCLUDERS;
        if is_over {
            let eye = window.eye_in_world().as_vec3();
            self.scored.clear();
            self.scored.extend(self.filled.iter().map(|&id| (self.surfaces.solid_angle(id, eye), id)));
            let by_size =
                |a: &(f32, PolygonId), b: &(f32, PolygonId)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
            self.scored.select_nth_unstable_by(Self::MOST_OCCLUDERS, by_size);
            self.filled.clear();
            self.filled.extend(self.scored[..Self::MOST_OCCLUDERS].iter().map(|&(_, id)| id));
        }
        let counts = self.buffer.build_of(window, &self.surfaces, self.filled.iter().copied());
        seen.filled.clear();
        for (id, is_useful) in self.buffer.filled() {
            let (block, bit) = (id.index() / BLOCK, 1 << (id.index() % BLOCK));
            seen.filled.insert_block(block, bit);
            if is_useful {
                seen.useless.remove_block(block, bit);
            } else {
                seen.useless.insert_block(block, bit);
            }
        }
        seen.eye = Some(Eye {
            eye_in_world: window.eye_in_world(),
            forward: window.forward(),
            occluders_m: self.buffer.mean_distance_m(),
        });
        self.is_built = counts.occluders > 0;
        PreviousFrameCounts {
            occluders: u64::from(counts.occluders),
            tiles: u64::from(counts.nodes),
            tests: 0,
        }
    }

    /// Sets `drawn` to the polygons in view that the picture does not hide, and stores them for the next frame of view
    /// number `view`. The picture must be built for this view.
    pub fn cull(
        &mut self,
        view: usize,
        input: &ViewInput<'_>,
        drawn: &mut VisibleBlocks,
        counts: &mut PreviousFrameCounts,
    ) {
        let ViewInput { index, geometry, view: seen, in_view, spaces } = *input;
        if self.is_built {
            // The corners of polygons are tested instead of their boxes, unless they are unknown.
            let by_box = CullConfig::default();
            let nodes = CullConfig { polygon_test: PolygonTest::Never, ..by_box };
            let frustum = seen.frustum();
            let tested =
                remove_hidden(&self.buffer, nodes, index, geometry, &frustum, in_view, spaces, drawn);
            counts.tests += tested.node_tests;
            for (block, mask) in in_view.blocks() {
                let left = mask & drawn.mask(block);
                let whole = self.whole.mask(block);
                let mut boxes = Tests::new(&self.buffer, by_box);
                let hidden = boxes.hidden_in_block(geometry, block, left & !whole);
                let left = left & !hidden;
                counts.tests += boxes.counts.polygon_tests + u64::from(left.count_ones());
                let hidden =
                    hidden | self.buffer.hidden_of_block(&self.surfaces, geometry, block, [left, whole]);
                drawn.remove_block(block, hidden);
            }
        } else {
            drawn.copy_from(in_view);
        }
        self.view(view).remember(in_view, drawn);
    }
}
