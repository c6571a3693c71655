//! The parts of a view that its occluders hide.

use std::sync::atomic::{AtomicUsize, Ordering};

use bevy_camera::{
    Camera, Projection,
    visibility::{InheritedVisibility, RenderLayers, VisibilityRange},
};
use bevy_ecs::{query::Without, system::Query};
use bevy_transform::components::GlobalTransform;
use osp::{
    glam::{DVec3, Vec3},
    math::{Aabb as WorldBox, Sphere},
    occlusion::{
        OcclusionCuller, ShadowVolume, Verdict,
        msvbsp::{Msvbsp, MsvbspConfig},
    },
    view::{ViewWindow, WINDOW_MARGIN},
};

use crate::{Occluder, OccluderSides};

/// Largest number of polygons whose solid angles are computed for a view: the largest by an approximation. Further
/// polygons hide nothing.
const MOST_MEASURED: usize = 256;

/// Largest number of occluders of a view: the largest of these polygons. Further polygons would hide little more.
const MOST_OCCLUDERS: usize = 64;

/// An occluder that covers less than this fraction of the window hides almost nothing.
const LEAST_FRACTION: f64 = 1.0e-3;

/// Largest deviation of a camera's axes from those of a rotation. A camera that is scaled or sheared has no occluders.
const MOST_SHEAR: f32 = 1.0e-3;

/// The occluders for a view. An occluder with a visibility range may be drawn dithered, so it hides nothing.
pub(crate) type Occluders<'w, 's> = Query<
    'w,
    's,
    (
        &'static Occluder,
        &'static GlobalTransform,
        Option<&'static InheritedVisibility>,
        Option<&'static RenderLayers>,
    ),
    Without<VisibilityRange>,
>;

/// The shadows of a view's occluders. One value serves all views, one after the other, and reuses its memory.
#[derive(Debug, Default)]
pub(crate) struct Shadows {
    /// Created for the first occluder, because it takes some megabytes.
    culler: Option<Msvbsp>,
    polygons: Vec<(f32, [Vec3; 4], usize)>,
    shadows: Vec<ShadowVolume>,
    measured: Vec<(f64, ShadowVolume)>,
    occluded: AtomicUsize,
}

impl Shadows {
    /// Builds the shadows in a view. Returns `false` if there are none.
    pub(crate) fn build(
        &mut self,
        window: &ViewWindow,
        layers: &RenderLayers,
        occluders: &Occluders<'_, '_>,
    ) -> bool {
        self.gather(window, layers, occluders);
        if self.polygons.len() > MOST_MEASURED {
            self.polygons.select_nth_unstable_by(MOST_MEASURED, |a, b| b.0.total_cmp(&a.0));
            self.polygons.truncate(MOST_MEASURED);
        }
        self.shadows.clear();
        for (_, corners, len) in &self.polygons {
            ShadowVolume::push_polygon(&corners[..*len], window, &mut self.shadows);
        }
        let least_sr = LEAST_FRACTION * window.solid_angle_sr();
        let measured = self.shadows.iter().map(|shadow| (shadow.solid_angle_in(window), *shadow));
        self.measured.clear();
        self.measured.extend(measured.filter(|(solid_angle_sr, _)| *solid_angle_sr > least_sr));
        self.measured.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.shadows.clear();
        self.shadows.extend(self.measured.iter().take(MOST_OCCLUDERS).map(|(_, shadow)| *shadow));
        if !self.shadows.is_empty() {
            let culler = self.culler.get_or_insert_with(|| Msvbsp::new(MsvbspConfig::default()));
            culler.build(window, &self.shadows);
        }
        !self.shadows.is_empty()
    }

    /// Collects the polygons that the view draws, each with its approximate solid angle.
    fn gather(&mut self, window: &ViewWindow, layers: &RenderLayers, occluders: &Occluders<'_, '_>) {
        self.polygons.clear();
        for (occluder, transform, inherited, occluder_layers) in occluders {
            let is_drawn = inherited.is_none_or(|inherited| inherited.get())
                && layers.intersects(occluder_layers.unwrap_or_default());
            let world_from_local = transform.affine();
            let is_mirrored = world_from_local.matrix3.determinant() < 0.0;
            let is_one_sided = occluder.sides() == OccluderSides::Front;
            if !is_drawn || is_mirrored && is_one_sided {
                continue;
            }
            for polygon in occluder.polygons() {
                let polygon = polygon.map(|corner| {
                    let corner = bevy_math::Vec3::from(corner.to_array());
                    Vec3::from(world_from_local.transform_point3(corner).to_array())
                });
                let corners = polygon.vertices();
                let to_eye = -window.from_eye(corners[0]);
                let facing = polygon.area_vector().as_dvec3().dot(to_eye);
                if is_one_sided && facing <= 0.0 || !facing.is_finite() {
                    continue;
                }
                let middle = corners.iter().map(|corner| window.from_eye(*corner)).sum::<DVec3>()
                    / corners.len() as f64;
                // Twice the area times the cosine, divided by the square of the distance.
                let size = facing.abs() / middle.length().powi(3);
                let mut four = [corners[0]; 4];
                four[..corners.len()].copy_from_slice(corners);
                self.polygons.push((size as f32, four, corners.len()));
            }
        }
    }

    /// Whether a box is completely hidden.
    #[inline]
    pub(crate) fn hides(&self, bounds: &WorldBox) -> bool {
        self.culler.as_ref().is_some_and(|culler| culler.test_box(bounds).verdict == Verdict::Hidden)
    }

    /// Whether a sphere is completely hidden.
    pub(crate) fn hides_sphere(&self, sphere: &Sphere) -> bool {
        self.culler.as_ref().is_some_and(|culler| culler.test_sphere(sphere).verdict == Verdict::Hidden)
    }

    /// Does the test of [`Shadows::hides`], and counts a hidden entity.
    #[inline]
    pub(crate) fn hide(&self, bounds: &WorldBox) -> bool {
        let is_hidden = self.hides(bounds);
        if is_hidden {
            self.occluded.fetch_add(1, Ordering::Relaxed);
        }
        is_hidden
    }

    /// Returns the number of hidden entities since the last call.
    pub(crate) fn take_occluded(&mut self) -> usize {
        std::mem::take(self.occluded.get_mut())
    }
}

/// Returns the window of a camera. `None` if nothing is hidden from the camera: it is not perspective, is scaled, has
/// an oblique near plane, or has a sub-view.
pub(crate) fn window(
    camera: &Camera,
    projection: &Projection,
    transform: &GlobalTransform,
) -> Option<ViewWindow> {
    let Projection::Perspective(perspective) = projection else { return None };
    let near_plane = perspective.near_clip_plane;
    let is_upright = (near_plane.x, near_plane.y, near_plane.z) == (0.0, 0.0, -1.0);
    if camera.sub_camera_view.is_some() || !is_upright {
        return None;
    }
    let matrix = transform.affine().matrix3;
    let difference = matrix.transpose() * matrix - bevy_math::Mat3A::IDENTITY;
    let shear = difference.to_cols_array().into_iter().fold(0.0, |most: f32, part| most.max(part.abs()));
    if shear.is_nan() || shear > MOST_SHEAR {
        return None;
    }
    let [right, up, back] =
        [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| Vec3::from(axis.to_array()).as_dvec3());
    // The window is wider than the picture, and its near plane is farther away, by more than the rounding errors of the
    // GPU.
    let top = (f64::from(perspective.fov) * 0.5).tan() * (1.0 + WINDOW_MARGIN);
    let side = top * f64::from(perspective.aspect_ratio);
    let corner = |x: f64, y: f64| right * (x * side) + up * (y * top) - back;
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let eye = Vec3::from(transform.translation().to_array()).as_dvec3();
    ViewWindow::new(eye, -back, corners, f64::from(perspective.near) * (1.0 + WINDOW_MARGIN))
}
