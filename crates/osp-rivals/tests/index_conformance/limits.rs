//! Senseless configurations and numbers: they cause no panic, and take no more memory than documented.

use glam::Vec3;
use osp::{
    frame::Pipeline,
    glam::Affine3A,
    index::{BruteForce, IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_rivals::groups::GroupIndex;
use osp_testkit::Altered;

use crate::subjects::subjects;

/// Upper bound of the documented memory: a hundred bytes for each polygon.
const MOST_BYTES: usize = 100 * IndexConfig::MOST_RESERVED;

#[test]
fn a_set_takes_no_number_beyond_the_limit() {
    let mut set = VisibleBlocks::with_capacity(usize::MAX);
    let last = PolygonId(PolygonId::LIMIT - 1);
    for id in [PolygonId::LIMIT, u32::MAX - 1, u32::MAX].map(PolygonId) {
        assert!(!set.insert(id) && !set.contains(id));
    }
    for block in [PolygonId::LIMIT as usize / 16, usize::MAX] {
        set.insert_block(block, u16::MAX);
        set.remove_block(block, u16::MAX);
        assert_eq!(set.mask(block), 0);
    }
    assert!(set.is_empty());
    // Room grows by half, and not beyond the limit, either.
    let mut grown = VisibleBlocks::with_capacity(PolygonId::LIMIT as usize / 4 * 3);
    assert!(grown.insert(last) && !grown.insert(PolygonId(PolygonId::LIMIT)));
    assert!(set.insert(last) && set.contains(last));
    assert_eq!(set.to_vec(), [last]);
    let ids = [3, u32::MAX].map(PolygonId);
    assert_eq!(ids.into_iter().collect::<VisibleBlocks>().to_vec(), [PolygonId(3)]);
}

/// A foreign index, which reports impossible numbers.
#[test]
fn a_list_of_any_numbers_becomes_a_set_of_those_below_the_limit() {
    let mut set = VisibleBlocks::new();
    let any = Altered::by(|list| list.extend([7, u32::MAX].map(PolygonId)));
    any.frustum_cull_blocks(&Frustum::everything(), &mut set);
    assert_eq!(set.to_vec(), [PolygonId(7)]);
}

#[test]
fn a_capacity_of_all_numbers_reserves_what_is_stated() {
    let pipeline = Pipeline::new(Box::new(BruteForce::with_capacity(usize::MAX)), usize::MAX);
    assert!(pipeline.bytes() <= MOST_BYTES);
    let config = IndexConfig { capacity: usize::MAX, ..IndexConfig::default() };
    assert!(Osp::new(&config).bytes() <= MOST_BYTES);
    for subject in &subjects() {
        let mut index = (subject.make)(&config);
        assert!(index.bytes() <= 4 * MOST_BYTES, "{}: {} bytes", subject.name, index.bytes());
        index.insert(PolygonId(9), &Aabb::cube(Vec3::ONE, 0.1)).expect("a good box");
        index.commit();
        assert_eq!(index.len(), 1, "{}", subject.name);
    }
}

#[test]
fn the_last_number_costs_no_more_in_a_mesh_than_the_first() {
    let bytes = |id: u32| {
        let mut groups = GroupIndex::default();
        let mesh = groups.add_mesh();
        groups.set_polygon(mesh, PolygonId(id), Some(&Aabb::cube(Vec3::ONE, 0.1))).expect("a good box");
        groups.add_node(None, Affine3A::IDENTITY, Some(mesh)).expect("a finite transform");
        groups.commit();
        groups.bytes()
    };
    let (first, last) = (bytes(0), bytes(PolygonId::LIMIT - 1));
    assert!(last < first + (16 << 20), "{last} bytes, {first} for the first");
}
