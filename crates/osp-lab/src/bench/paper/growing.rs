//! Figs. 19 and 21 to 23: polygons come one after the other, and every frame files, culls and draws.

use osp_session::platform::time::Instant;
use std::ops::Range;

use serde::Serialize;

use super::{
    drawing::{Adapter, Drawer, Drawn},
    input::{PaperConfig, PaperError, PaperInput, mean},
};
use crate::{Method, bench::Estimate};
use osp::{
    index::{IndexConfig, SpatialIndex},
    polygon::{Change, VisibleBlocks},
    view::View,
};
use osp_rivals::{CutNodes, FilingCounts, IndexKind, OctreePaper, OctreePaperConfig, OspGrid, OspPaper};
use osp_session::{
    recording::{Event, RecordingError},
    replay::{Moment, Player},
    scene::Scene,
};

/// Consecutive frames that are measured at a time; the first is not counted: it catches up with those before.
const STRETCH: u64 = 10;

/// The parts of the session that the paper shows.
const PARTS: [(&str, Range<u64>); 4] = [
    ("whole session", 0..u64::MAX),
    ("up to 1,000 polygons", 0..1000),
    ("1,000 to 10,000", 1000..10_000),
    ("over 10,000", 10_000..u64::MAX),
];

/// The part in which nothing is inserted.
pub(super) const STILL: &str = "nothing inserted";

/// One tree in one part of the session. Times in microseconds.
#[derive(Clone, Debug, Serialize)]
pub struct GrowingRow {
    /// Name of the index.
    pub tree: &'static str,
    /// Whether all polygons of a cut node are drawn (Fig. 6).
    pub as_printed: bool,
    /// The part of the session.
    pub part: &'static str,
    /// Filing what a frame brought, with a rebuild where the tree needs one.
    pub insert_us: Estimate,
    /// Culling by the frustum.
    pub cull_us: Estimate,
    /// Sending and drawing, where something was drawn.
    pub draw_us: Option<Estimate>,
    /// The frame.
    pub frame_us: Estimate,
    /// The slowest frame of a hundred.
    pub frame_p99_us: f64,
    /// Planes that polygons were compared with, for each polygon that came, went or moved; where it is counted.
    pub planes_per_polygon: Option<f64>,
    /// Polygons drawn, mean.
    pub drawn: f64,
    /// Polygons in view, mean.
    pub in_view: f64,
    /// The frames.
    #[serde(skip)]
    pub frames: Vec<GrowingFrame>,
}

/// A frame of the growing model.
#[derive(Clone, Copy, Debug)]
pub struct GrowingFrame {
    /// Its number in the session.
    pub frame: u64,
    /// Polygons in the model.
    pub polygons: u64,
    /// Polygons that came, went or moved.
    pub changed: u64,
    /// Filing, nanoseconds.
    pub insert_ns: u64,
    /// Culling, nanoseconds.
    pub cull_ns: u64,
    /// Drawing, nanoseconds; 0 where nothing was drawn.
    pub draw_ns: u64,
    /// Planes asked while filing.
    pub planes: u64,
    /// Polygons drawn.
    pub drawn: u64,
    /// Polygons in view.
    pub in_view: u64,
}

impl GrowingFrame {
    /// All of it, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.insert_ns + self.cull_ns + self.draw_ns
    }
}

/// A tree whose tests of filing are counted, or another one.
enum Tree {
    Osp(OspPaper),
    Octree(OctreePaper),
    Other(Box<dyn SpatialIndex>),
}

impl Tree {
    fn index(&self) -> &dyn SpatialIndex {
        match self {
            Self::Osp(tree) => tree,
            Self::Octree(tree) => tree,
            Self::Other(tree) => &**tree,
        }
    }

    fn index_mut(&mut self) -> &mut dyn SpatialIndex {
        match self {
            Self::Osp(tree) => tree,
            Self::Octree(tree) => tree,
            Self::Other(tree) => &mut **tree,
        }
    }

    fn filing(&self) -> Option<FilingCounts> {
        match self {
            Self::Osp(tree) => Some(tree.filing()),
            Self::Octree(tree) => Some(tree.filing()),
            Self::Other(_) => None,
        }
    }

    fn file(&mut self, scene: &Scene, changes: &[Change]) {
        let index = self.index_mut();
        for &change in changes {
            // What is beyond all range cannot be drawn and stays out.
            let _ = match change {
                Change::Insert(id) => index.insert(id, &scene.bounds(id)),
                Change::Remove(id) => index.remove(id),
                Change::Update(id) => index.update(id, &scene.bounds(id)),
                Change::Repaint(_) | Change::Place(_) => Ok(()),
            };
        }
    }
}

struct Lane {
    tree: Tree,
    drawer: Option<Drawer>,
    list: VisibleBlocks,
    frames: Vec<GrowingFrame>,
}

impl Lane {
    fn frame(&mut self, scene: &Scene, changes: &[Change], view: &View) -> Result<GrowingFrame, PaperError> {
        let planes = self.tree.filing().map_or(0, |filing| filing.planes);
        let start = Instant::now();
        self.tree.file(scene, changes);
        self.tree.index_mut().commit();
        let insert_ns = start.elapsed().as_nanos() as u64;
        self.list.clear();
        let start = Instant::now();
        self.tree.index().frustum_cull_blocks(&view.frustum(), &mut self.list);
        let cull_ns = start.elapsed().as_nanos() as u64;
        let draw = match &mut self.drawer {
            Some(drawer) => drawer.draw(scene, view, &self.list)?,
            None => Drawn::default(),
        };
        Ok(GrowingFrame {
            frame: 0,
            polygons: self.tree.index().len() as u64,
            changed: changes.iter().filter(|change| !matches!(change, Change::Repaint(_))).count() as u64,
            insert_ns,
            cull_ns,
            draw_ns: draw.total_ns(),
            planes: self.tree.filing().map_or(0, |filing| filing.planes) - planes,
            drawn: self.list.len() as u64,
            in_view: 0,
        })
    }
}

/// The paper's two trees as they are printed, and the same two as well as we can.
fn trees(input: &PaperInput<'_>, config: &PaperConfig) -> [Tree; 4] {
    let cube = input.cube(config.cube());
    let capacity = usize::try_from(input.summary.counts.polygons).unwrap_or(usize::MAX);
    let index = IndexConfig { root: input.root, capacity };
    let grid = OspGrid::new(cube.center(), cube.extent().max_element(), config.depth());
    let octree = OctreePaper::new(OctreePaperConfig::default(), &index);
    [
        Tree::Osp(OspPaper::new(grid, capacity).with_cut_nodes(CutNodes::Drawn)),
        Tree::Octree(octree.with_cut_nodes(CutNodes::Drawn)),
        Tree::Other(IndexKind::OctreeRebuild.create(&index)),
        Tree::Other(IndexKind::Osp.create(&index)),
    ]
}

/// Plays the session; the rows, and the moments of the frames that were measured.
pub(super) fn grow<I>(
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
) -> Result<(Vec<GrowingRow>, Vec<Moment>), PaperError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let mut lanes = Vec::new();
    for tree in trees(input, config) {
        let drawer = adapter.map(|adapter| adapter.drawer(Method::NONE)).transpose()?;
        lanes.push(Lane { tree, drawer, list: VisibleBlocks::new(), frames: Vec::new() });
    }
    let mut moments = Vec::new();
    let mut player = Player::new(events, input.pace);
    while player.step()? {
        let (scene, changes, moment) = (player.scene(), player.changes(), player.moment());
        for drawer in lanes.iter_mut().filter_map(|lane| lane.drawer.as_mut()) {
            drawer.follow(changes);
        }
        let Some(counts) = measured(moment.frame, input.summary.frames, config.frames) else {
            lanes.iter_mut().for_each(|lane| lane.tree.file(scene, changes));
            continue;
        };
        let view = input.camera.0.view(&moment);
        // None always comes first, so that each finds the caches as the others leave them.
        let (count, mut in_view) = (lanes.len(), 0);
        for i in 0..count {
            let i = (i + moment.frame as usize) % count;
            let frame = lanes[i].frame(scene, changes, &view)?;
            if counts {
                lanes[i].frames.push(GrowingFrame { frame: moment.frame, ..frame });
            }
            if i == count - 1 {
                in_view = frame.drawn; // The last tree's answer is exact.
            }
        }
        for frame in lanes.iter_mut().filter(|_| counts).filter_map(|lane| lane.frames.last_mut()) {
            frame.in_view = in_view;
        }
        moments.extend(counts.then_some(moment));
    }
    Ok((lanes.iter().flat_map(rows).collect(), moments))
}

/// Whether a frame is measured, and whether it counts: stretches from the first frame to the last, evenly spaced, the first
/// frame of each to catch up.
fn measured(frame: u64, frames: u64, most: u64) -> Option<bool> {
    if frames <= most.max(2 * (STRETCH + 1)) {
        return Some(true);
    }
    let stretches = (most / STRETCH).max(2);
    let (last, gaps) = (frames - STRETCH - 1, stretches - 1);
    // The last stretch that begins at this frame or before.
    let number = (0..stretches).rev().find(|number| number * last / gaps <= frame)?;
    let at = frame - number * last / gaps;
    (at <= STRETCH).then_some(at > 0)
}

fn rows(lane: &Lane) -> Vec<GrowingRow> {
    let of_part = |(part, polygons): &(&'static str, Range<u64>)| {
        row(lane, part, lane.frames.iter().filter(|frame| polygons.contains(&frame.polygons)))
    };
    let still = row(lane, STILL, lane.frames.iter().filter(|frame| frame.changed == 0));
    PARTS.iter().map(of_part).chain([still]).flatten().collect()
}

fn row<'a>(
    lane: &Lane,
    part: &'static str,
    frames: impl Iterator<Item = &'a GrowingFrame>,
) -> Option<GrowingRow> {
    let frames: Vec<GrowingFrame> = frames.copied().collect();
    let estimate = |ns: fn(&GrowingFrame) -> u64| {
        let mut us: Vec<f64> = frames.iter().map(|frame| ns(frame) as f64 / 1000.0).collect();
        Estimate::of(&mut us).unwrap_or_default()
    };
    let sum = |count: fn(&GrowingFrame) -> u64| frames.iter().map(count).sum::<u64>();
    let mut total: Vec<u64> = frames.iter().map(GrowingFrame::total_ns).collect();
    total.sort_unstable();
    let slowest = total.get((total.len() * 99).div_ceil(100).saturating_sub(1))?;
    let changed = sum(|frame| frame.changed);
    Some(GrowingRow {
        tree: lane.tree.index().name(),
        as_printed: lane.tree.filing().is_some(),
        part,
        insert_us: estimate(|frame| frame.insert_ns),
        cull_us: estimate(|frame| frame.cull_ns),
        draw_us: lane.drawer.as_ref().map(|_| estimate(|frame| frame.draw_ns)),
        frame_us: estimate(GrowingFrame::total_ns),
        frame_p99_us: *slowest as f64 / 1000.0,
        planes_per_polygon: lane
            .tree
            .filing()
            .filter(|_| changed > 0)
            .map(|_| sum(|frame| frame.planes) as f64 / changed as f64),
        drawn: mean(sum(|frame| frame.drawn), frames.len()),
        in_view: mean(sum(|frame| frame.in_view), frames.len()),
        frames,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_frames_count_as_are_wanted_all_over_the_session() {
        for (frames, most) in [(10, 90), (1000, 90), (12_345, 360), (91, 90), (30, 1)] {
            let of = |frame| measured(frame, frames, most);
            let counted: Vec<u64> = (0..frames).filter(|&frame| of(frame) == Some(true)).collect();
            assert!(counted.len() as u64 <= most.max(3 * STRETCH) + STRETCH, "{frames}: {}", counted.len());
            assert!(counted.len() as u64 >= frames.min(most) * 9 / 10, "{frames}: {}", counted.len());
            // A frame that counts follows one that has caught up.
            assert!(counted.iter().all(|&frame| frame == 0 || of(frame - 1).is_some()), "{frames}");
            assert!(counted.contains(&(frames - 1)) && counted.iter().any(|&frame| frame < 12), "{frames}");
        }
    }
}
