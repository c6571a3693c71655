//! Files are whole or not there, whatever ends the program.

use std::fs;

use super::{names, session_text, write_session};
use crate::OSP;
use osp_testkit::{stderr, temp, wait_until};

#[test]
fn a_table_appears_when_all_sessions_are_played_or_not_at_all() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let damaged = session_text(0.0).replacen("Point(", "Pont(", 1);
    fs::write(folder.path().join("b.ron"), damaged).expect("written");
    let args = ["replay", "a.ron", "b.ron", "--csv", "t.csv"];
    let old = "recording,index,frame,old\n";
    for existing in [None, Some(old)] {
        if let Some(text) = existing {
            fs::write(folder.path().join("t.csv"), text).expect("written");
        }
        OSP.refused_in(folder.path(), args);
        assert_eq!(fs::read_to_string(folder.path().join("t.csv")).ok().as_deref(), existing);
    }
    assert_eq!(names(folder.path()), ["a.ron", "b.ron", "t.csv"]);
}

#[cfg(feature = "render")]
#[test]
fn render_treats_damage_as_replay_does() {
    let folder = temp();
    let damaged = session_text(0.0).replacen("Point(t: 2", "Pont(t: 2", 1);
    fs::write(folder.path().join("damaged.ron"), damaged).expect("written");
    let replay = OSP.run_in(folder.path(), ["replay", "damaged.ron"]);
    super::assert_refused(&replay, &["damaged.ron, line "]);
    if let Err(error) = osp_render::Gpu::headless() {
        eprintln!("skipped `osp render`: {error}");
        return;
    }
    let render = OSP.run_in(folder.path(), ["render", "damaged.ron", "p.png", "--size", "32x32"]);
    assert_eq!(render.status.code(), Some(2));
    assert_eq!(stderr(&render), stderr(&replay));
    assert_eq!(names(folder.path()), ["damaged.ron"]);
    OSP.done_in(folder.path(), ["render", "damaged.ron", "p.png", "--size", "32x32", "--lenient"]);
}

/// A signal while a file is being written: it ends the program as it always does, and nothing is left.
#[cfg(unix)]
#[test]
fn a_signal_leaves_nothing_unfinished() {
    use std::{
        os::unix::process::ExitStatusExt,
        process::{Command, Stdio},
    };
    let folder = temp();
    let folder = folder.path();
    fs::write(folder.join("old.ron"), "old").expect("written");
    for (name, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        // What nohup and a shell's background start inherits it, and so would the program.
        if is_ignored(number) {
            eprintln!("skipped: these tests were started with SIG{name} ignored");
            continue;
        }
        let args = ["synth", "scribble", "--polygons", "4000000000", "old.ron", "--force"];
        let mut child =
            OSP.command_in(folder, args).stderr(Stdio::null()).spawn().expect("the program starts");
        let is_writing = || {
            let unfinished = names(folder).into_iter().find(|name| name.starts_with(".unfinished-"));
            unfinished.is_some_and(|name| fs::metadata(folder.join(name)).is_ok_and(|data| data.len() > 0))
        };
        wait_until("it to write", is_writing);
        let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
        if !sent.is_ok_and(|status| status.success()) {
            eprintln!("skipped: no kill(1)");
            child.kill().expect("ours");
            child.wait().expect("ours");
            return;
        }
        let status = child.wait().expect("ours");
        assert_eq!(status.signal(), Some(number as i32), "{name}: {status:?}");
        assert_eq!(names(folder), ["old.ron"], "{name}");
        assert_eq!(fs::read_to_string(folder.join("old.ron")).expect("there"), "old");
    }
}

#[cfg(unix)]
fn is_ignored(signal: u32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// `nohup` and a shell's background start a program with signals ignored.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_is_ignored_stays_ignored() {
    use std::process::Command;
    let folder = temp();
    let script = format!(
        "trap '' INT HUP; exec {} synth scribble --polygons 400000 out.ron",
        OSP.0.replace('\'', "'\\''")
    );
    let mut child =
        Command::new("sh").args(["-c", &script]).current_dir(folder.path()).spawn().expect("a shell");
    wait_until("it to write", || {
        child.try_wait().expect("ours").is_some() || !names(folder.path()).is_empty()
    });
    for signal in ["-INT", "-HUP"] {
        Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill(1)");
    }
    assert!(child.wait().expect("ours").success());
    assert_eq!(names(folder.path()), ["out.ron"]);
}

/// Whoever reads a pipe may have seen enough, of a session as of a table.
#[cfg(unix)]
#[test]
fn a_pipe_that_nobody_reads_any_more_is_no_error() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    for args in [
        &["import", "a.ron", "-"][..],
        &["synth", "scribble", "--polygons", "2000", "-"],
        &["replay", "a.ron", "--csv", "-"],
    ] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = OSP.command_in(folder.path(), args).stdout(writer).output().expect("osp");
        assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    }
}
