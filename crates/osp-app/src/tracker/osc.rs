//! OSC packets (Matthew Wright, "The Open Sound Control 1.0 Specification", 2002).
//!
//! No library is used, because nested bundles must not be parsed by unlimited recursion: anybody on the network can
//! send them.

use super::message::{Argument, Arguments, Message};

/// Largest depth of nested bundles.
const MAX_DEPTH: u32 = 4;
/// Beginning of a bundle. A time tag of 8 bytes follows. It is ignored: poses are handled when they are received.
const BUNDLE: &[u8] = b"#bundle\0";
/// Beginning of the address of every message; its name follows.
const PREFIX: &str = "/osp/";
const KEY: &str = "/osp/key";
/// All values are padded to multiples of this number of bytes.
const WORD: usize = 4;

/// Parses a packet. Appends its messages to `out` and returns the number of malformed messages. An unknown brush is
/// treated as a plain ribbon.
pub fn parse_osc(bytes: &[u8], out: &mut Vec<Message>) -> u64 {
    parse_osc_noting(bytes, out, &mut |_| {})
}

/// Does the same as [`parse_osc`], and reports the names of unknown brushes.
pub(super) fn parse_osc_noting(bytes: &[u8], out: &mut Vec<Message>, unknown: &mut dyn FnMut(&str)) -> u64 {
    take_packet(bytes, 0, out, unknown)
}

fn take_packet(bytes: &[u8], depth: u32, out: &mut Vec<Message>, unknown: &mut dyn FnMut(&str)) -> u64 {
    let Some(content) = bytes.strip_prefix(BUNDLE) else {
        let message = read(bytes, unknown);
        out.extend(message.flatten());
        return u64::from(message.is_none());
    };
    let Some((_time_tag, mut rest)) = content.split_at_checked(8).filter(|_| depth < MAX_DEPTH) else {
        return 1;
    };
    let mut malformed = 0;
    while let Some((size, content)) = rest.split_first_chunk::<WORD>() {
        let Some((inner, behind)) = content.split_at_checked(u32::from_be_bytes(*size) as usize) else {
            return malformed + 1;
        };
        malformed += take_packet(inner, depth + 1, out, unknown);
        rest = behind;
    }
    malformed + u64::from(!rest.is_empty())
}

pub(super) fn osc_key(packet: &[u8]) -> Option<&str> {
    let first = match packet.strip_prefix(BUNDLE) {
        None => packet,
        Some(content) => {
            let (size, inside) = content.get(8..)?.split_first_chunk::<WORD>()?;
            inside.get(..u32::from_be_bytes(*size) as usize)?
        }
    };
    let mut bytes = first;
    let is_key = take_text(&mut bytes)? == KEY && take_text(&mut bytes)? == ",s";
    take_text(&mut bytes).filter(|_| is_key && bytes.is_empty())
}

/// Parses a message. A key gives no message, because it was checked before.
fn read(bytes: &[u8], unknown: &mut dyn FnMut(&str)) -> Option<Option<Message>> {
    if osc_key(bytes).is_some() {
        return Some(None);
    }
    let mut bytes = bytes;
    let address = take_text(&mut bytes)?;
    let tags = match bytes {
        // Old senders omit the types if there are no arguments.
        [] => "",
        _ => take_text(&mut bytes)?.strip_prefix(',')?,
    };
    let mut values = Values { tags: tags.as_bytes(), bytes };
    Message::read(address.strip_prefix(PREFIX)?, &mut values, unknown).map(Some)
}

/// Parses text that ends with one to four zero bytes, so that the next value begins at a multiple of four.
fn take_text<'a>(bytes: &mut &'a [u8]) -> Option<&'a str> {
    let length = bytes.iter().position(|&b| b == 0)?;
    let (text, rest) = bytes.split_at_checked((length / WORD + 1) * WORD)?;
    *bytes = rest;
    str::from_utf8(&text[..length]).ok()
}

/// The remaining arguments: their types, and their bytes.
struct Values<'a> {
    tags: &'a [u8],
    bytes: &'a [u8],
}

impl Values<'_> {
    fn tag(&mut self) -> Option<u8> {
        let (tag, rest) = self.tags.split_first()?;
        self.tags = rest;
        Some(*tag)
    }

    fn take<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        let (bytes, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(*bytes)
    }
}

impl<'a> Arguments<'a> for Values<'a> {
    fn number(&mut self) -> Option<f32> {
        match self.tag()? {
            b'f' => self.take().map(f32::from_be_bytes),
            b'd' => self.take().map(|bytes| f64::from_be_bytes(bytes) as f32),
            b'i' => self.take().map(|bytes| i32::from_be_bytes(bytes) as f32),
            _ => None,
        }
    }

    fn hand(&mut self) -> Option<u8> {
        match self.tag() {
            None => Some(0),
            Some(b'i') => u8::try_from(i32::from_be_bytes(self.take()?)).ok(),
            Some(_) => None,
        }
    }

    fn text(&mut self) -> Option<&'a str> {
        match self.tag()? {
            b's' => take_text(&mut self.bytes),
            _ => None,
        }
    }

    fn are_over(&self) -> bool {
        self.tags.is_empty() && self.bytes.is_empty()
    }
}

pub fn osc_packet(message: &Message) -> Vec<u8> {
    let (name, arguments) = message.written();
    let (mut tags, mut values) = (",".to_owned(), Vec::new());
    for argument in arguments {
        match argument {
            Argument::Number(number) => {
                tags.push('f');
                values.extend(number.to_be_bytes());
            }
            Argument::Hand(hand) => {
                tags.push('i');
                values.extend(i32::from(hand).to_be_bytes());
            }
            Argument::Text(text) => {
                tags.push('s');
                put_text(text, &mut values);
            }
        }
    }
    let mut bytes = Vec::new();
    put_text(&format!("{PREFIX}{name}"), &mut bytes);
    put_text(&tags, &mut bytes);
    bytes.append(&mut values);
    bytes
}

/// A bundle of a key and a packet, for immediate processing.
pub fn osc_keyed(key: &str, packet: &[u8]) -> Vec<u8> {
    let mut said = Vec::new();
    put_text(KEY, &mut said);
    put_text(",s", &mut said);
    put_text(key, &mut said);
    let mut bytes = BUNDLE.to_vec();
    // The time tag for immediate processing.
    bytes.extend(1u64.to_be_bytes());
    for message in [&said[..], packet] {
        bytes.extend((message.len() as u32).to_be_bytes());
        bytes.extend(message);
    }
    bytes
}

fn put_text(text: &str, out: &mut Vec<u8>) {
    out.extend(text.as_bytes());
    out.resize((out.len() / WORD + 1) * WORD, 0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn packets_are_laid_out_as_the_specification_says() {
        let expected = b"/osp/erase\0\0,fff\0\0\0\0\x3f\x80\0\0\xc0\0\0\0\0\0\0\0";
        assert_eq!(osc_packet(&Message::Erase { p: Vec3::new(1.0, -2.0, 0.0) }), expected);
        // Packets of other senders: doubles and integers instead of floats, a bundle, no types.
        let mut bundle = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
        let mixed = b"/osp/erase\0\0,dif\0\0\0\0\x3f\xf0\0\0\0\0\0\0\xff\xff\xff\xfe\0\0\0\0";
        for message in [&mixed[..], b"/osp/undo\0\0\0"] {
            bundle.extend((message.len() as u32).to_be_bytes());
            bundle.extend(message);
        }
        let mut out = Vec::new();
        assert_eq!(parse_osc(&bundle, &mut out), 0);
        assert_eq!(out, [Message::Erase { p: Vec3::new(1.0, -2.0, 0.0) }, Message::Undo]);
    }

    #[test]
    fn a_key_comes_first_and_says_nothing_itself() {
        let keyed = osc_keyed("word", &osc_packet(&Message::Redo));
        assert_eq!(&keyed[..32], b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\0\x18/osp/key\0\0\0\0");
        assert_eq!(osc_key(&keyed), Some("word"));
        let mut out = Vec::new();
        assert_eq!((parse_osc(&keyed, &mut out), &out[..]), (0, &[Message::Redo][..]));
        assert_eq!(osc_key(&osc_packet(&Message::Redo)), None);
        for end in 0..keyed.len() {
            let said = osc_key(&keyed[..end]);
            assert!(said.is_none_or(|said| said == "word"), "cut at {end}: {said:?}");
        }
        // A key may also be sent alone.
        assert_eq!(parse_osc(&keyed[20..44], &mut Vec::new()), 0);
        assert_eq!(parse_osc(b"/osp/key\0\0\0\0,i\0\0\0\0\0\x01", &mut Vec::new()), 1);
    }
}
