//! Figs. 19 and 21 to 23: polygons are added one after the other, and every frame inserts, culls and draws.

use osp_session::platform::time::Instant;

use super::{
    drawing::{Adapter, Drawer, Drawn},
    input::{PaperConfig, PaperError, PaperInput, mean},
};
use crate::{
    Method,
    bench::curves::grouped,
    rows::{Curves, Rows, quantile},
};
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

/// Number of consecutive frames that are measured together. The frame before them applies the skipped changes
/// and is not counted.
const STRETCH: u64 = 10;

/// The name of the frames without insertion.
const STILL: &str = "nothing inserted";
const PART: &str = "paper-growing";

/// A frame of the growing model.
#[derive(Clone, Copy, Debug)]
struct GrowingFrame {
    frame: u64,
    /// Number of polygons in the model.
    polygons: u64,
    /// Number of polygons that were inserted, removed or moved.
    changed: u64,
    insert_ns: u64,
    cull_ns: u64,
    /// 0 if the frame was not drawn.
    draw_ns: u64,
    /// Number of plane tests of polygons.
    planes: u64,
    drawn: u64,
    in_view: u64,
}

impl GrowingFrame {
    fn total_us(&self) -> f64 {
        (self.insert_ns + self.cull_ns + self.draw_ns) as f64 / 1000.0
    }
}

/// A tree whose tests during insertion are counted, or any other tree.
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
            // A polygon with an invalid box cannot be drawn and is left out.
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

/// The paper's two trees as printed, and osp's best versions of them.
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

/// Plays the session. Returns the poses of the measured frames.
pub(super) fn grow<I>(
    rows: &mut Rows,
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
) -> Result<Vec<Moment>, PaperError>
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
        // The trees take turns in running first, so that each finds the caches as the others leave them.
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
    add(rows, input, &lanes);
    Ok(moments)
}

/// Whether a frame is measured, and if so, whether it counts. The measured frames are evenly spaced runs of consecutive
/// frames from the first frame to the last. The first frame of each run only applies the changes of skipped frames.
fn measured(frame: u64, frames: u64, most: u64) -> Option<bool> {
    if frames <= most.max(2 * (STRETCH + 1)) {
        return Some(true);
    }
    let stretches = (most / STRETCH).max(2);
    let (last, gaps) = (frames - STRETCH - 1, stretches - 1);
    // The last run that begins at or before this frame.
    let number = (0..stretches).rev().find(|number| number * last / gaps <= frame)?;
    let at = frame - number * last / gaps;
    (at <= STRETCH).then_some(at > 0)
}

/// Whether a frame belongs to a part of the session.
type IsIn = fn(&GrowingFrame) -> bool;

fn add(rows: &mut Rows, input: &PaperInput<'_>, lanes: &[Lane]) {
    rows.part(PART, "The paper: the model grows (Figs. 19, 21 to 23)");
    let parts: [(&str, IsIn); 5] = [
        ("whole session", |_| true),
        ("up to 1,000 polygons", |frame| frame.polygons < 1000),
        ("1,000 to 10,000", |frame| (1000..10_000).contains(&frame.polygons)),
        ("over 10,000", |frame| frame.polygons >= 10_000),
        (STILL, |frame| frame.changed == 0),
    ];
    // The last tree is osp's; all trees have the same frames.
    let Some(reference) = lanes.last() else { return };
    for (part, is_in) in parts {
        for lane in lanes {
            let both = || lane.frames.iter().zip(&reference.frames).filter(|(_, other)| is_in(other));
            let frames: Vec<GrowingFrame> = both().map(|(frame, _)| *frame).collect();
            if frames.is_empty() {
                continue;
            }
            let times: Vec<(f64, f64)> =
                both().map(|(own, other)| (own.total_us(), other.total_us())).collect();
            let us =
                |ns: fn(&GrowingFrame) -> u64| frames.iter().map(|frame| ns(frame) as f64 / 1000.0).collect();
            let sum = |count: fn(&GrowingFrame) -> u64| frames.iter().map(count).sum::<u64>();
            let (changed, task) = (sum(|frame| frame.changed), format!("{PART}/{part}"));
            let mut figures = rows.of(task, input.recording, lane.tree.index().name());
            figures.against(&times).median("insert", "us", us(|frame| frame.insert_ns));
            figures.median("cull", "us", us(|frame| frame.cull_ns));
            if lane.drawer.is_some() {
                let mut rates: Vec<f64> =
                    frames.iter().map(|frame| 1.0e6 / frame.total_us().max(1.0e-3)).collect();
                rates.sort_unstable_by(f64::total_cmp);
                figures.median("draw", "us", us(|frame| frame.draw_ns));
                figures.value("frames", "1/s", quantile(&rates, 0.5));
            }
            let counts_planes = lane.tree.filing().is_some() && changed > 0;
            figures
                .maybe(
                    "planes",
                    "1/polygon",
                    counts_planes.then(|| sum(|frame| frame.planes) as f64 / changed as f64),
                )
                .value("drawn", "polygons", mean(sum(|frame| frame.drawn), frames.len()))
                .value("in_view", "polygons", mean(sum(|frame| frame.in_view), frames.len()));
        }
    }
    let line = |lane: &Lane| {
        let points = lane.frames.iter().map(|frame| (frame.frame as f64, frame.total_us()));
        (lane.tree.index().name().to_owned(), grouped(points.collect()))
    };
    rows.curves.push(Curves {
        part: PART,
        title: format!("{}: the OSP tree and the octree as the model grows", input.recording),
        x: "frame",
        y: "µs",
        lines: lanes.iter().map(line).collect(),
    });
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
            // A frame that counts is preceded by a measured frame.
            assert!(counted.iter().all(|&frame| frame == 0 || of(frame - 1).is_some()), "{frames}");
            assert!(counted.contains(&(frames - 1)) && counted.iter().any(|&frame| frame < 12), "{frames}");
        }
    }
}
