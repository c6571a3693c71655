use crate::{
    math::Aabb,
    polygon::{ById, ConvexPolygon, Geometry, PolygonId},
};

/// The boxes of all objects, and what layers they are on.
#[derive(Debug)]
pub(super) struct Boxes {
    /// Empty where there is no object, or one that was refused.
    bounds: ById<Aabb>,
    layers: ById<u32>,
    /// Whether an object has had other layers than [`FIRST_LAYER`].
    is_layered: bool,
    /// Objects on no layer.
    unseen: usize,
    /// One more than the highest number that was in use.
    end: usize,
    count: usize,
}

/// The layer that objects are on unless the engine puts them on others.
const FIRST_LAYER: u32 = 1;

impl Default for Boxes {
    fn default() -> Self {
        Self {
            bounds: ById::new(Aabb::EMPTY),
            layers: ById::new(FIRST_LAYER),
            is_layered: false,
            unseen: 0,
            end: 0,
            count: 0,
        }
    }
}

impl Boxes {
    /// Sets the box of an object, or takes it away ([`Aabb::EMPTY`]). Returns the one before.
    #[inline]
    pub(super) fn set(&mut self, place: PolygonId, bounds: Aabb) -> Aabb {
        let before = self.bounds.get(place);
        self.bounds.set(place, bounds);
        self.end = self.end.max(place.index() + 1);
        self.count = self.count + usize::from(!bounds.is_empty()) - usize::from(!before.is_empty());
        before
    }

    pub(super) fn get(&self, place: PolygonId) -> Option<Aabb> {
        Some(self.bounds.get(place)).filter(|bounds| !bounds.is_empty())
    }

    /// Objects with a box.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn set_layers(&mut self, place: PolygonId, layers: u32) {
        let before = self.layers.get(place);
        self.layers.set(place, layers);
        self.is_layered |= layers != FIRST_LAYER;
        self.unseen = self.unseen + usize::from(layers == 0) - usize::from(before == 0);
    }

    /// Puts a place that nobody has any more on the first layer.
    pub(super) fn forget_layers(&mut self, place: PolygonId) {
        if self.is_layered {
            self.set_layers(place, FIRST_LAYER);
        }
    }

    /// Whether a camera on these layers may see an object.
    pub(super) fn is_on(&self, place: PolygonId, layers: u32) -> bool {
        self.layers.get(place) & layers != 0
    }

    /// Whether a camera on these layers sees every object.
    pub(super) fn are_all_on(&self, layers: u32) -> bool {
        if self.is_layered { layers == u32::MAX && self.unseen == 0 } else { layers & FIRST_LAYER != 0 }
    }
}

impl Geometry for Boxes {
    fn id_end(&self) -> usize {
        self.end
    }

    fn is_present(&self, id: PolygonId) -> bool {
        !self.bounds.get(id).is_empty()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.bounds.get(id)
    }

    fn polygon(&self, _: PolygonId) -> Option<ConvexPolygon> {
        None
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }
}
