use serde::Serialize;

use super::{Race, Racer};
use crate::{
    Machine,
    report::{one_line, short, thousands},
    rows::Rows,
};

const PART: &str = "race";

#[derive(Clone, Debug, Serialize)]
pub struct RaceReport {
    /// The result in one sentence.
    pub verdict: String,
    pub machine: Machine,
    /// The arguments that repeat the run.
    pub command: String,
    #[serde(flatten)]
    pub rows: Rows,
}

impl RaceReport {
    pub fn new(race: &Race, machine: Machine, command: String) -> Self {
        Self { verdict: verdict(race), machine, command, rows: rows(race) }
    }

    /// The report as text: the verdict, a table, the machine.
    pub fn to_text(&self) -> String {
        format!("{}\n{}\n\n{}", self.verdict, self.rows.all_tables(|_| true), self.machine.text())
    }
}

/// One sentence about all structures.
fn verdict(race: &Race) -> String {
    let of = |racer: &Racer| {
        let (name, longest) = (racer.name, milliseconds(racer.longest_ns));
        match racer.first_missed {
            None => format!("{name} held 90 Hz in every frame, the longest took {longest} ms"),
            Some(polygons) => format!(
                "{name} missed 90 Hz in {} {}, first at {} polygons, and took {longest} ms in the longest",
                thousands(racer.missed),
                if racer.missed == 1 { "frame" } else { "frames" },
                thousands(polygons)
            ),
        }
    };
    let said = match race.frames {
        0 => "there is nothing to measure".to_owned(),
        _ => race.racers.iter().map(of).collect::<Vec<_>>().join("; "),
    };
    let (polygons, frames) = (thousands(race.polygons), thousands(race.frames));
    format!("On {} ({polygons} polygons, {frames} frames) {said}.", one_line(&race.recording))
}

/// A time in milliseconds, with three digits or to the microsecond.
fn milliseconds(ns: u64) -> String {
    match ns as f64 / 1.0e6 {
        ms if ms < 1.0 => format!("{ms:.3}"),
        ms => short(ms),
    }
}

fn rows(race: &Race) -> Rows {
    let mut rows = Rows::default();
    rows.part(PART, "Race: insertion, commit and culling of each frame");
    rows.note(
        PART,
        "One thread, thus one core, runs all structures in turns; another structure begins each frame.",
    );
    rows.note(PART, "Missed: frames of more than 11.1 ms (90 Hz).");
    let others = match race.runs {
        1 => "The times include work of other programs; `--runs 3` removes most of it.".to_owned(),
        runs => format!(
            "A frame's time is the shortest of {runs} races, because longer times include work of other programs."
        ),
    };
    rows.note(PART, others);
    race.load.note().into_iter().for_each(|note| rows.note(PART, note));
    rows.note(
        PART,
        format!(
            "All structures found the same polygons in every frame; fingerprint {:016x}.",
            race.fingerprint()
        ),
    );
    let name = race.recording.as_str();
    rows.note(PART, format!("{name}: {}, camera {}.", race.pace, race.camera));
    rows.of(PART, name, "").value("polygons", "polygons", race.polygons as f64).value(
        "frames",
        "frames",
        race.frames as f64,
    );
    for racer in &race.racers {
        let us = racer.times_ns.iter().map(|&ns| ns as f64 / 1000.0).collect();
        rows.of(PART, name, racer.name)
            .spread("frame", us)
            .value("missed", "frames", racer.missed as f64)
            .maybe("first_missed_at", "polygons", racer.first_missed.map(|polygons| polygons as f64))
            .value("memory", "bytes/polygon", racer.bytes as f64 / race.present().max(1) as f64);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::{recording::Pace, replay::SessionFingerprint};

    fn race(frames_us: [&[u64]; 2]) -> Race {
        let racer = |(name, us): (&'static str, &[u64])| {
            let mut racer = Racer::new(name);
            for (&us, polygons) in us.iter().zip((1000..).step_by(1000)) {
                racer.add(us * 1000, polygons);
            }
            racer
        };
        Race {
            recording: "a\u{7}.ron".to_owned(),
            pace: Pace::Samples(16),
            camera: "auto",
            frames: frames_us[0].len() as u64,
            polygons: 3000,
            present: (1000..).step_by(1000).take(frames_us[0].len()).collect(),
            fingerprint: SessionFingerprint::new(),
            runs: 1,
            load: Default::default(),
            racers: [("osp", frames_us[0]), ("octree-rebuild", frames_us[1])].map(racer).into(),
        }
    }

    #[test]
    fn what_disturbs_a_frame_in_one_race_alone_is_left_out() {
        let disturbed = race([&[30_000, 8, 7], &[400, 12_000, 900]]);
        let least = disturbed
            .least(&race([&[9, 20_000, 7], &[500, 700, 800]]))
            .least(&race([&[10, 9, 6], &[1, 2, 3]]));
        let times: Vec<&[u64]> = least.racers.iter().map(|racer| &racer.times_ns[..]).collect();
        assert_eq!(times, [&[9_000, 8_000, 6_000][..], &[1_000, 2_000, 3_000]]);
        assert!(least.racers.iter().all(|racer| racer.missed == 0 && racer.first_missed.is_none()));
        let notes = &rows(&least).parts[0].notes;
        assert!(notes.iter().any(|note| note.contains("the shortest of 3 races")), "{notes:?}");
        // Frames that are slow in both races stay slow.
        let slow = || race([&[1, 1, 1], &[1, 12_000, 13_000]]);
        let racer = &slow().least(&slow()).racers[1].clone();
        assert_eq!((racer.missed, racer.first_missed, racer.longest_ns), (2, Some(2000), 13_000_000));
    }
}
