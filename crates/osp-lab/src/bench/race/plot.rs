use glam::{DVec2, DVec3, DVec4, Vec3};

use osp::{
    math::{clip_convex, rotate},
    polygon::{Change, PolygonId},
    view::View,
};
use osp_session::scene::Scene;

/// Number of samples of a pixel along each axis.
const SAMPLES: usize = 2;
/// Brightness of a polygon seen edge-on; a polygon that faces the eye has 1.
const DIMMEST: f64 = 0.6;

/// A picture of a growing model, drawn on the CPU: every polygon in its plain colour, lit from the eye.
#[derive(Clone, Debug)]
pub(super) struct ModelPlot {
    view: View,
    /// Width and height, pixels.
    size: (u32, u32),
    ground: [u8; 3],
    /// The visible polygon at each sample: its distance along the view, metres, and its colour. Rows from the top.
    samples: Vec<(f64, [u8; 3])>,
    /// Whether a polygon in the samples has been removed or changed.
    is_stale: bool,
}

impl ModelPlot {
    /// A picture of an empty model, `size` pixels large, with a background colour (sRGB). The view must have the same
    /// aspect ratio.
    pub(super) fn new(view: View, size: (u32, u32), ground: [u8; 3]) -> Self {
        let samples = vec![(f64::INFINITY, ground); size.0 as usize * size.1 as usize * SAMPLES * SAMPLES];
        Self { view, size, ground, samples, is_stale: false }
    }

    /// Applies the changes of a frame to the picture. O(new polygons and their samples).
    pub(super) fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        for change in changes {
            match *change {
                // A later change of the same frame may have removed the polygon.
                Change::Insert(id) if !self.is_stale && scene.is_visible(id) => self.add(scene, id),
                Change::Insert(_) => {}
                _ => self.is_stale = true,
            }
        }
    }

    /// The picture: red, green and blue bytes, rows from the top. O(pixels), plus O(polygons and their samples) if a
    /// polygon was removed or changed since the last picture.
    pub(super) fn picture(&mut self, scene: &Scene) -> Vec<u8> {
        if self.is_stale {
            self.samples.fill((f64::INFINITY, self.ground));
            scene.visible_ids().for_each(|id| self.add(scene, id));
            self.is_stale = false;
        }
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let mut rgb = Vec::with_capacity(width * height * 3);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let sample = |at: usize| {
                let (row, column) = (y * SAMPLES + at / SAMPLES, x * SAMPLES + at % SAMPLES);
                self.samples[row * width * SAMPLES + column].1
            };
            let sum =
                |channel: usize| (0..SAMPLES * SAMPLES).map(|at| u32::from(sample(at)[channel])).sum::<u32>();
            rgb.extend([0, 1, 2].map(|channel| (sum(channel) / (SAMPLES * SAMPLES) as u32) as u8));
        }
        rgb
    }

    fn add(&mut self, scene: &Scene, id: PolygonId) {
        let up = rotate(self.view.world_from_view, Vec3::Y);
        let polygon = scene.polygon_from(id, self.view.eye_in_world, up);
        let (r, g, b, opacity) = scene.color(id);
        let normal = polygon.area_vector().as_dvec3().normalize_or_zero();
        let towards = (self.view.eye_in_world - polygon.bounds().center()).as_dvec3().normalize_or_zero();
        let light = DIMMEST + (1.0 - DIMMEST) * normal.dot(towards).abs();
        let color = [r, g, b].map(|c| f64::from(c) * light * 255.0);
        let opacity = f64::from(opacity).clamp(0.0, 1.0);
        let to_clip = self.view.clip_from_world().as_dmat4();
        let near = f64::from(self.view.projection.near_m);
        let corners: Vec<DVec4> =
            polygon.vertices().iter().map(|p| to_clip * p.as_dvec3().extend(1.0)).collect();
        let mut seen = Vec::new();
        clip_convex(&corners, |p: DVec4| p.w - near, |p| seen.push(p));
        let (width, height) =
            (f64::from(self.size.0) * SAMPLES as f64, f64::from(self.size.1) * SAMPLES as f64);
        // In samples from the upper left; the third component is the inverse of the distance, which is linear on the
        // screen.
        let on_screen: Vec<DVec3> = seen
            .iter()
            .map(|p| DVec3::new((p.x / p.w + 1.0) * 0.5 * width, (1.0 - p.y / p.w) * 0.5 * height, 1.0 / p.w))
            .collect();
        for triangle in on_screen.windows(2).skip(1) {
            self.fill([on_screen[0], triangle[0], triangle[1]], |below| {
                let blend = |channel: usize| {
                    let under = f64::from(below[channel]);
                    (under + (color[channel] - under) * opacity) as u8
                };
                [0, 1, 2].map(blend)
            });
        }
    }

    /// Paints the samples whose centres lie in a triangle, where it is nearer than everything painted before.
    fn fill(&mut self, [a, b, c]: [DVec3; 3], paint: impl Fn([u8; 3]) -> [u8; 3]) {
        let cross = |p: DVec2, q: DVec2| p.perp_dot(q);
        let area = cross((b - a).truncate(), (c - a).truncate());
        if !(area.abs() > 0.0 && area.is_finite()) {
            return;
        }
        let (width, height) = (self.size.0 as usize * SAMPLES, self.size.1 as usize * SAMPLES);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // The cast saturates for numbers that are too large.
        let rows = low.y.max(0.0) as usize..(high.y.max(0.0) as usize).saturating_add(1).min(height);
        let columns = low.x.max(0.0) as usize..(high.x.max(0.0) as usize).saturating_add(1).min(width);
        for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
            let middle = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let part = |p: DVec3, q: DVec3| cross((q - p).truncate(), middle - p.truncate()) / area;
            let (of_c, of_a, of_b) = (part(a, b), part(b, c), part(c, a));
            if of_a < 0.0 || of_b < 0.0 || of_c < 0.0 {
                continue;
            }
            let distance_m = 1.0 / (of_a * a.z + of_b * b.z + of_c * c.z);
            let sample = &mut self.samples[row * width + column];
            if distance_m < sample.0 {
                *sample = (distance_m, paint(sample.1));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::view::Projection;
    use osp_session::recording::{Author, Event};

    const GROUND: [u8; 3] = [10, 20, 30];
    const SIZE: (u32, u32) = (40, 20);

    fn plot() -> ModelPlot {
        let projection = Projection::symmetric(90.0, 2.0, 0.1, 100.0);
        ModelPlot::new(View::look_at(Vec3::Z, Vec3::ZERO, projection), SIZE, GROUND)
    }

    /// A square perpendicular to the view, half as high as the picture at z = 0.
    fn square(z: f32, color: (f32, f32, f32, f32)) -> Event {
        let corner = |x: f32, y: f32| Vec3::new(0.5 * x, 0.5 * y, z);
        let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color }
    }

    fn pixel(picture: &[u8], x: usize, y: usize) -> [u8; 3] {
        let at = (y * SIZE.0 as usize + x) * 3;
        [picture[at], picture[at + 1], picture[at + 2]]
    }

    #[test]
    fn the_nearest_polygon_is_seen_whatever_the_order() {
        let (red, green) = ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0));
        for events in [[square(0.0, red), square(-1.0, green)], [square(-1.0, green), square(0.0, red)]] {
            let (mut plot, mut scene, mut changes) = (plot(), Scene::new(), Vec::new());
            scene.apply_all(&events, &mut changes);
            plot.follow(&scene, &changes);
            let picture = plot.picture(&scene);
            let middle = pixel(&picture, 20, 10);
            assert!(middle[0] > 240 && middle[1] == 0, "{middle:?}");
            assert_eq!(pixel(&picture, 20, 2), GROUND);
            assert_eq!(pixel(&picture, 12, 10), GROUND);
            // The square extends five pixels from the centre in each direction.
            let red = picture.chunks(3).filter(|pixel| pixel[0] > 200).count();
            assert_eq!(red, 100);
        }
    }

    #[test]
    fn what_is_undone_leaves_the_picture_and_what_reaches_behind_the_eye_is_cut() {
        let (mut plot, mut scene, mut changes) = (plot(), Scene::new(), Vec::new());
        let floor = [(-1.0, 50.0), (1.0, 50.0), (1.0, -50.0), (-1.0, -50.0)];
        let vertices = floor.map(|(x, z)| Vec3::new(50.0 * x, -0.5, z)).to_vec();
        let color = (1.0, 1.0, 1.0, 1.0);
        let floor =
            Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color };
        scene.apply_all(&[floor], &mut changes);
        plot.follow(&scene, &changes);
        let picture = plot.picture(&scene);
        assert_eq!(pixel(&picture, 20, 2), GROUND);
        assert_ne!(pixel(&picture, 1, 19), GROUND);
        changes.clear();
        scene.apply_all(&[Event::Undo { author: Author::SOLE, t: 1.0 }], &mut changes);
        plot.follow(&scene, &changes);
        assert_eq!(plot.picture(&scene), GROUND.repeat(800));
    }

    #[test]
    fn extreme_places_are_no_panic() {
        let (mut plot, mut scene, mut changes) = (plot(), Scene::new(), Vec::new());
        let vertices = vec![Vec3::splat(-3.0e38), Vec3::X * 3.0e38, Vec3::Y * 3.0e38];
        let color = (1.0, 1.0, 1.0, 1.0);
        scene.apply_all(
            &[Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color }],
            &mut changes,
        );
        plot.follow(&scene, &changes);
        assert_eq!(plot.picture(&scene).len(), 2400);
    }
}
