//! The colours of a page in the light and the dark theme. Each chart colour has a name, and a shade for each theme that
//! contrasts with the background and the other colours.

use std::fmt::Write;

use plotters::prelude::RGBColor;

use super::colors::{BLUE, GRAY, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION};

/// A chart colour, its name in a style sheet, and its shades.
struct Shade {
    drawn: RGBColor,
    name: &'static str,
    light: RGBColor,
    dark: RGBColor,
}

const fn shade(drawn: RGBColor, name: &'static str, light: RGBColor, dark: RGBColor) -> Shade {
    Shade { drawn, name, light, dark }
}

/// The background of the charts.
const GROUND: Shade =
    shade(RGBColor(255, 255, 255), "--ground", RGBColor(255, 255, 255), RGBColor(22, 24, 29));

/// Colours of curves. The orange and the sky blue of printed charts are too pale on a white screen.
const LINES: [Shade; 8] = [
    shade(BLUE, "--blue", BLUE, RGBColor(77, 148, 255)),
    shade(ORANGE, "--orange", RGBColor(190, 132, 0), ORANGE),
    shade(GREEN, "--green", GREEN, RGBColor(0, 178, 130)),
    shade(VERMILION, "--vermilion", RGBColor(200, 60, 0), RGBColor(235, 100, 40)),
    shade(PURPLE, "--purple", RGBColor(196, 105, 158), PURPLE),
    shade(SKY, "--sky", RGBColor(50, 152, 215), RGBColor(140, 220, 250)),
    shade(INK, "--ink", INK, RGBColor(235, 235, 235)),
    shade(GRAY, "--gray", RGBColor(118, 118, 118), RGBColor(140, 140, 140)),
];

/// The grid behind the curves.
const MESH: Shade = shade(RGBColor(222, 222, 222), "--mesh", RGBColor(222, 222, 222), RGBColor(58, 62, 70));

fn all() -> impl Iterator<Item = &'static Shade> {
    LINES.iter().chain([&MESH, &GROUND])
}

/// The name of a chart colour in a style sheet.
pub(crate) fn css_name(color: RGBColor) -> Option<&'static str> {
    all().find(|shade| shade.drawn == color).map(|shade| shade.name)
}

/// The CSS declarations of the colours, for the light and for the dark theme.
pub(crate) fn css_variables() -> [String; 2] {
    let theme = |color: fn(&Shade) -> RGBColor| {
        let mut css = String::new();
        for shade in all() {
            let RGBColor(r, g, b) = color(shade);
            // Writing to a string never fails.
            let _ = write!(css, "{}:#{r:02x}{g:02x}{b:02x};", shade.name);
        }
        css
    };
    [theme(|shade| shade.light), theme(|shade| shade.dark)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The contrast ratio of the Web Content Accessibility Guidelines 2.1.
    fn contrast(a: RGBColor, b: RGBColor) -> f64 {
        let luminance = |RGBColor(r, g, b): RGBColor| {
            let linear = |c: u8| match f64::from(c) / 255.0 {
                c if c <= 0.040_45 => c / 12.92,
                c => ((c + 0.055) / 1.055).powf(2.4),
            };
            0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn lines_stand_out_from_the_ground_and_from_each_other_in_both_themes() {
        assert!((contrast(INK, RGBColor(255, 255, 255)) - 21.0).abs() < 1.0e-9);
        for theme in [(|shade| shade.light) as fn(&Shade) -> RGBColor, |shade| shade.dark] {
            for (at, a) in LINES.iter().enumerate() {
                let to_ground = contrast(theme(a), theme(&GROUND));
                assert!(to_ground >= 3.0, "{}: {to_ground}", a.name);
                for b in &LINES[..at] {
                    let ((x, y), square) =
                        ((theme(a), theme(b)), |a: u8, b: u8| (f64::from(a) - f64::from(b)).powi(2));
                    let apart = (square(x.0, y.0) + square(x.1, y.1) + square(x.2, y.2)).sqrt();
                    assert!(apart > 60.0, "{} and {}: {apart}", a.name, b.name);
                }
            }
        }
    }

    #[test]
    fn each_theme_declares_its_colours() {
        let [light, dark] = css_variables();
        assert!(light.contains("--ink:#000000;") && dark.contains("--ink:#ebebeb;"), "{light} {dark}");
        assert_eq!((css_name(INK), css_name(RGBColor(1, 2, 3))), (Some("--ink"), None));
    }
}
