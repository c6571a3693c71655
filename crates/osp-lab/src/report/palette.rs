//! Styles of curves in charts. A structure has the same colour and mark in all charts, and no two structures have the
//! same style.
//!
//! Colour-blind people can distinguish the colours, which are from Okabe and Ito, "Color Universal Design", 2008.
//! A page has a shade of each colour for the light and for the dark theme. Because there are more structures than colours, structures of one family share a colour and differ by their mark.

use std::fmt::Write;

use plotters::{
    chart::ChartContext,
    coord::{
        cartesian::Cartesian2d,
        ranged1d::{Ranged, ValueFormatter},
    },
    element::{ComposedElement, DashedPathElement},
    prelude::*,
};

use super::picture::Drawn;
use crate::Method;

/// The colour of `osp`, which no other structure has.
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const VERMILION: RGBColor = RGBColor(213, 94, 0);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);
pub(super) const SKY: RGBColor = RGBColor(86, 180, 233);
pub(super) const INK: RGBColor = RGBColor(0, 0, 0);
pub(super) const GRAY: RGBColor = RGBColor(130, 130, 130);

/// The mark at a few points of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Mark {
    None,
    Disc,
    Square,
    Triangle,
    Ring,
    HollowSquare,
    HollowTriangle,
    HollowDiamond,
}

use Mark::{Disc, Square, Triangle};

/// Structures with their colours and marks. Structures that are often shown together have different colours.
const STRUCTURES: [(&str, RGBColor, Mark); 27] = [
    ("osp", BLUE, Mark::None),
    ("osp-paper", SKY, Mark::None),
    ("bsp", SKY, Disc),
    ("octree-rebuild", VERMILION, Mark::None),
    ("octree-rebuild-insert", GRAY, Disc),
    ("octree-rebuild-thread", GRAY, Triangle),
    ("octree-rebuild-nth", ORANGE, Triangle),
    ("octree-paper", PURPLE, Triangle),
    ("octree-every-child", SKY, Square),
    ("octree-bvh", SKY, Triangle),
    ("loose-octree", VERMILION, Disc),
    ("quadtree", VERMILION, Square),
    ("kd-tree", VERMILION, Triangle),
    ("brute-force", INK, Mark::None),
    ("brute-simd", INK, Disc),
    ("time-order", INK, Square),
    ("bvh-sah", GREEN, Mark::None),
    ("bvh-sah-sweep", GREEN, Disc),
    ("bvh-median", GREEN, Square),
    ("bvh-midpoint", GREEN, Triangle),
    ("bvh-two-level", ORANGE, Mark::None),
    ("lbvh", ORANGE, Disc),
    ("hlbvh", ORANGE, Square),
    ("dynamic-bvh", PURPLE, Mark::None),
    ("rstar", PURPLE, Square),
    ("parry3d", GRAY, Mark::None),
    ("obvhs", GRAY, Square),
];

/// Colours and marks of occlusion culling methods, for charts of one structure with several methods.
const METHOD_COLORS: [RGBColor; 7] = [VERMILION, GREEN, ORANGE, PURPLE, INK, SKY, GRAY];
const METHOD_MARKS: [Mark; 4] = [Mark::Ring, Mark::HollowSquare, Mark::HollowTriangle, Mark::HollowDiamond];

/// Lengths of dash and gap of dashed lines, pixels.
const DASHES: [Option<(u32, u32)>; 3] = [None, Some((9, 5)), Some((2, 4))];

pub(crate) const SAMPLE_PIXELS: i32 = 36;
const MARKS: usize = 8;
/// Largest number of points of a curve that are drawn as dots.
const FEW_POINTS: usize = 12;

type Point = (i32, i32);
type MarkElement<DB> = ComposedElement<Point, DB, Polygon<Point>, PathElement<Point>>;
/// A piece of a line with its mark.
pub(crate) type Sample<DB> =
    ComposedElement<Point, DB, DashedPathElement<std::array::IntoIter<Point, 2>, u32>, MarkElement<DB>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct LineStyle {
    color: RGBColor,
    mark: Mark,
    /// Length of dash and gap, pixels; `None` for a solid line.
    pub(crate) dash: Option<(u32, u32)>,
}

impl LineStyle {
    /// The style of a structure; a structure without an entry gets a style that no other has.
    pub(crate) fn of_structure(name: &str) -> Self {
        match STRUCTURES.iter().find(|(other, ..)| *other == name) {
            Some(&(_, color, mark)) => Self { color, mark, dash: None },
            None => Self { color: GRAY, mark: Mark::None, dash: DASHES[1] },
        }
    }

    /// The style of the curve `name`. If the name is not that of a structure, the style depends on `number`.
    pub(crate) fn of_any(name: &str, number: usize) -> Self {
        if STRUCTURES.iter().any(|(other, ..)| *other == name) {
            return Self::of_structure(name);
        }
        let (color, at) = (METHOD_COLORS[number % METHOD_COLORS.len()], number / METHOD_COLORS.len());
        Self { color, mark: METHOD_MARKS[at % METHOD_MARKS.len()], dash: None }
    }

    /// The style of a structure with an occlusion culling method; `number` is the index of the structure in the chart.
    pub(crate) fn of_method(structure: &str, number: usize, method: &str) -> Self {
        let methods: Vec<_> = Method::all().map(Method::name).collect();
        match methods.iter().position(|other| *other == method) {
            // The method `none` has the style of the structure alone.
            Some(0) | None => Self::of_structure(structure),
            Some(method) => {
                let at = number * (methods.len() - 1) + method - 1;
                let (color, at) = (METHOD_COLORS[at % METHOD_COLORS.len()], at / METHOD_COLORS.len());
                let (mark, at) = (METHOD_MARKS[at % METHOD_MARKS.len()], at / METHOD_MARKS.len());
                Self { color, mark, dash: DASHES[at % DASHES.len()] }
            }
        }
    }

    /// The name of the colour's variable in a page's style sheet.
    pub(crate) fn css_name(self) -> &'static str {
        css_name(self.color).unwrap_or("--ink")
    }

    pub(crate) fn mark_character(self) -> &'static str {
        match self.mark {
            Mark::None => "",
            Disc => "●",
            Square => "■",
            Triangle => "▲",
            Mark::Ring => "○",
            Mark::HollowSquare => "□",
            Mark::HollowTriangle => "△",
            Mark::HollowDiamond => "◇",
        }
    }

    pub(crate) fn faint(self) -> ShapeStyle {
        self.color.mix(0.3).into()
    }

    pub(crate) fn draw<'b, DB, X, Y>(
        self,
        chart: &mut ChartContext<'b, DB, Cartesian2d<X, Y>>,
        points: &[(f64, f64)],
        width: u32,
    ) -> Drawn
    where
        DB: DrawingBackend + 'b,
        DB::ErrorType: 'static,
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let stroke = self.color.stroke_width(width);
        let line = points.iter().copied();
        match self.dash {
            None => chart.draw_series(LineSeries::new(line, stroke))?,
            Some((dash, gap)) => chart.draw_series(DashedLineSeries::new(line, dash, gap, stroke))?,
        };
        let marked: Vec<_> = if points.len() <= FEW_POINTS {
            points.iter().collect()
        } else {
            // Each kind of mark is at different points, because curves may overlap.
            let first = self.mark as usize * points.len() / (MARKS * METHOD_MARKS.len() * 2);
            points.iter().skip(first).step_by(points.len().div_ceil(MARKS)).collect()
        };
        let is_dot = self.mark == Mark::None && points.len() <= FEW_POINTS;
        if self.mark != Mark::None || is_dot {
            let marker = |&point: &(f64, f64)| {
                let (area, outline) = self.marker((0, 0));
                EmptyElement::at(point) + area + outline
            };
            chart.draw_series(marked.into_iter().map(marker))?;
        }
        Ok(())
    }

    /// A piece of the curve for a legend.
    pub(crate) fn sample<DB: DrawingBackend>(self, at: Point, width: u32) -> Sample<DB> {
        // A solid line is drawn as a single dash.
        let (dash, gap) = self.dash.unwrap_or((2 * SAMPLE_PIXELS as u32, 1));
        let ends = [(0, 0), (SAMPLE_PIXELS, 0)];
        let line = DashedPathElement::new(ends, dash, gap, self.color.stroke_width(width));
        // A curve without a mark has no dots in the legend.
        let (area, outline) = match self.mark {
            Mark::None => (Polygon::new([], self.color.filled()), PathElement::new([], self.color)),
            _ => self.marker((SAMPLE_PIXELS / 2, 0)),
        };
        EmptyElement::at(at) + line + area + outline
    }

    /// The mark's area and outline, relative to a point, pixels.
    fn marker(self, (x, y): Point) -> (Polygon<Point>, PathElement<Point>) {
        let corners: &[Point] = match self.mark {
            Mark::None => &[(-2, -2), (2, -2), (2, 2), (-2, 2)],
            Disc | Mark::Ring => &[
                (5, 0),
                (4, 3),
                (3, 4),
                (0, 5),
                (-3, 4),
                (-4, 3),
                (-5, 0),
                (-4, -3),
                (-3, -4),
                (0, -5),
                (3, -4),
                (4, -3),
            ],
            Square | Mark::HollowSquare => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
            Triangle | Mark::HollowTriangle => &[(0, -6), (5, 4), (-5, 4)],
            Mark::HollowDiamond => &[(0, -6), (6, 0), (0, 6), (-6, 0)],
        };
        // A curve without a mark has square dots if it has few points.
        let mut corners: Vec<_> = corners.iter().map(|&(dx, dy)| (x + dx, y + dy)).collect();
        let is_hollow = !matches!(self.mark, Mark::None | Disc | Square | Triangle);
        let inside = if is_hollow { WHITE } else { self.color };
        let area = Polygon::new(corners.clone(), inside.filled());
        corners.push(corners[0]);
        (area, PathElement::new(corners, self.color.stroke_width(2)))
    }
}

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
    use std::collections::HashSet;

    use super::*;
    use crate::Contender;

    #[test]
    fn no_two_structures_are_alike_and_each_is_known() {
        let mut seen = HashSet::new();
        for contender in Contender::all() {
            let name = contender.name();
            assert!(STRUCTURES.iter().any(|(known, ..)| *known == name), "{name} has no colour and mark");
            assert!(seen.insert(LineStyle::of_structure(name)), "{name} looks like another structure");
        }
        let names: HashSet<_> = STRUCTURES.iter().map(|(name, ..)| name).collect();
        let styles: HashSet<_> = STRUCTURES.iter().map(|(name, ..)| LineStyle::of_structure(name)).collect();
        assert_eq!((names.len(), styles.len()), (STRUCTURES.len(), STRUCTURES.len()));
        assert!(!styles.contains(&LineStyle::of_structure("unheard of")));
    }

    #[test]
    fn every_colour_has_a_name_on_a_page() {
        let all = STRUCTURES.iter().map(|(_, color, _)| color).chain(&METHOD_COLORS);
        for color in all {
            assert!(css_name(*color).is_some(), "{color:?}");
        }
    }

    #[test]
    fn methods_are_told_apart_from_each_other_and_from_structures() {
        let methods: Vec<_> = Method::all().map(Method::name).collect();
        let mut seen: HashSet<_> =
            STRUCTURES.iter().map(|(name, ..)| LineStyle::of_structure(name)).collect();
        for number in 0..4 {
            for method in &methods[1..] {
                assert!(seen.insert(LineStyle::of_method("osp", number, method)), "{number} {method}");
            }
            assert_eq!(LineStyle::of_method("osp", number, "none"), LineStyle::of_structure("osp"));
        }
        assert_eq!(methods[0], "none");
    }
}
