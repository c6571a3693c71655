use std::collections::BTreeMap;

use glam::{Quat, Vec3};

use super::{BrushChoice, Message};
use osp_session::recording::{Author, Event, NormalRule, Paint, StrokeId, Tool};

/// A position, and the rotation from the body's space.
pub type Pose = (Vec3, Quat);

#[derive(Clone, Copy, Debug)]
struct Hand {
    brush: BrushChoice,
    drawing: Option<StrokeId>,
    received_secs: f64,
}

/// Converts a tracker's messages to the events of a session.
#[derive(Clone, Debug)]
pub struct Hands {
    hands: BTreeMap<u8, Hand>,
    first_brush: BrushChoice,
    head: Option<Pose>,
}

impl Hands {
    /// Time without messages after which a drawing hand's stroke ends, seconds, because the hand's last message may
    /// have been lost.
    pub const SILENCE_SECS: f64 = 1.0;

    /// Hands that draw with `first_brush` until a message chooses another brush.
    pub fn new(first_brush: BrushChoice) -> Self {
        Self { hands: BTreeMap::new(), first_brush, head: None }
    }

    /// The last pose of the head.
    pub fn head(&self) -> Option<Pose> {
        self.head
    }

    /// Updates the head's pose without recording it.
    pub fn look(&mut self, message: &Message) {
        if let Message::Head { p, q } = *message {
            self.head = Some((p, q));
        }
    }

    /// Processes a message received at `t` and appends its events. `next_stroke` returns an unused number. For an
    /// erasure, returns the position, because only the caller can find the stroke.
    pub fn take(
        &mut self,
        t: f64,
        message: &Message,
        mut next_stroke: impl FnMut() -> StrokeId,
        out: &mut Vec<Event>,
    ) -> Option<Vec3> {
        let author = Author::SOLE;
        match *message {
            Message::Head { p, q } => {
                self.head = Some((p, q));
                out.push(Event::Head { author, t, p, q });
            }
            Message::Hand { hand, p, q, pressure } => {
                let hand = self.hand(hand);
                hand.received_secs = t;
                if pressure > 0.0 {
                    let stroke = *hand.drawing.get_or_insert_with(|| {
                        let stroke = next_stroke();
                        let BrushChoice { tool, paint, width_m: width, color, normal } = hand.brush;
                        out.push(Event::Begin {
                            author,
                            t,
                            stroke,
                            tool,
                            width,
                            color,
                            normal,
                            thinnest: 0.0,
                            paint: paint.map(|brush| Box::new(Paint::new(&*brush.name, stroke.0))),
                        });
                        stroke
                    });
                    out.push(Event::Point { t, stroke, p, q, pressure });
                } else if let Some(stroke) = hand.drawing.take() {
                    out.push(Event::End { t, stroke });
                }
            }
            Message::Brush { hand, brush } => self.hand(hand).brush = brush,
            Message::Erase { p } => return Some(p),
            Message::Undo => out.push(Event::Undo { author, t }),
            Message::Redo => out.push(Event::Redo { author, t }),
        }
        None
    }

    /// Ends the strokes of hands that have been inactive for too long.
    pub fn rest(&mut self, t: f64, out: &mut Vec<Event>) {
        for hand in self.hands.values_mut() {
            if t - hand.received_secs > Self::SILENCE_SECS
                && let Some(stroke) = hand.drawing.take()
            {
                out.push(Event::End { t, stroke });
            }
        }
    }

    /// Ends all strokes. The next sample of a hand begins a new stroke.
    pub fn stop(&mut self, t: f64, out: &mut Vec<Event>) {
        let strokes = self.hands.values_mut().filter_map(|hand| hand.drawing.take());
        out.extend(strokes.map(|stroke| Event::End { t, stroke }));
    }

    pub fn is_drawing(&self) -> bool {
        self.hands.values().any(|hand| hand.drawing.is_some())
    }

    fn hand(&mut self, number: u8) -> &mut Hand {
        let brush = self.first_brush;
        self.hands.entry(number).or_insert(Hand { brush, drawing: None, received_secs: 0.0 })
    }
}

impl Default for Hands {
    fn default() -> Self {
        Self::new(BrushChoice {
            tool: Tool::Ribbon,
            paint: None,
            width_m: 0.02,
            color: (0.9, 0.9, 0.9, 1.0),
            normal: NormalRule::LocalX,
        })
    }
}
