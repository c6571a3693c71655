//! Coverage of textures: smaller mip levels keep the solid share of the texture, as in Tilt Brush, where the brushes
//! come from. So thin hairs and small lights stay visible far away.

use super::noise::mix;

/// Alpha above which a texel counts as solid.
const SOLID: f32 = 0.5;
/// Number of bisection steps for the factor.
const STEPS: usize = 10;

/// Solid share of a mip level, 0 to 1, if its alpha is multiplied by `factor`. `alpha` has one value for each of `side`
/// times `side` texels, and is interpolated between them. A level of a single texel gives 0. O(texels).
pub fn coverage(alpha: &[f32], side: usize, factor: f32) -> f32 {
    if side < 2 {
        return 0.0;
    }
    // Number of sample positions between two texels.
    let between = if side >= 32 { 2 } else { 4 };
    let part = |i: usize| (i as f32 + 0.5) / between as f32;
    let mut solid = 0;
    for y in 0..side - 1 {
        for x in 0..side - 1 {
            let of = |x: usize, y: usize| (alpha[y * side + x] * factor).min(1.0);
            let corners = [of(x, y), of(x + 1, y), of(x, y + 1), of(x + 1, y + 1)];
            let is_above = corners.map(|corner| corner > SOLID);
            if is_above == [is_above[0]; 4] {
                solid += if is_above[0] { between * between } else { 0 };
                continue;
            }
            for i in 0..between * between {
                let (s, t) = (part(i % between), part(i / between));
                let at = mix(mix(corners[0], corners[1], s), mix(corners[2], corners[3], s), t);
                solid += usize::from(at > SOLID);
            }
        }
    }
    solid as f32 / ((side - 1) * (side - 1) * between * between) as f32
}

/// Factor, at least 1, for the alpha of a smaller mip level that makes its [`coverage`] equal `wanted`. If no factor
/// gives that coverage exactly, the factor at which the coverage passes it is returned. O(texels).
pub fn coverage_factor(alpha: &[f32], side: usize, wanted: f32) -> f32 {
    let (mut low, mut high, mut least) = (0.0, 1.0, SOLID);
    // A single texel has no sample positions, because these lie between texels.
    if side < 2 {
        return 1.0;
    }
    for _ in 0..STEPS {
        let found = coverage(alpha, side, SOLID / least);
        if found < wanted {
            high = least;
        } else if found > wanted {
            low = least;
        } else {
            break;
        }
        least = 0.5 * (low + high);
    }
    (SOLID / least).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every fourth column of the texture is a hair. In the mip level of half the size, every second column has alpha 0.5.
    #[test]
    fn hairs_that_are_thinner_than_a_texel_stay() {
        let of = |side: usize, column: fn(usize) -> f32| -> Vec<f32> {
            (0..side * side).map(|i| column(i % side)).collect()
        };
        let fine = of(64, |x| if x % 4 == 0 { 1.0 } else { 0.0 });
        let wanted = coverage(&fine, 64, 1.0);
        assert!((wanted - 0.25).abs() < 0.03, "{wanted}");
        let coarse = of(32, |x| if x % 2 == 0 { 0.5 } else { 0.0 });
        assert_eq!(coverage(&coarse, 32, 1.0), 0.0, "what is not kept vanishes");
        let factor = coverage_factor(&coarse, 32, wanted);
        assert!(factor > 1.0 && factor < 4.0, "{factor}");
        assert!(coverage(&coarse, 32, factor) > 0.5 * wanted);
        let solid = of(8, |_| 1.0);
        assert_eq!(coverage_factor(&solid, 8, 1.0), 1.0);
    }
}
