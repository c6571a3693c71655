use std::{fmt, hash::BuildHasher, ops::Index, sync::Arc};

use super::{
    camera::Camera,
    culler::Culler,
    detail::{Detail, Eye},
    hiding::{Hiding, OccludedView, hides_box},
    keys::{Key, Places, Slot},
};
use crate::{
    FastHash,
    index::{
        Backend, SpatialIndex,
        kernels::{IdWriter, Kernel, RunSink, WithKernel},
    },
    math::{Aabb, Frustum, Sphere},
    occlusion::{OcclusionCuller, OcclusionReport, Verdict},
    polygon::{BLOCK, ById, PolygonId, VisibleBlocks},
};

/// Number of cameras whose results a frame holds without allocation.
const INLINE_CAMERAS: usize = 8;

/// What a camera keeps from frame to frame: its result, and the memory for the next one. Keep one for each camera and
/// thread; [`Culler::cull_view`] then allocates nothing once the lists have grown.
#[derive(Debug)]
pub struct ViewState {
    /// The objects to draw.
    list: Vec<PolygonId>,
    /// The level of detail of each object to draw, if an object has several.
    levels: Vec<u8>,
    /// For each slot, one more than the level of detail when it was last in view; 0 if it was too far or too small.
    last: ById<u8>,
    /// Number of objects in view, hidden or not.
    in_view: usize,
    frustum: Frustum,
    layers: u32,
    /// Whether occlusion culling ran. Only then `found` has the objects in view, and `drawn` those to draw.
    is_occluded: bool,
    pub(super) found: VisibleBlocks,
    drawn: VisibleBlocks,
    spare: VisibleBlocks,
    pub(super) occluders: Option<Box<OccludedView>>,
    pub(super) report: OcclusionReport,
}

impl Default for ViewState {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            levels: Vec::new(),
            last: ById::new(0),
            in_view: 0,
            frustum: Frustum::everything(),
            layers: 0,
            is_occluded: false,
            found: VisibleBlocks::new(),
            drawn: VisibleBlocks::new(),
            spare: VisibleBlocks::new(),
            occluders: None,
            report: OcclusionReport::default(),
        }
    }
}

/// Lists the numbers of a set.
struct ListIds<'a> {
    set: &'a VisibleBlocks,
    list: &'a mut Vec<PolygonId>,
}

impl WithKernel for ListIds<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let (first, words) = self.set.words();
        let mut writer = IdWriter::new(self.list);
        writer.push_masks(kernel, first / BLOCK, words.as_flattened());
        writer.finish();
    }
}

impl<K: Key, S: BuildHasher> Culler<K, S> {
    /// Finds the objects that may be on the screen of a camera, as [`Culler::cull`] does, for the state of the last
    /// commit. Several threads may do this at once, each with a [`ViewState`] of its own.
    ///
    /// ```
    /// use osp::{Camera, Culler, Depth, ViewState};
    ///
    /// let mut culler = Culler::<u32>::new();
    /// culler.set(7, [[-1.0, 0.0, -4.0], [1.0, 1.0, -3.0_f32]]);
    /// culler.commit();
    /// let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.0_f32];
    /// let camera = Camera::from_matrix(clip, Depth::OneToZero)?;
    /// let mut states = [ViewState::default(), ViewState::default()]; // Kept from frame to frame.
    /// std::thread::scope(|scope| {
    ///     for state in &mut states {
    ///         scope.spawn(|| assert!(culler.cull_view(&camera, state).iter().eq([7])));
    ///     }
    /// });
    /// # Ok::<(), osp::CameraError>(())
    /// ```
    pub fn cull_view<'a>(&'a self, camera: &Camera, state: &'a mut ViewState) -> Seen<'a, K, S> {
        let frustum = camera.frustum_within(|| self.objects.index().around());
        self.find(camera, &frustum, state, false);
        Seen { culler: self, state, later: None }
    }

    /// Sets a view's result. If `is_found`, `state.found` has the objects in the frustum already.
    pub(super) fn find(&self, camera: &Camera, frustum: &Frustum, state: &mut ViewState, is_found: bool) {
        let (mask, index) = (camera.layers(), self.objects.index());
        (state.frustum, state.layers, state.is_occluded) = (*frustum, mask, false);
        state.report = OcclusionReport::default();
        state.list.clear();
        let hiding = self.hiding.as_ref().zip(camera.hiding_window());
        state.report.unsupported = usize::from(hiding.is_none() && camera.asks_to_hide());
        if let Some((hiding, window)) = hiding.filter(|(hiding, _)| !hiding.is_empty()) {
            if !is_found {
                state.found.clear();
                index.frustum_cull_blocks(frustum, &mut state.found);
            }
            let uses = self.draws_occluders(hiding, mask);
            state.report.unseen = usize::from(!uses);
            let ViewState { found, drawn, occluders, report, .. } = state;
            let view = (window, camera.frustum());
            state.is_occluded = uses && hiding.cull(&self.objects, view, occluders, (found, drawn), report);
            let set = if state.is_occluded { &state.drawn } else { &state.found };
            Backend::detect().run(ListIds { set, list: &mut state.list });
        } else if is_found {
            Backend::detect().run(ListIds { set: &state.found, list: &mut state.list });
        } else {
            index.frustum_cull(frustum, &mut state.list);
        }
        let sees = |number: &PolygonId| self.layers.sees(self.keys.slot_of(*number), mask);
        let is_filtered = !self.layers.sees_all(mask);
        if is_filtered {
            state.list.retain(sees);
        }
        if is_filtered && state.is_occluded {
            state.spare.clear();
            state.spare.extend(state.found.ids().filter(sees));
            std::mem::swap(&mut state.found, &mut state.spare);
        }
        state.in_view = if state.is_occluded { state.found.len() } else { state.list.len() };
        let in_list = state.list.len();
        state.list.extend(self.objects.endless().filter(sees));
        state.in_view += state.list.len() - in_list;
        state.levels.clear();
        if !self.details.is_empty() {
            self.choose_levels(&Eye::new(camera), state);
        }
    }

    /// Whether a camera on these layers draws each object with an occluder at every distance. If it does not, it uses no
    /// occluders, because objects behind one that is not drawn would be missing.
    pub(super) fn draws_occluders(&self, hiding: &Hiding, mask: u32) -> bool {
        let is_drawn = |slot: Slot| {
            self.layers.sees(slot, mask) && !self.details.get(&slot).is_some_and(Detail::is_limited)
        };
        (self.layers.sees_all(mask) && self.details.is_empty())
            || hiding.iter().all(|(slot, _)| is_drawn(slot))
    }

    /// Removes the objects of a result that are too far or too small, and chooses the level of detail of the others.
    fn choose_levels(&self, eye: &Eye, state: &mut ViewState) {
        let ViewState { list, levels, last, in_view, .. } = state;
        let before = list.len();
        list.retain(|&number| {
            let slot = self.keys.slot_of(number);
            let level = match (self.details.get(&slot), self.objects.get(number)) {
                (None, _) | (_, None) => Some(0),
                (Some(detail), Some(bounds)) => {
                    let level = detail.level(eye, &bounds, last.get(slot).checked_sub(1));
                    last.set(slot, level.map_or(0, |level| level + 1));
                    level
                }
            };
            levels.extend(level);
            level.is_some()
        });
        *in_view -= before - list.len();
    }
}

/// The results of all cameras, in their order: `frame[0]` belongs to the first camera.
///
/// # Panics
/// Indexing beyond the last camera panics, as in a slice. [`Frame::get`] returns `None` instead.
#[derive(Debug)]
pub struct Frame<'a, K: Key, S: BuildHasher = FastHash> {
    first: [Option<Seen<'a, K, S>>; INLINE_CAMERAS],
    more: Vec<Seen<'a, K, S>>,
    len: usize,
}

/// The result of one camera: the objects to draw, each once, in no particular order.
pub struct Seen<'a, K: Key, S: BuildHasher = FastHash> {
    culler: &'a Culler<K, S>,
    state: &'a ViewState,
    /// The result without the objects that were removed since; `None` if no object was changed since.
    later: Option<Arc<Later>>,
}

#[derive(Debug)]
struct Later {
    list: Vec<PolygonId>,
    levels: Vec<u8>,
    drawn: VisibleBlocks,
    in_view: VisibleBlocks,
}

impl<'a, K: Key, S: BuildHasher> Frame<'a, K, S> {
    pub(super) fn new(seen: impl IntoIterator<Item = Seen<'a, K, S>>) -> Self {
        let mut frame = Self { first: [const { None }; INLINE_CAMERAS], more: Vec::new(), len: 0 };
        for seen in seen {
            match frame.first.get_mut(frame.len) {
                Some(place) => *place = Some(seen),
                None => frame.more.push(seen),
            }
            frame.len += 1;
        }
        frame
    }

    /// Number of cameras.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the frame has no camera.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The result of a camera; `None` beyond the last camera.
    pub fn get(&self, camera: usize) -> Option<&Seen<'a, K, S>> {
        match camera.checked_sub(INLINE_CAMERAS) {
            None => self.first[camera].as_ref(),
            Some(more) => self.more.get(more),
        }
    }

    /// The results of all cameras.
    pub fn iter(&self) -> impl Iterator<Item = &Seen<'a, K, S>> {
        self.first.iter().flatten().chain(&self.more)
    }
}

impl<'a, K: Key, S: BuildHasher> Index<usize> for Frame<'a, K, S> {
    type Output = Seen<'a, K, S>;

    fn index(&self, camera: usize) -> &Self::Output {
        match self.get(camera) {
            Some(seen) => seen,
            None => panic!("camera {camera} of {}", self.len),
        }
    }
}

impl<'a, K: Key, S: BuildHasher> Seen<'a, K, S> {
    /// The stored result of a view. If objects were changed since, it has the same objects, except removed ones.
    pub(super) fn stored(culler: &'a Culler<K, S>, state: &'a ViewState, is_changed: bool) -> Self {
        let later = is_changed.then(|| {
            let is_there = |number: &PolygonId| culler.objects.get(*number).is_some();
            let list: Vec<_> = state.list.iter().copied().filter(is_there).collect();
            let levels = state.list.iter().zip(&state.levels).filter(|(number, _)| is_there(number));
            let levels = levels.map(|(_, level)| *level).collect();
            let drawn: VisibleBlocks = list.iter().copied().collect();
            let in_view = match state.is_occluded {
                true => state.found.ids().filter(is_there).collect(),
                false => drawn.clone(),
            };
            Arc::new(Later { list, levels, drawn, in_view })
        });
        Self { culler, state, later }
    }

    fn list(&self) -> &[PolygonId] {
        self.later.as_ref().map_or(&self.state.list, |later| &later.list)
    }

    /// The keys of the objects to draw.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = K> + Clone {
        self.list().iter().map(|&number| self.culler.keys.key(number))
    }

    /// The keys of the objects to draw, each with its level of detail ([`Culler::set_detail`]).
    pub fn levels(&self) -> impl Iterator<Item = (K, u8)> + Clone {
        let levels = self.later.as_ref().map_or(&self.state.levels, |later| &later.levels);
        self.iter().zip(levels.iter().copied().chain(std::iter::repeat(0)))
    }

    /// Number of objects to draw.
    pub fn len(&self) -> usize {
        self.list().len()
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.list().is_empty()
    }

    /// Number of objects in view that are culled, because occluders hide them.
    pub fn hidden(&self) -> usize {
        self.later.as_ref().map_or(self.state.in_view, |later| later.in_view.len()) - self.len()
    }

    /// What the camera did with the occluders.
    pub fn occlusion(&self) -> OcclusionReport {
        self.state.report
    }

    /// Whether an object has to be drawn.
    pub fn contains(&self, key: K) -> bool {
        let Some((slot, number)) = self.find(key) else { return false };
        match &self.later {
            Some(later) => later.drawn.contains(number),
            None => {
                let is_hidden = self.state.is_occluded && !self.state.drawn.contains(number);
                let is_endless = || self.culler.objects.endless().any(|of| of == number);
                self.sees(slot, number) && (!is_hidden || is_endless())
            }
        }
    }

    /// Whether an object is in view, hidden or not.
    pub fn is_in_view(&self, key: K) -> bool {
        let Some((slot, number)) = self.find(key) else { return false };
        match &self.later {
            Some(later) => later.in_view.contains(number),
            None => self.sees(slot, number),
        }
    }

    fn find(&self, key: K) -> Option<(Slot, PolygonId)> {
        let slot = self.culler.keys.slot(key)?;
        Some((slot, self.culler.keys.number(slot)?))
    }

    /// The test of the query, for an object that has not been changed since.
    fn sees(&self, slot: Slot, number: PolygonId) -> bool {
        let bounds = self.culler.objects.get(number);
        bounds.is_some_and(|bounds| !bounds.is_valid() || self.state.frustum.may_see(&bounds))
            && self.culler.layers.sees(slot, self.state.layers)
            && (!self.culler.details.contains_key(&slot) || self.state.last.get(slot) > 0)
    }

    /// The culler of a camera that hides by occluders; `None` if no occluder is in view.
    fn occluders(&self) -> Option<&dyn OcclusionCuller> {
        self.state.occluders.as_ref().filter(|_| self.state.is_occluded).map(|view| view.culler())
    }

    /// Whether the occluders of this frame certainly hide the part of a box that is in view. `false` means that the box
    /// may be visible. The box, world space, metres, need not belong to an object. It may surround a light, a sound or
    /// something that is not loaded yet. A box that is not finite is never hidden. O(log occluders).
    ///
    /// Always `false` for a camera that does not [hide by occluders](crate::Camera::hide_by_occluders).
    pub fn hides_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2]) -> bool {
        let [min, max] = bounds.map(|corner| corner.into().into());
        self.occluders().is_some_and(|culler| hides_box(culler, &Aabb::new(min, max)))
    }

    /// Does the test of [`Seen::hides_box`] for a sphere. A sphere that is not finite or has a negative radius is never
    /// hidden.
    pub fn hides_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32) -> bool {
        let sphere = Sphere { center: center.into().into(), radius_m };
        let is_finite = sphere.center.is_finite() && radius_m.is_finite() && radius_m >= 0.0;
        let hides = |culler: &dyn OcclusionCuller| culler.test_sphere(&sphere).verdict == Verdict::Hidden;
        is_finite && self.occluders().is_some_and(hides)
    }
}

impl<K: Key, S: BuildHasher> Clone for Seen<'_, K, S> {
    fn clone(&self) -> Self {
        Self { later: self.later.clone(), ..*self }
    }
}

impl<K: Key, S: BuildHasher> fmt::Debug for Seen<'_, K, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Seen").field("drawn", &self.len()).field("hidden", &self.hidden()).finish()
    }
}
