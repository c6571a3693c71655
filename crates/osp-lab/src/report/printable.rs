use std::{borrow::Cow, fmt::Write};

/// Escapes the characters that a terminal, a picture or a page would interpret. Control characters other than newlines,
/// and characters that change the direction of text, become `\u001b` and the like. In a JSON string this denotes the
/// same character.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_command) {
        return text.into();
    }
    let mut clean = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match is_command(c) {
            // Writing to a string never fails.
            true => drop(write!(clean, "\\u{:04x}", u32::from(c))),
            false => clean.push(c),
        }
    }
    clean.into()
}

/// An external name escaped like [`printable`], with newlines escaped, too.
pub fn one_line(text: &str) -> Cow<'_, str> {
    match printable(text) {
        clean if clean.contains('\n') => clean.replace('\n', "\\u000a").into(),
        clean => clean,
    }
}

/// Appends text to HTML, with all special characters escaped.
pub fn push_html(html: &mut String, text: &str) {
    for c in printable(text).chars() {
        match c {
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '&' => html.push_str("&amp;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            c => html.push(c),
        }
    }
}

fn is_command(c: char) -> bool {
    let turns =
        matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    // Some programs treat line and paragraph separators as newlines.
    turns || matches!(c, '\u{2028}' | '\u{2029}') || (c.is_control() && c != '\n')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_shown_and_everything_else_is_kept() {
        let plain = "grüße, 日本\n3 µs";
        assert!(matches!(printable(plain), Cow::Borrowed(same) if same == plain));
        assert_eq!(printable("a\u{1b}[31mb\r\u{9b}c\u{7f}"), "a\\u001b[31mb\\u000d\\u009bc\\u007f");
        assert_eq!(printable("\u{202e}txt.exe"), "\\u202etxt.exe");
        assert_eq!(one_line("a\nb\u{7}"), "a\\u000ab\\u0007");
        let json = serde_json::to_string("a\u{7f}\u{9b}\u{1b}").expect("a string");
        let back: String = serde_json::from_str(&printable(&json)).expect("JSON still");
        assert_eq!(back, "a\u{7f}\u{9b}\u{1b}");
    }
}
