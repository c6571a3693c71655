//! How often the polygons of a block have moved lately.

/// Commits one after the other in which a polygon of a block has moved, after which what moves in the block goes to the flat
/// rows. More: moving things stay in the tree longer, where each step costs more. Fewer: the last pieces of a stroke that is
/// being smoothed go there and come back.
const HOT: u8 = 4;

/// A block stays hot if no more commits than this lie between two of its moves.
const APART: u8 = 2;

/// How often the polygons of a block have moved lately.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    /// The low bits of the last commit's number. A wrong guess costs time only.
    clock: u8,
    commits: u8,
}

impl Heat {
    pub(super) const NONE: Self = Self { clock: 0, commits: 0 };

    /// Notes a move; whether the block is hot.
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
