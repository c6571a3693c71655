//! Numbers of authors. The number of a stroke or group contains the number of its author.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Number of an author. Authors are numbered from 1 in the order in which they join. 0 is the only author of a
/// recording without authors, and the author of events before the first join.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Author(pub u32);

impl Author {
    /// The author in a recording without authors.
    pub const SOLE: Self = Self(0);

    /// Largest number of authors of a session, including those who have left. Every author's number is below it.
    pub const MAX: u32 = 1 << (32 - Self::NUMBER_BITS);

    /// Longest name of an author, bytes.
    pub const MAX_NAME_BYTES: usize = 256;

    /// A stroke's or group's number has this number of low bits for its index among the author's strokes or groups. The
    /// high bits are the author's number.
    pub const NUMBER_BITS: u32 = 20;

    pub fn is_sole(&self) -> bool {
        *self == Self::SOLE
    }

    pub fn is_valid(self) -> bool {
        self.0 < Self::MAX
    }

    /// The number of the author's `n`-th stroke or group in a session of several authors; `None` if `n` is too large.
    pub fn number(self, n: u32) -> Option<u32> {
        (n < 1 << Self::NUMBER_BITS && self.is_valid()).then_some(self.0 << Self::NUMBER_BITS | n)
    }

    /// The range of the author's stroke and group numbers, as text.
    pub(super) fn range(self) -> String {
        let first = self.0 << Self::NUMBER_BITS;
        format!("a number from {first} to {}", first | ((1 << Self::NUMBER_BITS) - 1))
    }

    /// Whether a stroke of this number can belong to the author. The sole author can own any number.
    pub fn owns(self, stroke: StrokeId) -> bool {
        self.is_sole() || stroke.author() == self
    }

    fn of_number(number: u32) -> Self {
        Self(number >> Self::NUMBER_BITS)
    }
}

impl fmt::Display for Author {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A stroke's number, unique within a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StrokeId(pub u32);

impl StrokeId {
    /// Author of the stroke, in a session of several authors.
    pub fn author(self) -> Author {
        Author::of_number(self.0)
    }
}

/// A group's number, unique within a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct GroupId(pub u32);

impl GroupId {
    /// Author of the group, in a session of several authors.
    pub fn author(self) -> Author {
        Author::of_number(self.0)
    }
}
