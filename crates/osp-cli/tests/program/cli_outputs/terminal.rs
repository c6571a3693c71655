//! Output for a terminal: narrow tables, a verdict, completions.

use crate::OSP;
use osp_testkit::{shipped_session, stderr, stdout, temp};

fn grow() -> String {
    shipped_session("grow")
}

#[test]
fn a_narrow_terminal_gets_a_table_that_fits() {
    let folder = temp();
    let args = ["replay", &grow(), "--pace", "samples:200", "--index", "osp,brute-force"];
    let replay = |columns: &str| {
        let output =
            OSP.command_in(folder.path(), args).env("COLUMNS", columns).output().expect("the program starts");
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let missing = |columns: &str| {
        let said = replay(columns);
        said.lines().find(|line| line.starts_with("Too wide for the terminal:")).map(str::to_owned)
    };
    assert!(
        missing("80")
            .is_some_and(|line| line.contains(" memory ") && line.ends_with("--json has all columns."))
    );
    assert_eq!(missing("200"), None);
    let table = |columns: &str| {
        let said = replay(columns);
        said.lines().filter(|line| line.starts_with(['─', '═', ' '])).map(str::to_owned).collect::<Vec<_>>()
    };
    let (narrow, wide) = (table("80"), table("200"));
    assert_eq!(narrow.len(), wide.len());
    assert!(narrow.iter().all(|line| line.chars().count() <= 80), "{}", narrow.join("\n"));
    assert!(wide.iter().any(|line| line.chars().count() > 80));
    for (name, is_in_narrow) in [("frame p50", true), ("p99", true), ("memory", false), ("visible", false)] {
        let has = |lines: &[String]| lines.iter().any(|line| line.contains(name));
        assert_eq!((has(&narrow), has(&wide)), (is_in_narrow, true), "{name}");
    }
}

#[test]
fn shells_get_completions() {
    let folder = temp();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = OSP.done_in(folder.path(), ["completions", shell]);
        assert!(script.contains("draw-index") && script.contains("occlusion"), "{shell}");
    }
    assert_eq!(OSP.run_in(folder.path(), ["completions", "csh"]).status.code(), Some(2));
}
