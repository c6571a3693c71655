//! Conversion between a line of a recording and a header or event, and messages about invalid lines.

use std::str::Utf8Error;

use ron::error::{Error as RonError, SpannedError};
use ron::extensions::Extensions;

use super::{Event, FORMAT_VERSION, Header, error::Mismatch, ron_scan};

/// Number of characters of a damaged line in an error message.
const EXCERPT_CHARS: usize = 80;

pub(super) const HEADER_EXPECTED: &str = "the header line `Header(format: 4, …)` of a recording";

pub(super) fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

pub(super) fn is_blank(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with("//")
}

/// The reason why a line is not an event.
#[derive(Debug)]
pub(super) struct BadEvent {
    /// Whether the line is a complete event with an invalid number. Otherwise the end of the file may have cut it.
    pub(super) is_whole: bool,
    pub(super) why: Mismatch,
}

impl BadEvent {
    pub(super) fn not_utf8(line: &[u8], error: Utf8Error) -> Self {
        let column = error.valid_up_to() + 1;
        let found = format!("other bytes in column {column}: {}", excerpt(&String::from_utf8_lossy(line)));
        Self { is_whole: false, why: Mismatch::new("UTF-8 text", found) }
    }
}

pub(super) fn parse_event(line: &str) -> Result<Event, BadEvent> {
    let bad = |is_whole, why| BadEvent { is_whole, why };
    let event = match ron_scan::scan(line) {
        Some(event) => event,
        None => options().from_str(line).map_err(|e| bad(false, explain(line, &e)))?,
    };
    match event.check() {
        Ok(()) => Ok(event),
        Err(expected) => Err(bad(true, Mismatch::new(expected, excerpt(line)))),
    }
}

/// Parses an event from a line that this crate has written or read before.
pub fn read_event(line: &str) -> Option<Event> {
    parse_event(line.trim_end()).ok()
}

/// Parses the header. The format number is parsed first, so that the error for a newer format names the format.
pub(super) fn parse_header(line: &str) -> Result<Header, Mismatch> {
    #[derive(serde::Deserialize)]
    #[serde(rename = "Header")]
    struct Probe {
        format: u32,
    }

    let start = line.trim_start();
    if !(start.starts_with("Header") || start.starts_with('(')) {
        return Err(Mismatch::new(HEADER_EXPECTED, excerpt(line)));
    }
    let probe: Probe = options().from_str(line).map_err(|e| explain(line, &e))?;
    if probe.format == 0 || probe.format > FORMAT_VERSION {
        let expected = format!("a recording of format 1 to {FORMAT_VERSION}");
        let found = if probe.format == 0 { "format 0" } else { "a newer format" };
        return Err(Mismatch::new(expected, format!("{found}: {}", excerpt(line))));
    }
    let header: Header = options().from_str(line).map_err(|e| explain(line, &e))?;
    match header.check() {
        Ok(()) => Ok(header),
        Err(expected) => Err(Mismatch::new(expected, excerpt(line))),
    }
}

pub(super) fn write_header(line: &mut String, header: &Header) -> Result<(), ron::Error> {
    line.push_str("Header");
    options().to_writer(&mut *line, header)?;
    line.push('\n');
    Ok(())
}

pub(super) fn write_event(line: &mut String, event: &Event) -> Result<(), ron::Error> {
    options().to_writer(&mut *line, event)?;
    line.push('\n');
    Ok(())
}

/// Appends the event as a line with its newline. Returns whether RON can represent the event.
pub fn push_event(lines: &mut String, event: &Event) -> bool {
    write_event(lines, event).is_ok()
}

pub(super) fn explain(line: &str, error: &SpannedError) -> Mismatch {
    let place = Place::of(line, error);
    let rest = || match place {
        Place::Start => excerpt(line),
        Place::Column { number, byte } => format!("{} in column {number}", excerpt(&line[byte..])),
        Place::End => format!("the end of the line after {}", tail(line)),
    };
    let within =
        |outer: &Option<String>| outer.as_ref().map_or(String::new(), |outer| format!(" in `{outer}`"));
    match &error.code {
        RonError::NoSuchEnumVariant { expected, found, .. } => {
            Mismatch::new(format!("one of {}", expected.join(", ")), format!("`{}`", shorten(found)))
        }
        RonError::NoSuchStructField { expected, found, outer } => Mismatch::new(
            format!("one of the fields {}{}", expected.join(", "), within(outer)),
            format!("`{}`", shorten(found)),
        ),
        RonError::MissingStructField { field, outer } => {
            Mismatch::new(format!("the field `{field}`{}", within(outer)), excerpt(line))
        }
        RonError::DuplicateStructField { field, outer } => {
            Mismatch::new(format!("the field `{field}`{} once", within(outer)), excerpt(line))
        }
        RonError::InvalidValueForType { expected, .. } => Mismatch::new(expected.clone(), rest()),
        RonError::ExpectedDifferentLength { expected, found } => {
            Mismatch::new(expected.clone(), format!("{found} elements: {}", excerpt(line)))
        }
        RonError::TrailingCharacters => Mismatch::new("the end of the line", rest()),
        RonError::ExpectedComma => Mismatch::new("`,` or a closing bracket", rest()),
        RonError::ExpectedMapColon => Mismatch::new("`:`", rest()),
        RonError::ExpectedFloat => Mismatch::new("a number", rest()),
        RonError::ExpectedInteger => Mismatch::new("a whole number", rest()),
        RonError::Eof => Mismatch::new("a whole value", rest()),
        RonError::ExpectedIdentifier | RonError::SuggestRawIdentifier(_) => match place {
            Place::Start => Mismatch::new(format!("one of {}", event_names().join(", ")), rest()),
            _ => Mismatch::new("a name", rest()),
        },
        RonError::IntegerOutOfBounds => Mismatch::new("a whole number from 0 to 4294967295", rest()),
        RonError::ExceededRecursionLimit => Mismatch::new("fewer nested brackets", rest()),
        other => {
            let text = other.to_string();
            match text.strip_prefix("Expected ") {
                Some(expected) => Mismatch::new(expected, rest()),
                None => Mismatch::new("a value in RON", format!("{} ({text})", rest())),
            }
        }
    }
}

/// Position in a line at which the parser stopped.
#[derive(Clone, Copy)]
enum Place {
    Start,
    Column { number: usize, byte: usize },
    End,
}

impl Place {
    fn of(line: &str, error: &SpannedError) -> Self {
        let length = line.trim_end().chars().count();
        if error.span.end.col > length {
            return Self::End;
        }
        // The parser reports a position before blanks that it would skip, and after a sign.
        let start = error.span.start.col.saturating_sub(1);
        let signed = start > 0 && line.chars().nth(start - 1) == Some('-');
        let mut rest = line.char_indices().enumerate().skip(start - usize::from(signed));
        match rest.find(|(_, (_, c))| !c.is_whitespace()) {
            Some((0, _)) => Self::Start,
            Some((index, (byte, _))) => Self::Column { number: index + 1, byte },
            None => Self::End,
        }
    }
}

fn event_names() -> &'static [&'static str] {
    match options().from_str::<Event>("Unknown") {
        Err(SpannedError { code: RonError::NoSuchEnumVariant { expected, .. }, .. }) => expected,
        _ => &[],
    }
}

/// The beginning of a text in quotes, shortened, on one line.
pub(super) fn excerpt(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() { "nothing".to_owned() } else { format!("`{}`", shorten(text)) }
}

/// The end of a text in quotes, shortened.
fn tail(text: &str) -> String {
    let text = text.trim();
    let skipped = text.chars().count().saturating_sub(EXCERPT_CHARS / 2);
    let end: String = text.chars().skip(skipped).map(printable).collect();
    format!("`{}{end}`", if skipped > 0 { "…" } else { "" })
}

fn shorten(text: &str) -> String {
    let mut chars = text.chars();
    let mut short: String = chars.by_ref().take(EXCERPT_CHARS).map(printable).collect();
    if chars.next().is_some() {
        short.push('…');
    }
    short
}

/// Replaces control characters, so that a damaged file sends none to a terminal.
fn printable(c: char) -> char {
    if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }
}
