use super::structure::ShadowStructure;
use osp::{
    math::Aabb,
    occlusion::{
        OcclusionCuller, ShadowVolume, Verdict,
        kernels::{ShadowTree, node_budget},
        msvbsp::{Msvbsp, MsvbspConfig},
    },
    view::ViewWindow,
};
use osp_rivals::occlusion::{MsvbspPaper, PaperCaps};

/// The two forms of the modified shadow-volume BSP tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowForm {
    Conservative,
    Paper,
}

impl ShadowForm {
    /// The name of the method of occlusion culling with this form.
    pub fn name(self) -> &'static str {
        match self {
            Self::Conservative => "msvbsp",
            Self::Paper => "msvbsp-paper",
        }
    }

    fn tree(self, window: &ViewWindow, occluders: &[ShadowVolume]) -> ShadowTree {
        let node_budget = node_budget(occluders.len());
        match self {
            Self::Conservative => {
                let mut culler = Msvbsp::new(MsvbspConfig { node_budget, ..MsvbspConfig::default() });
                culler.build(window, occluders);
                culler.tree().clone()
            }
            Self::Paper => {
                let mut culler = MsvbspPaper::new(PaperCaps::Supporting, node_budget);
                culler.build(window, occluders);
                culler.tree().clone()
            }
        }
    }
}

/// The tree of a view's occluders. Each step adds one plane.
#[derive(Clone, Debug)]
pub struct ShadowSteps {
    pub form: ShadowForm,
    tree: ShadowTree,
}

impl ShadowSteps {
    /// The tree of these occluders, which are sorted, the best first.
    pub fn new(form: ShadowForm, window: &ViewWindow, occluders: &[ShadowVolume]) -> Self {
        Self { form, tree: form.tree(window, occluders) }
    }

    /// Number of planes of the whole tree, which is the number of the last step.
    pub fn planes(&self) -> usize {
        self.tree.node_count()
    }

    /// The first `planes` planes, at most all, of the tree of this window and these occluders. O(planes * occluders).
    pub fn step(&self, planes: usize, window: &ViewWindow, occluders: &[ShadowVolume]) -> ShadowStep {
        let first = self.tree.first(planes);
        ShadowStep {
            form: self.form,
            planes_in_all: self.planes(),
            structure: ShadowStructure::of(&first, window, occluders),
            first,
        }
    }
}

/// The first planes of a tree.
#[derive(Clone, Debug)]
pub struct ShadowStep {
    pub form: ShadowForm,
    pub planes_in_all: usize,
    /// The planes of this step and the cells between them.
    pub structure: ShadowStructure,
    first: ShadowTree,
}

impl ShadowStep {
    /// Whether these planes prove that a box, world space, is hidden.
    pub fn hides(&self, bounds: &Aabb) -> bool {
        self.first.test_box(bounds).verdict == Verdict::Hidden
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{
        super::structure::{ShadowHolds, ShadowNode},
        *,
    };
    use osp::view::{Projection, View};

    /// The first planes of a square in the middle of the window, two metres away.
    fn step_of(form: ShadowForm, planes: usize) -> ShadowStep {
        let projection = Projection::symmetric(90.0, 1.0, 0.1, 10.0);
        let window = View::look_at(Vec3::ZERO, Vec3::NEG_Z, projection).window().expect("a window");
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| Vec3::new(x, y, -2.0));
        let occluders = [ShadowVolume::of_polygon(&corners, &window).expect("an occluder")];
        ShadowSteps::new(form, &window, &occluders).step(planes, &window, &occluders)
    }

    #[test]
    fn four_planes_of_a_square_leave_one_cell_in_its_shadow() {
        for form in [ShadowForm::Conservative, ShadowForm::Paper] {
            let step = step_of(form, 9);
            let whole = &step.structure;
            assert_eq!((whole.planes, whole.levels(), whole.nodes.len()), (4, 4, 9));
            let is_dark = |node: &&ShadowNode| matches!(&node.holds, ShadowHolds::Leaf { occluders } if occluders == &[0]);
            let dark: Vec<_> = whole.nodes.iter().filter(is_dark).collect();
            assert_eq!(dark.len(), 1);
            assert_eq!((dark[0].cell.len(), dark[0].depth), (4, 4));
            let all_cut = |node: &ShadowNode| match node.holds {
                ShadowHolds::Plane { occluder, cut, .. } => occluder == Some(0) && cut.is_some(),
                ShadowHolds::Leaf { .. } => true,
            };
            assert!(whole.nodes.iter().all(all_cut));
            let step = step_of(form, 3);
            let part = &step.structure;
            assert_eq!((part.planes, part.nodes.iter().filter(is_dark).count()), (3, 0));
        }
    }
}
