//! Shows a race on a terminal: the time of the latest frame of each structure in large digits, and a strip chart.

use std::time::{Duration, Instant};

use console::{Term, truncate_str};
use indicatif::ProgressBar;

use super::{output::one_line, progress};
use osp_lab::{
    bench::{Race, Racer},
    report::thousands,
};

/// Interval between two drawings of the view. All structures wait during a drawing.
const EVERY: Duration = Duration::from_millis(100);
/// Height of the large digits, and of the strip chart beside them, in lines.
const HEIGHT: usize = 3;
/// Number of characters in the longest time.
const FIGURE: usize = 6;
/// Number of columns of a large digit, including the gap after it.
const DIGIT: usize = 4;
/// Bars with a height of 0 to 8 eighths of a line.
const EIGHTHS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The view, in the last lines of the terminal. Nothing is shown if standard error is no terminal.
pub(super) struct RaceView {
    pane: ProgressBar,
    drawn: Option<Instant>,
    /// Number of the current race, from 1.
    run: u32,
    /// Number of races.
    runs: u32,
}

impl RaceView {
    pub(super) fn new(runs: u32) -> Self {
        Self { pane: progress::pane(), drawn: None, run: 0, runs }
    }

    /// Starts the next race.
    pub(super) fn begin(&mut self) {
        self.run += 1;
    }

    /// Shows the race after a frame, at most once in [`EVERY`].
    pub(super) fn show(&mut self, race: &Race) {
        if self.pane.is_hidden() || self.drawn.is_some_and(|drawn| drawn.elapsed() < EVERY) {
            return;
        }
        let columns = usize::from(Term::stderr().size().1);
        let race_of =
            if self.runs > 1 { format!("race {} of {}, ", self.run, self.runs) } else { String::new() };
        self.pane.set_message(lines(race, &race_of, columns).join("\n"));
        self.drawn = Some(Instant::now());
    }

    /// Clears the view for the report.
    pub(super) fn finish(self) {
        self.pane.finish_and_clear();
    }
}

/// Returns the lines of the view on a terminal of this width.
fn lines(race: &Race, race_of: &str, columns: usize) -> Vec<String> {
    let frames = race.racers.first().map_or(0, |racer| racer.times_ns.len());
    let mut lines = vec![format!(
        "{}: {race_of}frame {} of {}, {} polygons",
        one_line(&race.recording),
        thousands(frames as u64),
        thousands(race.frames),
        thousands(race.present())
    )];
    for racer in &race.racers {
        let latest = racer.times_ns.last().map_or(0, |&ns| ns);
        let is_late = |ns: u64| ns > Racer::MOST_NS;
        let frames = if racer.missed == 1 { "frame" } else { "frames" };
        let missed = format!("{} {frames} over 11.1 ms", thousands(racer.missed));
        let missed = if racer.missed > 0 { red(&missed) } else { missed };
        let longest = Racer::figure_ms(racer.longest_ns);
        lines.push(String::new());
        lines.push(format!(
            "{}: {missed}, longest {longest} ms",
            console::style(racer.name).for_stderr().bold()
        ));
        let digits = large(&format!("{:>FIGURE$}", Racer::figure_ms(latest)));
        let strip = strip(&racer.times_ns, columns.saturating_sub(FIGURE * DIGIT + 5));
        for (row, (digits, strip)) in digits.iter().zip(strip).enumerate() {
            let digits = if is_late(latest) { red(digits) } else { digits.clone() };
            lines.push(format!("{digits}{} {strip}", if row + 1 == HEIGHT { "ms" } else { "  " }));
        }
    }
    lines.push("One core, in turns. Strips are 11.1 ms high: a frame at 90 Hz.".to_owned());
    lines.iter().map(|line| truncate_str(line, columns, "").into_owned()).collect()
}

fn red(text: &str) -> String {
    console::style(text).for_stderr().red().to_string()
}

/// Returns the lines of a strip chart of the latest frames, one frame a column. The full height is the time of a frame
/// at 90 Hz.
fn strip(times_ns: &[u64], columns: usize) -> [String; HEIGHT] {
    let latest = &times_ns[times_ns.len().saturating_sub(columns)..];
    let line = |row: usize| {
        let below = 8 * (HEIGHT - 1 - row) as u64;
        let column = |&ns: &u64| {
            // Even the shortest frame is visible.
            let eighths = (ns.saturating_mul(8 * HEIGHT as u64) / Racer::MOST_NS).max(1);
            let letter = EIGHTHS[eighths.saturating_sub(below).min(8) as usize];
            if ns > Racer::MOST_NS { red(&letter.to_string()) } else { letter.to_string() }
        };
        latest.iter().map(column).collect()
    };
    std::array::from_fn(line)
}

/// Each digit has five rows of three pixels. The highest bit is the upper left pixel.
const DIGITS: [u16; 10] = [
    0b111_101_101_101_111,
    0b010_110_010_010_111,
    0b111_001_111_100_111,
    0b111_001_111_001_111,
    0b101_101_111_001_001,
    0b111_100_111_001_111,
    0b111_100_111_101_111,
    0b111_001_001_010_010,
    0b111_101_111_101_111,
    0b111_101_111_001_111,
];

/// Returns digits, points, commas and spaces as large characters. Two rows of pixels make one line.
fn large(text: &str) -> [String; HEIGHT] {
    let pixels = |letter: char| match letter.to_digit(10) {
        Some(digit) => DIGITS[digit as usize],
        None if letter == '.' => 0b000_000_000_000_010,
        None if letter == ',' => 0b000_000_000_010_100,
        None => 0,
    };
    std::array::from_fn(|line| {
        let cell = |letter: char, x: usize| {
            let is_set = |y: usize| y < 5 && pixels(letter) >> (14 - 3 * y - x) & 1 == 1;
            match (is_set(2 * line), is_set(2 * line + 1)) {
                (true, true) => '█',
                (true, false) => '▀',
                (false, true) => '▄',
                (false, false) => ' ',
            }
        };
        text.chars().flat_map(|letter| [cell(letter, 0), cell(letter, 1), cell(letter, 2), ' ']).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_three_lines_high() {
        assert_eq!(large("4.2"), ["█ █     ▀▀█ ", "▀▀█     █▀▀ ", "  ▀  ▀  ▀▀▀ "]);
    }

    #[test]
    fn a_strip_shows_the_latest_frames_up_to_one_at_90_hz() {
        let half = Racer::MOST_NS / 2 + 1;
        let [top, middle, bottom] = strip(&[9, 7_000, half, Racer::MOST_NS], 3);
        assert_eq!([top, middle, bottom], ["  █", " ▄█", "▁██"].map(str::to_owned));
        assert_eq!(strip(&[], 3), [""; 3].map(str::to_owned));
    }
}
