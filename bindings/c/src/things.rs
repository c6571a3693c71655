//! What is in a scene, by id, and what has become of it since the last frame.

use osp::{
    glam::Vec3,
    math::{Aabb, COORDINATE_LIMIT_M, Ray},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId},
};

use crate::{
    index::{room_for, unknown},
    status::{Failure, OspStatus, Outcome},
};

/// One thing of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Thing {
    /// Known by its box; hides nothing.
    Box(Aabb),
    Triangle {
        corners: [Vec3; 3],
        is_opaque: bool,
    },
}

impl Thing {
    pub(crate) fn bounds(&self) -> Aabb {
        match self {
            Self::Box(bounds) => *bounds,
            Self::Triangle { corners, .. } => Aabb::from_points(corners),
        }
    }

    /// Where a ray meets it.
    pub(crate) fn meet(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        match self {
            Self::Box(bounds) => ray.enter_box(bounds, t_max),
            Self::Triangle { corners, .. } => ray.meet_triangle(*corners),
        }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    thing: Option<Thing>,
    /// Whether the pipeline knows it.
    is_known: bool,
    is_touched: bool,
}

/// All things.
#[derive(Debug, Default)]
pub(crate) struct Things {
    slots: Vec<Slot>,
    free: Vec<u32>,
    /// Ids whose thing has come, gone or changed; each once.
    touched: Vec<u32>,
    count: usize,
}

impl Things {
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self { slots: Vec::with_capacity(capacity), touched: Vec::with_capacity(capacity), ..Self::default() }
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    pub(crate) fn bytes(&self) -> usize {
        let ids = self.free.capacity() + self.touched.capacity();
        self.slots.capacity() * size_of::<Slot>() + ids * size_of::<u32>()
    }

    pub(crate) fn get(&self, id: u32) -> Option<&Thing> {
        self.slots.get(id as usize)?.thing.as_ref()
    }

    pub(crate) fn insert(&mut self, things: impl ExactSizeIterator<Item = Thing>) -> Outcome<Vec<u32>> {
        room_for(self.count, things.len())?;
        let ids = things.map(|thing| {
            let id = self.free.pop().unwrap_or_else(|| {
                self.slots.push(Slot::default());
                self.slots.len() as u32 - 1
            });
            self.slots[id as usize].thing = Some(thing);
            self.count += 1;
            self.touch(id);
            id
        });
        Ok(ids.collect())
    }

    /// Puts another thing of the same kind in the place of one that is there.
    pub(crate) fn update(&mut self, id: u32, thing: Thing) -> Outcome<()> {
        let there = self.slots.get_mut(id as usize).and_then(|slot| slot.thing.as_mut());
        let there = there.ok_or_else(|| unknown(id))?;
        if matches!(there, Thing::Box(_)) != matches!(thing, Thing::Box(_)) {
            let (is, asked) =
                if matches!(there, Thing::Box(_)) { ("box", "triangle") } else { ("triangle", "box") };
            let message = format!("id {id}: expected a {asked}, and it is a {is}");
            return Err(Failure::new(OspStatus::UnknownId, message));
        }
        *there = thing;
        self.touch(id);
        Ok(())
    }

    pub(crate) fn remove(&mut self, id: u32) -> Outcome<()> {
        let slot = self.slots.get_mut(id as usize).filter(|slot| slot.thing.is_some());
        let slot = slot.ok_or_else(|| unknown(id))?;
        slot.thing = None;
        self.free.push(id);
        self.count -= 1;
        self.touch(id);
        Ok(())
    }

    fn touch(&mut self, id: u32) {
        let slot = &mut self.slots[id as usize];
        if !slot.is_touched {
            slot.is_touched = true;
            self.touched.push(id);
        }
    }

    pub(crate) fn is_touched(&self) -> bool {
        !self.touched.is_empty()
    }

    /// Replaces `changes` by what a pipeline has to hear, which then knows all.
    pub(crate) fn take_changes(&mut self, changes: &mut Vec<Change>) {
        changes.clear();
        for id in self.touched.drain(..) {
            let slot = &mut self.slots[id as usize];
            let (was, is, id) = (slot.is_known, slot.thing.is_some(), PolygonId(id));
            // What came in the place of another thing is another shape of it.
            changes.extend(match (was, is) {
                (false, true) => Some(Change::Insert(id)),
                (true, true) => Some(Change::Update(id)),
                (true, false) => Some(Change::Remove(id)),
                (false, false) => None,
            });
            (slot.is_known, slot.is_touched) = (is, false);
        }
    }
}

impl Geometry for Things {
    fn id_end(&self) -> usize {
        self.slots.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.get(id.0).is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.get(id.0).map_or(Aabb::EMPTY, Thing::bounds)
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        match self.get(id.0)? {
            Thing::Box(_) => None,
            Thing::Triangle { corners: [a, b, c], .. } => Some(ConvexPolygon::triangle(*a, *b, *c)),
        }
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        matches!(self.get(id.0), Some(Thing::Triangle { is_opaque: true, .. }))
    }
}

/// Whether the things of a scene may have this coordinate.
pub(crate) fn is_in_reach(point: Vec3) -> bool {
    point.abs().cmple(Vec3::splat(COORDINATE_LIMIT_M)).all()
}
