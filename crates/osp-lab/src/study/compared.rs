use std::collections::BTreeMap;

use super::StudyRow;

/// One session on one machine, measured in one way: its indexes side by side.
#[derive(Clone, Debug)]
pub struct SessionOutcome {
    /// The file.
    pub file: String,
    /// The machine.
    pub host: String,
    /// Polygons made.
    pub polygons: u64,
    /// Frames played.
    pub frames: u64,
    /// Why it could not be measured.
    pub error: Option<String>,
    /// Whether all indexes saw the same polygons.
    pub indexes_agree: bool,
    /// Each index (with its method of occlusion culling) that was measured on every frame: a frame, median and 99th percentile,
    /// microseconds; memory, bytes.
    pub runs: Vec<(String, [f64; 2], u64)>,
    /// The indexes that were too slow for that: their times are of other frames, and are not compared.
    pub too_slow: Vec<String>,
    /// The index with the least median, of those that were measured on every frame.
    pub best: Option<String>,
}

/// What the sessions of a study say together.
#[derive(Clone, Debug, Default)]
pub struct Compared {
    sessions: BTreeMap<[String; 5], SessionOutcome>,
    /// Median of the best, to find it.
    least: BTreeMap<[String; 5], f64>,
}

impl Compared {
    /// Takes a row.
    pub fn add(&mut self, row: &StudyRow) {
        let hash = row.file_hash.clone().unwrap_or_default();
        let key = [row.file.clone(), hash, row.host.clone(), row.options.clone(), row.osp_commit.clone()];
        let session = self.sessions.entry(key.clone()).or_insert_with(|| SessionOutcome {
            file: row.file.clone(),
            host: row.host.clone(),
            polygons: row.polygons.unwrap_or(0),
            frames: row.frames.unwrap_or(0),
            error: row.error.clone(),
            indexes_agree: row.indexes_agree.unwrap_or(true),
            runs: Vec::new(),
            too_slow: Vec::new(),
            best: None,
        });
        let (Some(name), Some(p50), Some(p99)) = (row.run_name(), row.frame_p50_us, row.frame_p99_us) else {
            return;
        };
        // The same session again, from another file of results.
        if session.runs.iter().any(|(other, ..)| *other == name) || session.too_slow.contains(&name) {
            return;
        }
        if !row.is_complete() {
            session.too_slow.push(name);
            return;
        }
        session.runs.push((name.clone(), [p50, p99], row.index_bytes.unwrap_or(0)));
        let least = self.least.entry(key).or_insert(f64::INFINITY);
        // A session without frames has no fastest.
        if row.frames.unwrap_or(0) > 0 && p50 < *least {
            (*least, session.best) = (p50, Some(name));
        }
    }

    /// The sessions, by name.
    pub fn sessions(&self) -> impl Iterator<Item = &SessionOutcome> {
        self.sessions.values()
    }

    /// The indexes, in the order in which they first appear.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (name, ..) in self.sessions().flat_map(|session| &session.runs) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    /// The sessions of which several indexes were measured on every frame, and how often each took the least time there, the
    /// most frequent first.
    pub fn wins(&self) -> (usize, Vec<(String, usize)>) {
        let mut wins: BTreeMap<&str, usize> = BTreeMap::new();
        let rivals = self.sessions().filter(|session| session.runs.len() > 1);
        let measured: Vec<_> = rivals.filter_map(|session| session.best.as_deref()).collect();
        measured.iter().for_each(|best| *wins.entry(best).or_default() += 1);
        let mut wins: Vec<_> = wins.into_iter().map(|(name, n)| (name.to_owned(), n)).collect();
        wins.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        (measured.len(), wins)
    }

    /// How many times as long as `of` an index took (medians of a frame): least, median and largest ratio over the sessions
    /// of which both were measured on every frame.
    pub fn ratio(&self, of: &str, other: &str) -> Option<[f64; 3]> {
        let median_of = |session: &SessionOutcome, name: &str| {
            let run = session.runs.iter().find(|(run, ..)| run == name)?;
            Some(run.1[0]).filter(|us| *us > 0.0)
        };
        let ratio = |session| Some(median_of(session, other)? / median_of(session, of)?);
        let mut ratios: Vec<f64> = self.sessions().filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let middle = ratios.len() / 2;
        let median = match ratios.len() % 2 {
            0 if middle > 0 => (ratios[middle - 1] + ratios[middle]) * 0.5,
            _ => *ratios.get(middle)?,
        };
        Some([*ratios.first()?, median, *ratios.last()?])
    }
}
