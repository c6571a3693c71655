//! A message in the form in which it is sent: a line with its sender, then events as lines of a recording.

use osp_session::recording::{Event, Message, Sender, push_event, read_event};

/// The first word of every message, with the version of the format.
const MARK: &str = "osp-live-1";

/// Longest message, bytes. Servers accept a megabyte by default.
pub(super) const MAX_BYTES: usize = 1 << 19;

/// Largest number of events of a message.
pub(super) const MAX_EVENTS: usize = 4096;

/// Room for the first line, bytes.
pub(super) const HEAD_BYTES: usize = 64;

pub(super) fn head(sender: Sender, number: u64) -> String {
    format!("{MARK} {:016x} {number}\n", sender.0)
}

/// Appends an event as a line. Returns false, without effect, if the line is too long for a message.
pub(super) fn push(lines: &mut String, event: &Event) -> bool {
    let before = lines.len();
    let is_written = push_event(lines, event) && lines.len() - before <= MAX_BYTES - HEAD_BYTES;
    if !is_written {
        lines.truncate(before);
    }
    is_written
}

/// Reads a message. The error is the expected form. The numbers of each event are checked.
pub(super) fn read(bytes: &[u8]) -> Result<Message, &'static str> {
    if bytes.len() > MAX_BYTES {
        return Err("a message of at most 512 KiB");
    }
    let text = std::str::from_utf8(bytes).map_err(|_| "text in UTF-8")?;
    let mut lines = text.split_terminator('\n');
    let (sender, number) = lines.next().and_then(read_head).ok_or("the first line of a message")?;
    let mut events = Vec::new();
    for line in lines {
        if events.len() == MAX_EVENTS {
            return Err("at most 4096 events");
        }
        events.push(read_event(line).ok_or("an event of a recording in each line")?);
    }
    Ok(Message { sender, number, events })
}

fn read_head(line: &str) -> Option<(Sender, u64)> {
    let mut words = line.split(' ');
    let (mark, sender, number) = (words.next()?, words.next()?, words.next()?);
    let is_hex = sender.len() == 16 && sender.bytes().all(|c| c.is_ascii_hexdigit());
    let is_number = number.bytes().all(|c| c.is_ascii_digit());
    if mark != MARK || !is_hex || !is_number || words.next().is_some() {
        return None;
    }
    Some((Sender(u64::from_str_radix(sender, 16).ok()?), number.parse().ok()?))
}

/// The presence message of an author that sends no other messages.
pub(super) fn presence(sender: Sender) -> String {
    format!("{MARK} {:016x}", sender.0)
}

pub(super) fn read_presence(bytes: &[u8]) -> Option<Sender> {
    let text = std::str::from_utf8(bytes).ok().filter(|text| text.len() <= HEAD_BYTES)?;
    Some(read_head(&format!("{text} 0"))?.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::Author;

    #[test]
    fn messages_are_written_and_read_again() {
        let events = [Event::Undo { t: 1.25, author: Author(2) }, Event::Redo { t: -0.0, author: Author(2) }];
        let mut text = head(Sender(0xabc), 17);
        assert!(text.len() < HEAD_BYTES && head(Sender(u64::MAX), u64::MAX).len() < HEAD_BYTES);
        assert!(events.iter().all(|event| push(&mut text, event)));
        let message = read(text.as_bytes()).expect("a message");
        assert_eq!(message, Message { sender: Sender(0xabc), number: 17, events: events.to_vec() });
        assert_eq!(read(head(Sender::HOST, 0).as_bytes()).expect("nothing said").events, []);
        assert_eq!(read_presence(presence(Sender(7)).as_bytes()), Some(Sender(7)));
    }

    #[test]
    fn what_is_no_message_is_refused() {
        let head = head(Sender(1), 0);
        let cases: Vec<(Vec<u8>, &str)> = vec![
            (vec![], "first line"),
            (b"hello".to_vec(), "first line"),
            (b"osp-live-2 0000000000000001 0\n".to_vec(), "first line"),
            (b"osp-live-1 +000000000000001 0\n".to_vec(), "first line"),
            (b"osp-live-1 0000000000000001 +0\n".to_vec(), "first line"),
            (b"osp-live-1 0000000000000001 99999999999999999999\n".to_vec(), "first line"),
            (b"osp-live-1 0000000000000001 0 0\n".to_vec(), "first line"),
            (vec![0xff, 0xfe], "UTF-8"),
            (vec![b'a'; MAX_BYTES + 1], "512 KiB"),
            (format!("{head}Undo(t:1)\nnonsense\n").into_bytes(), "each line"),
            (format!("{head}Undo(t:1)\n\n").into_bytes(), "each line"),
            (format!("{head}Undo(t:inf)\n").into_bytes(), "each line"),
            (format!("{head}{}", "Undo(t:1)\n".repeat(MAX_EVENTS + 1)).into_bytes(), "4096"),
        ];
        for (bytes, expected) in cases {
            let error = read(&bytes).expect_err("refused");
            assert!(error.contains(expected), "{error}: {expected}");
        }
        for bad in [&b""[..], b"x", b"osp-live-1 12", &[0xff], &[b'0'; 200]] {
            assert_eq!(read_presence(bad), None);
        }
    }

    #[test]
    fn an_event_that_no_message_holds_is_not_written() {
        let strokes = vec![osp_session::recording::StrokeId(u32::MAX); MAX_BYTES / 11];
        let mut lines = "before".to_owned();
        let event = Event::Move { t: 0.0, author: Author(1), strokes, by: glam::Vec3::X };
        assert!(!push(&mut lines, &event));
        assert_eq!(lines, "before");
    }
}
