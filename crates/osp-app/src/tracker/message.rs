use glam::{Quat, Vec3};

use osp::math::COORDINATE_LIMIT_M;
use osp_session::{
    brush::{self, Brush},
    recording::{NormalRule, Tool},
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrushChoice {
    pub tool: Tool,
    /// The brush of a ribbon; `None` for a plain ribbon.
    pub paint: Option<&'static Brush>,
    /// Full width, metres.
    pub width_m: f32,
    /// Red, green, blue, opacity, sRGB, 0 to 1.
    pub color: (f32, f32, f32, f32),
    /// Orientation of a ribbon relative to the pose.
    pub normal: NormalRule,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// The pose of the head.
    Head {
        p: Vec3,
        /// Rotation from head space to world space.
        q: Quat,
    },
    /// The pose of a hand; it draws while `pressure` is above 0.
    Hand {
        hand: u8,
        p: Vec3,
        /// Rotation from hand space to world space.
        q: Quat,
        /// Pressure, 0 to 1.
        pressure: f32,
    },
    /// The brush of a hand, from its next stroke on.
    Brush { hand: u8, brush: BrushChoice },
    /// Erase the stroke at a position.
    Erase { p: Vec3 },
    /// Undo the last edit.
    Undo,
    /// Redo the edit that was undone last.
    Redo,
}

impl Message {
    /// The message in another space, into which these functions lead.
    pub(crate) fn transformed(self, point: impl Fn(Vec3) -> Vec3, turn: impl Fn(Quat) -> Quat) -> Self {
        match self {
            Self::Head { p, q } => Self::Head { p: point(p), q: turn(q) },
            Self::Hand { hand, p, q, pressure } => Self::Hand { hand, p: point(p), q: turn(q), pressure },
            Self::Erase { p } => Self::Erase { p: point(p) },
            Self::Brush { .. } | Self::Undo | Self::Redo => self,
        }
    }

    /// The message with normalised quaternions; `None` if a number is invalid in a session.
    fn checked(self) -> Option<Self> {
        let point = |p: Vec3| (p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M).then_some(p);
        // Trackers send rounded quaternions: quaternions with lengths within a tenth of 1 are normalised, other
        // quaternions are not rotations.
        let turn = |q: Quat| ((0.9..=1.1).contains(&q.length())).then(|| q.normalize());
        Some(match self {
            Self::Head { p, q } => Self::Head { p: point(p)?, q: turn(q)? },
            Self::Hand { hand, p, q, pressure } if pressure.is_finite() => {
                Self::Hand { hand, p: point(p)?, q: turn(q)?, pressure: pressure.clamp(0.0, 1.0) }
            }
            Self::Brush { hand, brush } => {
                let (r, g, b, a) = brush.color;
                let is_fine = [r, g, b, a].iter().all(|c| c.is_finite())
                    && (0.0..=COORDINATE_LIMIT_M).contains(&brush.width_m);
                return is_fine.then_some(Self::Brush { hand, brush });
            }
            Self::Erase { p } => Self::Erase { p: point(p)? },
            Self::Undo | Self::Redo => self,
            Self::Hand { .. } => return None,
        })
    }
}

/// The remaining arguments of a message: words of a line, or values of an OSC packet.
pub(super) trait Arguments<'a> {
    fn number(&mut self) -> Option<f32>;
    /// The number of a hand, or 0 at the end of the message.
    fn hand(&mut self) -> Option<u8>;
    fn text(&mut self) -> Option<&'a str>;
    fn are_over(&self) -> bool;

    fn point(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn turn(&mut self) -> Option<Quat> {
        Some(Quat::from_xyzw(self.number()?, self.number()?, self.number()?, self.number()?))
    }
}

/// An argument of a message that is written.
pub(super) enum Argument {
    Number(f32),
    Hand(u8),
    Text(&'static str),
}

impl Message {
    /// The message of this name with these arguments; `None` if it is malformed.
    pub(super) fn read<'a>(
        name: &str,
        arguments: &mut impl Arguments<'a>,
        unknown: &mut dyn FnMut(&str),
    ) -> Option<Self> {
        let message = match name {
            "head" => Self::Head { p: arguments.point()?, q: arguments.turn()? },
            "hand" => {
                let (p, q, pressure) = (arguments.point()?, arguments.turn()?, arguments.number()?);
                Self::Hand { p, q, pressure, hand: arguments.hand()? }
            }
            "brush" => {
                let name = arguments.text().filter(|name| !name.is_empty())?;
                let width_m = arguments.number()?;
                let mut channel = || arguments.number();
                let color = (channel()?, channel()?, channel()?, channel()?);
                let hand = arguments.hand()?;
                let normal = match arguments.are_over() {
                    true => None,
                    false => Some(normal_of(arguments.text()?)?),
                };
                let (tool, paint, usual) = BrushChoice::named(name, unknown);
                let normal = normal.unwrap_or(usual);
                Self::Brush { hand, brush: BrushChoice { tool, paint, width_m, color, normal } }
            }
            "erase" => Self::Erase { p: arguments.point()? },
            "undo" => Self::Undo,
            "redo" => Self::Redo,
            _ => return None,
        };
        message.checked().filter(|_| arguments.are_over())
    }

    /// The name and the arguments of the message, as [`Message::read`] takes them.
    pub(super) fn written(&self) -> (&'static str, Vec<Argument>) {
        let numbers =
            |p: &Vec3, q: &[f32]| p.to_array().iter().chain(q).map(|&n| Argument::Number(n)).collect();
        match self {
            Self::Head { p, q } => ("head", numbers(p, &q.to_array())),
            Self::Hand { hand, p, q, pressure } => {
                let mut arguments: Vec<Argument> = numbers(p, &q.to_array());
                arguments.extend([Argument::Number(*pressure), Argument::Hand(*hand)]);
                ("hand", arguments)
            }
            Self::Brush { hand, brush } => {
                let BrushChoice { width_m, color: (r, g, b, a), normal, .. } = *brush;
                let mut arguments = vec![Argument::Text(brush.name())];
                arguments.extend([width_m, r, g, b, a].map(Argument::Number));
                arguments.extend([Argument::Hand(*hand), Argument::Text(normal_name(normal))]);
                ("brush", arguments)
            }
            Self::Erase { p } => ("erase", numbers(p, &[])),
            Self::Undo => ("undo", Vec::new()),
            Self::Redo => ("redo", Vec::new()),
        }
    }
}

impl BrushChoice {
    /// The tool of this name, or the ribbon with the brush of this name, and its default orientation. An unknown brush
    /// is reported, and drawn as a plain ribbon.
    fn named(name: &str, unknown: &mut dyn FnMut(&str)) -> (Tool, Option<&'static Brush>, NormalRule) {
        if let Some(tool) = tool_of(name) {
            return (tool, None, NormalRule::default());
        }
        let paint = brush::find(name);
        if paint.is_none() {
            unknown(name);
        }
        // Brushes are oriented across the hand's direction of travel.
        (Tool::Ribbon, paint, NormalRule::Travel)
    }

    /// The name of the tool or brush, a single word.
    fn name(&self) -> &'static str {
        match self.paint {
            Some(brush) if brush.name.contains(' ') => &brush.guid,
            Some(brush) => &brush.name,
            None => tool_name(self.tool),
        }
    }
}

fn tool_name(tool: Tool) -> &'static str {
    match tool {
        Tool::Ribbon => "ribbon",
        Tool::Wall => "wall",
        Tool::Tube => "tube",
    }
}

fn tool_of(name: &str) -> Option<Tool> {
    [Tool::Ribbon, Tool::Wall, Tool::Tube].into_iter().find(|&tool| tool_name(tool) == name)
}

fn normal_name(normal: NormalRule) -> &'static str {
    match normal {
        NormalRule::LocalX => "local-x",
        NormalRule::SideX => "side-x",
        NormalRule::Travel => "travel",
        NormalRule::Transport => "transport",
    }
}

fn normal_of(name: &str) -> Option<NormalRule> {
    [NormalRule::LocalX, NormalRule::SideX, NormalRule::Travel, NormalRule::Transport]
        .into_iter()
        .find(|&normal| normal_name(normal) == name)
}
