use glam::{DVec3, Vec3};

use super::{culling::is_there, layers::draw_outlines};
use osp::{
    math::Aabb,
    occlusion::{Score, SelectConfig},
    polygon::PolygonId,
    view::View,
};
use osp_lab::{
    oracle::{OracleConfig, Sight},
    shadows::{ShadowForm, ShadowHolds, ShadowStep, ShadowSteps, ShadowStructure, ShadowView, occluder_name},
};
use osp_render::{Depth, LineBatch, LineColor};
use osp_session::{recording::Motion, scene::Scene};

/// Initial number of occluders, the same as in `osp draw-occlusion`.
const INITIAL_OCCLUDERS: usize = 6;

/// Resolution of the reference picture, which shows the visible polygons. It reveals polygons that
/// [`ShadowForm::Paper`] wrongly culls.
const REFERENCE: OracleConfig = OracleConfig { width: 1280, height: 720 };
/// Largest number of polygons in view for which the reference picture is drawn.
const MAX_REFERENCE_POLYGONS: usize = 50_000;

const TAKEN: LineColor = [255, 190, 60, 255];
const NOT_TAKEN: LineColor = [255, 190, 60, 90];
const LATEST: LineColor = [120, 235, 255, 255];
const LATEST_FACE: LineColor = [120, 235, 255, 40];
const PLANE: LineColor = [235, 240, 255, 110];
const SHADOW_CELL: LineColor = [60, 90, 200, 40];
const HIDDEN: LineColor = [80, 140, 255, 190];
const NEWLY_HIDDEN: LineColor = [120, 235, 255, 255];

const VISIBLE: LineColor = [255, 60, 60, 255];

/// An edit of the displayed steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepsEdit {
    /// Show or hide the steps.
    Show(bool),
    /// Go forwards or back by this number of steps.
    By(i64),
    /// Go to the step with this number of planes, at most to the last step.
    To(usize),
    /// Show the tree of this form.
    Form(ShadowForm),
    /// Set the largest number of occluders, 1 to [`OcclusionSteps::MOST_OCCLUDERS`].
    Occluders(usize),
}

/// An occluder of the steps.
#[derive(Clone, Debug, PartialEq)]
pub struct StepOccluder {
    /// Its name and its score.
    pub text: String,
    /// Whether the step's tree contains a plane or the shadow of the occluder.
    pub is_taken: bool,
    /// The middle of its corners, world space.
    pub middle: Vec3,
}

/// Numbers of polygons in one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepCounts {
    /// Polygons whose boxes intersect the view.
    pub in_view: u64,
    /// Polygons in view that the step hides.
    pub hidden: u64,
    /// Hidden polygons that the previous step does not hide.
    pub newly_hidden: u64,
    /// Polygons that the step hides wrongly: the reference picture shows them. `None` without a reference picture.
    pub visible: Option<u64>,
}

/// The occlusion culling of the culling camera's view, step by step.
#[derive(Debug)]
pub struct OcclusionSteps {
    form: ShadowForm,
    occluders: usize,
    planes: usize,
    shown: Option<ViewSteps>,
    /// The view in the last frame.
    seen: Option<View>,
    /// Whether `shown` belongs to an earlier view, model or setting.
    is_stale: bool,
    /// Whether the last frame computed steps that the panel does not show yet.
    is_new: bool,
}

#[derive(Debug)]
struct ViewSteps {
    of: View,
    view: ShadowView,
    steps: ShadowSteps,
    step: ShadowStep,
    /// The polygons that the step hides. The previous step hides the first `hidden_before` of them, too.
    hidden: Vec<PolygonId>,
    hidden_before: usize,
    /// The polygons that the eye sees, in increasing order. `None` in the conservative form, and if too many polygons
    /// are in view.
    visible: Option<Vec<PolygonId>>,
}

impl Default for OcclusionSteps {
    fn default() -> Self {
        Self {
            form: ShadowForm::Conservative,
            occluders: INITIAL_OCCLUDERS,
            planes: 0,
            shown: None,
            seen: None,
            is_stale: true,
            is_new: false,
        }
    }
}

impl OcclusionSteps {
    /// Largest number of occluders; more occluders would cover each other in the picture.
    pub const MOST_OCCLUDERS: usize = 64;

    /// The form of the tree.
    pub fn form(&self) -> ShadowForm {
        self.form
    }

    /// Largest number of occluders.
    pub fn most_occluders(&self) -> usize {
        self.occluders
    }

    /// The number of planes of the step.
    pub fn planes(&self) -> usize {
        self.planes
    }

    /// The number of planes of the last step.
    pub fn planes_in_all(&self) -> usize {
        self.shown.as_ref().map_or(0, |shown| shown.steps.planes())
    }

    /// Whether the steps belong to an earlier view or model. New steps are computed as soon as view and model stop
    /// changing.
    pub fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// The tree of the step.
    pub fn tree(&self) -> Option<&ShadowStructure> {
        self.shown.as_ref().map(|shown| &shown.step.structure)
    }

    /// Describes the step in one line.
    pub fn line(&self) -> Option<String> {
        self.shown.as_ref().map(|shown| shown.view.line(&shown.step))
    }

    /// Numbers of polygons that the step hides.
    pub fn counts(&self) -> Option<StepCounts> {
        let shown = self.shown.as_ref()?;
        let sees = |visible: &Vec<PolygonId>| {
            shown.hidden.iter().filter(|id| visible.binary_search(id).is_ok()).count()
        };
        Some(StepCounts {
            in_view: shown.view.in_view.len() as u64,
            hidden: shown.hidden.len() as u64,
            newly_hidden: (shown.hidden.len() - shown.hidden_before) as u64,
            visible: shown.visible.as_ref().map(|visible| sees(visible) as u64),
        })
    }

    /// The occluders, best first.
    pub fn occluders(&self) -> Vec<StepOccluder> {
        let Some(shown) = &self.shown else { return Vec::new() };
        let taken = shown.step.taken();
        let eye = shown.view.window.eye_in_world();
        let occluders = shown.view.occluders.iter().enumerate();
        let named = occluders.map(|(number, volume)| {
            let corners = volume.corners();
            let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
            StepOccluder {
                text: format!("{} {:.1} %", occluder_name(number), 100.0 * shown.view.share(volume)),
                is_taken: taken.binary_search(&number).is_ok(),
                middle: (eye + middle).as_vec3(),
            }
        });
        named.collect()
    }

    pub(crate) fn waits(&self) -> bool {
        self.is_stale || self.is_new
    }

    /// Marks the steps as outdated, because the model has changed.
    pub(crate) fn forget(&mut self) {
        self.is_stale = true;
    }

    pub(crate) fn edit(&mut self, edit: StepsEdit, scene: &Scene) {
        match edit {
            StepsEdit::Show(_) => return,
            StepsEdit::By(by) => {
                self.planes = self.planes.saturating_add_signed(isize::try_from(by).unwrap_or(0));
            }
            StepsEdit::To(planes) => self.planes = planes,
            StepsEdit::Form(form) => (self.form, self.is_stale) = (form, true),
            StepsEdit::Occluders(most) => {
                (self.occluders, self.is_stale) = (most.clamp(1, Self::MOST_OCCLUDERS), true);
            }
        }
        self.planes = self.planes.min(self.planes_in_all());
        // Steps of an earlier view are edited, too, because they are shown until new steps are computed.
        if let Some(shown) = &mut self.shown {
            shown.go_to(self.planes, scene);
        }
    }

    /// Computes the steps of a view, if neither the view nor the model has changed since the last frame. `is_resting`:
    /// whether the model is unchanged.
    pub(crate) fn follow(&mut self, scene: &Scene, view: &View, score: Score, is_resting: bool) {
        self.is_new = false;
        self.is_stale |= !is_resting || self.shown.as_ref().is_none_or(|shown| shown.of != *view);
        let rests = is_resting && self.seen.replace(*view) == Some(*view);
        if !self.is_stale || !rests {
            return;
        }
        (self.is_stale, self.is_new) = (false, true);
        let select = SelectConfig { occluders: self.occluders, score, ..SelectConfig::default() };
        self.shown = ShadowView::new(scene, view, select).map(|found| {
            let steps = found.steps(self.form);
            self.planes = self.planes.min(steps.planes());
            ViewSteps::new(*view, found, steps, self.planes, scene)
        });
    }

    /// Draws the step. `bounds` is the box of the model.
    pub(crate) fn draw(&self, scene: &Scene, bounds: &Aabb, out: &mut LineBatch) {
        if let Some(shown) = &self.shown {
            shown.draw(scene, bounds, out);
        }
    }
}

impl ViewSteps {
    fn new(of: View, view: ShadowView, steps: ShadowSteps, planes: usize, scene: &Scene) -> Self {
        let step = view.step(&steps, planes);
        let judges = steps.form == ShadowForm::Paper && view.in_view.len() <= MAX_REFERENCE_POLYGONS;
        let visible = judges.then(|| {
            let sights = view.sights(scene, REFERENCE).into_iter();
            let mut visible: Vec<PolygonId> =
                sights.filter(|(_, sight)| *sight == Sight::Visible).map(|(id, _)| id).collect();
            visible.sort_unstable();
            visible
        });
        let mut shown = Self { of, view, steps, step, hidden: Vec::new(), hidden_before: 0, visible };
        shown.find_hidden(scene);
        shown
    }

    fn go_to(&mut self, planes: usize, scene: &Scene) {
        self.step = self.view.step(&self.steps, planes);
        self.find_hidden(scene);
    }

    fn find_hidden(&mut self, scene: &Scene) {
        let before = self.step.structure.planes.checked_sub(1);
        let before = before.map(|planes| self.view.step(&self.steps, planes));
        let mut newly = Vec::new();
        self.hidden.clear();
        for id in self.view.in_view.iter().copied().filter(|&id| is_there(scene, id)) {
            let bounds = scene.bounds(id);
            if before.as_ref().is_some_and(|before| before.hides(&bounds)) {
                self.hidden.push(id);
            } else if self.step.hides(&bounds) {
                newly.push(id);
            }
        }
        self.hidden_before = self.hidden.len();
        self.hidden.append(&mut newly);
    }

    fn draw(&self, scene: &Scene, bounds: &Aabb, out: &mut LineBatch) {
        let eye = self.view.window.eye_in_world();
        let here = eye.as_vec3();
        // The planes are drawn to just beyond the model.
        let reach_m = f64::from((bounds.center() - here).length() + bounds.extent().length() * 0.5);
        if !reach_m.is_finite() {
            return;
        }
        let far = |direction: &DVec3| (eye + direction.normalize_or_zero() * reach_m).as_vec3();
        let mut latest = None;
        for node in &self.step.structure.nodes {
            match &node.holds {
                ShadowHolds::Plane { number, cut: Some(cut), .. } => {
                    let corners = [here, far(&cut[0]), far(&cut[1])];
                    if number + 1 == self.step.structure.planes {
                        latest = Some(corners);
                    } else {
                        out.line(corners[1], corners[2], PLANE, Depth::Through);
                    }
                }
                ShadowHolds::Leaf { occluders } if !occluders.is_empty() && node.cell.len() >= 3 => {
                    out.face(&node.cell.iter().map(far).collect::<Vec<_>>(), SHADOW_CELL);
                }
                ShadowHolds::Plane { .. } | ShadowHolds::Leaf { .. } => {}
            }
        }
        let (before, newly) = self.hidden.split_at(self.hidden_before);
        for (hidden, color) in [(before, HIDDEN), (newly, NEWLY_HIDDEN)] {
            // Polygons may have been removed since the step was computed.
            let hidden = hidden.iter().copied().filter(|&id| is_there(scene, id));
            draw_outlines(scene, hidden, &Motion::STAY, color, out);
        }
        if let Some(visible) = &self.visible {
            let wrong = self.hidden.iter().copied().filter(|id| visible.binary_search(id).is_ok());
            draw_outlines(scene, wrong.filter(|&id| is_there(scene, id)), &Motion::STAY, VISIBLE, out);
        }
        let taken = self.step.taken();
        for (number, occluder) in self.view.occluders.iter().enumerate() {
            let corners: Vec<Vec3> = occluder.corners().iter().map(|v| (eye + *v).as_vec3()).collect();
            let is_taken = taken.binary_search(&number).is_ok();
            out.outline(&corners, if is_taken { TAKEN } else { NOT_TAKEN }, Depth::Through);
        }
        // The latest plane is drawn last, because a side of an occluder lies in it.
        if let Some(corners) = latest {
            out.face(&corners, LATEST_FACE);
            out.outline(&corners, LATEST, Depth::Through);
        }
    }
}
