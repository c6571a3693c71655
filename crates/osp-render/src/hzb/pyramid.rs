/// Largest number of levels: enough for the largest texture of wgpu.
pub(super) const MAX_LEVELS: usize = 16;

/// The sizes of the levels of a depth pyramid, and their offsets in its buffer. Level 1 has half the size of the picture,
/// rounded up; each later level has half the size of the previous level. Level 0 is the picture itself, which is not copied
/// to the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Levels {
    /// For each level: first texel, width, height, 0.
    pub(super) levels: [[u32; 4]; MAX_LEVELS],
    /// Number of levels, including the picture.
    pub(super) count: usize,
    pub(super) texels: u32,
}

impl Levels {
    pub(super) fn of(width: u32, height: u32) -> Self {
        let mut levels = [[0; 4]; MAX_LEVELS];
        levels[0] = [0, width.max(1), height.max(1), 0];
        let (mut size, mut count, mut texels) = ((width.max(1), height.max(1)), 1, 0);
        for level in &mut levels[1..] {
            size = (size.0.div_ceil(2), size.1.div_ceil(2));
            *level = [texels, size.0, size.1, 0];
            texels += size.0 * size.1;
            count += 1;
            if size == (1, 1) {
                break;
            }
        }
        Self { levels, count, texels }
    }

    /// First texel, width, height of each level from 1 on.
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = (u32, u32, u32)> + '_ {
        self.levels[1..self.count].iter().map(|&[first, width, height, _]| (first, width, height))
    }
}

/// A level of a depth pyramid, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct PyramidLevel {
    pub width: u32,
    pub height: u32,
    /// The farthest depth of each texel, row by row from the top. Depth is reversed: 1 is near, 0 is far.
    pub depths: Vec<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_rounding_up_to_a_single_texel() {
        let sizes = |w, h| Levels::of(w, h).iter().map(|(_, w, h)| (w, h)).collect::<Vec<_>>();
        assert_eq!(sizes(1, 1), [(1, 1)]);
        assert_eq!(sizes(5, 1), [(3, 1), (2, 1), (1, 1)]);
        assert_eq!(sizes(3, 17), [(2, 9), (1, 5), (1, 3), (1, 2), (1, 1)]);
        assert_eq!(Levels::of(32_768, 1).count, MAX_LEVELS);
        let levels = Levels::of(641, 359);
        let mut texels = 0;
        for (first, width, height) in levels.iter() {
            assert_eq!(first, texels);
            texels += width * height;
        }
        assert_eq!(levels.texels, texels);
    }
}
