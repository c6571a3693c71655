use osp_session::scene::Scene;

/// The dark background, linear red, green, blue: a dark blue-grey.
pub(super) const DARK: [f64; 3] = [0.016, 0.019, 0.026];
/// The light background, a light grey, for models that hardly stand out from the dark one.
const LIGHT: [f64; 3] = [0.62, 0.63, 0.65];

/// Smallest contrast at which paint stands out from a background. Contrast is the ratio of relative luminances, each
/// plus 0.05, as in the Web Content Accessibility Guidelines 2.1. The guidelines require 3 for graphics. This limit is
/// lower, because unlit sides of paint are darker than its colour.
const LEAST_CONTRAST: f64 = 2.0;

/// Selects the background for a model: dark, or light if more polygons contrast with the light background. Returns
/// linear red, green, blue. O(polygons).
pub fn background_for(scene: &Scene) -> [f64; 3] {
    let (mut lost_in_dark, mut lost_in_light) = (0u64, 0u64);
    let [dark, light] = [DARK, LIGHT].map(luminance);
    for stroke in scene.strokes().iter().filter(|stroke| stroke.is_visible()) {
        let lost_in = |(r, g, b, _)| {
            let ink = luminance([r, g, b].map(|c: f32| linear_from_srgb(f64::from(c))));
            [dark, light].map(|background| u64::from(contrast(ink, background) < LEAST_CONTRAST))
        };
        // Polygons in a row mostly have the same colour.
        let mut last = (stroke.color(), lost_in(stroke.color()));
        for id in stroke.polygon_ids() {
            let color = scene.color(id);
            if color != last.0 {
                last = (color, lost_in(color));
            }
            lost_in_dark += last.1[0];
            lost_in_light += last.1[1];
        }
    }
    if lost_in_dark > lost_in_light { LIGHT } else { DARK }
}

fn contrast(a: f64, b: f64) -> f64 {
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// A colour channel in sRGB as a linear one, 0 to 1.
pub fn linear_from_srgb(srgb: f64) -> f64 {
    if srgb <= 0.04045 { srgb / 12.92 } else { libm::pow((srgb + 0.055) / 1.055, 2.4) }
}

pub(super) fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene;
    use glam::Vec3;

    fn scene_of(colors: &[(f32, f32, f32, f32)]) -> Scene {
        test_scene::of(colors.iter().map(|&color| (vec![Vec3::ZERO, Vec3::X, Vec3::Y], color)))
    }

    #[test]
    fn dark_ink_gets_a_light_background_and_all_else_the_dark_one() {
        let (black, white, red) = ((0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0), (0.9, 0.2, 0.2, 1.0));
        assert_eq!(background_for(&scene_of(&[])), DARK);
        assert_eq!(background_for(&scene_of(&[white, red])), DARK);
        assert_eq!(background_for(&scene_of(&[black])), LIGHT);
        assert_eq!(background_for(&scene_of(&[black, black, white])), LIGHT);
        assert_eq!(background_for(&scene_of(&[black, white, white])), DARK);
    }
}
