//! The two eyes, and the arrangements of their pictures.

use serde::{Deserialize, Serialize};

/// Arrangement of the pictures for the two eyes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stereo {
    /// One picture, for an eye midway between the two eyes.
    #[default]
    Mono,
    /// The left eye's picture in the left half of the window, the right eye's in the right half. For passive projectors
    /// with polarisers, or headsets that act as screens.
    SideBySide,
    /// The left eye's picture in the upper half of the window, the right eye's in the lower half.
    TopBottom,
    /// The left eye's picture in red, the right eye's in cyan, for coloured glasses.
    Anaglyph,
    /// A window for each screen and eye (for example a projector for each).
    Windows,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    Left,
    /// Midway between the two eyes.
    Middle,
    Right,
}

impl Eye {
    /// The other eye. The middle eye returns itself.
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Middle => Self::Middle,
            Self::Right => Self::Left,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left eye",
            Self::Middle => "eye",
            Self::Right => "right eye",
        }
    }
}

impl Stereo {
    pub const ALL: &'static [Self] =
        &[Self::Mono, Self::SideBySide, Self::TopBottom, Self::Anaglyph, Self::Windows];

    /// The arrangement's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mono => "mono",
            Self::SideBySide => "side-by-side",
            Self::TopBottom => "top-bottom",
            Self::Anaglyph => "anaglyph",
            Self::Windows => "windows",
        }
    }

    /// The eyes for which pictures are drawn.
    pub fn eyes(self) -> &'static [Eye] {
        match self {
            Self::Mono => &[Eye::Middle],
            Self::SideBySide | Self::TopBottom | Self::Anaglyph | Self::Windows => &[Eye::Left, Eye::Right],
        }
    }

    /// The part of a screen's picture that shows an eye's picture: the lower left and the upper right corner, 0 to 1, y
    /// up.
    pub fn part_of(self, eye: Eye) -> ([f32; 2], [f32; 2]) {
        match (self, eye) {
            (Self::SideBySide, Eye::Left) => ([0.0, 0.0], [0.5, 1.0]),
            (Self::SideBySide, Eye::Right) => ([0.5, 0.0], [1.0, 1.0]),
            (Self::TopBottom, Eye::Left) => ([0.0, 0.5], [1.0, 1.0]),
            (Self::TopBottom, Eye::Right) => ([0.0, 0.0], [1.0, 0.5]),
            _ => ([0.0, 0.0], [1.0, 1.0]),
        }
    }
}
