//! Shows a race on a terminal: the time of the latest frame of each structure, and a strip chart.

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
/// Number of characters in the longest time.
const FIGURE: usize = 6;
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
        let frames = if racer.missed == 1 { "frame" } else { "frames" };
        let missed = format!("{} {frames} over 11.1 ms", thousands(racer.missed));
        let missed = if racer.missed > 0 { red(&missed) } else { missed };
        let longest = Racer::figure_ms(racer.longest_ns);
        lines.push(String::new());
        lines.push(format!(
            "{}: {missed}, longest {longest} ms",
            console::style(racer.name).for_stderr().bold()
        ));
        let figure = format!("{:>FIGURE$} ms", Racer::figure_ms(latest));
        let figure = if latest > Racer::MOST_NS { red(&figure) } else { figure };
        lines.push(format!("{figure} {}", strip(&racer.times_ns, columns.saturating_sub(FIGURE + 5))));
    }
    lines.push("One core, in turns. Strips are 11.1 ms high: a frame at 90 Hz.".to_owned());
    lines.iter().map(|line| truncate_str(line, columns, "").into_owned()).collect()
}

fn red(text: &str) -> String {
    console::style(text).for_stderr().red().to_string()
}

/// Returns a strip chart of the latest frames, one frame a column. The full height is the time of a frame at 90 Hz.
fn strip(times_ns: &[u64], columns: usize) -> String {
    let latest = &times_ns[times_ns.len().saturating_sub(columns)..];
    let column = |&ns: &u64| {
        // Even the shortest frame is visible.
        let eighths = (ns.saturating_mul(8) / Racer::MOST_NS).clamp(1, 8);
        let letter = EIGHTHS[eighths as usize].to_string();
        if ns > Racer::MOST_NS { red(&letter) } else { letter }
    };
    latest.iter().map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_shows_the_latest_frames_up_to_one_at_90_hz() {
        let half = Racer::MOST_NS / 2 + 1;
        assert_eq!(strip(&[9, 7_000, half, Racer::MOST_NS], 3), "▁▄█");
        assert_eq!(strip(&[], 3), "");
    }
}
