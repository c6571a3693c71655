use std::{fmt::Write as _, str::SplitAsciiWhitespace};

use super::message::{Argument, Arguments, Message};

/// The error of a line that is no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;

/// Parses a line. Returns `Ok(None)` if the line has no message (empty, a comment, a key). An
/// unknown brush is treated as a plain ribbon.
///
/// # Errors
/// The line is malformed.
pub fn parse_line(line: &str) -> Result<Option<Message>, Malformed> {
    parse_line_noting(line, &mut |_| {})
}

/// Does the same as [`parse_line`], and reports the name of an unknown brush.
pub(super) fn parse_line_noting(
    line: &str,
    unknown: &mut dyn FnMut(&str),
) -> Result<Option<Message>, Malformed> {
    let mut words = Words(line.split_ascii_whitespace());
    let Some(word) = words.text().filter(|word| !word.starts_with('#')) else { return Ok(None) };
    if word != "key" {
        return Message::read(word, &mut words, unknown).map(Some).ok_or(Malformed);
    }
    // Keys were read before.
    if words.text().is_some() && words.are_over() { Ok(None) } else { Err(Malformed) }
}

struct Words<'a>(SplitAsciiWhitespace<'a>);

impl<'a> Arguments<'a> for Words<'a> {
    fn number(&mut self) -> Option<f32> {
        self.text()?.parse().ok()
    }

    fn hand(&mut self) -> Option<u8> {
        self.text().map_or(Some(0), |word| word.parse().ok())
    }

    fn text(&mut self) -> Option<&'a str> {
        self.0.next()
    }

    fn are_over(&self) -> bool {
        self.0.clone().next().is_none()
    }
}

/// Appends a message as a line with its newline. A parser gets exactly the same numbers.
pub fn write_line(message: &Message, out: &mut String) {
    let (name, arguments) = message.written();
    out.push_str(name);
    for argument in arguments {
        // Writing to a string never fails.
        let _ = match argument {
            Argument::Number(number) => write!(out, " {number}"),
            Argument::Hand(hand) => write!(out, " {hand}"),
            Argument::Text(text) => write!(out, " {text}"),
        };
    }
    out.push('\n');
}
