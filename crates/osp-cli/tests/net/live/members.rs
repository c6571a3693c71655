//! Members as processes, and what they leave behind.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
};

use crate::OSP;
use osp_session::recording::{Author, Event, OpenOptions};
use osp_testkit::wait_until;
use serde_json::Value;

pub(crate) fn recording(name: &str) -> String {
    format!("{}/recordings/{name}", osp_testkit::ROOT)
}

/// `osp join` on its way.
pub(crate) struct Member {
    child: Option<Child>,
    pub(crate) file: PathBuf,
    /// What it prints to standard error.
    said: PathBuf,
}

/// How a member has ended.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) said: String,
    pub(crate) summary: Value,
    pub(crate) bytes: Vec<u8>,
}

impl Member {
    pub(crate) fn join(folder: &Path, file: &str, address: &str, args: &[&str]) -> Self {
        Self::run(&[OSP.0], folder, file, address, args)
    }

    /// Somebody who stays until the test ends them, and with them the session of those who wait until it is empty.
    pub(crate) fn keeper(folder: &Path, address: &str) -> Self {
        let mut keeper = Self::join(folder, "keeper.ron", address, &["--name", "keeper"]);
        keeper.wait_for(|text| text.contains("Join("));
        keeper
    }

    /// With what stands before the arguments.
    pub(crate) fn run(before: &[&str], folder: &Path, file: &str, address: &str, args: &[&str]) -> Self {
        let file = folder.join(file);
        let mut command = Command::new(before[0]);
        command
            .args(&before[1..])
            .args(["join", address])
            .arg(&file)
            .arg("--json")
            .args(args)
            .current_dir(folder);
        let said = file.with_extension("said");
        let errors = fs::File::create(&said).expect("a file");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(errors);
        Self { child: Some(command.spawn().expect("the program starts")), file, said }
    }

    /// Waits until its recording holds something.
    pub(crate) fn wait_for(&mut self, what: impl Fn(&str) -> bool) {
        self.wait_for_text(&self.file.clone(), what);
    }

    /// Waits until it has noticed that the server is away.
    pub(crate) fn wait_for_silence(&mut self) {
        self.wait_until_it_says(|said| {
            let last = |of: &str| said.rfind(of).map_or(0, |at| at + 1);
            last("does not answer").max(last("connecting to ")) > last("connected to ")
        });
    }

    pub(crate) fn wait_until_it_says(&mut self, what: impl Fn(&str) -> bool) {
        self.wait_for_text(&self.said.clone(), what);
    }

    fn wait_for_text(&mut self, path: &Path, what: impl Fn(&str) -> bool) {
        wait_until("a member", || {
            let has_ended = self.child.as_mut().expect("it runs").try_wait().expect("its state").is_some();
            let is_so = what(&fs::read_to_string(path).unwrap_or_default());
            assert!(is_so || !has_ended, "it has ended: {}", self.take().said);
            is_so
        });
    }

    /// Waits until so many lines are in its recording.
    pub(crate) fn wait_for_lines(&mut self, lines: usize) {
        self.wait_for(|text| text.lines().count() >= lines);
    }

    /// Ends it at once, without a word.
    pub(crate) fn kill(mut self) -> Vec<u8> {
        let mut child = self.child.take().expect("it runs");
        child.kill().expect("killed");
        child.wait().expect("ended");
        fs::read(&self.file).expect("a recording")
    }

    /// As Ctrl-C does.
    #[cfg(unix)]
    pub(crate) fn interrupt(&self) {
        let id = self.child.as_ref().expect("it runs").id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
    }

    fn take(&mut self) -> Ended {
        let output: Output = self.child.take().expect("it runs").wait_with_output().expect("its output");
        let said = fs::read_to_string(&self.said).expect("what it said");
        let summary = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
        let bytes = fs::read(&self.file).unwrap_or_default();
        Ended { code: output.status.code(), said, summary, bytes }
    }

    /// Waits until it has ended by itself.
    pub(crate) fn end(mut self) -> Ended {
        self.take()
    }

    /// The same, and it has to have ended well.
    pub(crate) fn end_well(self) -> Ended {
        let file = self.file.clone();
        let ended = self.end();
        assert_eq!(ended.code, Some(0), "{}: {}", file.display(), ended.said);
        assert_eq!(ended.summary["undelivered"], 0, "{}", ended.said);
        ended
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Ended {
    pub(crate) fn count(&self, name: &str) -> u64 {
        self.summary["counts"][name].as_u64().unwrap_or_else(|| panic!("{name} in {}", self.summary))
    }
}

/// That all have written the same, and that their scenes are the same.
pub(crate) fn assert_same(members: &[Ended]) {
    let first = &members[0];
    assert!(first.bytes.len() > 100, "{}", first.said);
    for other in &members[1..] {
        assert!(
            first.bytes == other.bytes,
            "recordings of {} and {} bytes",
            first.bytes.len(),
            other.bytes.len()
        );
        for what in ["xxh3", "bytes", "session"] {
            assert_eq!(first.summary[what], other.summary[what], "{what}");
        }
    }
    assert!(first.summary["session"]["strokes"].as_u64().expect("a number") > 0);
}

/// What hands have drawn, by the name of the author: every place of a point, in order.
pub(crate) fn places(path: &Path) -> BTreeMap<String, Vec<[u32; 3]>> {
    let (mut names, mut places) = (BTreeMap::new(), BTreeMap::<String, Vec<_>>::new());
    for event in osp_session::recording::open(path, &OpenOptions::default()).expect("a recording") {
        match event.expect("an event") {
            Event::Join { author, name, .. } => _ = names.insert(author, name),
            Event::Point { stroke, p, .. } => {
                let name = names.get(&stroke.author()).cloned().unwrap_or_default();
                places.entry(name).or_default().push(p.to_array().map(f32::to_bits));
            }
            _ => {}
        }
    }
    places
}

/// What an author of a shipped session has drawn; of all of them, if none is named.
pub(crate) fn drawn(path: &str, author: Option<u32>) -> Vec<[u32; 3]> {
    let mut places = Vec::new();
    for event in osp_session::recording::open(Path::new(path), &OpenOptions::default()).expect("a recording")
    {
        if let Event::Point { stroke, p, .. } = event.expect("an event")
            && author.is_none_or(|author| stroke.author() == Author(author))
        {
            places.push(p.to_array().map(f32::to_bits));
        }
    }
    assert!(places.len() > 100, "{path}");
    places
}
