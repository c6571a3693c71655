//! The meshes of all occluders, each at its place. Meshes that have not moved are linked where their borders are equal
//! bit for bit, as those of a terrain's parts. The link of a mesh that moves counts again when it is back.

use std::{collections::HashMap, hash::BuildHasherDefault, sync::Arc};

use glam::Vec3;

use super::prepare::OccluderMesh;
use crate::{key_hasher::KeyHasher, math::Aabb, polygon::PolygonId};

/// The images of a space's axes, and of its origin.
pub(crate) type Columns = [Vec3; 4];

/// A mesh at its place.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    pub(super) mesh: Arc<OccluderMesh>,
    pub(super) columns: Columns,
    /// For each border of the mesh, the triangle of another mesh on the other side. Empty if there is none.
    mates: Vec<Option<Mate>>,
    /// Whether the borders were compared with those of other meshes. This takes long, so it lasts while the mesh moves.
    is_linked: bool,
}

/// A triangle of another mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mate {
    pub(super) instance: u32,
    pub(super) batch: u32,
    pub(super) triangle: u16,
    /// Number of the border in that mesh.
    border: u32,
}

/// An edge from one point to another, by the bits of the coordinates.
type EdgeBits = [[u32; 3]; 2];

/// The meshes of all occluders, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Meshes {
    /// The box of each instance in world space; [`Aabb::EMPTY`] for a free number.
    pub(super) bounds: Vec<Aabb>,
    pub(super) instances: Vec<Option<Instance>>,
    free: Vec<u32>,
    /// The borders of meshes that have not moved and have no mate.
    borders: HashMap<EdgeBits, Mate, BuildHasherDefault<KeyHasher>>,
    /// A box around all meshes that have not moved, and whether it may be too large.
    pub(super) around: Option<Aabb>,
    is_loose: bool,
}

impl Meshes {
    /// Adds a mesh. Returns its number.
    pub(crate) fn insert(&mut self, mesh: Arc<OccluderMesh>, columns: Columns) -> u32 {
        let number = self.free.pop().unwrap_or_else(|| {
            self.bounds.push(Aabb::EMPTY);
            self.instances.push(None);
            self.bounds.len() as u32 - 1
        });
        self.bounds[number as usize] = moved(&columns, &mesh.bounds());
        self.instances[number as usize] =
            Some(Instance { mesh, columns, mates: Vec::new(), is_linked: false });
        self.come_to_rest(number);
        number
    }

    /// Links a mesh that is where it was prepared.
    fn come_to_rest(&mut self, number: u32) {
        let Some(Some(instance)) = self.instances.get_mut(number as usize) else { return };
        if instance.columns != UNMOVED {
            return;
        }
        let bounds = instance.mesh.bounds();
        self.around = Some(self.around.map_or(bounds, |around| around.union(&bounds)));
        if !std::mem::replace(&mut instance.is_linked, true) {
            self.link(number);
        }
    }

    /// The triangle of another mesh on the other side of a border, if neither mesh has moved.
    #[inline]
    pub(super) fn mate(&self, instance: &Instance, border: usize) -> Option<Mate> {
        let mate = (*instance.mates.get(border)?)?;
        let is_there = |instance: &Instance| instance.columns == UNMOVED;
        let other = self.instances[mate.instance as usize].as_ref();
        (is_there(instance) && other.is_some_and(is_there)).then_some(mate)
    }

    /// Makes the box around the meshes as small as it can be. Before, it may be larger, which cuts off more near the eye.
    pub(crate) fn tighten(&mut self) {
        if std::mem::take(&mut self.is_loose) {
            let fixed = self.instances.iter().flatten().filter(|instance| instance.columns == UNMOVED);
            self.around = fixed.map(|instance| instance.mesh.bounds()).reduce(|a, b| a.union(&b));
        }
    }

    /// Links the borders of a mesh to equal borders of other meshes.
    fn link(&mut self, number: u32) {
        let Some(Some(Instance { mesh, .. })) = self.instances.get(number as usize) else { return };
        let mesh = mesh.clone();
        for ((batch, triangle, [from, to]), border) in mesh.open().zip(0..) {
            let [from, to] = [from, to].map(|p| p.to_array().map(f32::to_bits));
            let own = Mate { instance: number, batch, triangle, border };
            match self.borders.remove(&[to, from]) {
                Some(mate) if mate.instance != number => {
                    self.set_mate(own, Some(mate));
                    self.set_mate(mate, Some(own));
                }
                _ => {
                    self.borders.insert([from, to], own);
                }
            }
        }
    }

    /// Sets the triangle on the other side of a border.
    fn set_mate(&mut self, of: Mate, mate: Option<Mate>) {
        if let Some(Some(instance)) = self.instances.get_mut(of.instance as usize) {
            let place = of.border as usize;
            if instance.mates.len() <= place {
                instance.mates.resize(place + 1, None);
            }
            instance.mates[place] = mate;
        }
    }

    /// Removes all links of a mesh. Its former mates are borders again, until another mesh comes.
    fn unlink(&mut self, number: u32) {
        let Some(Some(instance)) = self.instances.get_mut(number as usize) else { return };
        if !std::mem::take(&mut instance.is_linked) {
            return;
        }
        let (mesh, mates) = (instance.mesh.clone(), std::mem::take(&mut instance.mates));
        for ((_, _, [from, to]), border) in mesh.open().zip(0..) {
            let [from, to] = [from, to].map(|p| p.to_array().map(f32::to_bits));
            if let Some(Some(mate)) = mates.get(border) {
                self.set_mate(*mate, None);
                self.borders.insert([to, from], *mate);
            } else if self.borders.get(&[from, to]).is_some_and(|own| own.instance == number) {
                self.borders.remove(&[from, to]);
            }
        }
    }

    /// Whether no mesh can be added.
    pub(crate) fn is_full(&self) -> bool {
        self.free.is_empty() && self.bounds.len() >= PolygonId::LIMIT as usize
    }

    /// Moves a mesh.
    pub(crate) fn place(&mut self, number: u32, columns: Columns) {
        if let Some(Some(instance)) = self.instances.get_mut(number as usize) {
            self.is_loose |= instance.columns == UNMOVED;
            instance.columns = columns;
            self.bounds[number as usize] = moved(&columns, &instance.mesh.bounds());
        }
        self.come_to_rest(number);
    }

    pub(crate) fn remove(&mut self, number: u32) {
        self.unlink(number);
        if let Some(place) = self.instances.get_mut(number as usize)
            && let Some(instance) = place.take()
        {
            self.is_loose |= instance.columns == UNMOVED;
            self.bounds[number as usize] = Aabb::EMPTY;
            self.free.push(number);
        }
    }
}

/// The place of a space that is world space.
pub(crate) const UNMOVED: Columns = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ZERO];

/// The box around a moved box, wider by the rounding error.
pub(crate) fn moved(columns: &Columns, bounds: &Aabb) -> Aabb {
    if *columns == UNMOVED {
        return *bounds;
    }
    let [x, y, z, origin] = *columns;
    let (center, half) = (bounds.center(), bounds.extent() * 0.5);
    let reach = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
    let size = x.abs() * center.x.abs() + y.abs() * center.y.abs() + z.abs() * center.z.abs() + origin.abs();
    let center = x * center.x + y * center.y + z * center.z + origin;
    let half = reach + (reach + size) * (8.0 * f32::EPSILON);
    Aabb::new(center - half, center + half)
}
