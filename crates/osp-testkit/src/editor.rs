//! Random sessions of few strokes with more edits than drawing: erase, move, group, place, undo and redo.

use crate::events::{Begin, SOLE, point};
use glam::{Quat, Vec3};
use osp_session::recording::{Event, GroupId, StrokeId, Tool, Transform};
use rand_pcg::{Pcg64, rand_core::Rng};

/// Number of strokes that are drawn at the start of every session.
pub const STROKES: u32 = 8;
const GROUPS: u32 = 4;

/// Makes random edits of a few strokes. Equal seeds make equal sessions.
#[derive(Debug)]
pub struct Editor {
    random: Pcg64,
    strokes: u32,
}

impl Editor {
    /// Creates an editor of a scene without strokes.
    pub fn new(seed: u64) -> Self {
        Self { random: Pcg64::new(u128::from(seed), 7), strokes: 0 }
    }

    /// Returns a number from 0 to below `count`.
    pub fn below(&mut self, count: u32) -> u32 {
        (self.random.next_u64() % u64::from(count)) as u32
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.below(1 << 16) as f32 / 65536.0)
    }

    fn turn(&mut self) -> Quat {
        let axis = Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(0.1, 1.0));
        let half = self.between(-1.5, 1.5);
        let [x, y, z] = (axis.normalize() * half.sin()).to_array();
        Quat::from_xyzw(x, y, z, half.cos())
    }

    fn way(&mut self) -> Vec3 {
        Vec3::new(self.between(-0.5, 0.5), self.between(-0.5, 0.5), self.between(-0.3, 0.3))
    }

    /// Returns the strokes at the start of the session.
    pub fn start(&mut self) -> Vec<Event> {
        (0..STROKES).flat_map(|_| self.stroke()).collect()
    }

    /// Returns a new stroke, opaque or not, in front of an eye that looks along -z from the origin.
    pub fn stroke(&mut self) -> Vec<Event> {
        let stroke = StrokeId(self.strokes);
        self.strokes += 1;
        let tool = [Tool::Ribbon, Tool::Tube, Tool::Wall][stroke.0 as usize % 3];
        let opacity = if stroke.0 % 5 == 4 { 0.5 } else { 1.0 };
        let color = (self.between(0.1, 1.0), self.between(0.1, 1.0), self.between(0.1, 1.0), opacity);
        let mut events = vec![Begin { tool, width: 0.2, color, ..Begin::of(stroke) }.event()];
        let start = Vec3::new(self.between(-0.7, 0.7), self.between(-0.6, 0.6), self.between(-3.0, -2.0));
        for i in 0..6 {
            let angle = i as f32 * 1.05;
            let p = start + Vec3::new(0.3 * angle.cos(), 0.3 * angle.sin(), 0.02 * i as f32);
            events.push(point(stroke, p));
        }
        events.push(Event::End { t: 0.0, stroke });
        events
    }

    /// Returns an edit of a stroke or group, which need not exist.
    pub fn edit(&mut self) -> Vec<Event> {
        let some = |editor: &mut Self| {
            let count = editor.strokes;
            StrokeId(editor.below(count))
        };
        let (a, b) = (some(self), some(self));
        let group = GroupId(self.below(GROUPS));
        vec![match self.below(18) {
            0..=2 => SOLE.erase(a),
            3..=5 => SOLE.moved([a, b], self.way()),
            6..=7 => {
                let parent = Some(GroupId(self.below(GROUPS + 2))).filter(|parent| parent.0 < GROUPS);
                SOLE.grouped(group, [a], parent)
            }
            8..=9 => {
                let to = Transform { p: self.way() * 0.3, q: self.turn(), s: self.between(0.7, 1.4) };
                SOLE.placed(group, to)
            }
            10..=12 => SOLE.undo(),
            13..=14 => SOLE.redo(),
            15 => return self.stroke(),
            // The erasure hides the move, and an undo may revert only the erasure.
            16 => {
                return vec![SOLE.moved([a], self.way()), SOLE.erase(a)];
            }
            _ => {
                let to = Transform { p: self.way() * 0.3, q: self.turn(), s: self.between(0.7, 1.4) };
                let erased = [a, b].map(|stroke| SOLE.erase(stroke));
                return [SOLE.placed(group, to)].into_iter().chain(erased).collect();
            }
        }]
    }

    /// Returns the events of a frame: mostly a few edits.
    pub fn frame(&mut self) -> Vec<Event> {
        let edits = 1 + self.below(4);
        (0..edits).flat_map(|_| self.edit()).collect()
    }
}
