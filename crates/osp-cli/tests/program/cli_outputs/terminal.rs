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

/// As in a shell, which sets `COLUMNS` but does not pass it on.
#[cfg(target_os = "linux")]
#[test]
fn a_narrow_terminal_is_asked_for_its_width() {
    let folder = temp();
    let line = format!(
        "stty rows 24 cols 80; '{}' replay '{}' --pace samples:200 --index osp,brute-force",
        OSP.0,
        grow()
    );
    let output = std::process::Command::new("script")
        .args(["-q", "-e", "-c", &line, "/dev/null"])
        .current_dir(folder.path())
        .env_remove("COLUMNS")
        .output();
    let Ok(output) = output else {
        eprintln!("skipped: the program `script`, which opens a terminal, is not there");
        return;
    };
    let said = stdout(&output);
    let lines = || said.lines().map(str::trim_end).filter(|line| line.starts_with(['─', '═']));
    assert!(lines().count() > 0, "{said}");
    assert!(lines().all(|line| line.chars().count() <= 80), "{said}");
}

#[test]
fn a_replay_ends_with_which_index_is_the_fastest() {
    let folder = temp();
    let replay = |index: &str| {
        stdout(&OSP.run_in(folder.path(), ["replay", &grow(), "--pace", "samples:200", "--index", index]))
    };
    let said = replay("osp,octree-rebuild");
    let verdict = said.lines().find(|line| line.contains("the least time")).expect("a verdict");
    assert!(verdict.contains("osp") && verdict.contains("an octree rebuilt"), "{verdict}");
    assert!(!replay("osp").contains("the least time"), "there is nothing to compare");
}

/// The terminal wraps only paragraphs, which are single lines in the text. Rows of tables have at most 80 columns.
#[test]
fn trailing_help_has_no_line_breaks_within_paragraphs() {
    let list = OSP.done(["--help"]);
    let (_, list) = list.split_once("Commands:\n").expect("commands");
    let commands = list.lines().take_while(|line| !line.is_empty());
    let names: Vec<&str> = commands.filter_map(|line| line.strip_prefix("  ")?.split(' ').next()).collect();
    assert!(names.contains(&"replay") && names.contains(&"send"), "{names:?}");
    for name in names.into_iter().filter(|name| !name.is_empty() && *name != "help") {
        let help = OSP.command([name, "--help"]).env("COLUMNS", "2000").output().expect("the program starts");
        let help = stdout(&help);
        let examples = help.split_once("Examples:\n").map(|(_, examples)| examples);
        assert!(examples.is_some_and(|lines| lines.contains(&format!("  osp {name}"))), "{name}: {help}");
        let (_, trailing) = help.rsplit_once("Print help").expect("the last option");
        for line in trailing.lines().skip(1).filter(|line| !line.is_empty()) {
            let is_row = line.starts_with(' ') && line.chars().count() <= 80;
            assert!(is_row || (!line.starts_with(' ') && line.ends_with(['.', ':'])), "{name}: {line}");
        }
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
