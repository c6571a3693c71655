//! The two eyes, and the forms of their pictures.

use serde::{Deserialize, Serialize};

/// Form of the pictures for the two eyes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stereo {
    /// One eye, between the two.
    #[default]
    Mono,
    /// The left eye's picture in the left half of the window, the right eye's in the right half: for passive
    /// projectors with polarisers, or headsets that act as screens.
    SideBySide,
    /// The left eye's picture in the upper half of the window, the right eye's in the lower one.
    TopBottom,
    /// Left in red, right in cyan, for coloured glasses at a desk.
    Anaglyph,
    /// A window for each screen and eye (a projector for each).
    Windows,
}

/// An eye of the tracked head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// The left one.
    Left,
    /// Between the two.
    Middle,
    /// The right one.
    Right,
}

impl Eye {
    /// The other one of two.
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Middle => Self::Middle,
            Self::Right => Self::Left,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left eye",
            Self::Middle => "eye",
            Self::Right => "right eye",
        }
    }
}

impl Stereo {
    /// All ways.
    pub const ALL: &'static [Self] =
        &[Self::Mono, Self::SideBySide, Self::TopBottom, Self::Anaglyph, Self::Windows];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mono => "mono",
            Self::SideBySide => "side-by-side",
            Self::TopBottom => "top-bottom",
            Self::Anaglyph => "anaglyph",
            Self::Windows => "windows",
        }
    }

    /// The eyes that are drawn.
    pub fn eyes(self) -> &'static [Eye] {
        match self {
            Self::Mono => &[Eye::Middle],
            Self::SideBySide | Self::TopBottom | Self::Anaglyph | Self::Windows => &[Eye::Left, Eye::Right],
        }
    }

    /// The part of a screen's picture that an eye's picture has: the left lower and the right upper corner, 0 to 1, y up.
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
