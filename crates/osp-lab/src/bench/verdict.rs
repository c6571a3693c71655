//! The verdict: which structure is the fastest, and how many times as long the others take, in a few sentences.

use super::{BenchReport, GrowthRow, SessionResult, moving, rays::show::QUESTIONS};
use crate::report::{one_line, short, thousands};

/// Structures that a sentence names besides the fastest: the nearest ones, and the paper's rival.
const NEAREST: usize = 2;
const RIVAL: &str = "octree-rebuild";

/// How many times as long a structure takes as the fastest.
#[derive(Clone, Debug, PartialEq)]
struct Taken<'a> {
    index: &'a str,
    times: f64,
    /// Whether the interval of 95 % holds 1: the two cannot be told apart.
    is_level: bool,
}

/// The sentences on a report, the most important first; none if there is nothing to compare.
pub(super) fn verdict(report: &BenchReport) -> Vec<String> {
    let mut lines: Vec<String> = report.sessions.iter().filter_map(of_session).collect();
    lines.extend(report.sessions.iter().filter(|session| !session.indexes_agree).map(|session| {
        let name = one_line(&session.recording);
        format!("NOT ALL INDEXES SAW THE SAME POLYGONS in {name}: the figures compare different work.")
    }));
    lines.extend(over_all(&report.sessions));
    let mut sizes: Vec<u32> = report.growth.iter().map(|row| row.polygons).collect();
    sizes.dedup();
    lines.extend(sizes.into_iter().filter_map(|size| of_size(&report.growth, size, &report.reference)));
    for result in &report.rays {
        let questions = QUESTIONS.map(|(_, asked)| {
            result.rows.iter().map(|row| (row.index.as_str(), asked(row).ratio.median)).collect()
        });
        let about = format!(
            "Rays, ranges and neighbours in {}, {} polygons",
            one_line(&result.recording),
            thousands(result.polygons as u64)
        );
        lines.extend(count(&about, "questions", &questions, &report.reference));
    }
    for result in &report.moving {
        let motions = moving::show::ratios(result);
        let about = format!("Moving things, {} polygons", thousands(result.polygons as u64));
        lines.extend(count(&about, "motions", &motions, &report.reference));
    }
    if !lines.is_empty() && !report.machine.optimized {
        lines.push(
            "The program is NOT optimised: build it with --release for figures that mean something."
                .to_owned(),
        );
    }
    lines
}

/// Two digits, and more where they are whole.
fn times(ratio: f64) -> String {
    match ratio {
        x if x < 1.995 => format!("{x:.2}"),
        x if x < 9.95 => format!("{x:.1}"),
        x => thousands(x.round() as u64),
    }
}

/// `fastest; a takes 2.1 times as long, b 120 times`.
fn sentence(fastest: &str, mut others: Vec<Taken<'_>>) -> Option<String> {
    others.retain(|taken| taken.index != fastest && taken.times > 0.0);
    others.sort_by(|a, b| a.times.total_cmp(&b.times));
    let named = others.iter().enumerate().filter(|(at, taken)| *at < NEAREST || taken.index == RIVAL);
    let mut text = fastest.to_owned();
    for (at, taken) in named {
        let words = [("; ", " takes "), (", ", " ")][usize::from(at > 0)];
        text += &format!("{}{}{}{} times", words.0, taken.index, words.1, times(taken.times));
        if at == 0 {
            text += " as long";
        }
        if taken.is_level {
            text += " (level: the interval holds 1)";
        }
    }
    (!others.is_empty()).then_some(text)
}

fn of_session(session: &SessionResult) -> Option<String> {
    let rows = session.rows.iter().filter(|row| row.ratio.values > 0);
    let fastest = rows.clone().min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
    let others = rows.map(|row| Taken {
        index: &row.index,
        times: row.against_fastest.median,
        is_level: row.against_fastest.low <= 1.0 && row.against_fastest.high >= 1.0,
    });
    let text = sentence(&fastest.index, others.collect())?;
    Some(format!("For your sketch {}: {text}.", one_line(&session.recording)))
}

/// The geometric mean over the sessions of each structure's median, which no session weighs down.
fn over_all(sessions: &[SessionResult]) -> Option<String> {
    let first = sessions.first().filter(|_| sessions.len() > 1)?;
    let mean = |index: &str| {
        let of = |session: &SessionResult| {
            let row = session.rows.iter().find(|row| row.index == index && row.ratio.median > 0.0)?;
            Some(row.ratio.median.ln())
        };
        let logarithms: Option<Vec<f64>> = sessions.iter().map(of).collect();
        Some((logarithms?.iter().sum::<f64>() / sessions.len() as f64).exp())
    };
    let means: Vec<(&str, f64)> =
        first.rows.iter().filter_map(|row| Some((row.index.as_str(), mean(&row.index)?))).collect();
    let (fastest, least) = means.iter().min_by(|a, b| a.1.total_cmp(&b.1)).copied()?;
    let wins = sessions.iter().filter(|session| {
        let rows = session.rows.iter().filter(|row| row.ratio.values > 0);
        rows.min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median)).is_some_and(|row| row.index == fastest)
    });
    let wins = wins.count();
    let others = means.iter().map(|&(index, mean)| Taken { index, times: mean / least, is_level: false });
    let text = sentence(fastest, others.collect())?;
    Some(format!(
        "Over all {} sessions: {text} (geometric means). It is the fastest in {wins} of them.",
        sessions.len()
    ))
}

fn of_size(rows: &[GrowthRow], size: u32, reference: &str) -> Option<String> {
    let rows = || rows.iter().filter(|row| row.polygons == size && row.ratio.values > 0);
    let fastest = rows().min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
    let is_level = |row: &GrowthRow| row.ratio.low <= 1.0 && row.ratio.high >= 1.0;
    // Structures were measured beside the reference, not beside each other.
    let others = match fastest.index == reference {
        true => rows()
            .map(|row| Taken { index: &row.index, times: row.ratio.median, is_level: is_level(row) })
            .collect(),
        false => {
            vec![Taken { index: reference, times: 1.0 / fastest.ratio.median, is_level: is_level(fastest) }]
        }
    };
    let text = sentence(&fastest.index, others)?;
    Some(format!("A synthetic model that grows, {} polygons: {text}.", thousands(u64::from(size))))
}

/// In how many of several tasks the reference is the fastest, and what is in the others.
fn count<'a>(about: &str, what: &str, tasks: &[Vec<(&'a str, f64)>], reference: &str) -> Option<String> {
    let best = |rows: &Vec<(&'a str, f64)>| {
        let rows = rows.iter().copied().filter(|(_, ratio)| *ratio > 0.0);
        // Where the reference is level, it comes first.
        rows.min_by(|a, b| a.1.total_cmp(&b.1).then((a.0 != reference).cmp(&(b.0 != reference))))
    };
    let best: Vec<(&str, f64)> = tasks.iter().filter_map(best).collect();
    let has_others = tasks.iter().any(|rows| rows.len() > 1);
    if best.is_empty() || !has_others {
        return None;
    }
    let wins = best.iter().filter(|(index, _)| *index == reference).count();
    // The others, each with the tasks that it is the fastest in.
    let mut winners: Vec<(&str, Vec<f64>)> = Vec::new();
    for &(index, ratio) in best.iter().filter(|(index, _)| *index != reference) {
        match winners.iter_mut().find(|(other, _)| *other == index) {
            Some((_, ratios)) => ratios.push(1.0 / ratio),
            None => winners.push((index, vec![1.0 / ratio])),
        }
    }
    winners.sort_by_key(|(_, ratios)| std::cmp::Reverse(ratios.len()));
    let others = winners.iter().map(|(index, ratios)| {
        let [least, most] = [
            ratios.iter().copied().fold(f64::INFINITY, f64::min),
            ratios.iter().copied().fold(0.0, f64::max),
        ];
        let range =
            if ratios.len() == 1 { times(most) } else { format!("{} to {}", times(least), times(most)) };
        format!("; {index} in {}, where {reference} takes {range} times as long", ratios.len())
    });
    let others: String = others.collect();
    Some(format!("{about}: {reference} is the fastest in {wins} of {} {what}{others}.", best.len()))
}

/// A note on the times of single frames, which cannot be repeated: how many steps of the clock the shortest are.
pub(super) fn clock_note(report: &BenchReport) -> String {
    let resolution_ns = report.machine.clock_resolution_ns as f64;
    let least_us = crate::clock::RESOLUTIONS * resolution_ns / 1000.0;
    let mut short_ones: Vec<(&str, f64)> = Vec::new();
    for row in report.sessions.iter().flat_map(|session| &session.rows) {
        let us = row.frame_us.median;
        if us > 0.0 && us < least_us {
            match short_ones.iter_mut().find(|(index, _)| *index == row.index) {
                Some((_, least)) => *least = least.min(us),
                None => short_ones.push((&row.index, us)),
            }
        }
    }
    let mut note = format!(
        "The clock tells times {resolution_ns} ns apart. What can be repeated and is shorter than {} of that (frames that insert \
         nothing, rays, ranges, neighbours) is measured over so many runs at once that the clock is off by about 2 %.",
        crate::clock::RESOLUTIONS
    );
    if let Some((_, us)) = short_ones.iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
        let names: Vec<&str> = short_ones.iter().map(|(index, _)| *index).collect();
        note += &format!(
            " A frame that inserts cannot be repeated: single frames of {} are known to within {} %.",
            names.join(", "),
            short(100.0 * resolution_ns / 1000.0 / us)
        );
    }
    note
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(index: &str, times: f64) -> Taken<'_> {
        Taken { index, times, is_level: false }
    }

    #[test]
    fn the_nearest_and_the_papers_rival_are_named() {
        let others = vec![
            taken("bsp", 900.0),
            taken(RIVAL, 119.7),
            taken("osp", 1.0),
            taken("b", 2.71),
            taken("a", 2.14),
        ];
        assert_eq!(
            sentence("osp", others).as_deref(),
            Some("osp; a takes 2.1 times as long, b 2.7 times, octree-rebuild 120 times")
        );
        let level = vec![Taken { is_level: true, ..taken("a", 1.004) }];
        let expected = "osp; a takes 1.00 times as long (level: the interval holds 1)";
        assert_eq!(sentence("osp", level).as_deref(), Some(expected));
        assert_eq!(sentence("osp", vec![taken("osp", 1.0)]), None);
    }

    #[test]
    fn tasks_are_counted_and_lost_ones_named() {
        let row = |ratio: f64| vec![("osp", 1.0), ("x", ratio)];
        let tasks = [row(1.0), row(0.5), row(0.2), row(2.0)];
        assert_eq!(
            count("Rays", "questions", &tasks, "osp").as_deref(),
            Some(
                "Rays: osp is the fastest in 2 of 4 questions; x in 2, where osp takes 2.0 to 5.0 times as long."
            )
        );
        assert_eq!(count("Rays", "questions", &[vec![("osp", 1.0)]], "osp"), None);
    }
}
