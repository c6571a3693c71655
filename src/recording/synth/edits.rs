//! What artists change afterwards: strokes are undone, brought back, erased, moved.

use glam::DVec3;

use super::artist::{Artist, Stance, position};
use crate::recording::{Event, StrokeId};

/// Strokes back that an artist still changes.
const MEMORY: usize = 64;

#[derive(Debug, Default)]
pub(super) struct Edits {
    /// Strokes that are there, the newest last.
    recent: Vec<StrokeId>,
}

impl Edits {
    pub(super) fn remember(&mut self, stroke: StrokeId) {
        if self.recent.len() == MEMORY {
            self.recent.remove(0);
        }
        self.recent.push(stroke);
    }

    /// After a stroke (or several drawn at once): usually nothing.
    pub(super) fn perhaps(&mut self, artist: &mut Artist, strokes_at_once: usize, stance: Stance) {
        let choice = artist.rng.unit();
        if choice < 0.04 {
            let strokes = strokes_at_once.min(self.recent.len());
            if !self.undo(artist, strokes, stance) {
                self.recent.truncate(self.recent.len() - strokes);
            }
        } else if choice < 0.08 && self.recent.len() > 4 {
            let at = artist.rng.index(self.recent.len());
            let stroke = self.recent[at];
            artist.wait(0.7, stance);
            artist.push(|t| Event::Erase { t, stroke });
            if !artist.rng.chance(0.3) || self.undo(artist, 1, stance) {
                self.recent.remove(at);
            }
        } else if choice < 0.11 && self.recent.len() > 8 {
            let count = 2 + artist.rng.index(5);
            let first = artist.rng.index(self.recent.len() - count);
            let strokes = self.recent[first..first + count].to_vec();
            let by = position(artist.rng.direction() * artist.rng.between(0.005, 0.05) + DVec3::ZERO);
            artist.wait(0.9, stance);
            artist.push(|t| Event::Move { t, strokes, by });
            if artist.rng.chance(0.3) {
                self.undo(artist, 1, stance);
            }
        }
    }

    /// Takes the last edits back, and in half of the cases makes them again. Whether they stand in the end.
    fn undo(&mut self, artist: &mut Artist, edits: usize, stance: Stance) -> bool {
        let again = artist.rng.chance(0.5);
        for _ in 0..edits {
            artist.wait(0.3, stance);
            artist.push(|t| Event::Undo { t });
        }
        if again {
            artist.wait(0.8, stance);
            for _ in 0..edits {
                artist.push(|t| Event::Redo { t });
            }
        }
        again
    }
}
