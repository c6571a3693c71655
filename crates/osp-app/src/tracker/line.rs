use std::fmt::Write as _;

use glam::{Quat, Vec3};

use super::message::{BrushChoice, Message, TOOLS, normal_name, normal_of};

/// Parses a line. Returns `Ok(None)` if the line has no message (empty, a comment, a key). An unknown brush is treated
/// as a plain ribbon.
///
/// # Errors
/// A text that describes the expected form.
pub fn parse_line(line: &str) -> Result<Option<Message>, &'static str> {
    parse_line_noting(line, &mut |_| {})
}

/// The frame number of a packet: `frame N` in the first line, or in the second line after a key.
pub(super) fn frame_number(packet: &str) -> Option<u32> {
    packet.lines().take(2).find_map(|line| {
        let mut words = line.split_ascii_whitespace();
        match (words.next()?, words.next()?.parse()) {
            ("frame", Ok(number)) => Some(number),
            _ => None,
        }
    })
}

/// Does the same as [`parse_line`], and reports the name of an unknown brush.
pub(super) fn parse_line_noting(
    line: &str,
    unknown: &mut dyn FnMut(&str),
) -> Result<Option<Message>, &'static str> {
    let mut words = Words(line.split_ascii_whitespace());
    let Some(word) = words.0.next().filter(|word| !word.starts_with('#')) else { return Ok(None) };
    let message = match word {
        "head" => Message::Head { p: words.point()?, q: words.turn()? },
        "hand" => {
            let (p, q, pressure) = (words.point()?, words.turn()?, words.number()?);
            Message::Hand { p, q, pressure, hand: words.hand()? }
        }
        "brush" => {
            let name = words.0.next().ok_or(TOOLS)?;
            let width_m = words.number()?;
            let color = (words.number()?, words.number()?, words.number()?, words.number()?);
            let hand = words.hand()?;
            let normal = words.0.next().map(|name| normal_of(name).ok_or(NORMALS)).transpose()?;
            let (tool, paint, usual) = BrushChoice::named(name, unknown);
            let normal = normal.unwrap_or(usual);
            Message::Brush { hand, brush: BrushChoice { tool, paint, width_m, color, normal } }
        }
        "erase" => Message::Erase { p: words.point()? },
        "undo" => Message::Undo,
        "redo" => Message::Redo,
        // The frame number was parsed before.
        "frame" => {
            let number = words.0.next().and_then(|word| word.parse::<u32>().ok());
            number.ok_or("the number of a frame")?;
            return if words.0.next().is_some() { Err("the end of the line") } else { Ok(None) };
        }
        // The key was checked before.
        "key" => {
            words.0.next().ok_or("a key")?;
            return if words.0.next().is_some() { Err("the end of the line") } else { Ok(None) };
        }
        _ => return Err("head, hand, brush, erase, undo, redo, frame or key"),
    };
    if words.0.next().is_some() {
        return Err("the end of the line");
    }
    message.checked().map(Some).ok_or("finite numbers and unit quaternions")
}

const NORMALS: &str = "a normal: local-x, side-x, travel or transport";

struct Words<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Words<'_> {
    fn number(&mut self) -> Result<f32, &'static str> {
        self.0.next().and_then(|word| word.parse().ok()).ok_or("a number")
    }

    fn point(&mut self) -> Result<Vec3, &'static str> {
        Ok(Vec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn turn(&mut self) -> Result<Quat, &'static str> {
        Ok(Quat::from_xyzw(self.number()?, self.number()?, self.number()?, self.number()?))
    }

    fn hand(&mut self) -> Result<u8, &'static str> {
        self.0.next().map_or(Ok(0), |word| word.parse().map_err(|_| "a number of a hand, 0 to 255"))
    }
}

/// Appends a message as a line with its newline. A parser gets exactly the same numbers.
pub fn write_line(message: &Message, out: &mut String) {
    // Writing to a string never fails.
    let _ = match *message {
        Message::Head { p, q } => {
            writeln!(out, "head {} {} {} {} {} {} {}", p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        }
        Message::Hand { hand, p, q, pressure } => {
            writeln!(out, "hand {} {} {} {} {} {} {} {pressure} {hand}", p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        }
        Message::Brush { hand, brush } => {
            let BrushChoice { width_m, color: (r, g, b, a), normal, .. } = brush;
            let (tool, normal) = (brush.name(), normal_name(normal));
            writeln!(out, "brush {tool} {width_m} {r} {g} {b} {a} {hand} {normal}")
        }
        Message::Erase { p } => writeln!(out, "erase {} {} {}", p.x, p.y, p.z),
        Message::Undo => writeln!(out, "undo"),
        Message::Redo => writeln!(out, "redo"),
    };
}
