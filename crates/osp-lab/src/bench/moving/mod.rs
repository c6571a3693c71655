//! Moving things: 1, 10 and 100 % of the polygons move in every frame. They move in pieces, as a group, or as instances
//! of one mesh. Every structure gets the boxes of all moving polygons in one call; a group index
//! ([`osp_rivals::groups::GroupIndex`]) gets the transforms of the groups.
//!
//! Each structure and the reference run in turns, frame by frame. All structures must find the same polygons. The group
//! index tests a polygon's box in the space of its group, so it may find additional polygons. It must find every
//! polygon with a point in view, and no polygon whose transformed box is out of view.

mod exact;
mod subject;
mod world;

use osp_session::platform::time::{Instant, Load};

use self::{
    subject::{EachGroup, EachPolygon, GROUP_INDEX, Step, Subject, Took},
    world::{MOTIONS, World},
};
use super::{Contender, RaysModel, growth::skipped};
use crate::rows::Rows;
use osp::{index::Upkeep, math::Frustum, polygon::VisibleBlocks};
use osp_rivals::IndexKind;
use osp_session::{
    recording::RecordingError,
    replay::{CameraChoice, CameraPath, Moment},
};

const PART: &str = "moving";
const NOTES: [&str; 4] = [
    "in pieces: pieces of 32 polygons, each on its own small circle; the structure gets the new boxes, then culls from inside.",
    "scattered: single polygons chosen at random; the numbers of all polygons are shuffled, so that they have no spatial order.",
    "as a group: one transform places the polygons; the box of each is computed from its corners and stored, and all are \
     culled; group-index gets the transform alone. instances: 100 nodes show one mesh, and all move.",
    "entries set: entries whose box changed in place; inserted: entries inserted elsewhere, or again; boxes computed: boxes of nodes.",
];

/// Smallest number of frames that are measured, whatever the budget.
const FEWEST: u64 = 3;
/// Largest number of measured frames.
const MOST: u64 = 400;
/// A structure is skipped for a model if its estimated time is more than this multiple of the time budget. The estimate
/// comes from the next smaller model.
const LONGEST: f64 = 20.0;

/// Settings of [`move_things`].
#[derive(Clone, Debug, PartialEq)]
pub struct MovingConfig {
    /// Numbers of polygons of the models.
    pub sizes: Vec<u32>,
    pub kinds: Vec<Contender>,
    pub reference: IndexKind,
    /// Time for the frames of a structure with one motion, seconds.
    pub budget_secs: f64,
}

/// Measures every structure at every size; the rows are the part `moving`. `progress` is called with the name of the
/// next measurement.
///
/// # Errors
/// Never, because synthetic sessions have no damage.
pub fn move_things(config: &MovingConfig, mut progress: impl FnMut(&str)) -> Result<Rows, RecordingError> {
    let mut sizes = config.sizes.clone();
    sizes.sort_unstable();
    sizes.dedup();
    // For each structure, the time of [`FEWEST`] frames at the previous size, seconds, and the previous size.
    let mut took: Vec<Option<(f64, u32)>> = vec![None; config.kinds.len()];
    let mut rows = Rows::default();
    rows.part(PART, "Moving things: a frame in which a share of the polygons moves");
    NOTES.iter().for_each(|note| rows.note(PART, *note));
    for size in sizes {
        let model = RaysModel::synthetic(size)?;
        let limit_secs = config.budget_secs * LONGEST * MOTIONS.len() as f64;
        let is_measured: Vec<bool> = config
            .kinds
            .iter()
            .zip(&took)
            .map(|(kind, took)| {
                let Some((secs, before)) = *took else { return true };
                let expected_secs = secs * f64::from(size) / f64::from(before);
                if expected_secs > limit_secs {
                    rows.note(PART, skipped(kind.name(), size, expected_secs));
                }
                expected_secs <= limit_secs
            })
            .collect();
        let mut least_secs = vec![0.0; config.kinds.len()];
        for (motion, name) in MOTIONS {
            let world = World::new(&model, motion);
            rows.of(task(name), &model.recording, "")
                .value("polygons", "polygons", world.len() as f64)
                .value("moving", "polygons", world.moving() as f64)
                .median("computing_boxes", "µs", boxes_us(&world));
            let mut measured = Measured { world: &world, name, config, rows: &mut rows };
            for (at, &kind) in config.kinds.iter().enumerate().filter(|(at, _)| is_measured[*at]) {
                progress(&format!("{} at {size} polygons, {name}", kind.name()));
                let start = Instant::now();
                let mut subject = EachPolygon::new(kind, &world);
                let begun = Load::begin();
                let fill_secs = start.elapsed().as_secs_f64();
                let frame_us = measured.measure(kind.name(), &mut subject);
                measured.rows.load.add(begun);
                least_secs[at] += fill_secs + (FEWEST + 1) as f64 * frame_us * 1.0e-6;
            }
            if motion.has_groups() {
                progress(&format!("{GROUP_INDEX} at {size} polygons, {name}"));
                measured.measure(GROUP_INDEX, &mut EachGroup::new(&world));
            }
        }
        for ((took, secs), is_measured) in took.iter_mut().zip(least_secs).zip(is_measured) {
            if is_measured {
                *took = Some((secs, size));
            }
        }
    }
    Ok(rows)
}

fn task(motion: &str) -> String {
    format!("{PART}/{motion}")
}

struct Measured<'a> {
    world: &'a World<'a>,
    name: &'static str,
    config: &'a MovingConfig,
    rows: &'a mut Rows,
}

/// A frame of a structure, and the same frame of the reference.
type Pair = (Took, Took);

impl Measured<'_> {
    /// Measures a structure. Returns the median of a frame, microseconds.
    fn measure(&mut self, name: &str, subject: &mut dyn Subject) -> f64 {
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
            // The camera turns fast, so that even a few frames show the model from every side.
            let moment = Moment { frame: frame * 7, ..Moment::default() };
            let step = |wants_shapes: bool| Step {
                frame,
                moved: &moved,
                shapes: shapes.as_deref().filter(|_| wants_shapes),
                boxes_ns: if world.motion.is_rigid() { boxes_ns } else { 0.0 },
                frustum: camera.view(&moment).frustum(),
            };
            let (own, others) = (step(subject.wants_shapes()), step(reference.wants_shapes()));
            // The structure and the reference alternate in running first.
            let pair = if frame % 2 == 0 {
                let first = subject.frame(&own);
                (first, reference.frame(&others))
            } else {
                let first = reference.frame(&others);
                (subject.frame(&own), first)
            };
            // For a group index, only the first frames are compared with the polygons themselves, because that is slow.
            let is_checked = name != GROUP_INDEX || frame <= FEWEST;
            is_right &= !is_checked || self.sees_right(name, subject, &mut reference, frame, &own.frustum);
            // The first frame is not counted, because it fills caches and builds structures that are built on demand.
            match before {
                None => before = Some(subject.upkeep()),
                Some(_) => pairs.push(pair),
            }
        }
        let (task, recording) = (task(self.name), world.model.recording.as_str());
        if !is_right {
            let fault = format!("WRONG POLYGONS IN VIEW in {recording}: {name} ({}).", self.name);
            self.rows.faults.push(fault);
        }
        let frames = pairs.len().max(1) as f64;
        let upkeep = before.flatten().zip(subject.upkeep());
        let a_frame =
            |of: fn(&Upkeep) -> u64| upkeep.map(|(before, after)| (of(&after) - of(&before)) as f64 / frames);
        let polygons = world.moving().max(1) as f64;
        let mean =
            |count: fn(&Took) -> u64| pairs.iter().map(|(took, _)| count(took) as f64).sum::<f64>() / frames;
        let us = |took: &Took| took.total_ns() / 1000.0;
        let times: Vec<(f64, f64)> =
            pairs.iter().map(|(took, reference)| (us(took), us(reference))).collect();
        self.rows
            .of(&*task, recording, name)
            .against(&times)
            .median("move", "ns/polygon", pairs.iter().map(|(took, _)| took.move_ns / polygons).collect())
            .median("cull", "µs", pairs.iter().map(|(took, _)| took.cull_ns / 1000.0).collect())
            .maybe("entries_set", "1/frame", a_frame(|upkeep| upkeep.adjusted))
            .maybe("entries_inserted", "1/frame", a_frame(|upkeep| upkeep.inserted))
            .maybe("boxes_computed", "1/frame", a_frame(|upkeep| upkeep.boxes))
            .counted("boxes", "1/frame", mean(|took| took.work.boxes))
            .value("reported", "polygons", mean(|took| took.work.reported))
            .value("memory", "bytes/polygon", subject.bytes() as f64 / world.len().max(1) as f64);
        self.rows.value(&task, recording, name, "time").unwrap_or(0.0)
    }

    /// Whether the structure found the right polygons in a frame.
    fn sees_right(
        &self,
        name: &str,
        subject: &mut dyn Subject,
        reference: &mut EachPolygon,
        frame: u64,
        frustum: &Frustum,
    ) -> bool {
        let inserted: &VisibleBlocks = reference.seen(frustum);
        if name != GROUP_INDEX {
            return subject.seen(frustum) == inserted;
        }
        let found = subject.seen(frustum);
        let must = exact::seen(self.world, frame, frustum);
        exact::is_within(&must, inserted)
            && exact::is_within(&must, found)
            && exact::is_within(found, &exact::may_be_seen(self.world, frame, frustum))
    }
}

/// Times to compute the boxes of the moving polygons, microseconds.
fn boxes_us(world: &World<'_>) -> Vec<f64> {
    let mut moved = Vec::with_capacity(world.moving());
    let time = |frame: u64| {
        let start = Instant::now();
        world.moved(frame, &mut moved);
        start.elapsed().as_nanos() as f64 / 1000.0
    };
    (1..=9).map(time).collect()
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
        let rows = move_things(&config(), |_| ()).expect("it is whole");
        assert_eq!(rows.faults, Vec::<String>::new());
        let of = |motion: &str, index: &str, figure: &str| {
            rows.value(&task(motion), "scribble-2000", index, figure)
        };
        let moving = MOTIONS.map(|(_, name)| of(name, "", "moving").expect("it is counted"));
        assert_eq!(moving[2..7], [2000.0, 20.0, 200.0, 2000.0, 2000.0]);
        assert!((5.0..=50.0).contains(&moving[7]) && (120.0..=290.0).contains(&moving[8]), "{moving:?}");
        assert_eq!(moving[9], 2000.0);
        assert!((20.0..=64.0).contains(&moving[0]) && (190.0..=256.0).contains(&moving[1]), "{moving:?}");
        for (moving, (kind, name)) in moving.into_iter().zip(MOTIONS) {
            let figure = |index: &str, figure: &str| of(name, index, figure).expect("it counts");
            // Each moving polygon is an entry that is either replaced in place or inserted again.
            for incremental in ["osp", "loose-octree", "time-order", "dynamic-bvh", "osp-paper"] {
                let entries = figure(incremental, "entries_set") + figure(incremental, "entries_inserted");
                assert_eq!(entries, moving, "{incremental}, {name}");
            }
            // Structures that rebuild insert every polygon. Structures that refit compute every box, and insert no
            // entry.
            assert_eq!(figure("octree-rebuild", "entries_inserted"), 2000.0, "{name}");
            assert_eq!(of(name, "brute-simd", "boxes_computed"), None, "it does not count");
            assert!(figure("osp", "reported") > 0.0, "something is in view: {name}");
            if !kind.has_groups() {
                assert_eq!(of(name, GROUP_INDEX, "entries_set"), None, "{name}");
                continue;
            }
            assert!(figure("bvh-sah", "boxes_computed") > 100.0, "{name}");
            assert_eq!(figure("bvh-sah", "entries_set"), moving, "{name}");
            let entries = figure(GROUP_INDEX, "entries_set");
            match kind {
                Motion::Scattered(_) => unreachable!("it has no groups"),
                Motion::Pieces(_) => assert_eq!(entries, (moving / 32.0).ceil(), "{name}"),
                Motion::Group(_) => assert_eq!(entries, 1.0, "{name}"),
                Motion::Instances(nodes) => assert_eq!(entries, nodes as f64, "{name}"),
            }
        }
    }

    #[test]
    fn a_structure_that_does_not_follow_is_found_out() {
        let model = RaysModel::synthetic(1000).expect("it is whole");
        for (motion, name) in MOTIONS {
            let world = World::new(&model, motion);
            let other = World::new(&model, motion);
            let (mut rows, config) = (Rows::default(), config());
            let mut measured = Measured { world: &world, name, config: &config, rows: &mut rows };
            if motion.has_groups() {
                let mut stays = Stays(EachGroup::new(&other));
                measured.measure(GROUP_INDEX, &mut stays);
            }
            let mut stays = Stays(EachPolygon::new(Contender::Own(IndexKind::Osp), &world));
            measured.measure("stays", &mut stays);
            let is_found =
                |who: &str| rows.faults.iter().any(|fault| fault.contains(&format!("{who} ({name})")));
            // A hundredth of the polygons may be out of view, or stay at one position for three frames.
            let is_small =
                matches!(motion, Motion::Pieces(s) | Motion::Group(s) | Motion::Scattered(s) if s < 1.0);
            let is_group_found = !motion.has_groups() || is_found(GROUP_INDEX);
            assert!(is_small || (is_group_found && is_found("stays")), "{:?}", rows.faults);
        }
    }

    /// Finds every polygon at its first position.
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
