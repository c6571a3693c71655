use super::{Cell, Needed, OcclusionCuller, Tested, TestedBoxes, Verdict, verdict::TOGETHER};
use crate::{
    index::{Node, Visit, Visitor},
    math::{Aabb, Sphere},
    polygon::{BLOCK, Geometry, PolygonId, SpacesInView, VisibleBlocks, count_polygons, ids_of},
};

/// The bounding volume of a node that is tested against the shadow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeTest {
    /// The bounding sphere of the node's box, as in the paper.
    Sphere,
    /// The node's box. It lies inside the sphere, so this test finds at least as many hidden nodes in the same time.
    Box,
    /// The box's eight corners, which must all lie in one cell of the tree and beyond one occluder. It finds fewer hidden
    /// nodes than the box, which may lie in several hidden cells.
    Corners,
}

impl NodeTest {
    /// All kinds of tests.
    pub const ALL: [Self; 3] = [Self::Box, Self::Sphere, Self::Corners];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Sphere => "sphere",
            Self::Corners => "corners",
        }
    }
}

/// Whether the polygons of a partly hidden leaf are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolygonTest {
    /// All polygons of the leaf are drawn.
    Never,
    /// The box of each polygon is tested.
    InPartlyHiddenLeaves,
}

/// Settings of culling an index by occlusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CullConfig {
    /// The bounding volume of a node that is tested.
    pub node_test: NodeTest,
    /// Whether polygons are tested one by one.
    pub polygon_test: PolygonTest,
    /// Nodes with fewer polygons (in the node and below) are drawn without a test, because a test would cost more than
    /// drawing.
    pub least_polygons: usize,
}

impl Default for CullConfig {
    /// Tests boxes, down to single polygons.
    fn default() -> Self {
        Self { node_test: NodeTest::Box, polygon_test: PolygonTest::InPartlyHiddenLeaves, least_polygons: 1 }
    }
}

/// Time to test a node or a polygon and to continue, nanoseconds; see [`CullConfig::for_drawing`]. An additional test took
/// 55 to 106 ns (`thin-out` in the bench `occlusion`, the least of a hundred samples, on a loaded machine).
const TEST_NS: f64 = 100.0;

impl CullConfig {
    /// Settings for a renderer that takes `polygon_ns` nanoseconds to draw a polygon. A node is drawn without a test if
    /// drawing it takes less time than four tests. Polygons are tested one by one only if drawing a polygon takes longer
    /// than four tests. The factor is four because most tests find nothing hidden, and the nodes above have been tested,
    /// too.
    pub(crate) fn for_drawing(polygon_ns: f64) -> Self {
        let least_polygons = (4.0 * TEST_NS / polygon_ns).ceil().clamp(1.0, 1.0e6) as usize;
        let polygon_test =
            if least_polygons == 1 { PolygonTest::InPartlyHiddenLeaves } else { PolygonTest::Never };
        Self { polygon_test, least_polygons, ..Self::default() }
    }
}

/// Counts of occlusion culling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Number of nodes tested.
    pub node_tests: u64,
    /// Number of tested nodes that are hidden.
    pub hidden: u64,
    /// Number of tested nodes of which no part is hidden.
    pub unoccluded: u64,
    /// Number of polygons tested one by one.
    pub polygon_tests: u64,
    /// Number of polygons tested one by one that are hidden.
    pub hidden_polygons: u64,
    /// Number of polygons in hidden nodes, in view or not.
    pub skipped: u64,
    /// Steps of all tests; see [`Tested::steps`].
    pub steps: u64,
    /// Number of planes read for all tests. It is less than `steps` if a plane is tested for many boxes at once.
    pub planes: u64,
}

/// Largest number of nested partly hidden boxes that are stored.
const MOST_NESTED: usize = 8;

/// A stack of nested, partly hidden boxes. Each entry has the culler's cell that contains the box. The next tested box
/// mostly lies in one of them, and its test begins at that box's cell.
struct BoxStack {
    boxes: [(Aabb, Cell); MOST_NESTED],
    count: usize,
}

impl BoxStack {
    const EMPTY: Self = Self { boxes: [(Aabb::EMPTY, Cell::ALL); MOST_NESTED], count: 0 };

    /// The cell at which the test of a box, or of all boxes inside it, begins. Removes stored boxes that do not contain
    /// `bounds`.
    #[inline]
    fn cell_around(&mut self, bounds: &Aabb) -> Cell {
        while self.count > 0 {
            let (outer, cell) = self.boxes[self.count - 1];
            if outer.contains(bounds) {
                return cell;
            }
            self.count -= 1;
        }
        Cell::ALL
    }

    /// Stores a box with the cell at which its test ended.
    fn push(&mut self, bounds: &Aabb, cell: Cell) {
        if self.count < MOST_NESTED {
            self.boxes[self.count] = (*bounds, cell);
            self.count += 1;
        }
    }
}

/// A culler with its settings, and the counts of its tests.
pub(super) struct Tests<'a> {
    culler: &'a dyn OcclusionCuller,
    config: CullConfig,
    pub(super) counts: CullCounts,
    nested: BoxStack,
}

impl<'a> Tests<'a> {
    pub(super) fn new(culler: &'a dyn OcclusionCuller, config: CullConfig) -> Self {
        Self { culler, config, counts: CullCounts::default(), nested: BoxStack::EMPTY }
    }

    /// Adds the visible polygons of spaces to `drawn`, and removes the hidden ones. It tests the box of each
    /// space first, then the blocks of partly hidden spaces.
    pub(super) fn cull_spaces(
        &mut self,
        geometry: &dyn Geometry,
        spaces: &SpacesInView,
        drawn: &mut VisibleBlocks,
    ) {
        for (bounds, blocks) in spaces.iter() {
            let polygons = count_polygons(blocks);
            let visit = self.test(bounds, polygons);
            for &(block, mask) in blocks {
                let hidden = match visit {
                    Visit::Skip => mask,
                    Visit::Take => 0,
                    Visit::Descend => self.hidden_in_block(geometry, block, mask),
                };
                drawn.remove_block(block, hidden);
                drawn.insert_block(block, mask & !hidden);
            }
        }
    }

    /// The mask of the hidden polygons of a block; 0 if the settings do not test single polygons.
    pub(super) fn hidden_in_block(&mut self, geometry: &dyn Geometry, block: usize, mask: u16) -> u16 {
        if mask == 0 || !self.tests_polygons() {
            return 0;
        }
        let (mut ids, mut len) = ([PolygonId(0); BLOCK], 0);
        for id in ids_of(block, mask) {
            ids[len] = id;
            len += 1;
        }
        let hidden = self.hidden_of_ids(geometry, &ids[..len]);
        let is_hidden = |&(i, _): &(usize, &PolygonId)| hidden >> i & 1 == 1;
        let hidden = ids[..len].iter().enumerate().filter(is_hidden);
        hidden.fold(0, |found, (_, id)| found | 1 << (id.index() % BLOCK))
    }

    /// The hidden polygons among at most sixteen, a bit for each.
    fn hidden_of_ids(&mut self, geometry: &dyn Geometry, ids: &[PolygonId]) -> u16 {
        let mut boxes = [Aabb::EMPTY; TOGETHER];
        for (bounds, &id) in boxes.iter_mut().zip(ids) {
            *bounds = geometry.bounds(id);
        }
        self.hidden_of(&boxes[..ids.len()])
    }

    /// Tests a node.
    fn test(&mut self, bounds: &Aabb, polygons: usize) -> Visit {
        if polygons < self.config.least_polygons {
            return Visit::Take;
        }
        let Tested { verdict, steps } = match self.config.node_test {
            NodeTest::Sphere => self.culler.test_sphere(&Sphere::around(bounds)),
            NodeTest::Box => {
                let (tested, cell) = self.culler.test_box_in(bounds, self.nested.cell_around(bounds));
                if tested.verdict == Verdict::PartlyHidden {
                    self.nested.push(bounds, cell);
                }
                tested
            }
            NodeTest::Corners => self.culler.test_corners(bounds),
        };
        self.counts.node_tests += 1;
        self.counts.steps += u64::from(steps);
        self.counts.planes += u64::from(steps);
        match verdict {
            Verdict::Hidden => {
                self.counts.hidden += 1;
                self.counts.skipped += polygons as u64;
                Visit::Skip
            }
            Verdict::Unoccluded => {
                self.counts.unoccluded += 1;
                Visit::Take
            }
            Verdict::PartlyHidden => Visit::Descend,
        }
    }
}

impl Visitor for Tests<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.test(node.bounds, node.polygons)
    }

    fn tests_together(&self) -> bool {
        true
    }

    fn leaves(&mut self, bounds: &[Aabb], polygons: &[u8], answers: &mut [Visit]) {
        let CullConfig { node_test, least_polygons, .. } = self.config;
        if node_test != NodeTest::Box || polygons.iter().any(|&count| usize::from(count) < least_polygons) {
            for ((answer, bounds), &polygons) in answers.iter_mut().zip(bounds).zip(polygons) {
                *answer = self.test(bounds, usize::from(polygons));
            }
            return;
        }
        let around = bounds.iter().fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let cell = self.nested.cell_around(&around);
        let TestedBoxes { hidden, unoccluded, steps, planes } =
            self.culler.test_boxes(bounds, cell, Needed::Verdict);
        for (i, (answer, &polygons)) in answers.iter_mut().zip(polygons).enumerate() {
            let is = |mask: u16| mask >> i & 1 == 1;
            *answer = match (is(hidden), is(unoccluded)) {
                (true, _) => Visit::Skip,
                (false, true) => Visit::Take,
                (false, false) => Visit::Descend,
            };
            self.counts.skipped += if is(hidden) { u64::from(polygons) } else { 0 };
        }
        self.counts.node_tests += bounds.len() as u64;
        self.counts.hidden += u64::from(hidden.count_ones());
        self.counts.unoccluded += u64::from(unoccluded.count_ones());
        self.counts.steps += u64::from(steps);
        self.counts.planes += u64::from(planes);
    }

    /// Thinning passes no polygons.
    fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}

    fn least_polygons(&self) -> usize {
        self.config.least_polygons
    }

    fn tests_polygons(&self) -> bool {
        self.config.polygon_test != PolygonTest::Never
    }

    fn hidden_of(&mut self, boxes: &[Aabb]) -> u16 {
        let around = boxes.iter().fold(Aabb::EMPTY, |around, bounds| around.union(bounds));
        let TestedBoxes { hidden, steps, planes, .. } =
            self.culler.test_boxes(boxes, self.nested.cell_around(&around), Needed::Hidden);
        self.counts.polygon_tests += boxes.len() as u64;
        self.counts.steps += u64::from(steps);
        self.counts.planes += u64::from(planes);
        self.counts.hidden_polygons += u64::from(hidden.count_ones());
        hidden
    }
}

/// An index visitor that omits the polygons hidden by the culler.
pub struct OcclusionVisitor<'a, L> {
    tests: Tests<'a>,
    geometry: &'a dyn Geometry,
    draw_list: &'a mut L,
}

impl<L> std::fmt::Debug for OcclusionVisitor<'_, L> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OcclusionVisitor")
            .field("culler", &self.tests.culler.name())
            .field("counts", &self.tests.counts)
            .finish_non_exhaustive()
    }
}

impl<'a, L: Extend<PolygonId>> OcclusionVisitor<'a, L> {
    /// A visitor that appends the polygons that are not hidden to `draw_list`. The culler has to be built for the view
    /// of the traversal.
    pub fn new(
        culler: &'a dyn OcclusionCuller,
        geometry: &'a dyn Geometry,
        config: CullConfig,
        draw_list: &'a mut L,
    ) -> Self {
        Self { tests: Tests::new(culler, config), geometry, draw_list }
    }

    /// The counts of all tests so far.
    pub fn counts(&self) -> CullCounts {
        self.tests.counts
    }
}

#[doc(hidden)]
impl<L: Extend<PolygonId>> Visitor for OcclusionVisitor<'_, L> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.tests.node(node)
    }

    fn tests_together(&self) -> bool {
        self.tests.config.node_test == NodeTest::Box
    }

    fn leaves(&mut self, bounds: &[Aabb], polygons: &[u8], answers: &mut [Visit]) {
        self.tests.leaves(bounds, polygons, answers);
    }

    fn polygons(&mut self, ids: &[PolygonId], decision: Visit) {
        if decision == Visit::Take || !self.tests.tests_polygons() {
            self.draw_list.extend(ids.iter().copied());
            return;
        }
        for ids in ids.chunks(TOGETHER) {
            let hidden = self.tests.hidden_of_ids(self.geometry, ids);
            let shown = ids.iter().enumerate().filter(|(i, _)| hidden >> i & 1 == 0);
            self.draw_list.extend(shown.map(|(_, &id)| id));
        }
    }
}
