//! The meshes of all occluders, each at its place.

use std::sync::Arc;

use glam::Vec3;

use super::prepare::OccluderMesh;
use crate::{math::Aabb, polygon::PolygonId};

/// The images of a space's axes, and of its origin.
pub(crate) type Columns = [Vec3; 4];

/// A mesh at its place.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    pub(super) mesh: Arc<OccluderMesh>,
    pub(super) columns: Columns,
}

/// The meshes of all occluders, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Meshes {
    /// The box of each instance in world space; [`Aabb::EMPTY`] for a free number.
    pub(super) bounds: Vec<Aabb>,
    pub(super) instances: Vec<Option<Instance>>,
    free: Vec<u32>,
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
        self.instances[number as usize] = Some(Instance { mesh, columns });
        number
    }

    /// Whether no mesh can be added.
    pub(crate) fn is_full(&self) -> bool {
        self.free.is_empty() && self.bounds.len() >= PolygonId::LIMIT as usize
    }

    /// Moves a mesh.
    pub(crate) fn place(&mut self, number: u32, columns: Columns) {
        if let Some(Some(instance)) = self.instances.get_mut(number as usize) {
            instance.columns = columns;
            self.bounds[number as usize] = moved(&columns, &instance.mesh.bounds());
        }
    }

    pub(crate) fn remove(&mut self, number: u32) {
        if let Some(place) = self.instances.get_mut(number as usize)
            && place.take().is_some()
        {
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
