//! A server of NATS for one test.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::{Ipv4Addr, TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use osp_testkit::wait_for;

use tempfile::TempDir;

/// The program; none, said in a line: the test is left out.
pub(crate) fn program() -> Option<PathBuf> {
    let named = std::env::var_os("OSP_NATS_SERVER").map(PathBuf::from);
    let program = named.unwrap_or_else(|| "nats-server".into());
    let answers =
        Command::new(&program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if answers.is_ok_and(|status| status.success()) {
        return Some(program);
    }
    let why = format!("{} does not run; OSP_NATS_SERVER names a server of NATS", program.display());
    assert!(std::env::var_os("CI").is_none_or(|ci| ci.is_empty()), "{why}");
    eprintln!("skipped: {why}");
    None
}

pub(crate) struct Server {
    program: PathBuf,
    folder: TempDir,
    args: Vec<String>,
    pub(crate) port: u16,
    child: Child,
}

impl Server {
    /// A server with streams, on a free port of this machine; `None`: there is no such program.
    pub(crate) fn start() -> Option<Self> {
        Self::with("")
    }

    /// With more lines in its settings.
    pub(crate) fn with(settings: &str) -> Option<Self> {
        Self::at("127.0.0.1", settings)
    }

    /// Also for other machines.
    #[cfg(unix)]
    pub(crate) fn everywhere() -> Option<Self> {
        Self::at("0.0.0.0", "")
    }

    fn at(host: &str, settings: &str) -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("store");
        let settings = format!("jetstream {{ store_dir: {store:?} }}\n{settings}");
        Self::of(folder, host, &settings)
    }

    /// With these settings.
    pub(crate) fn of(mut folder: TempDir, host: &str, settings: &str) -> Option<Self> {
        let program = program()?;
        let path = folder.path().join("server.conf");
        fs::write(&path, settings).expect("written");
        // Another program may take the port before the server does.
        for _ in 0..10 {
            let free = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
            let port = free.local_addr().expect("its address").port();
            drop(free);
            let args = ["-a", host, "-p", &port.to_string(), "-c", &path.to_string_lossy()];
            let args: Vec<String> = args.into_iter().map(str::to_owned).collect();
            let child = run(&program, &args, folder.path());
            let mut server = Self { program: program.clone(), folder, args, port, child };
            if server.is_up() {
                return Some(server);
            }
            folder = server.into_folder();
        }
        panic!("the server does not start");
    }

    fn into_folder(mut self) -> TempDir {
        self.kill();
        std::mem::replace(&mut self.folder, tempfile::tempdir().expect("a folder"))
    }

    fn is_up(&mut self) -> bool {
        wait_for("the server", || {
            if self.child.try_wait().expect("its state").is_some() {
                return Some(false);
            }
            let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).ok()?;
            // Another program may have the port, and be silent.
            stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a time");
            let mut word = [0; 5];
            (stream.read_exact(&mut word).is_ok() && &word == b"INFO ").then_some(true)
        })
    }

    /// Ends it at once, without a word.
    pub(crate) fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Starts it again where it was, with what it has kept.
    pub(crate) fn start_again(&mut self) {
        self.child = run(&self.program, &self.args, self.folder.path());
        assert!(self.is_up(), "the server does not start again");
    }

    /// Takes away all that it has kept; it has to be dead.
    pub(crate) fn forget(&self) {
        fs::remove_dir_all(self.folder.path().join("store")).expect("removed");
    }

    /// A session's address.
    pub(crate) fn session(&self, name: &str) -> String {
        format!("nats://127.0.0.1:{}/{name}", self.port)
    }

    /// What a test says itself, without a client.
    pub(crate) fn wire(&self) -> Wire {
        Wire::open(self.port)
    }

    /// What it has printed.
    pub(crate) fn said(&self) -> String {
        fs::read_to_string(self.folder.path().join("said.txt")).unwrap_or_default()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
        if thread::panicking() {
            eprintln!("the server said:\n{}", self.said());
        }
    }
}

fn run(program: &Path, args: &[String], folder: &Path) -> Child {
    let said = fs::File::options().append(true).create(true).open(folder.join("said.txt")).expect("a file");
    let mut command = Command::new(program);
    command.args(args).stdout(said.try_clone().expect("the file")).stderr(said).stdin(Stdio::null());
    command.spawn().expect("the server starts")
}

/// A plain connection in the server's own language.
pub(crate) struct Wire {
    stream: BufReader<TcpStream>,
}

impl Wire {
    fn open(port: u16) -> Self {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).expect("the server listens");
        let mut wire = Self { stream: BufReader::new(stream) };
        assert!(wire.line().starts_with("INFO "));
        wire.say(b"CONNECT {\"verbose\":false,\"headers\":true}\r\n");
        wire.settle();
        wire
    }

    fn say(&mut self, bytes: &[u8]) {
        self.stream.get_mut().write_all(bytes).expect("said");
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stream.read_line(&mut line).expect("a line");
        line
    }

    pub(crate) fn publish(&mut self, subject: &str, payload: &[u8]) {
        self.say(format!("PUB {subject} {}\r\n", payload.len()).as_bytes());
        self.say(payload);
        self.say(b"\r\n");
    }

    pub(crate) fn subscribe(&mut self, subject: &str) {
        self.say(format!("SUB {subject} 1\r\n").as_bytes());
        self.settle();
    }

    /// Until the server has taken everything said before; nothing may be subscribed to that is spoken of.
    pub(crate) fn settle(&mut self) {
        self.say(b"PING\r\n");
        while !self.line().starts_with("PONG") {}
    }

    /// The next message of what was subscribed to, without its headers.
    pub(crate) fn message(&mut self) -> Vec<u8> {
        loop {
            let line = self.line();
            let words: Vec<&str> = line.split_whitespace().collect();
            let number = |back: usize| words[words.len() - back].parse::<usize>().expect("a number");
            let (head, whole) = match words.first() {
                Some(&"MSG") => (0, number(1)),
                Some(&"HMSG") => (number(2), number(1)),
                Some(&"PING") => {
                    self.say(b"PONG\r\n");
                    continue;
                }
                _ => continue,
            };
            let mut bytes = vec![0; whole + 2];
            self.stream.read_exact(&mut bytes).expect("a message");
            return bytes[head..whole].to_vec();
        }
    }
}
