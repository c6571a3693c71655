//! The window on Wayland: a compositor that is itself a window of the X server, so that the same hand drives it.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Stdio},
};

use super::desk::{Desk, Ours, all_there};
use osp_testkit::{stdout, wait_for};

/// No borders, a fixed size.
const SWAY: &str = "output X11-1 resolution 1200x800\ndefault_border none\n";

/// A compositor, and where its socket is.
struct Compositor {
    _process: Ours,
    runtime: PathBuf,
    socket: String,
    /// Its window on the X server.
    window: String,
}

impl Compositor {
    /// Starts it, or says why it cannot be.
    fn new(desk: &Desk) -> Option<Self> {
        if let Err(missing) = all_there(&["sway", "setpriv"]) {
            assert!(!osp_testkit::nothing_may_be_skipped(), "{missing} is not installed");
            eprintln!("skipped: {missing} is not installed");
            return None;
        }
        let runtime = desk.folder().join("wayland");
        fs::create_dir(&runtime).expect("a folder");
        let config = runtime.join("sway.conf");
        fs::write(&config, SWAY).expect("a file");
        // Sway refuses to run as root: then it runs as nobody.
        let is_root = Command::new("id").arg("-u").output().expect("id").stdout == b"0\n";
        let mut sway = if is_root {
            let mut to_nobody = Command::new("chown");
            to_nobody.args(["-R", "nobody"]).arg(&runtime);
            assert!(to_nobody.status().expect("chown").success());
            let mut path_in = Command::new("chmod");
            path_in.args(["a+x"]).arg(desk.folder());
            assert!(path_in.status().expect("chmod").success());
            let mut sway = desk.command("setpriv");
            sway.args(["--reuid", "nobody", "--regid", "nogroup", "--clear-groups", "sway"]);
            sway
        } else {
            desk.command("sway")
        };
        let log = desk.folder().join("sway.log");
        let process = sway
            .arg("-c")
            .arg(&config)
            .env("WLR_BACKENDS", "x11")
            .env("WLR_RENDERER", "pixman")
            .env("XDG_RUNTIME_DIR", &runtime)
            .env("XDG_CONFIG_HOME", &runtime)
            .env("HOME", &runtime)
            .stdout(Stdio::null())
            .stderr(fs::File::create(&log).expect("a file"))
            .spawn()
            .expect("sway");
        let mut process = Ours(process);
        let (socket, window) = wait_for("sway", || {
            if let Some(status) = process.0.try_wait().expect("a process") {
                panic!("sway: {status}: {}", fs::read_to_string(&log).expect("its log"));
            }
            let names = fs::read_dir(&runtime).expect("a folder").filter_map(|entry| {
                let name = entry.ok()?.file_name().into_string().ok()?;
                (name.starts_with("wayland-") && !name.ends_with(".lock")).then_some(name)
            });
            let listed = desk.command("wmctrl").arg("-l").output().expect("wmctrl");
            let listed = stdout(&listed);
            let line = listed.lines().find(|line| line.contains("wlroots"));
            // xdotool, which drives it, counts in tens.
            let window = line.and_then(|line| u64::from_str_radix(line.get(2..10)?, 16).ok());
            Some((names.last()?, window?))
        });
        Some(Self { _process: process, runtime, socket, window: window.to_string() })
    }
}

#[test]
fn the_window_draws_on_wayland_too() {
    let Some(desk) = Desk::new() else { return };
    let Some(compositor) = Compositor::new(&desk) else { return };
    let session = desk.folder().join("mine.ron");
    let mut window = desk.open_within(
        &compositor.window,
        &[("WAYLAND_DISPLAY", compositor.socket.as_ref()), ("XDG_RUNTIME_DIR", compositor.runtime.as_ref())],
        &["sketch", session.to_str().expect("a path")],
    );
    // As large as the compositor's only output: it has come there and not to the X server.
    window.until_last("its size", |frame| frame["window"] == serde_json::json!([1200, 800]));
    window.drag(1, &[(500, 500), (560, 510), (620, 530), (700, 540), (760, 520)]);
    window.until_last("a stroke", |frame| frame["strokes"] == 1 && frame["drawn"].as_u64() > Some(2));
    window.settle();
    window.keep_picture("wayland.png");
    let (pixels, ..) = window.picture();
    let orange = |[r, g, b]: &&[u8; 3]| *r > 180 && (100..200).contains(g) && *b < 110;
    assert!(pixels.iter().filter(orange).count() > 1_000, "the stroke is seen");
    window.key("ctrl+z");
    window.until_last("no stroke", |frame| frame["drawn"] == 0);
    window.key("ctrl+q");
    assert!(window.wait().success());
    let text = fs::read_to_string(&session).expect("the session");
    assert!(text.contains("Begin(") && text.contains("Undo("), "{text}");
}
