use std::{fmt, ops::Index};

use super::{
    hiding::hides_box,
    keys::{Key, Places},
};
use crate::{
    math::{Aabb, Sphere},
    occlusion::{OcclusionCuller, Verdict},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// Number of cameras whose results a frame holds without allocation.
const INLINE_CAMERAS: usize = 8;

static NOTHING: VisibleBlocks = VisibleBlocks::new();

/// The results of all cameras, in their order: `frame[0]` belongs to the first camera.
///
/// # Panics
/// Indexing beyond the last camera panics, as in a slice. [`Frame::get`] returns `None` instead.
#[derive(Clone, Debug)]
pub struct Frame<'a, K: Key> {
    first: [Seen<'a, K>; INLINE_CAMERAS],
    more: Vec<Seen<'a, K>>,
    len: usize,
}

/// The result of one camera: the objects to draw, each once, in no particular order.
pub struct Seen<'a, K: Key> {
    in_view: &'a VisibleBlocks,
    drawn: &'a VisibleBlocks,
    keys: &'a K::Places,
    /// The culler of a camera that hides by occluders; `None` if no occluder is in view.
    culler: Option<&'a dyn OcclusionCuller>,
}

impl<'a, K: Key> Frame<'a, K> {
    /// `views` yields for each camera the objects in view, the objects that remain after occlusion culling, and the
    /// culler for further tests.
    pub(super) fn new(
        keys: &'a K::Places,
        views: impl IntoIterator<Item = (&'a VisibleBlocks, &'a VisibleBlocks, Option<&'a dyn OcclusionCuller>)>,
    ) -> Self {
        let nothing = Seen { in_view: &NOTHING, drawn: &NOTHING, keys, culler: None };
        let mut frame = Self { first: [nothing; INLINE_CAMERAS], more: Vec::new(), len: 0 };
        for (in_view, drawn, culler) in views {
            let seen = Seen { in_view, drawn, keys, culler };
            match frame.first.get_mut(frame.len) {
                Some(place) => *place = seen,
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
    pub fn get(&self, camera: usize) -> Option<&Seen<'a, K>> {
        self.first[..self.len.min(INLINE_CAMERAS)]
            .get(camera)
            .or_else(|| self.more.get(camera.checked_sub(INLINE_CAMERAS)?))
    }

    /// The results of all cameras.
    pub fn iter(&self) -> impl Iterator<Item = &Seen<'a, K>> {
        self.first[..self.len.min(INLINE_CAMERAS)].iter().chain(&self.more)
    }
}

impl<'a, K: Key> Index<usize> for Frame<'a, K> {
    type Output = Seen<'a, K>;

    fn index(&self, camera: usize) -> &Self::Output {
        match self.get(camera) {
            Some(seen) => seen,
            None => panic!("camera {camera} of {}", self.len),
        }
    }
}

impl<'a, K: Key> Seen<'a, K> {
    /// The keys of the objects to draw.
    pub fn iter(&self) -> impl Iterator<Item = K> + 'a {
        let keys = self.keys;
        self.drawn.ids().filter_map(move |number| keys.key(number))
    }

    /// Number of objects to draw.
    pub fn len(&self) -> usize {
        self.drawn.len()
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.drawn.is_empty()
    }

    /// Number of objects in view that are culled, because occluders hide them.
    pub fn hidden(&self) -> usize {
        self.in_view.len() - self.drawn.len()
    }

    /// Whether an object has to be drawn.
    pub fn contains(&self, key: K) -> bool {
        self.number(key).is_some_and(|number| self.drawn.contains(number))
    }

    /// Whether an object is in view, hidden or not.
    pub fn is_in_view(&self, key: K) -> bool {
        self.number(key).is_some_and(|number| self.in_view.contains(number))
    }

    /// Whether the occluders of this frame certainly hide the part of a box that is in view. `false` means that the box
    /// may be visible. The box, world space, metres, need not belong to an object. It may surround a light, a sound or
    /// something that is not loaded yet. A box that is not finite is never hidden. O(log occluders).
    ///
    /// Always `false` for a camera that does not [hide by occluders](crate::Camera::hide_by_occluders).
    pub fn hides_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2]) -> bool {
        let [min, max] = bounds.map(|corner| corner.into().into());
        self.culler.is_some_and(|culler| hides_box(culler, &Aabb::new(min, max)))
    }

    /// Does the test of [`Seen::hides_box`] for a sphere. A sphere that is not finite or has a negative radius is never
    /// hidden.
    pub fn hides_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32) -> bool {
        let sphere = Sphere { center: center.into().into(), radius_m };
        let is_finite = sphere.center.is_finite() && radius_m.is_finite() && radius_m >= 0.0;
        let hides = |culler: &dyn OcclusionCuller| culler.test_sphere(&sphere).verdict == Verdict::Hidden;
        is_finite && self.culler.is_some_and(hides)
    }

    fn number(&self, key: K) -> Option<PolygonId> {
        self.keys.number(self.keys.slot(key)?)
    }

    /// The numbers of the objects to draw, as a mask for each block of sixteen numbers. With [`Dense`](super::Dense)
    /// keys the numbers are the keys.
    pub fn blocks(&self) -> &'a VisibleBlocks {
        self.drawn
    }
}

impl<K: Key> Copy for Seen<'_, K> {}

impl<K: Key> Clone for Seen<'_, K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Key> fmt::Debug for Seen<'_, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Seen").field("drawn", &self.len()).field("hidden", &self.hidden()).finish()
    }
}

/// The results of the cameras of a frame, in reused memory.
#[derive(Debug, Default)]
pub(super) struct Views {
    pub(super) in_view: Vec<VisibleBlocks>,
    pub(super) drawn: Vec<VisibleBlocks>,
    /// For each camera, whether occlusion culling ran. Only then the entry of `drawn` is valid.
    pub(super) is_occluded: Vec<bool>,
    spare: VisibleBlocks,
}

impl Views {
    pub(super) fn begin(&mut self, cameras: usize) {
        self.in_view.iter_mut().for_each(VisibleBlocks::clear);
        self.in_view.resize_with(cameras.max(self.in_view.len()), VisibleBlocks::new);
        self.drawn.resize_with(self.in_view.len(), VisibleBlocks::new);
        self.is_occluded.clear();
        self.is_occluded.resize(cameras, false);
    }

    /// Removes an object from all results.
    pub(super) fn remove(&mut self, number: PolygonId) {
        let (block, lane) = (number.index() / BLOCK, number.index() % BLOCK);
        let cameras = self.is_occluded.len();
        for set in self.in_view.iter_mut().take(cameras).chain(self.drawn.iter_mut().take(cameras)) {
            set.remove_block(block, 1 << lane);
        }
    }

    /// Removes the objects that a camera does not see from its results.
    pub(super) fn keep(&mut self, camera: usize, is_seen: impl Fn(PolygonId) -> bool) {
        let sets = [&mut self.in_view[camera], &mut self.drawn[camera]];
        for set in sets.into_iter().take(1 + usize::from(self.is_occluded[camera])) {
            self.spare.clear();
            self.spare.extend(set.ids().filter(|&number| is_seen(number)));
            std::mem::swap(set, &mut self.spare);
        }
    }

    /// For each camera: the objects in view, the objects to draw, and whether occluders were used.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&VisibleBlocks, &VisibleBlocks, bool)> {
        let drawn = self.in_view.iter().zip(&self.drawn).zip(&self.is_occluded);
        drawn.map(|((in_view, drawn), &is_occluded)| {
            (in_view, if is_occluded { drawn } else { in_view }, is_occluded)
        })
    }
}
