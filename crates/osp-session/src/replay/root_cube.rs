use crate::recording::Header;
use osp::{index::IndexConfig, math::Aabb};

/// The root cube of an index for a session, world space, metres: the header's modelling volume, or else a cube around
/// `bounds`, the box of all polygons.
pub fn root_cube(header: &Header, bounds: &Aabb) -> Aabb {
    match header.root {
        Some(root) if root.size > 0.0 && root.size.is_finite() && root.center.is_finite() => {
            Aabb::cube(root.center, root.size)
        }
        _ if bounds.is_empty() => IndexConfig::default().root,
        _ => Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.01),
    }
}
