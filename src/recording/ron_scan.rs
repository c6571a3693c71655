//! A short way through the lines that make up nearly all of a recording: head poses and control points, written as
//! this crate writes them.
//!
//! A general RON parser copies every number and looks up every field name; here the fields stand in their usual
//! order. What looks unusual in any way (other order, other spacing, a comment, a number in a rare notation) is not
//! judged but left to the parser, so that both ways accept the same lines with the same bits.

use glam::{Quat, Vec3};

use super::{Author, Event, StrokeId};

/// The event of a line in the usual form; `None` leaves the line to the general parser.
pub(super) fn scan(line: &str) -> Option<Event> {
    let mut scan = Scan { rest: line };
    let event = if scan.literal("Point(").is_some() {
        scan.point()?
    } else {
        scan.literal("Head(")?;
        scan.head()?
    };
    scan.rest.is_empty().then_some(event)
}

struct Scan<'a> {
    rest: &'a str,
}

impl<'a> Scan<'a> {
    fn literal(&mut self, text: &str) -> Option<()> {
        self.rest = self.rest.strip_prefix(text)?;
        Some(())
    }

    /// A separator and at most one space after it.
    fn separator(&mut self, text: &str) -> Option<()> {
        self.literal(text)?;
        self.rest = self.rest.strip_prefix(' ').unwrap_or(self.rest);
        Some(())
    }

    fn field(&mut self, name: &str) -> Option<()> {
        self.literal(name)?;
        self.separator(":")
    }

    /// `-?digits(.digits)?(e-?digits)?`; what follows it is the caller's to check.
    fn number(&mut self) -> Option<&'a str> {
        fn digits(bytes: &[u8], mut at: usize) -> Option<usize> {
            let first = at;
            while bytes.get(at).is_some_and(u8::is_ascii_digit) {
                at += 1;
            }
            (at > first).then_some(at)
        }
        let bytes = self.rest.as_bytes();
        let mut at = digits(bytes, usize::from(bytes.first() == Some(&b'-')))?;
        if bytes.get(at) == Some(&b'.') {
            at = digits(bytes, at + 1)?;
        }
        if bytes.get(at) == Some(&b'e') {
            at = digits(bytes, at + 1 + usize::from(bytes.get(at + 1) == Some(&b'-')))?;
        }
        let (number, rest) = self.rest.split_at(at);
        self.rest = rest;
        Some(number)
    }

    fn float(&mut self) -> Option<f32> {
        self.number()?.parse().ok()
    }

    fn time(&mut self) -> Option<f64> {
        self.field("t")?;
        self.number()?.parse().ok()
    }

    fn stroke(&mut self) -> Option<StrokeId> {
        self.field("stroke")?;
        self.whole().map(StrokeId)
    }

    fn whole(&mut self) -> Option<u32> {
        let number = self.number()?;
        // A leading zero may start a notation of RON's own.
        if number.len() > 1 && number.starts_with('0') {
            return None;
        }
        number.parse().ok()
    }

    fn floats<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            self.separator(if i == 0 { "(" } else { "," })?;
            *value = self.float()?;
        }
        self.literal(")")?;
        Some(values)
    }

    fn position(&mut self) -> Option<Vec3> {
        self.field("p")?;
        self.floats().map(Vec3::from_array)
    }

    fn rotation(&mut self) -> Option<Quat> {
        self.field("q")?;
        self.floats().map(Quat::from_array)
    }

    fn head(&mut self) -> Option<Event> {
        let t = self.time()?;
        self.separator(",")?;
        let mut author = Author::SOLE;
        if self.rest.starts_with('a') {
            self.field("author")?;
            author = Author(self.whole()?);
            self.separator(",")?;
        }
        let p = self.position()?;
        self.separator(",")?;
        let q = self.rotation()?;
        self.literal(")")?;
        Some(Event::Head { t, author, p, q })
    }

    fn point(&mut self) -> Option<Event> {
        let t = self.time()?;
        self.separator(",")?;
        let stroke = self.stroke()?;
        self.separator(",")?;
        let p = self.position()?;
        let (mut q, mut pressure) = (Quat::IDENTITY, 1.0);
        let mut more = self.separator(",").is_some();
        if more && self.rest.starts_with('q') {
            q = self.rotation()?;
            more = self.separator(",").is_some();
        }
        if more {
            self.field("pressure")?;
            pressure = self.float()?;
        }
        self.literal(")")?;
        Some(Event::Point { t, stroke, p, q, pressure })
    }
}
