//! osp is a spatial index and culler for 3D models that grow while somebody draws them. Every frame inserts the new
//! polygons into the index without a rebuild, and finds the polygons that a view may see.
//!
//! # In an engine
//!
//! A [`Culler`] works with the engine's own keys. Insert, move and remove boxes, then cull for each camera.
//!
//! ```
//! use osp::{Camera, Culler, Depth, Occluder, math::Aabb};
//!
//! #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
//! struct Entity(u64); // Or any other key that is `Copy + Eq + Hash`; `osp::Dense` numbers need no map.
//!
//! let mut culler = Culler::<Entity>::new(); // Needs no size of the world and no capacity.
//! let (table, cupboard, wall) = (Entity(1), Entity(2), Entity(3));
//! culler.set(table, [[-1.0, 0.0, -4.0], [1.0, 1.0, -3.0_f32]]); // Inserts or moves an object: min, max.
//! culler.set(cupboard, [[-1.0, 0.0, -9.0], [1.0, 2.0, -8.0_f32]]);
//! culler.set(wall, [[-4.0, 0.0, -6.0], [4.0, 3.0, -5.9_f32]]);
//! let corners = [[-4.0, 0.0, -6.0], [4.0, 0.0, -6.0], [4.0, 3.0, -6.0], [-4.0, 3.0, -6.0_f32]];
//! culler.set_occluder(wall, Occluder::quad(corners)?); // Or `mesh(vertices, indices)`, or a `cuboid`.
//!
//! // The engine's matrices from world to clip space, `f32` or `f64`, by columns. `clip` is a perspective with reversed
//! // depth and no far plane, from an eye at a height of 1 m. `ortho` is the parallel projection of a sun above.
//! let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.1, 0.0_f32];
//! let ortho = [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0_f32];
//! let main = Camera::from_matrix(clip, Depth::OneToZero)?;
//! let sun = Camera::from_matrix(ortho, Depth::ZeroToOne)?;
//!
//! // In each frame, after the changes. With `hide_by_occluders`, a camera omits the objects behind occluders.
//! let frame = culler.cull(&[main.hide_by_occluders(), sun]);
//! let draw: Vec<Entity> = frame[0].iter().collect();
//! assert!(draw.contains(&table) && draw.contains(&wall) && !draw.contains(&cupboard));
//! assert_eq!((frame[0].hidden(), frame[1].len()), (1, 3));
//! for (entity, why) in culler.refused() {
//!     eprintln!("{entity:?}: {why}"); // A box that was empty, infinite or NaN.
//! }
//!
//! // The object under the cursor. An engine intersects the ray with meshes, this example with boxes.
//! let hit = culler.pick(main.ray(0.0, -0.2), |entity, ray| {
//!     let [min, max] = culler.bounds(entity)?;
//!     ray.enter_box(&Aabb::new(min.into(), max.into()), f32::INFINITY)
//! });
//! assert_eq!(hit.map(|(entity, _distance_m)| entity), Some(table));
//!
//! culler.remove(wall);
//! assert!(culler.cull(&[main.hide_by_occluders()])[0].contains(cupboard));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Culler::in_box`] and [`Culler::in_sphere`] find near objects. [`Culler::set_layers`] and [`Camera::on_layers`] choose the
//! objects of each camera. Queries and [`Culler::cull_view`] take `&self`: several threads may run them at once.
//!
//! # From a change to the screen
//!
//! In a [`Culler`]:
//!
//! ```text
//!  set, remove ──> keys get ids ──> index ── commit ──> frustum of each Camera ──> occlusion ──> keys in view
//! ```
//!
//! In a [`Pipeline`](frame::Pipeline), the layer below:
//!
//! ```text
//! the caller's polygons (Geometry) ─────────┬──────────────────────────────┐
//!                                           v                              v
//!  Change ──> index (insert, commit) ──> frustum of a View ──> occlusion (a Pass) ──> draw list ──> renderer
//!             osp, or a rival            what may be in view   large occluders,                     wgpu, or the
//!                                                              previous frame's                     caller's own
//!                └──────────────────── frame: Pipeline ────────────────────┘
//! ```
//!
//! # Below the culler
//!
//! An engine whose polygons move in groups, or that uses another index, calls the layer below: it gives each object an id,
//! implements [`Geometry`](polygon::Geometry) for these ids, and passes the changes of each frame to a
//! [`Pipeline`](frame::Pipeline). [`Pipeline::draw_list`](frame::Pipeline::draw_list) then returns the visible ids in
//! blocks of sixteen.
//!
//! ```
//! use osp::{
//!     frame::{PassConfig, Pipeline},
//!     glam::Vec3,
//!     index::{IndexConfig, Osp},
//!     math::Aabb,
//!     occlusion::Occlusion,
//!     polygon::{Change, ConvexPolygon, Geometry, PolygonId},
//!     view::{Projection, View},
//! };
//!
//! /// Polygon 0 is a wall that hides others. The others are meshes, which have only boxes.
//! struct World {
//!     wall: [Vec3; 4],
//!     meshes: Vec<Aabb>,
//! }
//!
//! impl Geometry for World {
//!     fn id_end(&self) -> usize {
//!         1 + self.meshes.len()
//!     }
//!     fn is_present(&self, id: PolygonId) -> bool {
//!         id.index() < self.id_end()
//!     }
//!     fn bounds(&self, id: PolygonId) -> Aabb {
//!         id.index().checked_sub(1).map_or(Aabb::from_points(&self.wall), |mesh| self.meshes[mesh])
//!     }
//!     fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
//!         (id.0 == 0).then(|| ConvexPolygon::quad(self.wall))
//!     }
//!     fn may_occlude(&self, id: PolygonId) -> bool {
//!         id.0 == 0
//!     }
//! }
//!
//! let wall = [[-3.0, 0.0, -5.0], [3.0, 0.0, -5.0], [3.0, 4.0, -5.0], [-3.0, 4.0, -5.0]].map(Vec3::from);
//! let mesh = |i| Aabb::cube(Vec3::new(i as f32 * 0.2 - 10.0, 1.0, -9.0), 0.5);
//! let mut world = World { wall, meshes: (0..100).map(mesh).collect() };
//!
//! // The cube that will contain most meshes, and their number: hints, not limits.
//! let index = Osp::new(&IndexConfig { root: Aabb::cube(Vec3::ZERO, 64.0), capacity: 1000 });
//! // The pass assumes that drawing a mesh takes 10 microseconds, so it tests each one.
//! let occlusion = PassConfig::new(Occlusion::Msvbsp);
//! let mut pipeline = Pipeline::new(Box::new(index), 1000).with_occlusion(occlusion);
//! pipeline.load(&world);
//!
//! // Or `View::from_matrix`, with the engine's own matrix.
//! let projection = Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0);
//! let view = View::look_at(Vec3::new(0.0, 1.6, 0.0), Vec3::new(0.0, 1.6, -5.0), projection);
//!
//! // In each frame: update the world first, then pass the changes to the pipeline.
//! world.meshes[6] = Aabb::cube(Vec3::new(0.0, 1.0, -2.0), 0.5);
//! pipeline.frame(&world, &[Change::Update(PolygonId(7))], &view);
//! for (block, mask) in pipeline.draw_list().blocks() {
//!     // Draw numbers block * 16 + i for each bit i of the mask; `polygon::ids_of` lists them.
//!     assert!(mask != 0 && block <= 100 / 16);
//! }
//! assert!(pipeline.draw_list().contains(PolygonId(7)));
//! assert!(!pipeline.draw_list().contains(PolygonId(51)), "hidden behind the wall");
//! ```
//!
//! `examples/engine.rs` extends this example by insertions, removals and the engine's own keys.
//! `examples/cull_boxes.rs` uses the index alone, `examples/culler.rs` the culler.
//!
//! # Layers
//!
//! Public items without documentation serve the other crates of the workspace, and change without notice.
//!
//! A module depends only on modules above it in this table. The library needs `glam`, `libm` and `thiserror` (in a browser also
//! `web-time`) and has no features.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`math`] | boxes, planes, frusta, rays |
//! | [`polygon`] | the caller's polygons: id, shape, change, [`Geometry`](polygon::Geometry) |
//! | [`index`] | the trait [`SpatialIndex`](index::SpatialIndex), [`Osp`](index::Osp), the reference |
//! | [`view`] | an eye and what its screen shows |
//! | [`occlusion`] | occluders, and structures that test boxes against their shadows |
//! | [`frame`] | one frame: apply changes, cull, omit hidden polygons |
//! | [`Culler`] | the engine's keys, cameras and occluders, above all these modules; [`oracle`] tests draw lists |
//!
//! The program `osp` consists of further crates. Each depends only on crates before it in this list: `osp-session`
//! (recordings, brushes, scenes), `osp-rivals` (every other index and culler), `osp-render` (wgpu), `osp-lab` (oracle,
//! benchmarks), `osp-net` (authors), `osp-app` (window), `osp-cli`.
//!
//! # Vocabulary
//!
//! *Polygon*: convex and planar, with three or four corners; a twisted quad is two triangles. *Index*: a spatial structure
//! of *nodes*. *View*: an *eye* and the part of the world that its *screen* shows. *Draw list*: the polygons that a frame
//! has to draw. *Occluder*: a polygon that hides others. A *conservative* method culls no visible polygon. *Space*: a
//! coordinate system with polygons that move as a whole, such as a dragged group; they have an index of their own.
//!
//! World space is right-handed, +y up, -z forward, in metres; names carry units and spaces. Vectors are those of `glam`
//! 0.34, re-exported as [`glam`]; its `From<[f32; 3]>` takes plain arrays.
//!
//! # Guarantees
//!
//! * **Conservative.** A query may return hidden polygons, but never omits a visible one. Undecided polygons count as visible.
//! * **Each id once.** A query reports every polygon at most once.
//! * **Nothing is lost.** Polygons that lie outside the root cube, are very large or coincide are kept and found.
//! * **Deterministic.** With the same changes and views, every frame has the same ids on every machine, except after
//!   [`PassConfig::by_measured_times`](frame::PassConfig::by_measured_times). Every box test is the same `f32` expression
//!   (see [`math`]), so all indexes agree bit for bit.
//! * **No allocation.** A frame allocates nothing once its lists have reached full size and the polygons fit the
//!   [capacity](index::IndexConfig::capacity) of the index.
//! * **No panic.** The index refuses invalid boxes and ids. [`IndexConfig`](index::IndexConfig) limits capacity and
//!   root.
//!
//! # References
//!
//! * "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree": the octal space partition tree.

pub use glam;

mod culler;
pub mod frame;
pub mod index;
mod key_hasher;
pub mod math;
pub mod occlusion;
pub mod polygon;
pub mod view;

pub use culler::{
    ALL_LAYERS, Camera, CameraError, Culler, Dense, Detail, Frame, Handle, Key, Occluder, OccluderError,
    OcclusionReport, Query, Refusal, Seen, ViewState, oracle,
};
pub use key_hasher::FastHash;
pub use view::matrix::Depth;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExample;

#[cfg(doctest)]
#[doc = include_str!("../docs/engine.md")]
struct EngineExample;
