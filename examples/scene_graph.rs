//! Groups that move within groups, culled as groups: the solar system of a lecture on scene graphs.
//!
//! `cargo run --example scene_graph`

use glam::{Affine3A, Vec3};
use osp::{
    index::groups::{CullScratch, GroupError, GroupIndex, NodeId, Polygons},
    math::Aabb,
    polygon::PolygonId,
    view::{Projection, View},
};

fn main() -> Result<(), GroupError> {
    let mut index = GroupIndex::default();
    // A ball of small plates, filed once and shown three times.
    let ball = index.add_mesh();
    for number in 0..1000 {
        let (height, angle) = (number as f32 / 500.0 - 1.0, number as f32 * 2.4);
        let around = (1.0 - height * height).max(0.0).sqrt();
        let at = Vec3::new(around * angle.cos(), height, around * angle.sin());
        index.set_polygon(ball, PolygonId(number), Some(&Aabb::cube(at, 0.05)))?;
    }
    let turned = |degrees: f32| Affine3A::from_rotation_y(degrees.to_radians());
    let at = |x: f32, size: f32| {
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(size),
            glam::Quat::IDENTITY,
            Vec3::new(x, 0.0, 0.0),
        )
    };
    let sun = index.add_node(None, at(0.0, 1.0), Some(ball))?;
    let orbit = index.add_node(None, turned(45.0), None)?;
    let planet = index.add_node(Some(orbit), at(5.0, 0.5), Some(ball))?;
    let moon_orbit = index.add_node(Some(planet), turned(30.0), None)?;
    let moon = index.add_node(Some(moon_orbit), at(3.0, 0.4), Some(ball))?;

    let view =
        View::look_at(Vec3::new(0.0, 1.0, 9.0), Vec3::ZERO, Projection::symmetric(40.0, 1.5, 0.1, 100.0));
    let mut scratch = CullScratch::default();
    for day in 0..6 {
        // One transform is changed; the planet, the moon's orbit and the moon follow.
        index.place(orbit, turned(45.0 + 60.0 * day as f32))?;
        index.commit();
        let mut seen = Vec::new();
        index.frustum_cull(&view.frustum(), &mut scratch, |found| {
            let name = |node: NodeId| {
                if node == sun {
                    "sun"
                } else if node == planet {
                    "planet"
                } else {
                    "moon"
                }
            };
            seen.push(match found.polygons {
                Polygons::All => format!("{}: all", name(found.node)),
                Polygons::Some(polygons) => format!("{}: {} of 1000", name(found.node), polygons.len()),
            });
        });
        let moon_at = index.world_from_node(moon)?.translation;
        say(&format!("day {day}: the moon is at {moon_at:.2}; in view {}", seen.join(", ")));
    }
    let work = index.work();
    say(&format!(
        "{} matrices, {} boxes and {} entries were computed anew",
        work.matrices, work.boxes, work.entries
    ));
    Ok(())
}

#[allow(clippy::print_stdout, reason = "an example")]
fn say(line: &str) {
    println!("{line}");
}
