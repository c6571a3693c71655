use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    time::{Duration, Instant, SystemTime},
};

use crate::recording::{Event, Flush, Header, RecordingError, RecordingFile, RonWriter};

/// How long to wait before a failed file is tried again.
const RETRY: Duration = Duration::from_secs(3);

/// The file of a session being drawn: every event is in it, as a line of its own, before the next one comes.
///
/// When the disk is full or gone, events wait in memory and the file is tried again from time to time.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    header: Header,
    writer: Option<RonWriter<RecordingFile>>,
    /// Not in the file yet.
    waiting: Vec<Event>,
    failure: Option<(String, Instant)>,
    mark: Option<OpenMark>,
}

impl Journal {
    /// A journal that will make `path` with its first event, or go on with it if it is there.
    pub fn new(path: PathBuf, header: Header) -> Self {
        Self { path, header, writer: None, waiting: Vec::new(), failure: None, mark: None }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the session has a place that a person chose.
    pub fn is_named(&self) -> bool {
        self.mark.is_none()
    }

    /// Why the last events are not in the file, if they are not.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_ref().map(|(reason, _)| reason.as_str())
    }

    /// Events that are not in the file.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Writes an event, now or, if the file fails, later.
    pub fn write(&mut self, event: &Event) {
        if self.waiting.is_empty()
            && let Some(writer) = &mut self.writer
        {
            match writer.write(event) {
                Ok(()) => return,
                Err(error) => self.fail(&error),
            }
        }
        self.waiting.push(event.clone());
        if self.failure.is_none() {
            self.catch_up();
        }
    }

    /// Tries a failed file again if it is time.
    pub fn retry(&mut self) {
        if self.failure.as_ref().is_some_and(|(_, at)| at.elapsed() >= RETRY) {
            self.catch_up();
        }
    }

    fn catch_up(&mut self) {
        let outcome = self.open_writer().and_then(|mut writer| {
            let written = self.waiting.iter().take_while(|event| writer.write(event).is_ok()).count();
            self.waiting.drain(..written);
            // An error of the file shows here once more.
            writer.flush()?;
            Ok(writer)
        });
        match outcome {
            Ok(writer) => {
                self.writer = Some(writer);
                self.failure = None;
            }
            Err(error) => self.fail(&error),
        }
    }

    fn open_writer(&mut self) -> Result<RonWriter<RecordingFile>, RecordingError> {
        // A writer that failed may have left half a line; appending cuts it off.
        self.writer = None;
        let is_there = fs::metadata(&self.path).is_ok_and(|data| data.len() > 0);
        if is_there {
            return Ok(RonWriter::append(&self.path, Flush::EachEvent)?.0);
        }
        if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|error| RecordingError::io(folder, error))?;
        }
        RonWriter::create(&self.path, &self.header, Flush::EachEvent)
    }

    fn fail(&mut self, error: &RecordingError) {
        self.writer = None;
        self.failure = Some((error.to_string(), Instant::now()));
    }

    /// Puts a copy of the session at `to` and goes on there.
    ///
    /// # Errors
    /// The file cannot be written, or its name does not end in `.ron`; the session goes on where it was.
    pub fn move_to(&mut self, to: &Path, events_so_far: u64) -> Result<(), RecordingError> {
        if to.extension().is_none_or(|ending| ending != "ron") {
            return Err(RecordingError::Unknown {
                path: to.to_owned(),
                expected: "a name that ends in .ron".to_owned(),
                found: to.extension().unwrap_or_default().to_string_lossy().into_owned(),
            });
        }
        self.catch_up();
        if let Some((reason, _)) = &self.failure {
            return Err(RecordingError::io(&self.path, io::Error::other(reason.clone())));
        }
        let is_same =
            fs::canonicalize(to).ok().is_some_and(|to| fs::canonicalize(&self.path).is_ok_and(|at| at == to));
        if is_same {
            return Ok(());
        }
        copy_whole(&self.path, to)?;
        let old = std::mem::replace(self, Self::new(to.to_owned(), self.header.clone()));
        self.catch_up();
        // Nobody chose the old place, and everything in it is at the new one.
        if let Some(mark) = old.mark
            && self.failure.is_none()
            && events_so_far > 0
        {
            drop(old.writer);
            // A copy too many does no harm.
            let _ = fs::remove_file(&old.path);
            mark.remove();
        }
        Ok(())
    }

    /// Ends the session on purpose: what is left open after this was left by a crash.
    pub fn close(mut self) {
        if self.failure.is_some() {
            self.catch_up();
        }
        let is_complete = self.waiting.is_empty();
        if let Some(mark) = self.mark.take()
            && is_complete
        {
            mark.remove();
        }
    }
}

/// Copies a file so that `to` is either the old one or the whole new one.
fn copy_whole(from: &Path, to: &Path) -> Result<(), RecordingError> {
    let mut part = to.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    fs::copy(from, &part).and_then(|_| fs::rename(&part, to)).map_err(|error| {
        // The error that counts is the one at hand.
        let _ = fs::remove_file(&part);
        RecordingError::io(to, error)
    })
}

/// A file beside a session that nobody has named: it exists while the session is open, and is locked while its
/// program lives.
#[derive(Debug)]
struct OpenMark {
    path: PathBuf,
    /// Holds the lock.
    _file: File,
}

impl OpenMark {
    fn path_of(session: &Path) -> PathBuf {
        let mut name = session.as_os_str().to_owned();
        name.push(".open");
        PathBuf::from(name)
    }

    /// Makes or takes over the mark; `None` where a living program holds it.
    fn take(session: &Path) -> Option<Self> {
        let path = Self::path_of(session);
        let file = File::options().create(true).truncate(false).write(true).open(&path).ok()?;
        file.try_lock().ok()?;
        Some(Self { path, _file: file })
    }

    fn remove(self) {
        // If it stays, the session is offered once more: nothing is lost.
        let _ = fs::remove_file(&self.path);
    }
}

/// Sessions that nobody has named yet, in a folder of their own.
#[derive(Clone, Debug)]
pub struct Autosaves {
    folder: PathBuf,
}

impl Autosaves {
    /// In this folder, or in the user's own.
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder: folder.unwrap_or_else(default_folder) }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A journal under a new name. Its file is made with the first event.
    pub fn create(&self, stem: &str, header: Header) -> Journal {
        // Without a folder the mark cannot be made; the journal says why when the first event comes.
        let _ = fs::create_dir_all(&self.folder);
        let stamp = time_stamp(SystemTime::now());
        for number in 1..1000 {
            let name = if number == 1 {
                format!("{stem}-{stamp}.ron")
            } else {
                format!("{stem}-{stamp}-{number}.ron")
            };
            let path = self.folder.join(name);
            if !path.exists()
                && !OpenMark::path_of(&path).exists()
                && let Some(mark) = OpenMark::take(&path)
            {
                return Journal { mark: Some(mark), ..Journal::new(path, header) };
            }
        }
        Journal::new(self.folder.join(format!("{stem}-{stamp}-{}.ron", std::process::id())), header)
    }

    /// The newest session that was left open by a program that is gone.
    pub fn left_open(&self) -> Option<PathBuf> {
        let entries = fs::read_dir(&self.folder).ok()?;
        let mut found: Vec<(SystemTime, PathBuf)> = Vec::new();
        for mark in entries.flatten().map(|entry| entry.path()) {
            if mark.extension().is_none_or(|ending| ending != "open") {
                continue;
            }
            let session = mark.with_extension("");
            let Some(held) = OpenMark::take(&session) else { continue };
            match fs::metadata(&session).and_then(|data| data.modified()) {
                Ok(modified) => found.push((modified, session)),
                // Nothing was drawn: the mark is all there is.
                Err(_) => held.remove(),
            }
        }
        found.into_iter().max().map(|(_, session)| session)
    }

    /// A journal that goes on with a session of this folder.
    pub fn resume(&self, session: &Path, header: Header) -> Journal {
        Journal { mark: OpenMark::take(session), ..Journal::new(session.to_owned(), header) }
    }
}

fn default_folder() -> PathBuf {
    let from = |name: &str, rest: &str| {
        std::env::var_os(name).filter(|value| !value.is_empty()).map(|value| PathBuf::from(value).join(rest))
    };
    from("XDG_DATA_HOME", "osp/sketches")
        .or_else(|| from("APPDATA", "osp/sketches"))
        .or_else(|| from("HOME", ".local/share/osp/sketches"))
        .unwrap_or_else(|| PathBuf::from(".osp/sketches"))
}

/// `20260131-235959`, in universal time. The date from the number of days: Howard Hinnant, "chrono-Compatible
/// Low-Level Date Algorithms", 2013.
fn time_stamp(now: SystemTime) -> String {
    let secs = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second_of_day) = (secs / 86_400, secs % 86_400);
    // Eras of 400 years that begin in March, so that the leap day is the last of a year.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    let (hour, minute, second) = (second_of_day / 3600, second_of_day / 60 % 60, second_of_day % 60);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{second:02}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{self, OpenOptions};

    fn events_in(path: &Path) -> usize {
        recording::open(path, &OpenOptions::default()).expect("a recording").flatten().count()
    }

    fn header() -> Header {
        Header::new("test", "a test")
    }

    #[test]
    fn dates_are_dates() {
        let at = |secs| time_stamp(SystemTime::UNIX_EPOCH + Duration::from_secs(secs));
        assert_eq!(at(0), "19700101-000000");
        assert_eq!(at(951_782_400), "20000229-000000");
        assert_eq!(at(1_767_225_599), "20251231-235959");
        assert_eq!(at(1_767_225_600), "20260101-000000");
    }

    #[test]
    fn every_event_is_in_the_file_at_once_and_a_crash_is_found() {
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let mut journal = autosaves.create("sketch", header());
        assert!(!journal.path().exists(), "nothing is written before the first event");
        assert!(!journal.is_named());
        for count in 1..5 {
            journal.write(&Event::Undo { t: 0.0 });
            assert_eq!(events_in(journal.path()), count);
        }
        assert_eq!(autosaves.left_open(), None, "its program lives");
        let path = journal.path().to_owned();
        // A crash: the lock goes with the program, the mark stays.
        drop(journal);
        assert_eq!(autosaves.left_open(), Some(path.clone()));
        let mut journal = autosaves.resume(&path, header());
        journal.write(&Event::Redo { t: 1.0 });
        assert_eq!(events_in(&path), 5);
        journal.close();
        assert_eq!(autosaves.left_open(), None, "closed on purpose");
        assert!(path.exists());
    }

    #[test]
    fn a_session_without_events_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let (first, second) = (autosaves.create("sketch", header()), autosaves.create("sketch", header()));
        assert_ne!(first.path(), second.path());
        first.close();
        drop(second);
        assert_eq!(autosaves.left_open(), None);
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
    }

    #[test]
    fn saving_elsewhere_moves_the_session() {
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().join("auto")));
        let mut journal = autosaves.create("sketch", header());
        journal.write(&Event::Undo { t: 0.0 });
        let old = journal.path().to_owned();
        let refused = journal.move_to(&folder.path().join("no/such/folder.ron"), 1);
        assert!(refused.expect_err("no folder").to_string().contains("folder.ron"));
        assert_eq!(journal.path(), old);
        let new = folder.path().join("mine.ron");
        journal.move_to(&new, 1).expect("a copy");
        journal.write(&Event::Redo { t: 0.0 });
        assert_eq!(events_in(&new), 2);
        assert!(!old.exists() && journal.is_named());
        journal.move_to(&new, 2).expect("to the same place");
        assert_eq!(events_in(&new), 2);
    }

    #[test]
    fn events_wait_where_the_file_cannot_be_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("blocked").join("a.ron");
        // A file where a folder should be.
        fs::write(folder.path().join("blocked"), "").expect("a file");
        let mut journal = Journal::new(path.clone(), header());
        journal.write(&Event::Undo { t: 0.0 });
        journal.write(&Event::Redo { t: 0.0 });
        assert_eq!(journal.waiting(), 2);
        assert!(journal.failure().is_some());
        fs::remove_file(folder.path().join("blocked")).expect("removed");
        journal.catch_up();
        assert_eq!((journal.waiting(), journal.failure()), (0, None));
        assert_eq!(events_in(&path), 2);
    }
}
