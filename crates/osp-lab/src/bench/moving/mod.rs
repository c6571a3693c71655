//! Moving things: one, ten and a hundred per cent of the polygons move in every frame, in pieces or as a group, or as
//! instances of one mesh. Every structure takes the boxes of all of them at once; a group index
//! ([`osp_rivals::groups::GroupIndex`]) takes the transforms of the groups.
//!
//! Each structure runs beside the reference, frame by frame. All structures have to see the same polygons. The group index,
//! which tests a polygon's box in the space of its group, may see others: it has to see every polygon of which a point is in
//! view, and none whose turned box is not.

mod exact;
pub(super) mod show;
mod subject;
mod world;

use osp_session::platform::time::Instant;

use serde::Serialize;

use self::{
    subject::{EachGroup, EachPolygon, GROUP_INDEX, Step, Subject, Took},
    world::{MOTIONS, World},
};
use super::{Contender, Estimate, RaysModel, Skipped};
use osp::{index::Upkeep, math::Frustum, polygon::VisibleBlocks};
use osp_rivals::IndexKind;
use osp_session::{
    recording::RecordingError,
    replay::{CameraChoice, CameraPath, Moment},
};

/// Frames that a budget leaves at least, and that are measured at most.
const FEWEST: u64 = 3;
const MOST: u64 = 400;
/// A structure that would take so many budgets at a size, going by the size before, is left out.
const LONGEST: f64 = 20.0;

/// Settings of [`move_things`].
#[derive(Clone, Debug, PartialEq)]
pub struct MovingConfig {
    /// Numbers of polygons.
    pub sizes: Vec<u32>,
    /// The structures.
    pub kinds: Vec<Contender>,
    /// The one that the others are compared with.
    pub reference: IndexKind,
    /// Time for the frames of a structure with one motion, seconds.
    pub budget_secs: f64,
}

/// Work to follow the changes, a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UpkeepRow {
    /// Entries that got another box where they were filed; of a group index, entries of trees.
    pub adjusted: f64,
    /// Entries filed at another place, or again.
    pub filed: f64,
    /// Boxes of nodes computed anew.
    pub boxes: f64,
}

/// One structure with one motion.
#[derive(Clone, Debug, Serialize)]
pub struct MovingRow {
    /// Name of the structure.
    pub index: String,
    /// A frame: following and culling, microseconds. If groups move, with computing the boxes of their polygons.
    pub frame_us: Estimate,
    /// The same frames of the reference, microseconds.
    pub reference_us: Estimate,
    /// Its time divided by the reference's for the same frame.
    pub ratio: Estimate,
    /// Following what has moved, nanoseconds a polygon that has.
    pub move_ns_per_polygon: Estimate,
    /// Culling, microseconds.
    pub cull_us: Estimate,
    /// Work to follow; `None` if the structure does not count it.
    pub upkeep: Option<UpkeepRow>,
    /// Boxes that the query tests, a frame.
    pub boxes_culled: f64,
    /// Polygons reported, a frame.
    pub reported: f64,
    /// Memory, bytes a polygon of the world.
    pub bytes_per_polygon: f64,
}

/// One motion.
#[derive(Clone, Debug, Serialize)]
pub struct MotionResult {
    /// What moves.
    pub motion: String,
    /// Polygons that move in every frame.
    pub moving: usize,
    /// Computing their boxes, microseconds a frame.
    pub boxes_us: Estimate,
    /// One row for each structure; the group index is the last.
    pub rows: Vec<MovingRow>,
}

/// What was found at one size.
#[derive(Clone, Debug, Serialize)]
pub struct MovingResult {
    /// Polygons in the world.
    pub polygons: usize,
    /// The motions.
    pub motions: Vec<MotionResult>,
    /// Structures that saw other polygons than they should, with the motion: none, unless something is wrong.
    pub disagree: Vec<String>,
    /// Structures that were left out.
    pub skipped: Vec<Skipped>,
}

/// Measures every structure at every size. `progress` hears what comes next.
///
/// # Errors
/// Never, as synthetic sessions are whole.
pub fn move_things(
    config: &MovingConfig,
    mut progress: impl FnMut(&str),
) -> Result<Vec<MovingResult>, RecordingError> {
    let mut sizes = config.sizes.clone();
    sizes.sort_unstable();
    sizes.dedup();
    // Seconds of the unavoidable at the size before, and the size.
    let mut took: Vec<Option<(f64, u32)>> = vec![None; config.kinds.len()];
    let mut results = Vec::new();
    for size in sizes {
        let model = RaysModel::synthetic(size)?;
        let limit_secs = config.budget_secs * LONGEST * MOTIONS.len() as f64;
        let mut skipped = Vec::new();
        let is_measured: Vec<bool> = config
            .kinds
            .iter()
            .zip(&took)
            .map(|(kind, took)| {
                let Some((secs, before)) = *took else { return true };
                let expected_secs = secs * f64::from(size) / f64::from(before);
                if expected_secs > limit_secs {
                    let index = kind.name().to_owned();
                    skipped.push(Skipped { index, polygons: size, expected_secs });
                }
                expected_secs <= limit_secs
            })
            .collect();
        let mut least_secs = vec![0.0; config.kinds.len()];
        let (mut motions, mut disagree) = (Vec::new(), Vec::new());
        for (motion, name) in MOTIONS {
            let world = World::new(&model, motion);
            let mut measured = Measured { world: &world, name, config, disagree: &mut disagree };
            let mut rows = Vec::new();
            for (at, &kind) in config.kinds.iter().enumerate().filter(|(at, _)| is_measured[*at]) {
                progress(&format!("{} at {size} polygons, {name}", kind.name()));
                let start = Instant::now();
                let mut subject = EachPolygon::new(kind, &world);
                let fill_secs = start.elapsed().as_secs_f64();
                let row = measured.row(kind.name(), &mut subject);
                least_secs[at] += fill_secs + (FEWEST + 1) as f64 * row.frame_us.median * 1.0e-6;
                rows.push(row);
            }
            progress(&format!("{GROUP_INDEX} at {size} polygons, {name}"));
            rows.push(measured.row(GROUP_INDEX, &mut EachGroup::new(&world)));
            let boxes_us = boxes_us(&world);
            motions.push(MotionResult { motion: name.to_owned(), moving: world.moving(), boxes_us, rows });
        }
        for ((took, secs), is_measured) in took.iter_mut().zip(least_secs).zip(is_measured) {
            if is_measured {
                *took = Some((secs, size));
            }
        }
        results.push(MovingResult { polygons: model.boxes.len(), motions, disagree, skipped });
    }
    Ok(results)
}

/// The motion in hand.
struct Measured<'a> {
    world: &'a World<'a>,
    name: &'static str,
    config: &'a MovingConfig,
    disagree: &'a mut Vec<String>,
}

/// A frame with a structure and with the reference.
type Pair = (Took, Took);

impl Measured<'_> {
    fn row(&mut self, name: &str, subject: &mut dyn Subject) -> MovingRow {
        let world = self.world;
        let mut reference = EachPolygon::new(Contender::Own(self.config.reference), world);
        let camera = CameraPath::new(CameraChoice::Inside, None, &world.model.root);
        let mut moved = Vec::with_capacity(world.moving());
        let mut pairs: Vec<Pair> = Vec::new();
        let mut is_right = true;
        let mut before = None;
        let start = Instant::now();
        for frame in 1..=MOST {
            let is_late = start.elapsed().as_secs_f64() > self.config.budget_secs;
            if pairs.len() as u64 >= FEWEST && is_late {
                break;
            }
            let begin = Instant::now();
            world.moved(frame, &mut moved);
            let boxes_ns = begin.elapsed().as_nanos() as f64;
            let shapes =
                (subject.wants_shapes() || reference.wants_shapes()).then(|| world.moved_shapes(frame));
            // A quick turn, so that even a few frames see the model from every side.
            let moment = Moment { frame: frame * 7, ..Moment::default() };
            let step = |wants_shapes: bool| Step {
                frame,
                moved: &moved,
                shapes: shapes.as_deref().filter(|_| wants_shapes),
                boxes_ns: if world.motion.is_rigid() { boxes_ns } else { 0.0 },
                frustum: camera.view(&moment).frustum(),
            };
            let (own, others) = (step(subject.wants_shapes()), step(reference.wants_shapes()));
            // Neither always comes first.
            let pair = if frame % 2 == 0 {
                let first = subject.frame(&own);
                (first, reference.frame(&others))
            } else {
                let first = reference.frame(&others);
                (subject.frame(&own), first)
            };
            // Every group index is checked against the polygons themselves, which takes a while.
            let is_checked = name != GROUP_INDEX || frame <= FEWEST;
            is_right &= !is_checked || self.sees_right(name, subject, &mut reference, frame, &own.frustum);
            // The first frame fills caches and brings what is built late.
            match before {
                None => before = Some(subject.upkeep()),
                Some(_) => pairs.push(pair),
            }
        }
        if !is_right {
            self.disagree.push(format!("{name} ({})", self.name));
        }
        let frames = pairs.len().max(1) as f64;
        let upkeep =
            before.flatten().zip(subject.upkeep()).map(|(before, after)| per_frame(before, after, frames));
        let polygons = world.moving().max(1) as f64;
        let mean =
            |count: fn(&Took) -> u64| pairs.iter().map(|(took, _)| count(took) as f64).sum::<f64>() / frames;
        MovingRow {
            index: name.to_owned(),
            frame_us: estimate(&pairs, |(took, _)| took.total_ns() / 1000.0),
            reference_us: estimate(&pairs, |(_, reference)| reference.total_ns() / 1000.0),
            ratio: estimate(&pairs, |(took, reference)| took.total_ns() / reference.total_ns()),
            move_ns_per_polygon: estimate(&pairs, |(took, _)| took.move_ns / polygons),
            cull_us: estimate(&pairs, |(took, _)| took.cull_ns / 1000.0),
            upkeep,
            boxes_culled: mean(|took| took.work.boxes),
            reported: mean(|took| took.work.reported),
            bytes_per_polygon: subject.bytes() as f64 / world.len().max(1) as f64,
        }
    }

    /// Whether a frame's answer is what it has to be.
    fn sees_right(
        &self,
        name: &str,
        subject: &mut dyn Subject,
        reference: &mut EachPolygon,
        frame: u64,
        frustum: &Frustum,
    ) -> bool {
        let filed: &VisibleBlocks = reference.seen(frustum);
        if name != GROUP_INDEX {
            return subject.seen(frustum) == filed;
        }
        let found = subject.seen(frustum);
        let must = exact::seen(self.world, frame, frustum);
        exact::is_within(&must, filed)
            && exact::is_within(&must, found)
            && exact::is_within(found, &exact::may_be_seen(self.world, frame, frustum))
    }
}

fn per_frame(before: Upkeep, after: Upkeep, frames: f64) -> UpkeepRow {
    let of = |before: u64, after: u64| (after - before) as f64 / frames;
    UpkeepRow {
        adjusted: of(before.adjusted, after.adjusted),
        filed: of(before.filed, after.filed),
        boxes: of(before.boxes, after.boxes),
    }
}

fn estimate(pairs: &[Pair], value: impl Fn(&Pair) -> f64) -> Estimate {
    Estimate::of(&mut pairs.iter().map(value).collect::<Vec<_>>()).unwrap_or_default()
}

/// What computing the boxes of what moves takes.
fn boxes_us(world: &World<'_>) -> Estimate {
    let mut moved = Vec::with_capacity(world.moving());
    let mut times: Vec<f64> = (1..=9)
        .map(|frame| {
            let start = Instant::now();
            world.moved(frame, &mut moved);
            start.elapsed().as_nanos() as f64 / 1000.0
        })
        .collect();
    Estimate::of(&mut times).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::{world::Motion, *};

    fn config() -> MovingConfig {
        MovingConfig {
            sizes: vec![2000],
            kinds: Contender::all(),
            reference: IndexKind::Osp,
            budget_secs: 0.0,
        }
    }

    #[test]
    fn every_structure_follows_every_motion_and_the_work_is_what_it_has_to_be() {
        let results = move_things(&config(), |_| ()).expect("it is whole");
        let result = &results[0];
        assert_eq!(result.disagree, Vec::<String>::new());
        let moving: Vec<usize> = result.motions.iter().map(|motion| motion.moving).collect();
        assert_eq!(moving[2], 2000);
        assert_eq!(moving[3..], [20, 200, 2000, 2000]);
        assert!((20..=64).contains(&moving[0]) && (190..=256).contains(&moving[1]), "{moving:?}");
        for (motion, (kind, _)) in result.motions.iter().zip(MOTIONS) {
            let row = |name: &str| motion.rows.iter().find(|row| row.index == name).expect("a row");
            let upkeep = |name: &str| row(name).upkeep.expect("it counts");
            let moving = motion.moving as f64;
            let name = &motion.motion;
            // Each polygon that moves is an entry: where it was, or filed again.
            for incremental in ["osp", "loose-octree", "time-order", "dynamic-bvh", "osp-paper"] {
                let upkeep = upkeep(incremental);
                assert_eq!(upkeep.adjusted + upkeep.filed, moving, "{incremental}, {name}");
            }
            // What rebuilds files all, whatever moves; what refits computes every box, and moves no entry.
            assert_eq!(upkeep("octree-rebuild").filed, 2000.0, "{name}");
            assert!(upkeep("bvh-sah").boxes > 100.0 && upkeep("bvh-sah").adjusted == moving, "{name}");
            let entries = upkeep(GROUP_INDEX).adjusted;
            match kind {
                Motion::Pieces(_) => assert_eq!(entries, (moving / 32.0).ceil(), "{name}"),
                Motion::Group(_) => assert_eq!(entries, 1.0, "{name}"),
                Motion::Instances(nodes) => assert_eq!(entries, nodes as f64, "{name}"),
            }
            assert!(row("osp").reported > 0.0, "something is in view: {name}");
        }
    }

    #[test]
    fn a_structure_that_does_not_follow_is_found_out() {
        let model = RaysModel::synthetic(1000).expect("it is whole");
        for (motion, name) in MOTIONS {
            let world = World::new(&model, motion);
            let other = World::new(&model, motion);
            let mut disagree = Vec::new();
            let config = config();
            let mut measured = Measured { world: &world, name, config: &config, disagree: &mut disagree };
            let mut stays = Stays(EachGroup::new(&other));
            measured.row(GROUP_INDEX, &mut stays);
            let mut stays = Stays(EachPolygon::new(Contender::Own(IndexKind::Osp), &world));
            measured.row("stays", &mut stays);
            let expected = [format!("{GROUP_INDEX} ({name})"), format!("stays ({name})")];
            // A hundredth of the polygons may lie out of view, or at one place for three frames.
            let is_small = matches!(motion, Motion::Pieces(share) | Motion::Group(share) if share < 1.0);
            assert!(is_small || disagree == expected, "{disagree:?}");
        }
    }

    /// Sees everything where it was at first.
    struct Stays<S>(S);

    impl<S: Subject> Subject for Stays<S> {
        fn frame(&mut self, step: &Step<'_>) -> Took {
            self.0.frame(&Step { frame: 0, moved: &[], shapes: None, ..*step })
        }

        fn seen(&mut self, frustum: &Frustum) -> &VisibleBlocks {
            self.0.seen(frustum)
        }

        fn upkeep(&self) -> Option<Upkeep> {
            None
        }

        fn bytes(&self) -> usize {
            0
        }
    }
}
