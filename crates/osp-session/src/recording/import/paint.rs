//! The colour of each polygon of a model: material, texture and corner colours. A polygon has one colour, so a polygon
//! of several colours is split.

use glam::{Vec2, Vec3, Vec4};

use super::texture::{Texture, Wrap, srgb_from_linear};
use crate::recording::{Author, Event, Limits, Shading, StrokeId};

/// Most polygons that splitting adds to a model. 70,000 triangles of a helmet with a texture of 2048 x 2048 use them
/// all.
const MOST_PIECES: u64 = 1 << 18;
/// Most times that a triangle is divided by four.
const MOST_SPLITS: u32 = 6;
/// A colour fits a polygon if its quarters differ from it by at most this, of 255, in each channel.
const FITS: i32 = 20;
/// Steps of an opacity that differs within a surface. Each becomes a stroke, because a stroke has one opacity.
const OPACITIES: f32 = 15.0;
/// Cosine of the angle between a normal and the polygon's own up to which the polygon is flat: 1.8 degrees.
const FLAT: f32 = 0.9995;
/// Share of a polygon with a masked texture below which it is dropped, and above which it is opaque. In between, the
/// share is its opacity.
const MASKED: [f32; 2] = [0.1, 0.9];

/// A corner of a polygon.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corner {
    pub(super) p: Vec3,
    /// Any length; 0 without a normal.
    pub(super) normal: Vec3,
    pub(super) uv: Vec2,
    /// Linear red, green, blue, and opacity.
    pub(super) color: Vec4,
}

impl Corner {
    /// Checks that corners form a polygon as in [`Event::check`].
    ///
    /// # Errors
    /// What was expected of the corners.
    pub(super) fn check(corners: &[Self]) -> Result<(), &'static str> {
        let vertices = corners.iter().map(|corner| corner.p).collect();
        let color = (0.0, 0.0, 0.0, 0.0);
        let of =
            Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color };
        of.check()
    }

    fn between(a: &Self, b: &Self) -> Self {
        let normal = a.normal + b.normal;
        Self { p: (a.p + b.p) * 0.5, normal, uv: (a.uv + b.uv) * 0.5, color: (a.color + b.color) * 0.5 }
    }
}

/// What the opacity of a material means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Alpha {
    #[default]
    Opaque,
    /// The surface is where its opacity is at least this; the texture's texels are opaque or transparent already.
    Mask(f32),
    Blend,
}

/// How a surface looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look<'a> {
    /// Factor of the colour: linear red, green, blue, and opacity.
    pub(super) base: Vec4,
    pub(super) texture: Option<&'a Texture>,
    pub(super) wrap: [Wrap; 2],
    pub(super) alpha: Alpha,
    /// Light that is added to the colour, linear, and its texture.
    pub(super) emission: Vec3,
    pub(super) glow: Option<&'a Texture>,
}

impl Look<'_> {
    /// Colour of a triangle: red, green, blue, sRGB, and opacity.
    fn of(&self, corners: &[Corner; 3]) -> [u8; 4] {
        let mut color = self.base * (corners[0].color + corners[1].color + corners[2].color) / 3.0;
        let mean = |texture: Option<&Texture>| {
            texture.map_or(Vec4::ONE, |texture| texture.mean(corners.map(|corner| corner.uv), self.wrap))
        };
        let texture = mean(self.texture);
        color *= texture;
        let light =
            self.emission * if self.emission == Vec3::ZERO { Vec3::ONE } else { mean(self.glow).truncate() };
        let [r, g, b] =
            (color.truncate() + light).to_array().map(|c| (srgb_from_linear(c) * 255.0).round() as u8);
        let alpha = match (self.alpha, self.texture) {
            (Alpha::Opaque, _) => 1.0,
            (Alpha::Blend, None) if corners.iter().all(|of| of.color.w == corners[0].color.w) => color.w,
            (Alpha::Blend, _) => (color.w * OPACITIES).round() / OPACITIES,
            (Alpha::Mask(cutoff), None) => f32::from(color.w >= cutoff),
            (Alpha::Mask(_), Some(_)) if texture.w < MASKED[0] => 0.0,
            (Alpha::Mask(_), Some(_)) if texture.w > MASKED[1] => 1.0,
            (Alpha::Mask(_), Some(_)) => (texture.w * OPACITIES).round() / OPACITIES,
        };
        [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8]
    }
}

/// A polygon in one colour.
#[derive(Clone, Debug)]
pub(super) struct Painted {
    pub(super) corners: Vec<Vec3>,
    pub(super) shading: Option<Box<Shading>>,
    pub(super) color: [u8; 4],
}

impl Painted {
    fn of(corners: &[Corner], color: [u8; 4]) -> Self {
        let points: Vec<Vec3> = corners.iter().map(|corner| corner.p).collect();
        let [a, b, c] = [points[0], points[1], points[2]];
        let flat = (b - a).cross(c - a).normalize_or_zero();
        let normals = || corners.iter().map(|corner| corner.normal.normalize_or_zero());
        // The side to which normals point does not matter here.
        let is_curved = |normal: Vec3| normal.dot(flat).abs() < FLAT;
        let has_all = normals().all(|normal| normal != Vec3::ZERO);
        let is_smooth = has_all && normals().any(is_curved);
        let shading =
            is_smooth.then(|| Box::new(Shading { normals: normals().collect(), ..Shading::default() }));
        Self { corners: points, shading, color }
    }

    /// A polygon that a brush has painted.
    pub(super) fn by_brush(corners: &[Corner]) -> Self {
        // A texture repeats, and a surface stores small coordinates.
        let first = corners.iter().map(|corner| corner.uv).fold(Vec2::INFINITY, Vec2::min).floor();
        let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
        let color = corners.iter().map(|corner| corner.color).sum::<Vec4>() / corners.len() as f32;
        let mut of = Self::of(corners, [byte(color.x), byte(color.y), byte(color.z), 255]);
        let shading = of.shading.get_or_insert_default();
        shading.uv = corners.iter().map(|corner| corner.uv - first).collect();
        shading.alpha = corners.iter().map(|corner| corner.color.w).collect();
        of
    }

    pub(super) fn event(self, stroke: StrokeId) -> Event {
        let [r, g, b, a] = self.color.map(|byte| f32::from(byte) / 255.0);
        let (vertices, shading) = (self.corners, self.shading);
        Event::Polygon {
            author: Author::SOLE,
            t: 0.0,
            stroke: Some(stroke),
            vertices,
            shading,
            color: (r, g, b, a),
        }
    }
}

/// Divides polygons, and counts what their colours lose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Splitter {
    /// The pieces that polygons have not used so far.
    left: f64,
    /// The pieces that each further polygon adds.
    each: f64,
    /// Number of polygons with the mean of several colours.
    pub(super) mixed: u64,
    /// Number of polygons that a mask hides.
    pub(super) dropped: u64,
}

impl Splitter {
    /// A splitter for a model of about this number of polygons.
    pub(super) fn new(polygons: u64, limits: &Limits) -> Self {
        let room = limits.polygons.saturating_sub(polygons) / 2;
        let each = room.min(MOST_PIECES) as f64 / polygons.max(1) as f64;
        Self { each, ..Self::default() }
    }

    /// Appends a polygon, or its pieces.
    pub(super) fn paint(&mut self, corners: &[Corner], look: &Look<'_>, out: &mut Vec<Painted>) {
        let first = out.len();
        self.left += self.each;
        let is_even = look.texture.is_none()
            && look.glow.is_none()
            && corners.iter().all(|corner| corner.color == corners[0].color);
        let fan = |i: usize| [corners[0], corners[i], corners[i + 1]];
        let whole = |color| Painted::of(corners, color);
        match corners.len() {
            0..3 => {}
            _ if is_even => out.push(whole(look.of(&fan(1)))),
            3 => self.divide(&fan(1), look, 0, out),
            count => {
                let halves: Vec<[u8; 4]> = (1..count - 1).map(|i| look.of(&fan(i))).collect();
                if halves.iter().all(|half| fits(*half, halves[0]))
                    && fit(&quarters(&fan(1)), look, halves[0])
                {
                    out.push(whole(halves[0]));
                } else if count == 4 {
                    (1..3).for_each(|i| self.divide(&fan(i), look, 0, out));
                } else {
                    // The corners may form any outline, so only its colour is computed.
                    self.mixed += 1;
                    let areas = (1..count - 1).map(|i| {
                        let [a, b, c] = fan(i);
                        (b.p - a.p).cross(c.p - a.p).length()
                    });
                    out.push(whole(mean(halves.iter().copied().zip(areas))));
                }
            }
        }
        let before = out.len();
        // A material without a texture may also be hidden.
        if matches!(look.alpha, Alpha::Mask(_)) {
            let mut at = first;
            while at < out.len() {
                if out[at].color[3] == 0 {
                    out.swap_remove(at);
                } else {
                    at += 1;
                }
            }
        }
        self.dropped += (before - out.len()) as u64;
    }

    /// What the polygons lose, in words.
    pub(super) fn lost(&self) -> Vec<String> {
        let mixed =
            (self.mixed > 0).then(|| format!("several colours of one polygon: {} polygons", self.mixed));
        mixed.into_iter().collect()
    }

    fn divide(&mut self, corners: &[Corner; 3], look: &Look<'_>, depth: u32, out: &mut Vec<Painted>) {
        let color = look.of(corners);
        let quarters = quarters(corners);
        if fit(&quarters, look, color) {
            out.push(Painted::of(corners, color));
        } else if depth < MOST_SPLITS && self.left >= 3.0 {
            self.left -= 3.0;
            quarters.iter().for_each(|quarter| self.divide(quarter, look, depth + 1, out));
        } else {
            self.mixed += 1;
            out.push(Painted::of(corners, color));
        }
    }
}

fn quarters(corners: &[Corner; 3]) -> [[Corner; 3]; 4] {
    let [a, b, c] = corners;
    let [ab, bc, ca] = [Corner::between(a, b), Corner::between(b, c), Corner::between(c, a)];
    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
}

fn fit(quarters: &[[Corner; 3]; 4], look: &Look<'_>, color: [u8; 4]) -> bool {
    quarters.iter().all(|quarter| fits(look.of(quarter), color))
}

fn fits(one: [u8; 4], other: [u8; 4]) -> bool {
    // The colour of what cannot be seen does not matter.
    (one[3] == 0 && other[3] == 0)
        || one.iter().zip(other).all(|(a, b)| (i32::from(*a) - i32::from(b)).abs() <= FITS)
}

fn mean(colors: impl Iterator<Item = ([u8; 4], f32)>) -> [u8; 4] {
    let (mut sum, mut weights) = (Vec4::ZERO, f32::MIN_POSITIVE);
    for (color, weight) in colors {
        sum += Vec4::from(color.map(f32::from)) * weight;
        weights += weight;
    }
    (sum / weights).to_array().map(|part| part.round() as u8)
}
