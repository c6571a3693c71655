//! Shows the progress of a command in the last lines of a terminal. Shows nothing if standard error is no terminal.

use std::{sync::LazyLock, time::Duration};

use indicatif::{MultiProgress, ProgressBar, ProgressFinish, ProgressStyle};

use osp_lab::report::one_line;

/// Interval between two drawings of a spinner.
const TICK: Duration = Duration::from_millis(200);

/// All bars, so that lines of output can be printed above them.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// Hides the bars and writes text. The bars appear again at their next change. Ignores a closed terminal.
pub(super) fn aside<T>(write: impl FnOnce() -> T) -> T {
    if !BARS.is_hidden() {
        let _ = BARS.clear();
    }
    write()
}

/// Creates a bar for a number of frames, cells or views, with an estimate of the remaining time.
pub(super) fn bar(many: u64, what: &str, name: &str) -> ProgressBar {
    let template = format!("{{msg}} {{wide_bar}} {{pos}}/{{len}} {what}, {{eta}} left");
    let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(many).with_style(style).with_finish(ProgressFinish::AndClear);
    BARS.add(bar).with_message(one_line(name).into_owned())
}

pub(super) fn spinner() -> ProgressBar {
    let spinner = BARS.add(ProgressBar::new_spinner().with_finish(ProgressFinish::AndClear));
    if !BARS.is_hidden() {
        spinner.enable_steady_tick(TICK);
    }
    spinner
}

/// Creates a bar that shows only text. It is redrawn only when the text changes, not by a thread.
#[cfg(feature = "bench")]
pub(super) fn pane() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
    BARS.add(ProgressBar::new(1).with_style(style).with_finish(ProgressFinish::AndClear))
}

/// Creates a counter for the events of a session that is read or written. The total is unknown before the end.
pub(super) fn events(name: &str) -> ProgressBar {
    let spinner = spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}: {human_pos} events") {
        spinner.set_style(style);
    }
    spinner.with_message(one_line(name).into_owned())
}
