//! The index alone: it stores boxes, and returns the boxes in a camera's frustum. It needs no features: `cargo run
//! --example cull_boxes`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{
    Depth,
    glam::{
        Vec3,
        camera::rh::{proj::directx, view::look_at_mat4},
    },
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::{PolygonId, VisibleBlocks},
    view::View,
};

fn main() -> Result<(), IndexError> {
    // A hundred thousand cubes of 10 cm on a floor of 100 m by 100 m. The program chooses their ids.
    let root = Aabb::cube(Vec3::ZERO, 100.0);
    let mut index = Osp::new(&IndexConfig { root, capacity: 100_000 });
    for i in 0..100_000u32 {
        let (row, column) = (i / 316, i % 316);
        let center = Vec3::new(column as f32 * 0.316 - 50.0, 0.05, row as f32 * 0.316 - 50.0);
        index.insert(PolygonId(i), &Aabb::cube(center, 0.1))?;
    }
    // The program can insert, move and remove cubes at any time, without a rebuild.
    index.remove(PolygonId(7))?;
    index.update(PolygonId(8), &Aabb::cube(Vec3::new(0.0, 1.0, -2.0), 0.1))?;
    index.commit();

    // The matrix of an engine, here with reversed depth and no far plane.
    let clip_from_view = directx::perspective_infinite_reverse(1.0, 16.0 / 9.0, 0.1);
    let view_from_world = look_at_mat4(Vec3::new(0.0, 1.7, 0.0), Vec3::new(0.0, 1.0, -5.0), Vec3::Y);
    let view =
        View::from_matrix(&(clip_from_view * view_from_world), Depth::OneToZero).expect("a perspective");

    // A program reuses this list in every frame, so that no frame allocates.
    let mut visible = VisibleBlocks::new();
    visible.clear();
    let work = index.frustum_cull_blocks(&view.frustum(), &mut visible);
    println!("{} of {} cubes in view, {} boxes tested", visible.len(), index.len(), work.boxes);
    println!("the first three: {:?}", visible.ids().take(3).collect::<Vec<_>>());
    assert!(visible.contains(PolygonId(8)) && visible.len() < index.len());
    Ok(())
}
