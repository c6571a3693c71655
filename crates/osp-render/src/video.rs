//! The command that makes a video of numbered pictures.

use std::path::Path;

/// The ffmpeg command, as text for a shell, that makes a video beside a folder. The video has the folder's pictures in the
/// order of their names. `ending` is the end of the pictures' names.
pub fn ffmpeg_command(folder: &Path, ending: &str, frames_a_second: u32) -> String {
    let text = folder.to_string_lossy();
    let text = text.trim_end_matches(std::path::is_separator);
    let mut pattern = String::new();
    for c in text.chars() {
        // The character is escaped, because ffmpeg would read it as a pattern.
        if matches!(c, '*' | '?' | '[' | ']' | '{' | '}' | '\\') && !std::path::is_separator(c) {
            pattern.push('\\');
        }
        pattern.push(c);
    }
    let pictures = quoted(&format!("{pattern}/*{ending}.png"));
    let video = quoted(&format!("{text}{ending}.mp4"));
    // Most players require even sizes and this format of colours.
    format!(
        "ffmpeg -framerate {frames_a_second} -pattern_type glob -i {pictures} -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -pix_fmt yuv420p {video}"
    )
}

/// Quotes a text as one word of a shell.
pub fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_quoted_for_the_shell_and_for_the_pattern() {
        let command = ffmpeg_command(Path::new("my frames/it's [1]/"), "-left", 25);
        assert!(command.starts_with("ffmpeg -framerate 25 "), "{command}");
        assert!(command.contains(r"-i 'my frames/it'\''s \[1\]/*-left.png' "), "{command}");
        assert!(command.ends_with(r"'my frames/it'\''s [1]-left.mp4'"), "{command}");
    }
}
