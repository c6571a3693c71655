//! The culler as an engine takes it: own numbers, own geometry, no feature needed.

mod cameras;
mod culler;
mod hiding;
mod meshes;
mod model;
mod oracle;

use osp::{
    frame::{PassConfig, Pipeline, PreviousFramePass},
    glam::Vec3,
    index::{BruteForce, IndexConfig, Osp, SpatialIndex},
    math::Aabb,
    occlusion::{OccluderPool, Occlusion, OcclusionCuller, OcclusionStage, PreviousFrameOccluders},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
    view::{Projection, View, ViewWindow},
};
use osp_lab::Method;

/// By number: a wall, or a box of something else; glass is not opaque.
#[derive(Clone)]
pub(crate) enum Thing {
    Wall(ConvexPolygon),
    Glass(ConvexPolygon),
    Mesh(Aabb),
}

pub(crate) struct World(pub(crate) Vec<Option<Thing>>);

impl World {
    /// Polygons that all may occlude.
    pub(crate) fn of(polygons: impl IntoIterator<Item = ConvexPolygon>) -> Self {
        Self(polygons.into_iter().map(|polygon| Some(Thing::Wall(polygon))).collect())
    }
}

impl Geometry for World {
    fn id_end(&self) -> usize {
        self.0.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.0.get(id.index()).is_some_and(Option::is_some)
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        match &self.0[id.index()] {
            Some(Thing::Wall(polygon) | Thing::Glass(polygon)) => polygon.bounds(),
            Some(Thing::Mesh(bounds)) => *bounds,
            None => Aabb::EMPTY,
        }
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        match &self.0[id.index()] {
            Some(Thing::Wall(polygon) | Thing::Glass(polygon)) => Some(*polygon),
            _ => None,
        }
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        matches!(self.0[id.index()], Some(Thing::Wall(_) | Thing::Mesh(_)))
    }
}

/// An upright square at this depth, facing the eye at the origin.
pub(crate) fn square(depth_m: f32, half_m: f32) -> [Vec3; 4] {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| Vec3::new(x * half_m, y * half_m, -depth_m))
}

fn behind(i: u32) -> Thing {
    let center = Vec3::new((i % 6) as f32 * 0.2 - 0.5, (i / 6) as f32 * 0.2 - 0.5, -6.0);
    Thing::Mesh(Aabb::cube(center, 0.1))
}

fn pipelines(world: &World) -> Vec<Pipeline> {
    let methods = Method::conservative_cullers().into_iter();
    methods
        .chain([Occlusion::PreviousFrame.into()])
        .map(|choice| {
            let index = Osp::new(&IndexConfig::default());
            let config = PassConfig { polygon_ns: 1.0e6, ..PassConfig::default() };
            let pipeline = Pipeline::new(Box::new(index), 64);
            let mut pipeline = choice.add_to(pipeline, config);
            pipeline.load(world);
            pipeline
        })
        .collect()
}

fn ahead() -> View {
    View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 1.5, 0.01, 100.0))
}

#[test]
fn what_the_engine_calls_a_wall_hides_and_nothing_else_does() {
    // Numbers with gaps, and meshes that reach before what is behind them.
    let mut things = vec![None; 3];
    things.extend((0..36).map(|i| Some(behind(i))));
    let (wall, first, last) = (things.len(), 3, things.len() - 1);
    things.push(None);
    let mut world = World(things);
    world.0.push(Some(Thing::Mesh(Aabb::cube(Vec3::new(0.0, 0.0, -3.0), 1.5))));
    world.0.push(Some(Thing::Glass(ConvexPolygon::quad(square(4.0, 2.0)))));
    for mut pipeline in pipelines(&world) {
        let all = world.0.iter().flatten().count();
        let name = pipeline.occlusion().map(|pass| pass.config().choice.name());
        for _ in 0..3 {
            pipeline.frame(&world, &[], &ahead());
            assert_eq!(pipeline.draw_list().len(), all, "{name:?}: glass and meshes hide nothing");
        }
        world.0[wall] = Some(Thing::Wall(ConvexPolygon::quad(square(2.0, 1.9))));
        let mut drawn = 0;
        for frame in 0..4 {
            let came = [Change::Insert(PolygonId(wall as u32))];
            pipeline.frame(&world, if frame == 0 { &came } else { &[] }, &ahead());
            drawn = pipeline.draw_list().len();
        }
        let hidden = (first..=last).filter(|&i| !pipeline.draw_list().contains(PolygonId(i as u32))).count();
        assert!(pipeline.draw_list().contains(PolygonId(wall as u32)), "{name:?}");
        assert!(hidden > 30, "{name:?}: {hidden} hidden, {drawn} drawn");
        // It goes: what it hid is there in the same frame.
        world.0[wall] = None;
        pipeline.frame(&world, &[Change::Remove(PolygonId(wall as u32))], &ahead());
        assert_eq!(pipeline.draw_list().len(), all, "{name:?}");
    }
}

#[test]
fn settings_that_name_nothing_but_the_method_hide_the_meshes_behind_a_wall() {
    for (choice, meshes) in [(Occlusion::Msvbsp, 20), (Occlusion::Depth, 20), (Occlusion::Auto, 2000)] {
        let mesh = |i: u32| {
            let center = Vec3::new((i % 50) as f32 * 0.02 - 0.5, (i / 50) as f32 * 0.02 - 0.5, -6.0);
            Some(Thing::Mesh(Aabb::cube(center, 0.02)))
        };
        let mut world = World((0..meshes).map(mesh).collect());
        world.0.push(Some(Thing::Wall(ConvexPolygon::quad(square(2.0, 1.9)))));
        let index = Osp::new(&IndexConfig::default());
        let pipeline = Pipeline::new(Box::new(index), 64);
        let mut pipeline = pipeline.with_occlusion(PassConfig::new(choice));
        pipeline.load(&world);
        for _ in 0..3 {
            pipeline.frame(&world, &[], &ahead());
        }
        assert_eq!(pipeline.in_view().len(), meshes as usize + 1, "{}", choice.name());
        assert!(pipeline.draw_list().ids().eq([PolygonId(meshes)]), "{}: only the wall", choice.name());
    }
}

#[test]
fn walls_that_were_smaller_than_a_pixel_hide_when_the_eye_has_come_near() {
    // From 300 m a pixel of the picture is 38 mm wide, although the picture is magnified sixteen times. From 1 m it is 2 mm.
    let small = |i: u32| {
        let by = Vec3::new((i % 80) as f32 * 0.02 - 0.8, (i / 80) as f32 * 0.02 - 1.2, -0.5);
        // The last ones are larger, so that they are among those that are filled.
        let half_m = if i < 9_584 { 0.008 } else { 0.014 };
        Some(Thing::Wall(ConvexPolygon::quad(square(0.0, half_m).map(|corner| corner + by))))
    };
    let mut world = World((0..9_600).map(small).collect());
    let last = Aabb::from_points(&square(0.51, 0.001).map(|corner| corner + Vec3::new(0.78, 1.18, 0.0)));
    let mesh = PolygonId(world.0.len() as u32);
    world.0.push(Some(Thing::Mesh(last)));
    let index = Osp::new(&IndexConfig::default());
    let pipeline = Pipeline::new(Box::new(index), 10_000);
    let mut pipeline = pipeline.with_occlusion(PassConfig::new(Occlusion::PreviousFrame));
    pipeline.load(&world);
    let projection = Projection::symmetric(100.0, 1.5, 0.01, 1000.0);
    let view = |z: f32| View::look_at(Vec3::new(0.0, 0.0, z), Vec3::new(0.0, 0.0, z - 1.0), projection);
    for _ in 0..8 {
        pipeline.frame(&world, &[], &view(300.0));
    }
    assert_eq!(pipeline.draw_list().len(), world.0.len(), "nothing is hidden");
    // At most 256 of those that covered nothing are tried in a frame.
    let is_hidden = (0..2 * 9_600 / 256).any(|_| {
        pipeline.frame(&world, &[], &view(0.7));
        assert!(pipeline.in_view().contains(mesh));
        !pipeline.draw_list().contains(mesh)
    });
    assert!(is_hidden);
}

#[test]
fn every_structure_may_be_shared_between_threads() {
    fn shared<T: Send + Sync + ?Sized>() {}
    shared::<Osp>();
    shared::<BruteForce>();
    shared::<dyn SpatialIndex>();
    shared::<dyn OcclusionCuller>();
    shared::<OcclusionStage>();
    shared::<OccluderPool>();
    shared::<PreviousFrameOccluders>();
    shared::<PreviousFramePass>();
    shared::<Pipeline>();
    shared::<VisibleBlocks>();
    shared::<View>();
    shared::<ViewWindow>();
}

/// Boxes in the room ahead, of which each frame moves many: some to where they were refused, some back, some told of twice.
fn moved(world: &mut World, frame: u32) -> Vec<Change> {
    let mut changes = Vec::new();
    for id in 0..world.0.len() as u32 {
        let is_moved = (id / 40 + frame).is_multiple_of(3);
        let bounds = match (id * 7 + frame) % 90 {
            0 => Aabb::new(Vec3::ZERO, Vec3::new(1.0, f32::NAN, 1.0)),
            1 => Aabb::EMPTY,
            _ => {
                let way = Vec3::new((id % 40) as f32, (id / 40 % 30) as f32, -((id / 1200) as f32)) * 0.2;
                let by = Vec3::new((frame + id / 16) as f32, frame as f32, 0.0).map(f32::sin);
                Aabb::cube(way + by - Vec3::new(4.0, 3.0, 4.0), 0.15)
            }
        };
        match (id * 31 + frame * 17) % 101 {
            0 if world.0[id as usize].take().is_some() => changes.push(Change::Remove(PolygonId(id))),
            _ if world.0[id as usize].is_none() => {
                world.0[id as usize] = Some(Thing::Mesh(bounds));
                changes.push(Change::Insert(PolygonId(id)));
            }
            n if is_moved => {
                world.0[id as usize] = Some(Thing::Mesh(bounds));
                changes.push(Change::Update(PolygonId(id)));
                changes.extend((n == 1).then_some(Change::Update(PolygonId(id))));
            }
            _ => {}
        }
    }
    changes
}

#[test]
fn what_moves_in_a_frame_is_inserted_as_if_told_of_one_by_one() {
    let pipeline = |index: Box<dyn SpatialIndex>| Pipeline::new(index, 4000);
    let config = IndexConfig::default();
    let osp = || Box::new(Osp::new(&config));
    let mut together = [pipeline(osp()), pipeline(Box::<BruteForce>::default())];
    let mut of_each = [pipeline(osp()), pipeline(Box::<BruteForce>::default())];
    let mut world = World((0..4000).map(|_| None).collect());
    let view = ahead();
    let mut most_refused = 0;
    for frame in 0..24 {
        let changes = moved(&mut world, frame);
        for (together, of_each) in together.iter_mut().zip(&mut of_each) {
            let record = together.frame(&world, &changes, &view);
            let updates = changes.iter().filter(|change| matches!(change, Change::Update(_))).count();
            assert_eq!(record.updated, updates as u64);
            changes.iter().for_each(|change| of_each.skip(&world, std::slice::from_ref(change)));
            of_each.frame(&world, &[], &view);
            assert_eq!(together.index().validate(), Ok(()), "frame {frame}");
            assert_eq!(together.draw_list(), of_each.draw_list(), "frame {frame}");
            assert_eq!(together.polygon_count(), of_each.polygon_count(), "frame {frame}");
            let is_there = |id: &u32| world.bounds(PolygonId(*id)).is_valid();
            assert_eq!(together.polygon_count(), (0..4000).filter(is_there).count(), "frame {frame}");
            assert_eq!(together.refused(), of_each.refused(), "frame {frame}");
            assert!(!together.draw_list().is_empty(), "frame {frame}");
            most_refused = most_refused.max(together.refused());
        }
        assert_eq!(together[0].draw_list(), together[1].draw_list(), "frame {frame}");
    }
    assert!(most_refused > 500, "boxes are refused: {most_refused}");
}
