use super::backdrop::srgb_from_linear;

pub(super) const MAX_STYLES: usize = 8;

/// The appearance of the polygons of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Linear red, green, blue that is mixed into the polygon's own colour.
    pub tint: [f32; 3],
    /// Weight of the tint, from 0 to 1.
    pub amount: f32,
    /// Factor of the opacity. If it is below 1, the polygons are drawn as transparent.
    pub opacity: f32,
    /// Number added to the brightness.
    pub glow: f32,
}

impl Style {
    pub const PLAIN: Self = Self { tint: [0.0; 3], amount: 0.0, opacity: 1.0, glow: 0.0 };

    pub(super) fn words(self) -> [[f32; 4]; 2] {
        let [r, g, b] = self.tint.map(|c| srgb_from_linear(f64::from(c)) as f32);
        [[r, g, b, self.amount], [self.opacity, self.glow, 0.0, 0.0]]
    }
}
