use std::collections::{BTreeMap, BTreeSet};

use super::StudyRow;

/// Largest number of witnesses that a line names.
const WITNESSES: usize = 4;

/// The answer of who could not read a session.
const AN_ERROR: &str = "an error";

/// What must give the same answer wherever it is measured.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Question {
    file_hash: String,
    pace: String,
    camera: String,
    lenient: bool,
    max_polygons: u64,
    /// Index, method and options, where what is left by occlusion culling is compared: that depends on them.
    culled_by: Option<String>,
}

/// Results that should be the same and are not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Disagreement {
    /// The file, as the first row has it.
    pub file: String,
    /// Hash of its contents.
    pub file_hash: String,
    /// Pace and camera, and what culled.
    pub asked: String,
    /// Each answer (a fingerprint, or `an error`) with those who gave it: machine, instruction set, commit, index.
    pub answers: Vec<(String, Vec<String>)>,
}

impl Disagreement {
    /// All in one line.
    pub fn text(&self) -> String {
        let answers = self.answers.iter().map(|(answer, witnesses)| {
            let more = witnesses.len().saturating_sub(WITNESSES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let named = witnesses[..witnesses.len().min(WITNESSES)].join("; ");
            format!("{answer} on {named}{more}")
        });
        let answers: Vec<String> = answers.collect();
        format!("{} ({}): {}", self.file, self.asked, answers.join(" | "))
    }
}

#[derive(Debug, Default)]
struct Answers {
    file: String,
    by_answer: BTreeMap<String, BTreeSet<String>>,
}

/// Finds sessions of which machines, builds or indexes saw different polygons. Rows of which frames were left out
/// (`--budget`) are not compared: their fingerprints are of other frames.
#[derive(Debug, Default)]
pub struct Disagreements {
    asked: BTreeMap<Question, Answers>,
    incomplete: u64,
}

impl Disagreements {
    /// Takes a row.
    pub fn add(&mut self, row: &StudyRow) {
        let Some(file_hash) = row.file_hash.clone() else { return };
        let question = Question {
            file_hash,
            pace: row.pace.clone(),
            // Of a session on a rig this names the rig, too.
            camera: row.camera.clone(),
            lenient: row.lenient,
            max_polygons: row.max_polygons,
            culled_by: None,
        };
        let index = row.run_name().unwrap_or_default();
        let witness = format!("{} {} {} {index}", row.host, row.simd, row.osp_commit);
        let witness = witness.trim_end().to_owned();
        if row.error.is_some() {
            self.note(question, row, AN_ERROR.to_owned(), witness);
            return;
        }
        let Some(fingerprint) = row.fingerprint.clone().filter(|_| row.is_complete()) else {
            self.incomplete += 1;
            return;
        };
        if let Some(drawn) = row.drawn_fingerprint.clone() {
            let culled_by = Some(format!("{index}, {}", row.options));
            self.note(Question { culled_by, ..question.clone() }, row, drawn, witness.clone());
        }
        self.note(question, row, fingerprint, witness);
    }

    fn note(&mut self, question: Question, row: &StudyRow, answer: String, witness: String) {
        let answers = self.asked.entry(question).or_default();
        if answers.by_answer.is_empty() {
            answers.file.clone_from(&row.file);
        }
        answers.by_answer.entry(answer).or_default().insert(witness);
    }

    /// Results that were compared with another machine's, build's or index's, and rows that could not be because frames were
    /// left out.
    pub fn counts(&self) -> (u64, u64) {
        let of_sessions = self.asked.iter().filter(|(question, _)| question.culled_by.is_none());
        let witnesses = of_sessions.map(|(_, answers)| {
            let seen = answers.by_answer.iter().filter(|(answer, _)| *answer != AN_ERROR);
            seen.map(|(_, witnesses)| witnesses.len() as u64).sum::<u64>()
        });
        (witnesses.filter(|&witnesses| witnesses > 1).sum(), self.incomplete)
    }

    /// What was found.
    pub fn found(&self) -> impl Iterator<Item = Disagreement> + '_ {
        self.asked.iter().filter(|(_, answers)| answers.by_answer.len() > 1).map(|(question, answers)| {
            let culled_by = question.culled_by.as_ref().map(|by| format!(", {by}")).unwrap_or_default();
            Disagreement {
                file: answers.file.clone(),
                file_hash: question.file_hash.clone(),
                asked: format!("pace {}, camera {}{culled_by}", question.pace, question.camera),
                answers: answers
                    .by_answer
                    .iter()
                    .map(|(answer, witnesses)| (answer.clone(), witnesses.iter().cloned().collect()))
                    .collect(),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(host: &str, index: &str, fingerprint: &str) -> StudyRow {
        StudyRow {
            file: "a.ron".to_owned(),
            file_hash: Some("00".to_owned()),
            host: host.to_owned(),
            index: Some(index.to_owned()),
            fingerprint: Some(fingerprint.to_owned()),
            frames: Some(3),
            frames_fingerprinted: Some(3),
            pace: "samples:16".to_owned(),
            camera: "auto".to_owned(),
            ..StudyRow::default()
        }
    }

    fn found(rows: &[StudyRow]) -> Vec<Disagreement> {
        let mut all = Disagreements::default();
        rows.iter().for_each(|row| all.add(row));
        all.found().collect()
    }

    #[test]
    fn the_same_session_must_look_the_same_everywhere() {
        assert!(found(&[row("a", "osp", "1"), row("b", "osp", "1"), row("b", "bsp", "1")]).is_empty());
        let other = found(&[row("a", "osp", "1"), row("b", "osp", "2")]);
        assert_eq!(other.len(), 1);
        assert_eq!(other[0].answers.len(), 2);
        assert!(
            other[0].text().contains("1 on a") && other[0].text().contains("2 on b"),
            "{}",
            other[0].text()
        );
        // Indexes of one machine must agree, too.
        assert_eq!(found(&[row("a", "osp", "1"), row("a", "bsp", "2")]).len(), 1);
    }

    #[test]
    fn what_was_asked_otherwise_may_look_otherwise() {
        let mut paced = row("b", "osp", "2");
        paced.pace = "recorded".to_owned();
        let mut other_file = row("b", "osp", "3");
        other_file.file_hash = Some("01".to_owned());
        let mut left_out = row("b", "osp", "4");
        left_out.frames_fingerprinted = Some(2);
        assert!(found(&[row("a", "osp", "1"), paced, other_file, left_out]).is_empty());
    }

    #[test]
    fn what_one_machine_cannot_read_and_another_can_is_found() {
        let mut failed = row("b", "osp", "");
        (failed.error, failed.fingerprint, failed.index) = (Some("cut off".to_owned()), None, None);
        assert_eq!(found(&[row("a", "osp", "1"), failed.clone()]).len(), 1);
        assert!(found(&[failed.clone(), failed]).is_empty());
    }

    #[test]
    fn what_is_left_by_occlusion_culling_is_compared_for_each_index() {
        let drawn = |host: &str, index: &str, drawn: &str| StudyRow {
            drawn_fingerprint: Some(drawn.to_owned()),
            occlusion: Some("msvbsp".to_owned()),
            ..row(host, index, "1")
        };
        assert!(found(&[drawn("a", "osp", "1"), drawn("a", "bsp", "2")]).is_empty());
        assert_eq!(found(&[drawn("a", "osp", "1"), drawn("b", "osp", "2")]).len(), 1);
    }
}
