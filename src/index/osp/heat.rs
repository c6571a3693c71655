//! Detects blocks whose polygons move in frame after frame.

/// A block is hot if its polygons have moved in this number of consecutive commits. Its moving polygons then go to the
/// flat rows. If the number is larger, moving polygons stay longer in the tree, where each move costs more. If it is
/// smaller, the last pieces of a stroke being smoothed go to the rows and return.
const HOT: u8 = 4;

/// Two moves of a block count as consecutive if their commits are at most this many commits apart. Physics often runs at a
/// third of the frame rate.
const APART: u8 = 8;

/// The commit of a block's last move, and the number of its consecutive commits with moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    /// Low byte of the number of the commit with the last move. A wrapped number may make a block look hot; this only costs
    /// time.
    clock: u8,
    commits: u8,
}

impl Heat {
    pub(super) const NONE: Self = Self { clock: 0, commits: 0 };

    /// Counts a move of the block's polygons; returns whether the block is hot.
    #[inline]
    pub(super) fn note(&mut self, clock: u8) -> bool {
        let apart = clock.wrapping_sub(self.clock);
        if self.commits == 0 || apart > APART {
            self.commits = 1;
        } else if apart > 0 {
            self.commits = (self.commits + 1).min(HOT);
        }
        self.clock = clock;
        self.commits >= HOT
    }
}
