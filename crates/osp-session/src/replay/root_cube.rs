use crate::recording::Header;
use osp::{index::IndexConfig, math::Aabb};

/// The root cube of an index for a session, metres in world space: the header's modelling volume, or a cube around
/// `bounds`, the box of all its polygons.
pub fn root_cube(header: &Header, bounds: &Aabb) -> Aabb {
    match header.root {
        Some(root) if root.size > 0.0 && root.size.is_finite() && root.center.is_finite() => {
            Aabb::cube(root.center, root.size)
        }
        _ if bounds.is_empty() => IndexConfig::default().root,
        _ => Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.01),
    }
}
