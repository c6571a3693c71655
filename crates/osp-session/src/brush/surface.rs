use glam::{Vec2, Vec3};

/// Largest absolute texture coordinate that a [`Surface`] stores; larger coordinates are clamped.
pub const UV_LIMIT: f32 = 8.0;

/// Texture coordinates by distance start again at 0 after this value. A polygon that begins below it ends below
/// [`UV_LIMIT`].
pub(crate) const UV_PERIOD: f32 = 7.0;

/// Shading data of the corners of a polygon: normals and texture coordinates of 16 bits a component, alpha of 8 bits.
///
/// A polygon that faces the eye is stored as a square in any plane. The renderer uses only its centre and size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Surface {
    /// Octahedral normals, two signed 16-bit numbers each. If the polygon faces the eye, the first word has the bits of
    /// the roll.
    normals: [u32; 4],
    /// Two signed 16-bit numbers a corner, in units of [`UV_LIMIT`].
    uv: [u32; 4],
    alpha: [u8; 4],
    kind: Kind,
    /// sRGB; `None` for the stroke's colour.
    color: Option<[u8; 3]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The normal is that of the polygon's plane.
    Flat,
    /// Every corner has its own normal.
    Smooth,
    /// The polygon is rotated to face the eye.
    Facing,
}

impl Surface {
    /// A flat, opaque surface without texture coordinates.
    pub const PLAIN: Self =
        Self { normals: [0; 4], uv: [0; 4], alpha: [255; 4], kind: Kind::Flat, color: None };

    pub fn flat(uv: [Vec2; 4], alpha: [f32; 4]) -> Self {
        Self { uv: uv.map(pack_uv), alpha: alpha.map(pack_alpha), ..Self::PLAIN }
    }

    /// A polygon of a curved surface with a normal at each corner. A normal may have any length but 0.
    pub fn smooth(normals: [Vec3; 4], uv: [Vec2; 4], alpha: [f32; 4]) -> Self {
        Self { normals: normals.map(pack_normal), kind: Kind::Smooth, ..Self::flat(uv, alpha) }
    }

    /// A square that faces the eye, rotated by `roll_radians` about the line of sight.
    pub fn facing(roll_radians: f32, uv: [Vec2; 4], alpha: f32) -> Self {
        let normals = [roll_radians.to_bits(), 0, 0, 0];
        Self { normals, kind: Kind::Facing, ..Self::flat(uv, [alpha; 4]) }
    }

    /// The same surface with other normals at its corners.
    #[must_use]
    pub fn turned(self, turn: impl Fn(Vec3) -> Vec3) -> Self {
        let normals = self.normals.map(|normal| pack_normal(turn(unpack_normal(normal))));
        if self.is_smooth() { Self { normals, ..self } } else { self }
    }

    /// The same surface in a colour of its own, sRGB.
    #[must_use]
    pub fn with_color(self, color: [u8; 3]) -> Self {
        Self { color: Some(color), ..self }
    }

    /// The polygon's own colour, sRGB; `None` for the stroke's colour.
    pub fn color(&self) -> Option<[u8; 3]> {
        self.color
    }

    /// The same surface with permuted corners: corner `places[i]` becomes corner `i`.
    #[must_use]
    pub fn with_corners(&self, places: [usize; 4]) -> Self {
        let mut of = *self;
        for (i, &from) in places.iter().enumerate() {
            of.uv[i] = self.uv[from];
            of.alpha[i] = self.alpha[from];
            if self.kind == Kind::Smooth {
                of.normals[i] = self.normals[from];
            }
        }
        of
    }

    pub fn is_facing(&self) -> bool {
        self.kind == Kind::Facing
    }

    pub fn is_smooth(&self) -> bool {
        self.kind == Kind::Smooth
    }

    /// Rotation about the line of sight of a polygon that faces the eye, radians; else 0.
    pub fn roll_radians(&self) -> f32 {
        if self.is_facing() { f32::from_bits(self.normals[0]) } else { 0.0 }
    }

    /// The normal of a corner, of length 1, if the corners have their own normals.
    pub fn normal(&self, corner: usize) -> Option<Vec3> {
        self.is_smooth().then(|| unpack_normal(self.normals[corner]))
    }

    pub fn uv(&self, corner: usize) -> Vec2 {
        let [x, y] = halves(self.uv[corner]);
        Vec2::new(x, y) * UV_LIMIT
    }

    pub fn alpha(&self, corner: usize) -> f32 {
        f32::from(self.alpha[corner]) / 255.0
    }

    /// The packed normals (or the roll) and the packed texture coordinates. A shader unpacks them with
    /// `unpack2x16snorm`.
    pub fn words(&self) -> ([u32; 4], [u32; 4]) {
        (self.normals, self.uv)
    }

    pub fn alpha_bytes(&self) -> [u8; 4] {
        self.alpha
    }
}

fn pack_alpha(alpha: f32) -> u8 {
    (alpha.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn pack_uv(uv: Vec2) -> u32 {
    let part = uv / UV_LIMIT;
    pack(part.x, part.y)
}

fn pack(x: f32, y: f32) -> u32 {
    let word = |v: f32| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    word(x) | word(y) << 16
}

fn halves(word: u32) -> [f32; 2] {
    [word as u16, (word >> 16) as u16].map(|half| (f32::from(half as i16) / 32767.0).max(-1.0))
}

/// Encodes a normal in octahedral form: Cigolle and others, "A Survey of Efficient Representations for Independent Unit
/// Vectors" (2014).
fn pack_normal(normal: Vec3) -> u32 {
    let sum = normal.abs().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return pack(0.0, 0.0);
    }
    let n = normal / sum;
    let fold = |a: f32, b: f32| (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 };
    if n.z >= 0.0 { pack(n.x, n.y) } else { pack(fold(n.x, n.y), fold(n.y, n.x)) }
}

fn unpack_normal(word: u32) -> Vec3 {
    let [x, y] = halves(word);
    let z = 1.0 - x.abs() - y.abs();
    let back = (-z).max(0.0);
    let unfold = |v: f32| if v >= 0.0 { v - back } else { v + back };
    Vec3::new(unfold(x), unfold(y), z).normalize_or(Vec3::Z)
}
