use std::collections::HashMap;

use glam::{Quat, Vec3};

use super::{BrushChoice, Message};
use osp_session::{
    brush,
    recording::{Event, StrokeId},
};

/// Converts the events of a session to messages of a tracker. Each unfinished stroke gets its own hand.
///
/// Events without a corresponding message (groups, moved strokes, finished polygons) are skipped and counted.
#[derive(Clone, Debug, Default)]
pub struct EventEncoder {
    hands: Vec<Option<Drawing>>,
    /// The first point of each stroke. An erase message at this point erases the stroke.
    starts: HashMap<StrokeId, Vec3>,
    /// Number of events without a message.
    pub left_out: u64,
}

#[derive(Clone, Copy, Debug)]
struct Drawing {
    stroke: StrokeId,
    thinnest: f32,
    last: Option<(Vec3, Quat)>,
}

impl EventEncoder {
    /// An encoder before the first event of a session.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends the messages of an event.
    pub fn encode(&mut self, event: &Event, out: &mut Vec<Message>) {
        match *event {
            Event::Head { p, q, .. } => out.push(Message::Head { p, q }),
            Event::Begin { stroke, tool, width, color, normal, thinnest, ref paint, .. } => {
                let Some(hand) = self.free_hand() else {
                    self.left_out += 1;
                    return;
                };
                let paint = paint.as_ref().and_then(|paint| brush::find(&paint.brush));
                // A brush has its own response to pressure.
                let thinnest = if paint.is_some() { 0.0 } else { thinnest };
                self.hands[usize::from(hand)] = Some(Drawing { stroke, thinnest, last: None });
                out.push(Message::Brush {
                    hand,
                    brush: BrushChoice { tool, paint, width_m: width, color, normal },
                });
            }
            Event::Point { stroke, p, q, pressure, .. } => {
                let Some((hand, drawing)) = self.hand_of(stroke) else {
                    self.left_out += 1;
                    return;
                };
                drawing.last = Some((p, q));
                // A tracker's strokes have no minimum width, but a pressure of 0 would end the stroke.
                let pressure = drawing.thinnest + (1.0 - drawing.thinnest) * pressure.clamp(0.0, 1.0);
                out.push(Message::Hand { hand, p, q, pressure: pressure.max(f32::MIN_POSITIVE) });
                self.starts.entry(stroke).or_insert(p);
            }
            Event::End { stroke, .. } => {
                let Some((hand, drawing)) = self.hand_of(stroke) else { return };
                if let Some((p, q)) = drawing.last {
                    out.push(Message::Hand { hand, p, q, pressure: 0.0 });
                }
                self.hands[usize::from(hand)] = None;
            }
            Event::Erase { stroke, .. } => match self.starts.get(&stroke) {
                Some(&p) => out.push(Message::Erase { p }),
                None => self.left_out += 1,
            },
            Event::Undo { .. } => out.push(Message::Undo),
            Event::Redo { .. } => out.push(Message::Redo),
            Event::Join { .. } | Event::Leave { .. } => {}
            Event::Move { .. }
            | Event::Group { .. }
            | Event::Place { .. }
            | Event::Step { .. }
            | Event::Layer { .. }
            | Event::Assign { .. }
            | Event::View { .. }
            | Event::Polygon { .. } => self.left_out += 1,
        }
    }

    fn free_hand(&mut self) -> Option<u8> {
        let at = self.hands.iter().position(Option::is_none).unwrap_or(self.hands.len());
        let hand = u8::try_from(at).ok()?;
        if at == self.hands.len() {
            self.hands.push(None);
        }
        Some(hand)
    }

    fn hand_of(&mut self, stroke: StrokeId) -> Option<(u8, &mut Drawing)> {
        let mut hands = self.hands.iter_mut().enumerate();
        hands.find_map(|(at, hand)| match hand {
            Some(drawing) if drawing.stroke == stroke => Some((u8::try_from(at).ok()?, drawing)),
            _ => None,
        })
    }
}
