use std::collections::BTreeMap;

use super::{keys::Slot, objects::Objects, occluder::Occluder};
use crate::{
    math::{Aabb, Frustum},
    occlusion::{
        Columns, CullConfig, Layered, MeshBuffer, Meshes, OccluderPool, Occlusion, OcclusionConfig,
        OcclusionCuller, OcclusionReport, Selector, UNMOVED, Verdict, remove_hidden,
    },
    polygon::{ById, Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
    view::ViewWindow,
};

/// Largest number of stored changes. If there are more, all are applied before the next frame.
const MOST_STORED: usize = 1 << 16;

/// Default of [`Hiding::budget`]. With selection, tree and queries, a view then takes about a millisecond.
pub(super) const BUDGET: u64 = 720_000;

/// Width and height of the buffer. Twice as many pixels hide 2 % more of what is hidden in a city, and take half as long
/// again.
const BUFFER_PX: [usize; 2] = [512, 320];

/// The occluders of all objects. The polygons of occluders have numbers of their own.
#[derive(Clone, Debug)]
pub(super) struct Hiding {
    surfaces: OccluderPolygons,
    meshes: Meshes,
    of_object: BTreeMap<Slot, ObjectOccluder>,
    has_occluder: ById<bool>,
    changes: Vec<Change>,
    pool: OccluderPool,
    config: OcclusionConfig,
    /// Largest work of a view's buffer.
    pub(super) budget: u64,
}

/// An object's occluder and box.
#[derive(Clone, Debug)]
struct ObjectOccluder {
    occluder: Occluder,
    /// The numbers of the occluder's polygons, and of its mesh.
    numbers: Vec<PolygonId>,
    mesh: u32,
    /// The object's box in its own space, if it has one.
    bounds: Option<Aabb>,
}

/// The occluders of a view.
#[derive(Debug)]
pub(super) struct OccludedView {
    selector: Selector,
    culler: Layered,
}

impl OccludedView {
    pub(super) fn culler(&self) -> &dyn OcclusionCuller {
        &self.culler
    }
}

/// Error: the polygons would exceed the limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooManyPolygons;

impl Hiding {
    pub(super) fn new() -> Self {
        let config = OcclusionConfig::default();
        Self {
            surfaces: OccluderPolygons::default(),
            meshes: Meshes::default(),
            of_object: BTreeMap::new(),
            has_occluder: ById::new(false),
            changes: Vec::new(),
            pool: OccluderPool::new(config.pool),
            config,
            budget: BUDGET,
        }
    }

    /// Applies the new box of an object. Its occluder stays at the old place, so the occluder is removed unless the new box
    /// contains the former one.
    #[inline]
    pub(super) fn follow_object(&mut self, object: Slot, bounds: &Aabb) {
        if !self.has_occluder.get(object) {
            return;
        }
        let Some(own) = self.of_object.get_mut(&object) else { return };
        let before = own.bounds.replace(*bounds);
        if before.is_some_and(|before| !bounds.contains(&before)) {
            self.remove(object);
        }
    }

    /// Sets the occluder of an object, in place of the former one. `bounds` is the object's box, if it has one. Both are in
    /// the object's own space; `columns` is its place, if it has one.
    pub(super) fn set(
        &mut self,
        object: Slot,
        bounds: Option<Aabb>,
        columns: Option<Columns>,
        occluder: Occluder,
    ) -> Result<(), TooManyPolygons> {
        self.remove(object);
        // A polygon that moves is not offered to the tree, because its corners would be rounded.
        let polygons = if columns.is_none() { occluder.polygons() } else { &[] };
        if polygons.len() > self.surfaces.room() || self.meshes.is_full() {
            return Err(TooManyPolygons);
        }
        let numbers: Vec<_> = polygons.iter().map(|polygon| self.surfaces.add(*polygon)).collect();
        self.changes.extend(numbers.iter().map(|&number| Change::Insert(number)));
        let mesh = self.meshes.insert(occluder.prepared().clone(), columns.unwrap_or(UNMOVED));
        self.has_occluder.set(object, true);
        self.of_object.insert(object, ObjectOccluder { occluder, numbers, mesh, bounds });
        if self.changes.len() > MOST_STORED {
            self.follow();
        }
        Ok(())
    }

    /// Moves the occluder of an object, if it has one.
    #[inline]
    pub(super) fn place(&mut self, object: Slot, columns: Columns) {
        if self.has_occluder.get(object)
            && let Some(own) = self.of_object.get_mut(&object)
        {
            self.meshes.place(own.mesh, columns);
            for number in own.numbers.drain(..) {
                self.surfaces.remove(number);
                self.changes.push(Change::Remove(number));
            }
        }
    }

    #[inline]
    pub(super) fn remove(&mut self, object: Slot) {
        if !self.has_occluder.get(object) {
            return;
        }
        self.has_occluder.set(object, false);
        let Some(own) = self.of_object.remove(&object) else { return };
        self.meshes.remove(own.mesh);
        for number in own.numbers {
            self.surfaces.remove(number);
            self.changes.push(Change::Remove(number));
        }
    }

    /// Whether no object has an occluder.
    pub(super) fn is_empty(&self) -> bool {
        self.of_object.is_empty()
    }

    /// The objects that have an occluder.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Slot, &Occluder)> {
        self.of_object.iter().map(|(&object, own)| (object, &own.occluder))
    }

    /// Applies the stored changes to the pool of candidates. Called before the views of a frame are culled.
    pub(super) fn follow(&mut self) {
        self.pool.follow(&self.surfaces, &self.changes);
        self.changes.clear();
        self.meshes.tighten();
    }

    /// Sets `drawn` to the visible part of `in_view`; returns false, without effect, if no occluder is used.
    pub(super) fn cull(
        &self,
        objects: &Objects,
        (window, frustum): (&ViewWindow, &Frustum),
        view: &mut Option<Box<OccludedView>>,
        (in_view, drawn): (&VisibleBlocks, &mut VisibleBlocks),
        report: &mut OcclusionReport,
    ) -> bool {
        let Some(culler) = self.build(view, window, frustum) else { return false };
        *report = *culler.buffer().counts();
        if culler.is_empty() {
            return false;
        }
        remove_hidden(culler, CullConfig::default(), objects.index(), objects, frustum, in_view, None, drawn);
        true
    }

    /// Selects occluders for a view, and builds its culler; `None` without occluders.
    fn build<'a>(
        &self,
        view: &'a mut Option<Box<OccludedView>>,
        window: &ViewWindow,
        frustum: &Frustum,
    ) -> Option<&'a Layered> {
        if self.of_object.is_empty() {
            return None;
        }
        let OccludedView { selector, culler } = &mut **view.get_or_insert_with(|| {
            let config = self.config.select;
            let tree = Occlusion::Msvbsp.create(config.occluders);
            let culler = Layered::new(tree, MeshBuffer::new(BUFFER_PX[0], BUFFER_PX[1]));
            Box::new(OccludedView { selector: Selector::new(config), culler })
        });
        selector.select(&self.pool, &self.surfaces, window);
        culler.build(window, selector.chosen());
        culler.draw(&self.meshes, window, frustum, self.budget);
        Some(culler)
    }

    /// Sets `hidden` for the boxes that the view's occluders hide.
    pub(super) fn mark_hidden(
        &self,
        (window, frustum): (&ViewWindow, &Frustum),
        view: &mut Option<Box<OccludedView>>,
        boxes: &[Aabb],
        hidden: &mut [bool],
    ) {
        let Some(culler) = self.build(view, window, frustum) else { return };
        for (bounds, hidden) in boxes.iter().zip(hidden) {
            *hidden |= hides_box(culler, bounds);
        }
    }
}

/// Whether a culler hides all of a box. An empty or non-finite box is never hidden.
pub(super) fn hides_box(culler: &dyn OcclusionCuller, bounds: &Aabb) -> bool {
    bounds.is_valid() && culler.test_box(bounds).verdict == Verdict::Hidden
}

/// The polygons of all occluders, by number.
#[derive(Clone, Debug, Default)]
struct OccluderPolygons {
    polygons: Vec<Option<ConvexPolygon>>,
    free: Vec<PolygonId>,
}

impl OccluderPolygons {
    /// Number of polygons that can be added.
    fn room(&self) -> usize {
        PolygonId::LIMIT as usize - self.polygons.len() + self.free.len()
    }

    fn add(&mut self, polygon: ConvexPolygon) -> PolygonId {
        let number = self.free.pop().unwrap_or_else(|| {
            self.polygons.push(None);
            PolygonId(self.polygons.len() as u32 - 1)
        });
        self.polygons[number.index()] = Some(polygon);
        number
    }

    fn remove(&mut self, number: PolygonId) {
        self.polygons[number.index()] = None;
        self.free.push(number);
    }
}

impl Geometry for OccluderPolygons {
    fn id_end(&self) -> usize {
        self.polygons.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.polygon(id).is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.polygon(id).map_or(Aabb::EMPTY, |polygon| polygon.bounds())
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        self.polygons.get(id.index()).copied().flatten()
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        self.is_present(id)
    }
}
