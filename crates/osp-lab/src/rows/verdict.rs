//! The verdict over all recordings: the structures with the least time and memory, and ratios to them.

use super::{
    Row, Rows,
    table::{RIVAL, Table, distinct, geometric_mean, is_of, number},
};
use crate::report::{one_line, thousands};

/// Largest number of level structures that a sentence names.
const MOST_NAMED: usize = 3;
/// The part of the sessions that the user has named.
const SESSION: &str = "session";

impl Rows {
    /// One sentence on the times of the first part with ratios to `reference`. `None` if no part has ratios.
    pub fn verdict(&self, reference: &str) -> Option<String> {
        let tables = self.tables();
        let of_first = of_first(&compared(&tables, reference));
        let first = of_first.first()?;
        let on = match (first.part, of_first.len()) {
            (SESSION, 1) => format!("your sketch {}", one_line(first.recording)),
            (SESSION, count) => format!("your {count} sketches"),
            (_, 1) => one_line(first.recording).into_owned(),
            (_, count) => format!("{count} models"),
        };
        let said = sentence(&standings(&of_first, "ratio", reference), reference, "time", Some(RIVAL))?;
        Some(format!("On {on} {said}."))
    }

    /// One sentence each on insertion, query and memory, if the same part has the figure. If there are several tables,
    /// another sentence counts those in which no structure is clearly faster than the reference.
    pub fn verdict_in_detail(&self, reference: &str) -> Vec<String> {
        let tables = self.tables();
        let compared = compared(&tables, reference);
        let of_first = of_first(&compared);
        let line = |(name, figure, what)| {
            let standings = standings(&of_first, figure, reference);
            let own = standings.iter().find(|standing| standing.index == reference)?;
            let said = sentence(&standings, reference, what, None)?;
            Some(format!("{name}: {said} ({reference}: {} {}).", number(own.value), own.unit))
        };
        let figures =
            [("Insertion", "insert", "time"), ("Query", "cull", "time"), ("Memory", "memory", "memory")];
        let mut lines: Vec<String> = figures.into_iter().filter_map(line).collect();
        let count = |part: &super::Part| {
            let of = || compared.iter().filter(|table| is_of(table.part, part.part));
            let is_least = |table: &&&Table<'_>| {
                let standings = standings(&[table], "ratio", reference);
                let own = standings.iter().find(|standing| standing.index == reference);
                own.is_some_and(|own| own.low <= standings[0].high)
            };
            let (all, least) = (of().count(), of().filter(is_least).count());
            (all > 0).then(|| format!("{least} of {all} of {}", part.part))
        };
        if compared.len() > 1 {
            let counts: Vec<String> = self.parts.iter().filter_map(count).collect();
            lines.push(format!(
                "{reference} takes the least time or is level in these tables: {}.",
                counts.join(", ")
            ));
        }
        lines
    }
}

/// The tables in which the reference and another structure have a ratio. A structure with an occlusion method does not
/// count.
fn compared<'t, 'a>(tables: &'t [Table<'a>], reference: &str) -> Vec<&'t Table<'a>> {
    let has =
        |table: &Table<'_>, index: &str| !index.contains(" + ") && table.value(index, "ratio").is_some();
    let count = |table: &Table<'_>| table.indexes().iter().filter(|index| has(table, index)).count();
    tables.iter().filter(|table| count(table) > 1 && has(table, reference)).collect()
}

/// The tables of the first task.
fn of_first<'t, 'a>(tables: &[&'t Table<'a>]) -> Vec<&'t Table<'a>> {
    tables.iter().filter(|table| table.part == tables[0].part).copied().collect()
}

/// A measurement of a structure and the bounds of its interval: geometric means over tables.
struct Standing<'a> {
    index: &'a str,
    unit: &'static str,
    value: f64,
    low: f64,
    high: f64,
}

/// The structures with this measurement in all tables, sorted ascending. The reference precedes structures with the
/// same value.
fn standings<'a>(tables: &[&Table<'a>], figure: &str, reference: &str) -> Vec<Standing<'a>> {
    let of = |index: &'a str| {
        let mean = |of: fn(&Row) -> f64| geometric_mean(tables, |table| table.row(index, figure).map(of));
        Some(Standing {
            index,
            unit: tables.first()?.row(index, figure)?.unit,
            value: mean(|row| row.value)?,
            low: mean(|row| row.low.unwrap_or(row.value))?,
            high: mean(|row| row.high.unwrap_or(row.value))?,
        })
    };
    let indexes = distinct(tables.iter().flat_map(|table| table.indexes()));
    let mut standings: Vec<Standing<'_>> = indexes.into_iter().filter_map(of).collect();
    let is_other = |standing: &Standing<'_>| standing.index != reference;
    standings.sort_by(|a, b| a.value.total_cmp(&b.value).then(is_other(a).cmp(&is_other(b))));
    standings
}

/// A sentence such as `x takes the least time; the next (a) takes 2.1 times as long, b 120 times`. It always contains
/// the reference and `rival`. `None` if fewer than two structures have the figure.
fn sentence(standings: &[Standing<'_>], reference: &str, what: &str, rival: Option<&str>) -> Option<String> {
    let least = standings.first().filter(|_| standings.len() > 1)?;
    let (mut leaders, others): (Vec<_>, Vec<_>) =
        standings.iter().partition(|standing| standing.low <= least.high);
    leaders.sort_by_key(|standing| standing.index != reference);
    // Factors are those of the table below, if the reference leads it or is level.
    let base = leaders.first()?.value;
    let mut said = match &leaders[..] {
        [leader] => format!("{} takes the least {what}", named(leader.index)),
        _ => {
            let shown = leaders.len().min(MOST_NAMED);
            let mut names: Vec<String> =
                leaders[..shown].iter().map(|leader| named(leader.index).to_owned()).collect();
            names.extend((leaders.len() > shown).then(|| format!("{} more", leaders.len() - shown)));
            let last = names.pop()?;
            format!("{} and {last} take the least {what} (level: intervals overlap)", names.join(", "))
        }
    };
    let next = others.first().map(|standing| standing.index);
    let compared = if what == "time" { "long" } else { "much" };
    // The rival, also if it is rebuilt at other times.
    let rivals = others.iter().map(|standing| standing.index);
    let rivals = rivals.filter(|index| rival.is_some_and(|rival| index.starts_with(rival)));
    let names = distinct(next.into_iter().chain([reference]).chain(rivals));
    for (at, name) in names.into_iter().enumerate() {
        let Some(standing) = others.iter().find(|standing| standing.index == name) else { continue };
        let times = times(standing.value / base);
        said += &match at {
            0 => format!("; the next ({}) takes {times} times as {compared}", named(name)),
            _ => format!(", {} {times} times", named(name)),
        };
    }
    Some(said)
}

/// The name of a structure within a sentence.
fn named(index: &str) -> &str {
    match index {
        RIVAL => "an octree rebuilt in every frame",
        "octree-rebuild-insert" => "an octree rebuilt on every insert",
        "octree-rebuild-thread" => "an octree rebuilt on another thread",
        "octree-rebuild-nth" => "an octree rebuilt in every 16th frame",
        index => index,
    }
}

/// A ratio with two or three digits; integers are complete.
fn times(ratio: f64) -> String {
    match ratio {
        x if x < 1.995 => format!("{x:.2}"),
        x if x < 9.95 => format!("{x:.1}"),
        x => thousands(x.round() as u64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(part: &'static str, recordings: &[(&str, &[(&str, f64)])]) -> Rows {
        let mut rows = Rows::default();
        rows.part(part, "");
        for (recording, ratios) in recordings {
            for &(index, ratio) in *ratios {
                let spread = if index == "osp" { [1.0; 2] } else { [0.9, 1.2] };
                let ends = spread.map(|spread| ratio * spread);
                rows.of(part, *recording, index).median("ratio", "", vec![ends[0], ratio, ends[1]]);
            }
        }
        rows
    }

    #[test]
    fn the_next_the_reference_and_the_papers_rival_are_named() {
        let ratios = [("osp", 1.0), ("bsp", 900.0), (RIVAL, 119.7), ("b", 2.71), ("a", 2.14)];
        let one = rows(SESSION, &[("r.ron", &ratios)]);
        let said = "On your sketch r.ron osp takes the least time; the next (a) takes 2.1 times as long, an octree rebuilt \
                    in every frame 120 times.";
        assert_eq!(one.verdict("osp").as_deref(), Some(said));
        let behind = [("osp", 1.0), ("bsp", 0.9), ("b", 0.5), ("a", 0.2)];
        let said = "On r a takes the least time; the next (b) takes 2.5 times as long, osp 5.0 times.";
        assert_eq!(rows("replay", &[("r", &behind)]).verdict("osp").as_deref(), Some(said));
        let rival = rows("replay", &[("r", &[("osp", 1.0), (RIVAL, 0.5)])]);
        let said = "On r an octree rebuilt in every frame takes the least time; the next (osp) takes 2.0 times as long.";
        assert_eq!(rival.verdict("osp").as_deref(), Some(said));
        assert!(rows(SESSION, &[("r.ron", &[("osp", 1.0)])]).verdict("osp").is_none());
        assert!(
            Rows::default().verdict("osp").is_none() && Rows::default().verdict_in_detail("osp").is_empty()
        );
    }

    #[test]
    fn structures_whose_intervals_overlap_are_level_in_one_recording_and_in_several() {
        let level = [("a", 0.95), ("osp", 1.0), ("b", 1.1), ("c", 3.0)];
        let said = "osp, a and b take the least time (level: intervals overlap); the next (c) takes 3.0 times as long.";
        let recordings = [("r", &level[..]), ("s", &level[..])];
        for (name, count) in [("sketch r", 1), ("2 sketches", 2)] {
            let rows = rows(SESSION, &recordings[..count]);
            assert_eq!(rows.verdict("osp"), Some(format!("On your {name} {said}")));
        }
        // The factors are relative to the structure that is named first.
        let behind = [("osp", 1.0), ("a", 0.9), ("b", 2.7)];
        let said = "On r osp and a take the least time (level: intervals overlap); the next (b) takes 2.7 times as long.";
        assert_eq!(rows("replay", &[("r", &behind)]).verdict("osp").as_deref(), Some(said));
        let itself = [("osp", 1.0), ("osp + msvbsp", 3.0)];
        assert_eq!(rows("flight", &[("r", &itself)]).verdict("osp"), None);
        let many = [("osp", 1.0), ("a", 1.0), ("b", 1.0), ("c", 1.0), ("d", 1.0)];
        let said = "On r osp, a, b and 2 more take the least time (level: intervals overlap).";
        assert_eq!(rows("replay", &[("r", &many)]).verdict("osp").as_deref(), Some(said));
    }

    #[test]
    fn recordings_weigh_alike_and_the_tables_of_all_parts_are_counted() {
        let mut all =
            rows(SESSION, &[("a", &[("osp", 1.0), ("x", 2.0)]), ("b", &[("osp", 1.0), ("x", 0.9)])]);
        all.append(rows("rays", &[("a", &[("osp", 1.0), ("x", 0.5)]), ("b", &[("osp", 1.0), ("x", 1.0)])]));
        let first = "On your 2 sketches osp takes the least time; the next (x) takes 1.34 times as long.";
        let counts =
            "osp takes the least time or is level in these tables: 2 of 2 of session, 1 of 2 of rays.";
        assert_eq!(all.verdict("osp").as_deref(), Some(first));
        assert_eq!(all.verdict_in_detail("osp"), [counts]);
    }
}
