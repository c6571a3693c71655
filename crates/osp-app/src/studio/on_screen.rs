use glam::{Vec2, Vec3};

use osp::view::View;

/// Position of a point on a view's screen, -1 to 1, and its depth, metres; `None` if the view does not show the point.
pub(super) fn on_screen(view: &View, p: Vec3) -> Option<(Vec2, f32)> {
    let distance_m = (p - view.eye_in_world).dot(view.forward_in_world());
    if distance_m.partial_cmp(&view.projection.near_m) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let clip = view.clip_from_world() * p.extend(1.0);
    let at = Vec2::new(clip.x, clip.y) / clip.w;
    (at.abs().max_element() <= 1.0).then_some((at, distance_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::view::Projection;

    #[test]
    fn a_point_is_on_the_screen_where_the_ray_through_it_goes_and_nowhere_behind_the_eye() {
        let projection = Projection::symmetric(60.0, 1.5, 0.01, 100.0);
        let view = View::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-0.5, 0.4, 0.2), projection);
        for at in [Vec2::ZERO, Vec2::new(0.9, -0.3), Vec2::new(-0.5, 0.99)] {
            let ray = view.ray_through(at);
            let (seen, distance_m) = on_screen(&view, ray.origin + ray.direction * 2.5).expect("in view");
            assert!(seen.abs_diff_eq(at, 1.0e-4) && (distance_m - 2.5).abs() < 1.0e-4, "{seen} {at}");
            assert_eq!(on_screen(&view, ray.origin - ray.direction * 2.5), None);
        }
        let aside = view.ray_through(Vec2::new(1.1, 0.0));
        assert_eq!(on_screen(&view, aside.origin + aside.direction * 2.0), None);
        assert_eq!(on_screen(&view, view.eye_in_world), None);
        assert_eq!(on_screen(&view, Vec3::NAN), None);
    }
}
