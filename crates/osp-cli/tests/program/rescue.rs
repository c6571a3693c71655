//! What a person reads who has a damaged session, and what they can do then.

use std::{fs, path::Path};

use crate::OSP;
use osp_testkit::stderr;

fn osp(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = OSP.run_in(folder, arguments);
    (output.status.code(), stderr(&output))
}

fn damaged(folder: &Path, name: &str) {
    let session = osp_testkit::at("recordings/scribble.ron");
    let text = fs::read_to_string(session).expect("the session").replacen("Point(", "Pont(", 1);
    fs::write(folder.join(name), text).expect("written");
}

#[test]
fn whoever_refuses_a_damaged_session_names_what_reads_the_rest() {
    let folder = tempfile::tempdir().expect("a folder");
    damaged(folder.path(), "my house.ron");
    let (code, said) = osp(folder.path(), &["replay", "my house.ron"]);
    let import = "`osp import --lenient 'my house.ron' 'my house-rescued.ron'` keeps what can be read";
    assert_eq!((code, said.lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("my house.ron, line ") && said.contains(import), "{said}");
    // The words are a command that works.
    let import = ["import", "--lenient", "my house.ron", "my house-rescued.ron"];
    let (code, said) = osp(folder.path(), &import);
    assert_eq!((code, said.contains("damaged parts skipped: 1")), (Some(0), true), "{said}");
    let (code, said) = osp(folder.path(), &["info", "my house-rescued.ron"]);
    assert_eq!(code, Some(0), "{said}");
}

#[cfg(feature = "window")]
#[test]
fn a_window_draws_on_the_rest() {
    let folder = tempfile::tempdir().expect("a folder");
    damaged(folder.path(), "a.ron");
    let (code, said) = osp(folder.path(), &["sketch", "a.ron", "--autosave", "autosaves"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("`osp sketch --lenient a.ron` draws on a copy of it"), "{said}");
    // Without a display this is as far as it gets, and nothing is left behind.
    let output = OSP
        .without_display_in(folder.path(), ["sketch", "a.ron", "--autosave", "autosaves", "--lenient"])
        .output()
        .expect("osp");
    let said = stderr(&output);
    assert!(said.contains("damaged parts skipped: 1"), "{said}");
    assert_eq!(fs::read_dir(folder.path().join("autosaves")).expect("the folder").count(), 0);
}
