//! An index of boxes that gives out the ids.

use std::cell::RefCell;

use osp::{
    glam::Vec3,
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};

use crate::{
    border::Answer,
    status::{Failure, OspStatus, Outcome},
    types::{OSP_MAX_IDS, OspHit, OspIndexConfig, OspRayMode, point},
};

/// What a query finds; kept for its memory: a bit for each id, and the longest list.
#[derive(Default)]
struct Found {
    set: VisibleBlocks,
    list: Vec<PolygonId>,
}

thread_local! {
    static FOUND: RefCell<Found> = RefCell::default();
}

pub(crate) struct Index {
    index: Osp,
    /// By id; empty where there is none.
    boxes: Vec<Aabb>,
    /// Ids below the end of `boxes` that are not in use.
    free: Vec<u32>,
    is_committed: bool,
}

impl Index {
    pub(crate) fn new(config: Option<OspIndexConfig>) -> Outcome<Self> {
        let config = index_config(config)?;
        let boxes = Vec::with_capacity(config.capacity);
        Ok(Self { index: Osp::new(&config), boxes, free: Vec::new(), is_committed: true })
    }

    /// Inserts all boxes.
    pub(crate) fn insert(&mut self, boxes: &[Aabb]) -> Outcome<Vec<u32>> {
        room_for(self.index.len(), boxes.len())?;
        self.is_committed &= boxes.is_empty();
        let ids = boxes.iter().map(|bounds| {
            let id = self.free.pop().unwrap_or_else(|| {
                self.boxes.push(Aabb::EMPTY);
                self.boxes.len() as u32 - 1
            });
            self.boxes[id as usize] = *bounds;
            self.index.insert(PolygonId(id), bounds).expect("the box was checked, and its id is free");
            id
        });
        Ok(ids.collect())
    }

    /// Gives all these ids new boxes.
    pub(crate) fn update(&mut self, ids: &[u32], boxes: &[Aabb]) -> Outcome<()> {
        ids.iter().try_for_each(|&id| self.bounds(id).map(drop))?;
        self.is_committed &= ids.is_empty();
        for (&id, bounds) in ids.iter().zip(boxes) {
            self.boxes[id as usize] = *bounds;
            self.index.update(PolygonId(id), bounds).expect("the box was checked, and its id is in use");
        }
        Ok(())
    }

    pub(crate) fn remove(&mut self, id: u32) -> Outcome<()> {
        self.bounds(id)?;
        self.is_committed = false;
        self.index.remove(PolygonId(id)).expect("its id is in use");
        self.boxes[id as usize] = Aabb::EMPTY;
        self.free.push(id);
        Ok(())
    }

    pub(crate) fn clear(&mut self) {
        self.is_committed = false;
        self.index.clear();
        self.boxes.clear();
        self.free.clear();
    }

    pub(crate) fn commit(&mut self) {
        self.index.commit();
        self.is_committed = true;
    }

    pub(crate) fn bounds(&self, id: u32) -> Outcome<Aabb> {
        let bounds = self.boxes.get(id as usize).filter(|bounds| !bounds.is_empty());
        bounds.copied().ok_or_else(|| unknown(id))
    }

    pub(crate) fn count(&self) -> usize {
        self.index.len()
    }

    pub(crate) fn bytes(&self) -> usize {
        let own = self.boxes.capacity() * size_of::<Aabb>() + self.free.capacity() * size_of::<u32>();
        self.index.bytes() + own
    }

    fn committed(&self) -> Outcome<&Osp> {
        if self.is_committed { Ok(&self.index) } else { Err(not_committed("osp_index_commit")) }
    }

    pub(crate) fn frustum(&self, frustum: &Frustum, answer: &Answer) -> Outcome<()> {
        answer_frustum(self.committed()?, frustum, answer)
    }

    pub(crate) fn box_query(&self, bounds: &Aabb, answer: &Answer) -> Outcome<()> {
        let index = self.committed()?;
        answer_list(answer, |found| {
            index.box_query(bounds, found);
        })
    }

    pub(crate) fn sphere_query(&self, sphere: &Sphere, answer: &Answer) -> Outcome<()> {
        let index = self.committed()?;
        let mut is_in = |id: PolygonId| {
            let distance_squared = self.boxes[id.index()].distance_squared(sphere.center);
            distance_squared <= sphere.radius_m * sphere.radius_m
        };
        answer_list(answer, |found| {
            index.sphere_query(sphere, &mut is_in, found);
        })
    }

    pub(crate) fn ray(&self, asked: &AskedRay) -> Outcome<OspHit> {
        let AskedRay { ray, t_max, mode } = asked;
        let mut enter = |id: PolygonId| ray.enter_box(&self.boxes[id.index()], *t_max);
        let index = self.committed()?;
        Ok(OspHit::from(match mode {
            OspRayMode::Nearest => index.ray_nearest(ray, *t_max, &mut enter),
            OspRayMode::Any => index.ray_any(ray, *t_max, &mut enter),
        }))
    }
}

/// A ray that was checked.
pub(crate) struct AskedRay {
    pub(crate) ray: Ray,
    pub(crate) t_max: f32,
    pub(crate) mode: OspRayMode,
}

impl AskedRay {
    pub(crate) fn new(origin: [f32; 3], direction: [f32; 3], t_max: f32, mode: i32) -> Outcome<Self> {
        let refused = |message: String| Err(Failure::new(OspStatus::InvalidArgument, message));
        let (origin, along) = (point(origin, "origin")?, point(direction, "direction")?);
        if along == Vec3::ZERO {
            return refused("direction: expected another one than 0 0 0".into());
        }
        if t_max.is_nan() || t_max < 0.0 {
            return refused(format!("t_max: expected a number from 0 on, found {t_max}"));
        }
        let mode = match mode {
            mode if mode == OspRayMode::Nearest as i32 => OspRayMode::Nearest,
            mode if mode == OspRayMode::Any as i32 => OspRayMode::Any,
            _ => return refused(format!("mode: expected one of OspRayMode, found {mode}")),
        };
        Ok(Self { ray: Ray::new(origin, along), t_max, mode })
    }
}

/// Takes this thread's memory for the while of a call: what a panic leaves in it is never seen again.
fn with_found(call: impl FnOnce(&mut Found) -> Outcome<()>) -> Outcome<()> {
    let mut found = FOUND.take();
    let outcome = call(&mut found);
    FOUND.set(found);
    outcome
}

/// Asks an index and hands the ids over, ascending.
pub(crate) fn answer_frustum(index: &dyn SpatialIndex, frustum: &Frustum, answer: &Answer) -> Outcome<()> {
    with_found(|Found { set, .. }| {
        set.clear();
        index.frustum_cull_blocks(frustum, set);
        answer.write(set.len(), set.ids().map(|id| id.0))
    })
}

/// Hands over what `find` lists, ascending.
pub(crate) fn answer_list(answer: &Answer, find: impl FnOnce(&mut Vec<PolygonId>)) -> Outcome<()> {
    with_found(|Found { list, .. }| {
        list.clear();
        find(list);
        list.sort_unstable();
        answer.write(list.len(), list.iter().map(|id| id.0))
    })
}

pub(crate) fn index_config(config: Option<OspIndexConfig>) -> Outcome<IndexConfig> {
    let Some(OspIndexConfig { root_center, root_size, capacity }) = config else {
        return Ok(IndexConfig { capacity: 1024, ..IndexConfig::default() });
    };
    let refused = |message: String| Err(Failure::new(OspStatus::InvalidArgument, message));
    let root = Aabb::cube(point(root_center, "root_center")?, root_size);
    if root_size.is_nan() || root_size <= 0.0 || !root.is_valid() {
        return refused(format!("root_size: expected a finite number above 0, found {root_size}"));
    }
    if capacity > OSP_MAX_IDS {
        return refused(format!("capacity: expected at most {OSP_MAX_IDS}, found {capacity}"));
    }
    Ok(IndexConfig { root, capacity: capacity as usize })
}

/// Whether so many more are not too many.
pub(crate) fn room_for(count: usize, more: usize) -> Outcome<()> {
    if more <= OSP_MAX_IDS as usize - count {
        return Ok(());
    }
    let message = format!("expected at most {OSP_MAX_IDS} together, found {count} and {more} more");
    Err(Failure::new(OspStatus::TooMany, message))
}

pub(crate) fn unknown(id: u32) -> Failure {
    Failure::new(OspStatus::UnknownId, format!("id {id}: it is not in use"))
}

pub(crate) fn not_committed(commit: &str) -> Failure {
    Failure::new(
        OspStatus::NotCommitted,
        format!("there are changes since the last commit: call {commit} first"),
    )
}
