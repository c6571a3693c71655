//! Polygons in spaces that move as a whole.
//!
//! An index stores polygons by their boxes in the world. There, dragging a group of a hundred thousand polygons would
//! take a hundred thousand updates in each frame. Here each space has its own index, with the boxes of its polygons in
//! that space. If the space moves, only one box changes: the box around the space, in an index of all spaces.
//!
//! A query returns the same set as an index of world boxes, bit for bit. A frustum query tests two frusta in each
//! space. The *outer* frustum finds all polygons that may be in view. It is enlarged by rounding errors, and by the
//! growth of boxes under rotation. The *inner* frustum finds only polygons that are certainly in view. The polygons
//! that only the outer frustum finds are tested by their boxes in the world.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::{
    index::{IndexConfig, IndexError, Osp, SpatialIndex, WorkCounts, admission::admit, mesh::Mesh},
    math::{Aabb, Containment, Frustum, Plane, Ray},
    polygon::{
        BLOCK, ById, Geometry, PLACE_ROUNDING, PolygonId, SpaceId, SpacePlace, SpacesInView, VisibleBlocks,
        abs_matrix, ids_of,
    },
};

/// Rounding error of a kernel's test of a box against a plane, relative to the input numbers.
const KERNEL_ROUNDING: f64 = PLACE_ROUNDING;

/// A space with its polygons. Each block of sixteen ids with a polygon has a slot: `blocks[slot]` is `id / 16`. In
/// `mesh`, a polygon has the number `slot * 16 + id % 16`, so that masks of the mesh are masks of ids.
struct Space {
    id: SpaceId,
    mesh: Mesh,
    blocks: Vec<u32>,
    /// The present polygons, a mask for each slot.
    masks: Vec<u16>,
    slots: HashMap<u32, u32>,
    polygons: usize,
    /// Half the largest extent of a polygon along each axis, over all polygons so far.
    largest_half_m: Vec3,
    place: SpacePlace,
    /// The box around the space's polygons in the world, after the last commit.
    world_bounds: Aabb,
    has_changed: bool,
}

impl Space {
    fn new(id: SpaceId, place: SpacePlace) -> Self {
        Self {
            id,
            mesh: Mesh::default(),
            blocks: Vec::new(),
            masks: Vec::new(),
            slots: HashMap::new(),
            polygons: 0,
            largest_half_m: Vec3::ZERO,
            place,
            world_bounds: Aabb::EMPTY,
            has_changed: false,
        }
    }

    /// The number of a polygon in the mesh, if its block has a slot.
    fn number(&self, id: PolygonId) -> Option<PolygonId> {
        let slot = *self.slots.get(&(id.0 / BLOCK as u32))?;
        Some(PolygonId(slot * BLOCK as u32 + id.0 % BLOCK as u32))
    }

    fn id(&self, number: PolygonId) -> PolygonId {
        PolygonId(self.blocks[number.index() / BLOCK] * BLOCK as u32 + number.0 % BLOCK as u32)
    }

    fn set(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        admit(id, bounds)?;
        let slot = *self.slots.entry(id.0 / BLOCK as u32).or_insert_with(|| {
            self.blocks.push(id.0 / BLOCK as u32);
            self.masks.push(0);
            self.blocks.len() as u32 - 1
        });
        self.mesh.set(PolygonId(slot * BLOCK as u32 + id.0 % BLOCK as u32), Some(bounds))?;
        let (mask, bit) = (&mut self.masks[slot as usize], 1 << (id.0 % BLOCK as u32));
        self.polygons += usize::from(*mask & bit == 0);
        *mask |= bit;
        self.largest_half_m = self.largest_half_m.max(bounds.max * 0.5 - bounds.min * 0.5);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        let number = self.number(id).ok_or(IndexError::Unknown(id))?;
        self.mesh.set(number, None)?;
        self.masks[number.index() / BLOCK] &= !(1 << (number.index() % BLOCK));
        self.polygons -= 1;
        Ok(())
    }

    /// The present polygons, as pairs of block and mask.
    fn all(&self) -> impl Iterator<Item = (usize, u16)> + '_ {
        self.blocks.iter().zip(&self.masks).map(|(block, mask)| (*block as usize, *mask))
    }

    /// The outer and the inner frustum, in the space; see [`self`](crate::frame::spaces).
    fn outer_and_inner(&self, frustum: &Frustum) -> [Frustum; 2] {
        let matrix = self.place.world_from_space.matrix3;
        let half = self.largest_half_m.as_dvec3();
        let bounds = self.mesh.bounds();
        let far = bounds.min.abs().max(bounds.max.abs()).as_dvec3();
        let rounding_m = 2.0 * self.place.rounding_of(bounds);
        let planes = frustum.planes().map(|plane| {
            let in_world = plane.normal.as_dvec3();
            let exact: DVec3 = matrix.transpose() * in_world;
            let normal = exact.as_vec3();
            let d = in_world.dot(self.place.world_from_space.translation) + f64::from(plane.d);
            // Extents along the normal: of the largest box in the space, and of its box in the world.
            let reach_m = exact.abs().dot(half);
            let world_reach_m = in_world.abs().dot(abs_matrix(&matrix) * half);
            let size_m = exact.abs().dot(far)
                + d.abs()
                + in_world.abs().dot(self.place.reach_m())
                + f64::from(plane.d).abs();
            let rounding_m = rounding_m * in_world.abs().element_sum()
                + KERNEL_ROUNDING * size_m
                + f64::from(f32::MIN_POSITIVE);
            let widest_m = size_m + world_reach_m + reach_m + rounding_m;
            if widest_m > 0.25 * f64::from(f32::MAX) || widest_m.is_nan() {
                // The sums of a box test might overflow, so the plane decides nothing.
                return [0.0, -1.0].map(|d| Plane { normal: Vec3::ZERO, d });
            }
            let shifted = |by_m: f64| Plane { normal, d: (d + by_m) as f32 };
            [shifted((world_reach_m - reach_m).max(0.0) + rounding_m), shifted(-2.0 * reach_m - rounding_m)]
        });
        [0, 1].map(|which| Frustum::new(planes.map(|of_plane| of_plane[which])))
    }
}

/// Working memory of queries, kept from frame to frame.
#[derive(Debug, Default)]
struct Scratch {
    tops: VisibleBlocks,
    outer: VisibleBlocks,
    inner: VisibleBlocks,
}

/// All spaces of a pipeline. Their polygons are not in the pipeline's index.
pub(super) struct Spaces {
    spaces: Vec<Space>,
    numbers: HashMap<SpaceId, u32>,
    /// An index of the spaces by their boxes in the world.
    tops: Option<Osp>,
    /// For each polygon, one more than the index of its space in `spaces`; 0 without a space.
    space_of: ById<u32>,
    polygons: usize,
    changed: Vec<u32>,
    scratch: Scratch,
}

impl Spaces {
    pub(super) fn new() -> Self {
        Self {
            spaces: Vec::new(),
            numbers: HashMap::new(),
            tops: None,
            space_of: ById::new(0),
            polygons: 0,
            changed: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Number of polygons in spaces.
    pub(super) fn len(&self) -> usize {
        self.polygons
    }

    /// Whether no polygon was ever in a space.
    pub(super) fn is_unused(&self) -> bool {
        self.spaces.is_empty()
    }

    /// Whether a polygon is in a space.
    pub(super) fn holds(&self, id: PolygonId) -> bool {
        self.space_of.get(id) != 0
    }

    /// Inserts or updates a polygon in a space, by its box in that space.
    pub(super) fn set(
        &mut self,
        geometry: &dyn Geometry,
        id: PolygonId,
        space: SpaceId,
    ) -> Result<(), IndexError> {
        let number = self.number_of(geometry, space);
        if self.holds(id) && self.space_of.get(id) != number + 1 {
            self.remove(id)?;
        }
        let space_index = &mut self.spaces[number as usize];
        if space_index.polygons == 0 {
            // An empty space gets no `Place` changes, so its place is read here.
            space_index.place = geometry.place(space);
        }
        let outcome = space_index.set(id, &geometry.bounds_in_space(id));
        match outcome {
            Ok(()) => {
                self.polygons += usize::from(!self.holds(id));
                self.space_of.set(id, number + 1);
                self.note_changed(number);
            }
            // The polygon is removed, because queries would still find it at its old place.
            Err(_) if self.holds(id) => self.remove(id)?,
            Err(_) => {}
        }
        outcome
    }

    pub(super) fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        let number = self.space_of.get(id).checked_sub(1).ok_or(IndexError::Unknown(id))?;
        self.space_of.set(id, 0);
        self.polygons -= 1;
        self.note_changed(number);
        self.spaces[number as usize].remove(id)
    }

    /// Applies the move of a space.
    pub(super) fn place(&mut self, geometry: &dyn Geometry, space: SpaceId) {
        // The place of an unused space is read with its first polygon.
        if let Some(&number) = self.numbers.get(&space) {
            self.spaces[number as usize].place = geometry.place(space);
            self.note_changed(number);
        }
    }

    fn number_of(&mut self, geometry: &dyn Geometry, space: SpaceId) -> u32 {
        *self.numbers.entry(space).or_insert_with(|| {
            self.spaces.push(Space::new(space, geometry.place(space)));
            self.spaces.len() as u32 - 1
        })
    }

    fn note_changed(&mut self, number: u32) {
        if !std::mem::replace(&mut self.spaces[number as usize].has_changed, true) {
            self.changed.push(number);
        }
    }

    /// Ends a batch of changes.
    pub(super) fn commit(&mut self) {
        let tops = self
            .tops
            .get_or_insert_with(|| Osp::new(&IndexConfig { capacity: 1024, ..IndexConfig::default() }));
        for number in self.changed.drain(..) {
            let space = &mut self.spaces[number as usize];
            space.has_changed = false;
            space.mesh.commit();
            let id = PolygonId(number);
            let _ = tops.remove(id);
            if space.polygons > 0 {
                space.world_bounds = space.place.world_box(space.mesh.bounds());
                // The index accepts the box, because it is finite.
                let _ = tops.insert(id, &space.world_bounds);
            }
        }
        tops.commit();
    }

    /// Adds the polygons whose boxes in the world the frustum may see.
    pub(super) fn frustum_cull(
        &mut self,
        geometry: &dyn Geometry,
        frustum: &Frustum,
        visible: &mut SpacesInView,
    ) -> WorkCounts {
        let Scratch { tops, outer, inner } = &mut self.scratch;
        tops.clear();
        let mut work = WorkCounts::default();
        let Some(index) = &self.tops else { return work };
        work += index.frustum_cull_blocks(frustum, tops);
        work.reported = 0;
        for number in tops.ids() {
            let space = &self.spaces[number.index()];
            work.boxes += 1;
            if frustum.classify(&space.world_bounds) == Containment::Inside {
                space.all().for_each(|(block, mask)| visible.push_block(block, mask));
            } else {
                let [wide, narrow] = space.outer_and_inner(frustum);
                outer.clear();
                inner.clear();
                work += space.mesh.index().frustum_cull_blocks(&wide, outer);
                work += space.mesh.index().frustum_cull_blocks(&narrow, inner);
                for (slot, mask) in outer.blocks() {
                    let sure = mask & inner.mask(slot);
                    let block = space.blocks[slot] as usize;
                    let mut found = sure;
                    for bit in (0..BLOCK).filter(|bit| (mask & !sure) >> bit & 1 == 1) {
                        work.boxes += 1;
                        let id = PolygonId((block * BLOCK + bit) as u32);
                        found |= u16::from(frustum.may_see(&geometry.bounds(id))) << bit;
                    }
                    visible.push_block(block, found);
                }
            }
            work.reported += visible.end_space(&space.world_bounds) as u64;
        }
        work
    }

    /// Appends the polygons whose boxes in the world share a point with a box.
    pub(super) fn box_query(&self, geometry: &dyn Geometry, bounds: &Aabb, out: &mut Vec<PolygonId>) {
        let mut found = Vec::new();
        for space in self.spaces.iter().filter(|space| space.polygons > 0) {
            let place = geometry.place(space.id);
            if !place.world_box(space.mesh.bounds()).intersects(bounds) {
                continue;
            }
            found.clear();
            // The query box is enlarged by the largest extent of a polygon. It then touches each polygon whose world
            // box touches `bounds`.
            let largest_m =
                abs_matrix(&place.world_from_space.matrix3) * space.largest_half_m.as_dvec3() * 2.0;
            let beside_m = (largest_m + 4.0 * place.rounding_of(space.mesh.bounds())).as_vec3();
            let wider = Aabb { min: bounds.min - beside_m, max: bounds.max + beside_m };
            space.mesh.index().box_query(&place.box_in_space(&wider), &mut found);
            let ids = found.iter().map(|&number| space.id(number));
            out.extend(ids.filter(|&id| geometry.bounds(id).intersects(bounds)));
        }
    }

    /// The nearest polygon in a space that a ray meets, with the exact test `hit` in the world; see
    /// [`SpatialIndex::ray_nearest`].
    pub(super) fn ray_nearest(
        &self,
        geometry: &dyn Geometry,
        ray: &Ray,
        mut t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = None;
        for space in self.spaces.iter().filter(|space| space.polygons > 0) {
            let place = geometry.place(space.id);
            if ray.enter_box(&place.world_box(space.mesh.bounds()), t_max).is_none() {
                continue;
            }
            let space_from_world = place.world_from_space.inverse();
            let origin = space_from_world.transform_point3(ray.origin.as_dvec3()).as_vec3();
            let direction = space_from_world.transform_vector3(ray.direction.as_dvec3()).as_vec3();
            let in_space = Ray::new(origin, direction);
            if !in_space.is_valid() {
                // The space is scaled to a plane or a point, or by so much that the direction vanishes, so all its polygons
                // are tested.
                for id in space.all().flat_map(|(block, mask)| ids_of(block, mask)) {
                    if let Some(t) = hit(id).filter(|t| *t <= t_max)
                        && nearest.is_none_or(|(first, at)| (t, id) < (at, first))
                    {
                        (nearest, t_max) = (Some((id, t)), t);
                    }
                }
                continue;
            }
            let mut hit = |number: PolygonId| hit(space.id(number));
            let found = space.mesh.index().ray_nearest(&in_space, t_max, &mut hit);
            if let Some((number, t)) = found {
                (nearest, t_max) = (Some((space.id(number), t)), t);
            }
        }
        nearest
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        let of_space = |space: &Space| {
            size_of::<Space>() + space.mesh.bytes() + space.blocks.capacity() * 6 + space.slots.capacity() * 8
        };
        self.spaces.iter().map(of_space).sum::<usize>()
            + self.space_of.bytes()
            + self.tops.as_ref().map_or(0, SpatialIndex::bytes)
    }
}
