//! The verdict over all recordings: the fastest structure, and the ratios of the others to it.

use super::{
    Rows,
    table::{RIVAL, Table, distinct, is_of, mean},
};
use crate::report::{one_line, thousands};

/// Number of structures that a sentence names besides the fastest.
const NEAREST: usize = 2;

impl Rows {
    /// One sentence on the first part with ratios to `reference`, and one sentence that counts the tasks of all other
    /// parts. Empty if no part has ratios.
    pub fn verdict(&self, reference: &str) -> Vec<String> {
        let tables = self.tables();
        let compared = |table: &&Table<'_>| {
            let has = |index: &&str| table.value(index, "ratio").is_some();
            table.indexes().iter().filter(|index| has(index)).count() > 1
        };
        let tables: Vec<&Table<'_>> = tables.iter().filter(compared).collect();
        let Some(first) = tables.first() else { return Vec::new() };
        let of_first: Vec<&Table<'_>> =
            tables.iter().filter(|table| table.part == first.part).copied().collect();
        let mut lines: Vec<String> = fastest(&of_first, reference).into_iter().collect();
        let others = self.parts.iter().filter_map(|part| {
            let of: Vec<_> = tables
                .iter()
                .filter(|table| is_of(table.part, part.part) && table.part != first.part)
                .collect();
            let wins = of.iter().filter(|table| best_of(table, reference) == Some(reference)).count();
            (!of.is_empty()).then(|| format!("{wins} of {} of {}", of.len(), part.part))
        });
        let others: Vec<String> = others.collect();
        if !others.is_empty() {
            lines.push(format!("Of the other tables {reference} is the fastest in {}.", others.join(", ")));
        }
        lines
    }
}

/// The structure with the smallest ratio; if the reference has the same ratio, the reference.
fn best_of<'a>(table: &Table<'a>, reference: &str) -> Option<&'a str> {
    let ratios = table.indexes().into_iter().filter_map(|index| Some((index, table.value(index, "ratio")?)));
    let order = |a: &(&str, f64), b: &(&str, f64)| {
        a.1.total_cmp(&b.1).then((a.0 != reference).cmp(&(b.0 != reference)))
    };
    ratios.min_by(order).map(|(index, _)| index)
}

/// A sentence such as `Over 4 recordings x is the fastest; a takes 2.1 times as long, b 120 times`.
fn fastest(tables: &[&Table<'_>], reference: &str) -> Option<String> {
    let indexes = distinct(tables.iter().flat_map(|table| table.indexes()));
    let mut means: Vec<(&str, f64)> =
        indexes.into_iter().filter_map(|index| Some((index, mean(tables, index, "ratio")?))).collect();
    means.sort_by(|a, b| a.1.total_cmp(&b.1).then((a.0 != reference).cmp(&(b.0 != reference))));
    let (&(fastest, least), others) = means.split_first()?;
    let shown = others.iter().enumerate().filter(|(at, (index, _))| *at < NEAREST || *index == RIVAL);
    let mut said = String::new();
    for (at, &(index, mean)) in shown {
        said += if at == 0 { "; " } else { ", " };
        said += &format!("{index} {}{} times", if at == 0 { "takes " } else { "" }, times(mean / least));
        said += if at == 0 { " as long" } else { "" };
        // A ratio is measured only relative to the reference, and its interval only for one recording.
        let other = if fastest == reference { index } else { fastest };
        let is_of_two = fastest == reference || index == reference;
        if let ([table], true) = (tables, is_of_two)
            && table.is_level(other)
        {
            said += " (level: the interval holds 1)";
        }
    }
    let wins = tables.iter().filter(|table| best_of(table, reference) == Some(fastest)).count();
    Some(match tables {
        [table] => format!("{}: {fastest} is the fastest{said}.", one_line(table.recording)),
        _ => format!(
            "Over {} recordings {fastest} is the fastest, in {wins} of them{said} (geometric means).",
            tables.len()
        ),
    })
    .filter(|_| !others.is_empty())
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
                rows.of(part, *recording, index).median("ratio", "", vec![ratio * 0.9, ratio, ratio * 1.2]);
            }
        }
        rows
    }

    #[test]
    fn the_nearest_and_the_papers_rival_are_named() {
        let ratios = [("osp", 1.0), ("bsp", 900.0), (RIVAL, 119.7), ("b", 2.71), ("a", 2.14)];
        let one = rows("session", &[("r.ron", &ratios)]);
        let said =
            "r.ron: osp is the fastest; a takes 2.1 times as long, b 2.7 times, octree-rebuild 120 times.";
        assert_eq!(one.verdict("osp"), [said]);
        let level = rows("session", &[("r.ron", &[("osp", 1.0), ("a", 1.004)])]);
        let said = "r.ron: osp is the fastest; a takes 1.00 times as long (level: the interval holds 1).";
        assert_eq!(level.verdict("osp"), [said]);
        assert!(rows("session", &[("r.ron", &[("osp", 1.0)])]).verdict("osp").is_empty());
        assert!(Rows::default().verdict("osp").is_empty());
    }

    #[test]
    fn recordings_weigh_alike_and_the_tasks_of_other_parts_are_counted() {
        let mut all =
            rows("session", &[("a", &[("osp", 1.0), ("x", 2.0)]), ("b", &[("osp", 1.0), ("x", 0.8)])]);
        all.append(rows("rays", &[("a", &[("osp", 1.0), ("x", 0.5)]), ("b", &[("osp", 1.0), ("x", 1.0)])]));
        let first = "Over 2 recordings osp is the fastest, in 1 of them; x takes 1.26 times as long (geometric means).";
        assert_eq!(all.verdict("osp"), [first, "Of the other tables osp is the fastest in 1 of 2 of rays."]);
    }
}
