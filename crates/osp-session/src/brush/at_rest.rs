//! Appearance of brushes at time 0 for formats without shaders: the light and colours as a texture, and a colour at
//! each corner.
//!
//! The renderer's shaders also animate the brushes. A test of the program compares both for ribbons. The texture
//! averages effects that it cannot show: colours that change with the view, bloom, and lines whose number depends on
//! the stroke's colour.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{
    Brush, Draw, Effect, Lighting,
    texture::{
        SIDE,
        noise::{mix, step},
        solid::repeats,
    },
};

/// Width and height of the texture of a brush whose light is brighter than white, texels.
const GLARE_SIDE: usize = 16;
/// Brightness of a star in its texture. The corners' alpha supplies the remaining factor of the full brightness, 800.
const STAR: f32 = 8.0;
/// Repetitions of a streamer's texture per unit of `u`: the mean of its five lines.
const STREAMER_PACE: f32 = 0.65;
/// Phase of the wave over the length of a waveform, radians, as in a dark stroke. More waves would need more texels.
const WAVES: f32 = 30.0;
/// Largest factor of a stroke's colour. A larger factor makes the colour white. The renderer shows the colour in the
/// halo, which a file cannot store.
const EXPOSURE: f32 = 40.0;
/// Texels that are darker do not count for the mean brightness of a texture.
const LIT: f32 = 0.02;

/// View direction and light at a polygon.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Cosine of the angle between the normal and the direction to the eye.
    pub view_cosine: f32,
    /// Light on a matte surface: red, green, blue, averaged over all normals. 1 is full light.
    pub light: Vec3,
}

#[derive(Clone, Copy, Debug)]
pub struct BrushAtRest {
    brush: &'static Brush,
    /// Mean brightness of the lit texels for white paint, at least 1.
    brightness: f32,
}

impl BrushAtRest {
    /// Computes the brightness of a brush. O(texels) for additive brushes, else O(1).
    pub fn of(brush: &'static Brush) -> Self {
        let mut at_rest = Self { brush, brightness: 1.0 };
        if brush.draw == Draw::Additive {
            let place = |i: usize| (i as f32 + 0.5) / SIDE as f32;
            let all = (0..SIDE * SIDE).map(|i| at_rest.light(place(i % SIDE), place(i / SIDE)).max_element());
            let (sum, count) =
                all.filter(|lit| *lit > LIT).fold((0.0, 0.0), |(sum, count), lit| (sum + lit, count + 1.0));
            at_rest.brightness = (sum / f32::max(count, 1.0)).max(1.0);
        }
        at_rest
    }

    /// Whether the brush has a texture; otherwise all texels are white and opaque.
    pub fn has_texture(&self) -> bool {
        let is_patterned = matches!(
            self.brush.effect,
            Effect::Rainbow
                | Effect::Waveform
                | Effect::ChromaticWave
                | Effect::NeonPulse
                | Effect::Plasma
                | Effect::Electricity
        );
        self.brush.picture.is_some() || is_patterned
    }

    pub fn side(&self) -> usize {
        if self.is_glaring() { GLARE_SIDE } else { SIDE }
    }

    /// Whether a picture's light is brighter than white.
    fn is_glaring(&self) -> bool {
        self.brush.draw == Draw::Additive && self.brush.picture.is_some() && self.brush.emission_gain > 0.0
    }

    /// Red, green, blue (sRGB) and alpha of a texel. `x` is along the stroke, `y` across, both below
    /// [`side`](Self::side). A viewer multiplies these values by the corners' values, and blends or cuts out by the
    /// alpha. O(1).
    pub fn texel(&self, x: usize, y: usize) -> [f32; 4] {
        let parts = SIDE / self.side();
        let place = |i: usize, part: usize| ((i * parts + part) as f32 + 0.5) / SIDE as f32;
        if !self.is_glaring() {
            return self.texel_at(place(x, 0), place(y, 0));
        }
        // Light is averaged before it is clamped, so a texel with a small bright part is white.
        let all = (0..parts * parts).map(|i| self.light(place(x, i % parts), place(y, i / parts)));
        split(all.sum::<Vec3>() / (parts * parts) as f32)
    }

    fn texel_at(&self, u: f32, v: f32) -> [f32; 4] {
        match (self.brush.draw, self.brush.effect) {
            (Draw::Additive, _) if self.has_texture() => split(self.light(u, v)),
            (_, Effect::Hypercolor) => {
                let [r, _, _, a] = self.picture(u, v);
                let wander = Vec3::new(2.0, 3.3, 4.66) * r - u;
                let [r, g, b] = wander.to_array().map(|phase| (2.0 * (phase.sin() + 1.0)).min(1.0));
                [r, g, b, a]
            }
            _ => self.picture(u, v),
        }
    }

    /// Red, green, blue (sRGB) and alpha of a corner. `color` is the stroke's colour; `own` is the alpha of the corner.
    pub fn paint(&self, color: Vec3, own: f32, uv: Vec2, seen: Seen) -> [f32; 4] {
        if self.brush.effect == Effect::DiamondHull {
            return split(diamond(color, seen));
        }
        if self.brush.draw == Draw::Additive {
            let [r, g, b, alpha] = split(self.tinted(color));
            return [r, g, b, (alpha * self.share(own)).clamp(0.0, 1.0)];
        }
        let matte = match self.brush.lighting {
            Lighting::Specular { f0: (r, g, b), .. } => 1.0 - r.max(g).max(b).clamp(0.0, 1.0),
            Lighting::Unlit | Lighting::Lambert => 1.0,
        };
        let part = match self.brush.effect {
            // The wire between the bulbs is dark.
            Effect::LightWire => 0.2,
            Effect::Petal => mix(0.6, 1.0, uv.x.clamp(0.0, 1.0)),
            // A disco ball reflects in the colour of its paint.
            Effect::Disco => return color.extend(own).to_array(),
            _ => 1.0,
        };
        (color * matte * part).extend(own).to_array()
    }

    /// Converts texture coordinates of the brush to those of the texture of [`texel`](Self::texel).
    pub fn uv(&self, uv: Vec2) -> Vec2 {
        Vec2::new(uv.x * pace(self.brush), uv.y)
    }

    /// The inverse of [`uv`](Self::uv) for a brush.
    pub fn brush_uv(brush: &Brush, uv: Vec2) -> Vec2 {
        Vec2::new(uv.x / pace(brush), uv.y)
    }

    /// Samples the brush's picture. `u` is clamped or repeated, `v` is clamped.
    fn picture(&self, u: f32, v: f32) -> [f32; 4] {
        let u = if repeats(self.brush) { u.rem_euclid(1.0) } else { u.clamp(0.0, 1.0) };
        self.brush.picture.map_or([1.0; 4], |picture| picture.texel(u, v.clamp(0.0, 1.0)))
    }

    fn gain(&self) -> f32 {
        2.0 * (10.0 * self.brush.emission_gain).exp()
    }

    /// Light for white paint whose alpha is 1.
    fn light(&self, u: f32, v: f32) -> Vec3 {
        let brush = self.brush;
        let [r, g, b, a] = self.picture(u, v);
        let texel = Vec3::new(r, g, b);
        match brush.effect {
            Effect::Smoke | Effect::Snow => texel * a,
            Effect::Stars => Vec3::splat(a * STAR),
            Effect::Embers => texel * a * 4.0,
            Effect::Bubbles => texel + a,
            Effect::Dots => 0.4 * texel * (1.0 + 120.0 * a),
            Effect::Fire => {
                let [r, g, b, alpha] = self.picture(u - 0.1 * a, v - 0.1 * a);
                let wisps = Vec3::new(r, g, b).to_array().map(|c| if c < 0.01 { 0.0 } else { c });
                Vec3::from(wisps) * alpha * self.gain()
            }
            Effect::Streamers => self.streamers(u, v),
            Effect::Rainbow => rainbow(v) * (6.0 * brush.emission_gain).exp(),
            Effect::Waveform => {
                let envelope = (PI * u).sin();
                let off = v - 0.5 - 0.45 * (WAVES * u).sin() * envelope;
                Vec3::splat(envelope * line(off, 1.0 / (20.0 + 40.0 * (1.0 - envelope))) * self.gain())
            }
            Effect::ChromaticWave => {
                let off = (v + 4.0 * u).rem_euclid(1.0) - 0.5 + 0.15 * (100.0 * u).sin();
                Vec3::splat(line(off, 0.025) * self.gain())
            }
            // The factor 0.5 is the mean over the side that faces the eye.
            Effect::NeonPulse => {
                Vec3::splat((10.0 * (0.2 - u).max(0.0)).powi(5).min(1.0) * 0.5 * self.gain())
            }
            Effect::Comet => {
                let hot = (1.0 - u) * (r + g + b) / 3.0;
                let head = (1.0 - 5.0 * u).max(0.0);
                Vec3::splat(step(0.3, 1.1, 3.0 * (hot * hot + 0.125) + head))
            }
            Effect::Plasma => Vec3::splat(plasma(u, v)),
            Effect::Electricity => Vec3::splat(self.gain() * if (v - 0.5).abs() < 0.1 { 9.0 } else { 1.0 }),
            Effect::HyperGrid => 2.0 * texel * a,
            _ if brush.emission_gain > 0.0 => texel * a * self.gain(),
            _ if brush.cutoff > 0.0 => texel * if a >= brush.cutoff { 1.0 } else { 0.0 },
            _ => texel * a,
        }
    }

    /// The colour of a texel of mean brightness in a stroke of this colour.
    fn tinted(&self, color: Vec3) -> Vec3 {
        match self.brush.effect {
            Effect::Rainbow | Effect::Dots | Effect::Streamers => color,
            Effect::Embers => (20.0 * color * color).min(Vec3::ONE),
            Effect::Stars => (STAR * color).min(Vec3::ONE),
            _ if self.brush.emission_gain > 0.0 => {
                // Each channel is brightened and clamped, like an overexposed film.
                let own = color.max(Vec3::splat(0.05 * color.length()));
                (own.powf(2.2) * self.brightness.min(EXPOSURE)).min(Vec3::ONE)
            }
            _ => color,
        }
    }

    /// Factor of the light at a corner with the alpha `own`, at most 1. For a particle, `own` is a random number.
    fn share(&self, own: f32) -> f32 {
        match self.brush.effect {
            Effect::Smoke | Effect::Bubbles | Effect::Rainbow | Effect::ChromaticWave => 1.0,
            Effect::NeonPulse | Effect::Electricity | Effect::HyperGrid | Effect::Comet => 1.0,
            Effect::Dots => 1.0,
            Effect::Snow => 4.0 * (1.0 - (2.0 * own.fract() - 1.0).abs()).powi(3),
            Effect::Stars => 800.0 / STAR * (TAU * own).sin().abs().powi(20),
            Effect::Embers => {
                let age = (10.0 * own).fract();
                let flash = 1.0 + 200.0 * (1.0 - age).powi(10) + 50.0 * (10.0 * own).sin().abs().powi(30);
                flash * (1.0 - age) * (1.0 - age) * own
            }
            _ if self.brush.emission_gain > 0.0 && self.brush.effect != Effect::Streamers => {
                own.powf(2.2) * self.brightness
            }
            _ => own,
        }
        .min(1.0)
    }

    /// Five rows of hairlines, each with a random offset along the stroke.
    fn streamers(&self, u: f32, v: f32) -> Vec3 {
        let row = (v * 5.0).floor();
        let random = (182.445_6 * row).sin().abs() * 43_758.547;
        let part = (v * 5.0).fract();
        let [r, g, b, _] = self.picture(u + 200.0 * random.fract(), part);
        let texel = Vec3::new(r, g, b);
        let rim = (part * (1.0 - part)).powi(2);
        // The alpha of the shader's colour is 56 times the rim.
        let factor = rim * (5.0 * self.brush.emission_gain).exp();
        (texel + 55.0 * texel * texel) * factor * 56.0 * factor
    }
}

/// Repetitions of the texture of [`BrushAtRest::texel`] for each of the brush's own.
fn pace(brush: &Brush) -> f32 {
    if brush.effect == Effect::Streamers { STREAMER_PACE } else { 1.0 }
}

/// Splits light into a colour of full brightness, and an alpha that is the brightness. Blended over black, they give
/// the same light. Over other backgrounds they hide as little as possible.
fn split(light: Vec3) -> [f32; 4] {
    let light = light.clamp(Vec3::ZERO, Vec3::ONE);
    let most = light.max_element();
    let [r, g, b] = if most > 0.0 { (light / most).to_array() } else { [0.0; 3] };
    [r, g, b, most]
}

/// Brightness at the distance `off` from a line; it falls to 0 at `half_width`.
fn line(off: f32, half_width: f32) -> f32 {
    (1.0 - off.abs() / half_width).max(0.0)
}

/// Five pulsing lines along a stroke, side by side.
fn rainbow(v: f32) -> Vec3 {
    const COLORS: [Vec3; 5] = [
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.7, 0.3, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::new(0.0, 0.2, 1.0),
        Vec3::new(0.4, 0.0, 1.2),
    ];
    let row = (v * 5.0).floor().clamp(0.0, 4.0);
    let part = (v * 5.0 - row).clamp(0.0, 1.0);
    let profile = (5.0 * part * (1.0 - part)).min(1.0).powi(50);
    COLORS[row as usize] * profile * ((row.sin() + 1.0) * 0.5).powi(5)
}

/// Light of a facet of soap film, and of its matte side.
fn diamond(color: Vec3, seen: Seen) -> Vec3 {
    // The film's thickness varies about this mean, nanometres.
    const THICKNESS: f32 = 345.0;
    const INDEX: f32 = 1.3;
    let view_cosine = seen.view_cosine.clamp(1.0e-3, 1.0);
    let rim = 1.0 - view_cosine;
    let rim = mix(rim * (1.0 - rim.powi(5)), 150.0, (1.0 - 10.0 * view_cosine).clamp(0.0, 1.0));
    let inside = (1.0 - (1.0 - view_cosine * view_cosine) / (INDEX * INDEX)).sqrt();
    let upright = ((view_cosine - INDEX * inside) / (view_cosine + INDEX * inside)).powi(2);
    let level = ((INDEX * view_cosine - inside) / (INDEX * view_cosine + inside)).powi(2);
    let mirrored = [650.0, 510.0, 475.0].map(|wave: f32| {
        let phase = (4.0 * PI * INDEX * THICKNESS * inside / wave).cos();
        let through = |r: f32| (1.0 - r) * (1.0 - r) / (1.0 + r * r - 2.0 * r * phase);
        (1.0 - 0.5 * (through(upright) + through(level))).clamp(0.0, 1.0)
    });
    let mirrored = Vec3::from(mirrored);
    let matte = 0.2 * (1.0 - (color * mirrored).max_element());
    rim * mirrored * (0.5 * color + 0.25) + color * seen.light * matte
}

fn plasma(u: f32, v: f32) -> f32 {
    let scattered = |n: f32| ((n * 12.9898).sin() * 43_758.547).rem_euclid(1.0);
    let noise = |x: f32| mix(scattered(x.floor()), scattered(x.floor() + 1.0), step(0.0, 1.0, x - x.floor()));
    let arc = |n: f32| {
        let at = 0.5 + 0.35 * (noise(u * (6.0 + 3.0 * n) + 17.0 * n) - 0.5);
        0.03 / (0.01 + (v - at).abs())
    };
    let rim = (4.0 * v * (1.0 - v)).clamp(0.0, 1.0);
    (arc(0.0) + arc(1.0) + arc(2.0)) * rim * rim * 0.6
}
