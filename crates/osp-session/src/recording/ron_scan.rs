//! A fast parser for head poses and control points as this crate writes them: nearly all lines of a recording.
//!
//! A general RON parser copies every number and looks up every field name; this parser expects the fields in their
//! usual order. An unusual line (other order, other spacing, a comment, a number in a rare notation) goes to the
//! general parser. The parsers return the same bits for the same line.

use glam::{Quat, Vec3};

use super::{Author, Event, StrokeId};

/// Parses a line in the usual form. `None` means that the general parser must parse the line.
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

struct Number<'a> {
    text: &'a str,
    digits: usize,
    /// The digits as an integer; invalid beyond [`Number::MOST_DIGITS`] digits.
    mantissa: u64,
    /// Number of digits after the decimal point.
    decimals: usize,
    has_exponent: bool,
}

impl Number<'_> {
    /// An f64 is exact for every integer with up to this number of digits, and for every power of ten up to this
    /// exponent. Their quotient is therefore rounded only once.
    const MOST_DIGITS: usize = 15;
    const POWERS: [f64; 16] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

    /// Parses at least one digit; returns the position after the last digit.
    #[inline]
    fn digits(&mut self, bytes: &[u8], first: usize) -> Option<usize> {
        let mut at = first;
        while let Some(digit) = bytes.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10)
        {
            self.mantissa = self.mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            at += 1;
        }
        self.digits += at - first;
        (at > first).then_some(at)
    }

    /// The same value as that of the standard library's parser; `None` if a single division may round differently.
    fn to_f64(&self) -> Option<f64> {
        if self.has_exponent || self.digits > Self::MOST_DIGITS {
            return None;
        }
        let value = self.mantissa as f64 / Self::POWERS[self.decimals];
        Some(if self.text.starts_with('-') { -value } else { value })
    }

    fn to_f32(&self) -> Option<f32> {
        let value = self.to_f64()?;
        // Halfway between two f32, the f64 no longer decides which f32 is nearer.
        const BELOW_F32: u64 = (1 << 29) - 1;
        let is_halfway = value.to_bits() & BELOW_F32 == 1 << 28;
        let is_usual = value == 0.0 || value.abs() >= f64::from(f32::MIN_POSITIVE);
        (is_usual && !is_halfway).then_some(value as f32)
    }
}

struct Scan<'a> {
    rest: &'a str,
}

impl<'a> Scan<'a> {
    #[inline(always)]
    fn literal(&mut self, text: &str) -> Option<()> {
        self.rest = self.rest.strip_prefix(text)?;
        Some(())
    }

    /// Parses a separator and at most one space after it.
    #[inline(always)]
    fn separator(&mut self, text: &str) -> Option<()> {
        self.literal(text)?;
        self.rest = self.rest.strip_prefix(' ').unwrap_or(self.rest);
        Some(())
    }

    #[inline(always)]
    fn field(&mut self, name: &str) -> Option<()> {
        self.literal(name)?;
        self.separator(":")
    }

    /// Parses `-?digits(.digits)?(e-?digits)?`. The caller checks the text after the number.
    fn number(&mut self) -> Option<Number<'a>> {
        let bytes = self.rest.as_bytes();
        let mut number = Number { text: "", digits: 0, mantissa: 0, decimals: 0, has_exponent: false };
        let mut at = number.digits(bytes, usize::from(bytes.first() == Some(&b'-')))?;
        if bytes.get(at) == Some(&b'.') {
            let first = at + 1;
            at = number.digits(bytes, first)?;
            number.decimals = at - first;
        }
        if bytes.get(at) == Some(&b'e') {
            at = number.digits(bytes, at + 1 + usize::from(bytes.get(at + 1) == Some(&b'-')))?;
            number.has_exponent = true;
        }
        (number.text, self.rest) = self.rest.split_at(at);
        Some(number)
    }

    fn float(&mut self) -> Option<f32> {
        let number = self.number()?;
        number.to_f32().or_else(|| number.text.parse().ok())
    }

    fn time(&mut self) -> Option<f64> {
        self.field("t")?;
        let number = self.number()?;
        number.to_f64().or_else(|| number.text.parse().ok())
    }

    fn stroke(&mut self) -> Option<StrokeId> {
        self.field("stroke")?;
        self.whole().map(StrokeId)
    }

    fn whole(&mut self) -> Option<u32> {
        let number = self.number()?.text;
        // RON has notations that begin with a zero.
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Scan;

    fn same(text: &str) {
        let f32_bits = Scan { rest: text }.float().map(f32::to_bits);
        assert_eq!(f32_bits, text.parse().ok().map(f32::to_bits), "{text}");
        let number = Scan { rest: text }.number().expect("a number");
        if let Some(value) = number.to_f64() {
            assert_eq!(value.to_bits(), text.parse::<f64>().expect("a number").to_bits(), "{text}");
        }
    }

    #[test]
    fn numbers_have_the_bits_that_the_standard_library_reads() {
        // Numbers halfway between two f32, or so near that an f64 cannot distinguish them; the smallest and the longest
        // numbers.
        let halfway = "16777217 16777217.000000000001 16777216.9999999 0.500000029802322 1.00000005960464";
        let others = "0 -0.0 0.1 -123456.789012345 999999999999999 1e-3 0.00000000000001 00012.5";
        halfway.split(' ').chain(others.split(' ')).for_each(same);
        same(&format!("0.{}", "1".repeat(60)));
        same(&"9".repeat(25));
    }

    proptest! {
        #[test]
        fn any_number_has_those_bits(bits: u32, whole in 0u64..1_000_000_000_000_000, decimals in 0usize..16, plain: f32) {
            let value = f32::from_bits(bits);
            if value.is_finite() {
                same(&format!("{value:?}"));
            }
            same(&format!("{plain}"));
            let digits = format!("{whole:016}");
            let (before, after) = digits.split_at(16 - decimals);
            same(&if after.is_empty() { before.to_owned() } else { format!("{before}.{after}") });
        }
    }
}
