//! A display server of our own with a window manager, and a hand for its pointer.

use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
};

use crate::OSP;
use osp_testkit::{stderr, stdout, wait_until};
use serde_json::Value;

/// One window at a time: each keeps the processor busy.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A process that ends with the test.
pub(crate) struct Ours(pub(crate) Child);

impl Drop for Ours {
    fn drop(&mut self) {
        // It may have ended on its own.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A graphics card that is none, with room for three monitors.
const DUMMY_CARD: &str = r#"
Section "Device"
  Identifier "card"
  Driver "dummy"
  VideoRam 256000
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5-1000
  VertRefresh 5-200
EndSection
Section "Screen"
  Identifier "screen"
  Device "card"
  Monitor "monitor"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Virtual 2880 720
  EndSubSection
EndSection
"#;

/// Whether all programs are installed; else the first that is not.
pub(crate) fn all_there<'a>(tools: &[&'a str]) -> Result<(), &'a str> {
    let is_there = |tool: &&&str| {
        std::env::var_os("PATH")
            .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(tool).is_file()))
    };
    tools.iter().find(|tool| !is_there(tool)).map_or(Ok(()), |missing| Err(*missing))
}

/// Starts a display server and waits until it says the number of its display; `None` if it ends instead.
fn start_server(mut server: Command) -> Option<(Ours, String)> {
    let mut server =
        server.args(["-displayfd", "1"]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
    let output = server.stdout.take().expect("a pipe");
    let server = Ours(server);
    let mut number = String::new();
    BufReader::new(output).read_line(&mut number).expect("a display number");
    (!number.trim().is_empty()).then(|| (server, format!(":{}", number.trim())))
}

/// A display with nothing on it.
pub(crate) struct Desk {
    display: String,
    folder: tempfile::TempDir,
    /// Opened so far.
    windows: AtomicU32,
    _window_manager: Ours,
    _server: Ours,
    _turn: MutexGuard<'static, ()>,
}

impl Desk {
    /// A display, or a line that says why there is none.
    pub(crate) fn new() -> Option<Self> {
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(missing) = all_there(&["Xvfb", "xdotool", "openbox", "wmctrl", "import"]) {
            assert!(!osp_testkit::nothing_may_be_skipped(), "{missing} is not installed");
            eprintln!("skipped: {missing} is not installed");
            return None;
        }
        let folder = tempfile::tempdir().expect("a folder");
        // Without -noreset the server forgets its clients when the last of those that come and go has gone.
        let mut server = Command::new("Xvfb");
        server.args(["-screen", "0", "1400x1000x24", "-nolisten", "tcp", "-noreset"]);
        let (server, display) = start_server(server).expect("Xvfb");
        Some(Self::on(server, display, folder, turn))
    }

    /// A display with three monitors in a row: `DUMMY0` of 1280x720 pixels, `DUMMY1` and `DUMMY2` of 800x600; or a line that
    /// says why there is none. No server without a graphics card but X.Org's with the driver `dummy` has several, and it
    /// cannot be started everywhere.
    pub(crate) fn with_three_monitors() -> Option<Self> {
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(missing) = all_there(&["Xorg", "xrandr", "xdotool", "openbox", "wmctrl", "import"]) {
            eprintln!("skipped: {missing} is not installed");
            return None;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let (config, log) = (folder.path().join("xorg.conf"), folder.path().join("xorg.log"));
        fs::write(&config, DUMMY_CARD).expect("a file");
        let mut server = Command::new("Xorg");
        server.args(["-noreset", "-nolisten", "tcp", "-sharevts", "-novtswitch", "-config"]);
        server.arg(&config).arg("-logfile").arg(&log);
        let Some((server, display)) = start_server(server) else {
            eprintln!("skipped: X.Org does not start with the driver `dummy`");
            return None;
        };
        for arguments in [
            &["--output", "DUMMY0", "--mode", "1280x720", "--pos", "0x0"][..],
            &["--addmode", "DUMMY1", "800x600"],
            &["--addmode", "DUMMY2", "800x600"],
            &["--output", "DUMMY1", "--mode", "800x600", "--pos", "1280x0"],
            &["--output", "DUMMY2", "--mode", "800x600", "--pos", "2080x0"],
        ] {
            let ran =
                Command::new("xrandr").env("DISPLAY", &display).args(arguments).output().expect("xrandr");
            if !ran.status.success() {
                eprintln!("skipped: xrandr: {}", stderr(&ran).trim());
                return None;
            }
        }
        Some(Self::on(server, display, folder, turn))
    }

    fn on(server: Ours, display: String, folder: tempfile::TempDir, turn: MutexGuard<'static, ()>) -> Self {
        let window_manager = Command::new("openbox")
            .env("DISPLAY", &display)
            .env("HOME", folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("openbox");
        let windows = AtomicU32::new(0);
        let desk = Self {
            display,
            folder,
            windows,
            _window_manager: Ours(window_manager),
            _server: server,
            _turn: turn,
        };
        desk.await_window_manager();
        desk
    }

    /// The windows with such titles: place and size, pixels.
    pub(crate) fn windows(&self, titles: &str) -> Vec<([i32; 4], String)> {
        let listed = self.command("wmctrl").args(["-l", "-G"]).output().expect("wmctrl");
        let listed = stdout(&listed);
        let of_line = |line: &str| {
            let mut words = line.split_ascii_whitespace().skip(2);
            let mut number = || words.next()?.parse().ok();
            let place = [number()?, number()?, number()?, number()?];
            let title = words.skip(1).collect::<Vec<_>>().join(" ");
            title.starts_with(titles).then_some((place, title))
        };
        let mut found: Vec<_> = listed.lines().filter_map(of_line).collect();
        found.sort();
        found
    }

    /// A part of what the display shows: x, y, width and height. Red, green and blue of each pixel.
    pub(crate) fn picture(&self, [x, y, width, height]: [i32; 4]) -> Vec<[u8; 3]> {
        let part = format!("{width}x{height}+{x}+{y}");
        let taken = self
            .command("import")
            .args(["-window", "root", "-crop", &part, "-depth", "8", "rgb:-"])
            .output()
            .expect("import");
        let pixels: Vec<[u8; 3]> = taken.stdout.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        assert_eq!(pixels.len(), (width * height) as usize, "{}", stderr(&taken));
        pixels
    }

    /// Keeps a picture of the whole display, if somebody wants to see it.
    pub(crate) fn keep_picture(&self, name: &str) {
        let Some(folder) = std::env::var_os("OSP_SCREENSHOTS") else { return };
        let path = Path::new(&folder).join(name);
        let taken = self.command("import").args(["-window", "root"]).arg(path).status().expect("import");
        assert!(taken.success());
    }

    /// A window that opens while the window manager is starting may never be shown.
    fn await_window_manager(&self) {
        wait_until("openbox", || self.command("wmctrl").arg("-m").output().expect("wmctrl").status.success());
    }

    /// A folder that goes with the desk.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let mut command = Command::new(program);
        command
            .env("DISPLAY", &self.display)
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .env("XDG_DATA_HOME", self.folder.path().join("data"))
            .env("XDG_CONFIG_HOME", self.folder.path().join("config"))
            .env_remove("WAYLAND_DISPLAY");
        command
    }

    /// Runs `osp` to its end.
    pub(crate) fn osp(&self, arguments: &[&str]) -> std::process::Output {
        self.command(OSP.0).args(arguments).output().expect("osp")
    }

    /// Opens a window of `osp` and waits until it is there.
    pub(crate) fn open(&self, arguments: &[&str]) -> OspWindow<'_> {
        let mut window = self.start(arguments, None, &[]);
        window.until("the session and its first frames", |frames| {
            frames.len() >= 3 && frames.last().is_some_and(|frame| frame["reading"] == false)
        });
        window.find();
        window
    }

    /// Opens a window of `osp` on a display that is itself a window here and that these variables name.
    pub(crate) fn open_within(
        &self,
        display: &str,
        variables: &[(&str, &OsStr)],
        arguments: &[&str],
    ) -> OspWindow<'_> {
        let mut window = self.start(arguments, None, variables);
        window.until("the first frames", |frames| frames.len() >= 3);
        display.clone_into(&mut window.id);
        window.become_active();
        window
    }

    fn start(&self, arguments: &[&str], trace: Option<&str>, variables: &[(&str, &OsStr)]) -> OspWindow<'_> {
        let number = self.windows.fetch_add(1, Ordering::Relaxed);
        let file = |name: &str| self.folder.path().join(format!("{name}-{number}.txt"));
        let (own_trace, stderr) = (file("trace"), file("stderr"));
        // A file that would grow beyond a limit is refused, as on a full disk, instead of ending the program.
        let process = self
            .command("sh")
            .args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\"", OSP.0])
            .args(arguments)
            .args(["--trace", trace.unwrap_or(own_trace.to_str().expect("a path"))])
            .envs(variables.iter().copied())
            .stdout(Stdio::null())
            .stderr(File::create(&stderr).expect("a file"))
            .spawn()
            .expect("osp");
        OspWindow {
            desk: self,
            process: Some(Ours(process)),
            trace: own_trace,
            stderr,
            read: 0,
            frames: Vec::new(),
            id: String::new(),
        }
    }
}

/// An open window of `osp`.
pub(crate) struct OspWindow<'d> {
    desk: &'d Desk,
    process: Option<Ours>,
    trace: PathBuf,
    stderr: PathBuf,
    /// Bytes of the trace that have been read.
    read: usize,
    frames: Vec<Value>,
    id: String,
}

impl OspWindow<'_> {
    fn find(&mut self) {
        let process = self.process_id().to_string();
        let (desk, mut id) = (self.desk, String::new());
        self.until("a window", |_| {
            // The window manager may have been too busy to show it.
            let again = ["search", "--all", "--pid", &process, "--name", "osp", "windowmap", "%@"];
            desk.command("xdotool").args(again).output().expect("xdotool");
            let search = ["search", "--all", "--onlyvisible", "--pid", &process, "--name", " - osp$"];
            let found = desk.command("xdotool").args(search).output().expect("xdotool");
            id = stdout(&found).lines().next().unwrap_or_default().to_owned();
            !id.is_empty()
        });
        self.id = id;
        self.become_active();
    }

    /// The number of its process.
    pub(crate) fn process_id(&self) -> u32 {
        self.process.as_ref().map(|process| process.0.id()).expect("a process")
    }

    /// Waits until keys reach it: the window manager may still be starting.
    pub(crate) fn become_active(&mut self) {
        let id = self.id.clone();
        let desk = self.desk;
        self.until("the keyboard", |_| {
            let active = desk.command("xdotool").arg("getactivewindow").output().expect("xdotool");
            let is_active = stdout(&active).trim() == id;
            if !is_active {
                desk.command("xdotool").args(["windowactivate", "--sync", &id]).output().expect("xdotool");
            }
            is_active
        });
    }

    /// The pointer and the keys: arguments of `xdotool`.
    pub(crate) fn hand(&self, arguments: &[&str]) {
        let status = self.desk.command("xdotool").args(arguments).status().expect("xdotool");
        assert!(status.success(), "xdotool {arguments:?}");
    }

    /// Moves the pointer to a place in the window, pixels.
    pub(crate) fn point(&self, x: i32, y: i32) {
        self.hand(&["mousemove", "--window", &self.id, &x.to_string(), &y.to_string()]);
    }

    pub(crate) fn click(&self, x: i32, y: i32) {
        self.point(x, y);
        self.hand(&["click", "1"]);
    }

    /// Drags along these places.
    pub(crate) fn drag(&self, button: u32, places: &[(i32, i32)]) {
        self.point(places[0].0, places[0].1);
        self.hand(&["mousedown", &button.to_string()]);
        for (x, y) in &places[1..] {
            self.point(*x, *y);
        }
        self.hand(&["mouseup", &button.to_string()]);
    }

    /// Presses a key and waits until it is handled, because a frame handles the pointer before the keys.
    pub(crate) fn key(&mut self, key: &str) {
        self.hand(&["key", key]);
        self.draw_again();
    }

    pub(crate) fn write(&self, text: &str) {
        self.hand(&["type", "--delay", "15", text]);
    }

    pub(crate) fn resize(&self, width: u32, height: u32) {
        self.hand(&["windowsize", &self.id, &width.to_string(), &height.to_string()]);
    }

    /// Moves it off the display, but for a corner.
    pub(crate) fn move_away(&self) {
        self.hand(&["windowmove", "--sync", &self.id, "1380", "980"]);
    }

    /// Waits for a frame that begins after this, or for the window's end.
    pub(crate) fn draw_again(&mut self) {
        let before = self.frames().len();
        wait_until("another frame", || {
            // The first of two frames may have begun before.
            let is_over = self.has_ended().is_some() || self.frames().len() > before + 1;
            if !is_over {
                self.hand(&["key", "Shift_L"]);
            }
            is_over
        });
    }

    fn has_ended(&mut self) -> Option<ExitStatus> {
        self.process.as_mut().and_then(|process| process.0.try_wait().expect("a process"))
    }

    /// The frames so far.
    pub(crate) fn frames(&mut self) -> &[Value] {
        let mut text = String::new();
        if let Ok(mut file) = File::open(&self.trace) {
            file.read_to_string(&mut text).expect("the trace");
        }
        let new = &text[self.read..];
        let whole = new.rfind('\n').map_or(0, |end| end + 1);
        for line in new[..whole].lines() {
            self.frames.push(serde_json::from_str(line).expect("a line of JSON"));
        }
        self.read += whole;
        &self.frames
    }

    /// Waits until the frames are as expected.
    pub(crate) fn until(&mut self, what: &str, mut is_so: impl FnMut(&[Value]) -> bool) {
        wait_until(what, || {
            let ended = self.has_ended();
            let is_so = is_so(self.frames());
            if let Some(status) = ended.filter(|_| !is_so) {
                panic!("osp ended ({status}) before {what}: {}", self.stderr());
            }
            is_so
        });
    }

    /// Waits until the last frame is as expected.
    pub(crate) fn until_last(&mut self, what: &str, is_so: impl Fn(&Value) -> bool) {
        self.until(what, |frames| frames.last().is_some_and(&is_so));
    }

    pub(crate) fn last(&mut self) -> Value {
        self.frames().last().expect("a frame").clone()
    }

    /// A number of the last frame.
    pub(crate) fn number(&mut self, name: &str) -> u64 {
        self.last()[name].as_u64().unwrap_or_else(|| panic!("no number {name}"))
    }

    /// Where its standard error goes.
    pub(crate) fn stderr_file(&self) -> PathBuf {
        self.stderr.clone()
    }

    /// What it has written to standard error.
    pub(crate) fn stderr(&self) -> String {
        fs::read_to_string(&self.stderr).unwrap_or_default()
    }

    /// A picture of the window: red, green, blue of each pixel, its width and height.
    pub(crate) fn picture(&self) -> (Vec<[u8; 3]>, usize, usize) {
        let output = self.desk.command("import").args(["-window", &self.id, "-depth", "8", "ppm:-"]).output();
        read_ppm(&output.expect("import of ImageMagick").stdout)
    }

    /// Keeps a picture of the window where the environment variable `OSP_SCREENSHOTS` names a folder: the README's.
    pub(crate) fn keep_picture(&self, name: &str) {
        let Some(folder) = std::env::var_os("OSP_SCREENSHOTS") else { return };
        let path = Path::new(&folder).join(name);
        let shot = self.desk.command("import").args(["-window", &self.id]).arg(path).status();
        assert!(shot.expect("import of ImageMagick").success());
    }

    /// Waits until all input so far is seen: it is handled in order, and a panel may need some frames.
    pub(crate) fn settle(&mut self) {
        self.become_active();
        (0..4).for_each(|_| self.draw_again());
    }

    /// Closes the window as a person does, and waits for the end.
    pub(crate) fn close(self) -> ExitStatus {
        self.ask_to_close();
        self.wait()
    }

    /// Asks it to close, as a person does.
    pub(crate) fn ask_to_close(&self) {
        let status = self.desk.command("wmctrl").args(["-i", "-c", &self.id]).status().expect("wmctrl");
        assert!(status.success());
    }

    /// Waits for its end.
    pub(crate) fn wait(mut self) -> ExitStatus {
        let mut process = self.process.take().expect("a process");
        process.0.wait().expect("a process")
    }
}

/// Reads a binary PPM of 8 bits a channel: three numbers in text, one white space, then the pixels.
fn read_ppm(bytes: &[u8]) -> (Vec<[u8; 3]>, usize, usize) {
    let mut fields = bytes.splitn(4, |b| b.is_ascii_whitespace());
    assert_eq!(fields.next(), Some(&b"P6"[..]), "a PPM");
    let mut number = || {
        let text = str::from_utf8(fields.next().expect("a number")).expect("text");
        text.parse::<usize>().expect("a number")
    };
    let (width, height) = (number(), number());
    let rest = fields.next().expect("the largest value and the pixels");
    let pixels = rest.strip_prefix(b"255\n").expect("eight bits");
    (pixels.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(), width, height)
}
