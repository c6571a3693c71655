//! The moving parts of a model, each with a transform for every frame.

use std::ops::Range;

use glam::{Affine3A, Quat, Vec3};

use crate::{
    bench::{Contender, RaysModel},
    scenes::Random,
};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};
use osp_rivals::Bsp;

/// Number of polygons of a piece, about that of a stroke.
const PIECE: usize = 32;
/// Radius of a piece's circle, as a fraction of the model's diagonal.
const RADIUS: f32 = 0.02;
/// Angle by which a piece moves along its circle in a frame, radians. With [`RADIUS`] the step is 1/400 of the
/// diagonal.
const TURN: f32 = 0.125;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    /// Pieces of 32 polygons, evenly distributed over the drawing order; each moves on its own small circle. The number
    /// is the share of moving polygons.
    Pieces(f64),
    /// Single polygons chosen at random; each moves on its own small circle. Their ids have no spatial order. The
    /// number is the share of moving polygons.
    Scattered(f64),
    /// The first polygons form one group, which rotates and translates. The number is the share of moving polygons.
    Group(f64),
    /// One mesh of the first polygons, shown by this number of nodes, all of which rotate.
    Instances(usize),
}

pub(super) const MOTIONS: [(Motion, &str); 10] = [
    (Motion::Pieces(0.01), "1 % in pieces"),
    (Motion::Pieces(0.1), "10 % in pieces"),
    (Motion::Pieces(1.0), "all in pieces"),
    (Motion::Group(0.01), "1 % as a group"),
    (Motion::Group(0.1), "10 % as a group"),
    (Motion::Group(1.0), "all as a group"),
    (Motion::Instances(100), "100 instances"),
    (Motion::Scattered(0.01), "1 % scattered"),
    (Motion::Scattered(0.1), "10 % scattered"),
    (Motion::Scattered(1.0), "all scattered"),
];

impl Motion {
    /// Whether the moving polygons form groups, so that a group index saves work.
    pub(super) fn has_groups(self) -> bool {
        !matches!(self, Self::Scattered(_))
    }

    /// Whether parts are transformed as a whole, so that the box of a polygon must be computed from its corners.
    pub(super) fn is_rigid(self) -> bool {
        !matches!(self, Self::Pieces(_) | Self::Scattered(_))
    }
}

/// A mesh with a transform.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// The polygons of the model that the part shows.
    pub(super) mesh: Range<usize>,
    /// The id of the part's first polygon in the world.
    pub(super) first: usize,
    pub(super) moves: bool,
    middle: Vec3,
    scale: f32,
    to: Vec3,
    phase: f32,
}

impl Part {
    pub(super) fn ids(&self) -> Range<usize> {
        self.first..self.first + self.mesh.len()
    }
}

/// A model that is divided into parts.
pub(super) struct World<'a> {
    pub(super) model: &'a RaysModel,
    pub(super) motion: Motion,
    pub(super) parts: Vec<Part>,
    diagonal_m: f32,
}

impl<'a> World<'a> {
    pub(super) fn new(model: &'a RaysModel, motion: Motion) -> Self {
        let all = model.boxes.len();
        let around = model.around();
        let mut random = Random::new(3);
        let part = |mesh: Range<usize>, first, moves, phase| {
            let bounds = model.boxes[mesh.clone()].iter().fold(Aabb::EMPTY, |all, b| all.union(b));
            Part { mesh, first, moves, middle: bounds.center(), scale: 1.0, to: bounds.center(), phase }
        };
        let share = |share: f64| ((all as f64 * share).round() as usize).clamp(1, all);
        let parts = match motion {
            Motion::Pieces(moving) => {
                let count = all.div_ceil(PIECE);
                // Rounded up, so that at least one piece moves.
                let before = |piece: usize| (piece as f64 * moving).ceil() as usize;
                let piece = |at: usize| {
                    let mesh = at * PIECE..all.min((at + 1) * PIECE);
                    part(mesh, at * PIECE, before(at + 1) > before(at), at as f32)
                };
                (0..count).map(piece).collect()
            }
            Motion::Scattered(moving) => {
                let mut order: Vec<usize> = (0..all).collect();
                for left in (1..all).rev() {
                    order.swap(left, (random.unit() * (left + 1) as f64) as usize);
                }
                let mut one = |(first, at): (usize, usize)| {
                    part(at..at + 1, first, random.unit() < moving, first as f32)
                };
                order.into_iter().enumerate().map(&mut one).collect()
            }
            Motion::Group(moving) => {
                let group = share(moving);
                let mut parts = vec![part(0..group, 0, true, 0.0)];
                if group < all {
                    parts.push(part(group..all, group, false, 0.0));
                }
                parts
            }
            Motion::Instances(nodes) => {
                let mesh = (all / nodes).max(1);
                let scale = 3.0 / (nodes as f32).cbrt().max(3.0);
                let mut place = || random.within(around.min.as_dvec3(), around.max.as_dvec3()).as_vec3();
                let mut instance = |at: usize| {
                    let to = place();
                    Part { scale, to, ..part(0..mesh, at * mesh, true, at as f32) }
                };
                (0..nodes).map(&mut instance).collect()
            }
        };
        Self { model, motion, parts, diagonal_m: around.extent().length() }
    }

    pub(super) fn len(&self) -> usize {
        self.parts.last().map_or(0, |part| part.ids().end)
    }

    /// Number of polygons that move in every frame.
    pub(super) fn moving(&self) -> usize {
        self.parts.iter().filter(|part| part.moves).map(|part| part.mesh.len()).sum()
    }

    /// The transform of a part in a frame, from the model's space to world space.
    pub(super) fn place(&self, part: &Part, frame: u64) -> Affine3A {
        let Part { moves, middle, scale, to, phase, .. } = *part;
        if !moves {
            return Affine3A::IDENTITY;
        }
        let angle = frame as f32 * TURN + phase;
        let reach_m = RADIUS * self.diagonal_m;
        let circle = Vec3::new(angle.cos(), angle.sin(), (angle + phase).cos()) * reach_m;
        let turn = match self.motion {
            Motion::Pieces(_) | Motion::Scattered(_) => return Affine3A::from_translation(circle),
            Motion::Group(_) => Quat::from_rotation_y(0.3 * (angle * 0.2).sin()),
            Motion::Instances(_) => Quat::from_rotation_y(angle * 0.2),
        };
        Affine3A::from_translation(to + circle)
            * Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, Vec3::ZERO)
            * Affine3A::from_translation(-middle)
    }

    pub(super) fn polygons(&self, part: &Part, world: Affine3A) -> impl Iterator<Item = ConvexPolygon> {
        self.model.polygons[part.mesh.clone()].iter().map(move |of| of.map(|p| world.transform_point3(p)))
    }

    fn boxes(&self, part: &Part, frame: u64, out: &mut Vec<(PolygonId, Aabb)>) {
        let world = self.place(part, frame);
        let ids = part.ids().map(|id| PolygonId(id as u32));
        if self.motion.is_rigid() {
            out.extend(ids.zip(self.polygons(part, world).map(|polygon| polygon.bounds())));
            return;
        }
        let by = Vec3::from(world.translation);
        let moved = |of: &Aabb| Aabb { min: of.min + by, max: of.max + by };
        out.extend(ids.zip(self.model.boxes[part.mesh.clone()].iter().map(moved)));
    }

    /// Replaces `out` by the boxes of all moving polygons in a frame.
    pub(super) fn moved(&self, frame: u64, out: &mut Vec<(PolygonId, Aabb)>) {
        out.clear();
        self.parts.iter().filter(|part| part.moves).for_each(|part| self.boxes(part, frame, out));
    }

    pub(super) fn moved_shapes(&self, frame: u64) -> Vec<ConvexPolygon> {
        let moving = self.parts.iter().filter(|part| part.moves);
        moving.flat_map(|part| self.polygons(part, self.place(part, frame))).collect()
    }

    /// An index of this kind that contains all polygons at their positions in frame 0.
    pub(super) fn filled(&self, kind: Contender) -> Box<dyn SpatialIndex> {
        let mut index = kind.create(&IndexConfig { root: self.model.root, capacity: self.len() });
        let wants_shapes = Bsp::of(&mut *index).is_some();
        let mut boxes = Vec::new();
        for part in &self.parts {
            boxes.clear();
            self.boxes(part, 0, &mut boxes);
            let shapes = wants_shapes.then(|| self.polygons(part, self.place(part, 0)).collect::<Vec<_>>());
            for (at, (id, bounds)) in boxes.iter().enumerate() {
                // The boxes of a scene are finite, and each id is inserted once, so no error can occur.
                let inserted = index.insert(*id, bounds);
                debug_assert_eq!(inserted, Ok(()));
                if let (Some(shapes), Some(tree)) = (&shapes, Bsp::of(&mut *index)) {
                    tree.shape(*id, &shapes[at]);
                }
            }
        }
        index.commit();
        index
    }
}
