use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom},
    net::{SocketAddr, UdpSocket},
    path::PathBuf,
    str::FromStr,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use thiserror::Error;

use super::{Message, parse_line, parse_osc};
use crate::small_file::open_regular;

/// Messages that may wait for the next frame; later ones are dropped and counted.
const WAITING: usize = 1 << 16;
/// Longest line: longer ones are malformed. Bounds the memory that a stream without line ends can take.
const MAX_LINE_BYTES: u64 = 4096;
/// How often a thread looks whether it is still wanted, and whether a file has grown.
const NAP: Duration = Duration::from_millis(20);

/// Where a tracker's messages come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TrackerAddress {
    /// Datagrams sent to this address of ours.
    Udp(SocketAddr),
    /// Standard input, lines.
    StandardInput,
    /// A file, lines, from its beginning and on as it grows.
    File(PathBuf),
}

/// Port where a tracker is listened to unless it is told otherwise.
const DEFAULT_PORT: u16 = 9327;

impl FromStr for TrackerAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_prefix("udp://") {
            Some(address) => parse_address(address)
                .map(Self::Udp)
                .ok_or_else(|| format!("expected udp://ADDRESS:PORT, udp://:PORT or udp://; found `{text}`")),
            None if text == "-" => Ok(Self::StandardInput),
            None if text.is_empty() => Err("expected udp://ADDRESS:PORT, a file, or -".to_owned()),
            None => Ok(Self::File(PathBuf::from(text))),
        }
    }
}

/// Without an address only this machine is listened to.
fn parse_address(text: &str) -> Option<SocketAddr> {
    let text = text.trim_end_matches('/');
    match text.strip_prefix(':') {
        Some(port) => port.parse().ok().map(|port| SocketAddr::from(([127, 0, 0, 1], port))),
        None if text.is_empty() => Some(SocketAddr::from(([127, 0, 0, 1], DEFAULT_PORT))),
        None => text.parse().ok(),
    }
}

/// Why a tracker cannot be listened to.
#[derive(Debug, Error)]
#[error("tracker {what}: {cause}")]
pub struct TrackerError {
    what: String,
    cause: io::Error,
}

/// What has come so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages understood.
    pub messages: u64,
    /// Lines or packets that were not.
    pub malformed: u64,
    /// Messages dropped because nobody took them in time.
    pub dropped: u64,
}

#[derive(Debug, Default)]
struct Shared {
    messages: AtomicU64,
    malformed: AtomicU64,
    dropped: AtomicU64,
    is_over: AtomicBool,
}

/// A tracker being listened to on a thread of its own.
#[derive(Debug)]
pub struct Tracker {
    messages: Receiver<Message>,
    shared: Arc<Shared>,
    local_address: Option<SocketAddr>,
    /// Not joined for standard input, where a read cannot be called off.
    thread: Option<JoinHandle<()>>,
}

impl Tracker {
    /// Starts to listen. `wake` is called, on the thread, when something has come.
    ///
    /// # Errors
    /// The address is taken or not ours; the file cannot be opened.
    pub fn open(address: &TrackerAddress, wake: impl Fn() + Send + 'static) -> Result<Self, TrackerError> {
        let failed = |what: String| move |cause| TrackerError { what, cause };
        let shared = Arc::new(Shared::default());
        let (sender, messages) = sync_channel(WAITING);
        let output = Output { sender, shared: Arc::clone(&shared), wake: Box::new(wake) };
        let mut local_address = None;
        let builder = thread::Builder::new().name("tracker".to_owned());
        let spawned = match address {
            TrackerAddress::Udp(address) => {
                let name = format!("udp://{address}");
                let socket = UdpSocket::bind(address).map_err(failed(name.clone()))?;
                socket.set_read_timeout(Some(NAP)).map_err(failed(name.clone()))?;
                local_address = socket.local_addr().ok();
                builder.spawn(move || output.listen(&socket)).map_err(failed(name))
            }
            TrackerAddress::StandardInput => builder
                .spawn(move || output.read_lines(io::stdin(), AtEnd::Stop))
                .map_err(failed("-".to_owned())),
            TrackerAddress::File(path) => {
                let name = path.display().to_string();
                let file = open_regular(path).map_err(failed(name.clone()))?;
                let path = path.clone();
                builder.spawn(move || output.tail(file, &path)).map_err(failed(name))
            }
        };
        let thread = Some(spawned?).filter(|_| *address != TrackerAddress::StandardInput);
        Ok(Self { messages, shared, local_address, thread })
    }

    /// The address listened to, if it is a socket; the port is the real one where 0 was asked for.
    pub fn local_address(&self) -> Option<SocketAddr> {
        self.local_address
    }

    /// The next message, if one has come.
    pub fn take(&self) -> Option<Message> {
        self.messages.try_recv().ok()
    }

    /// What has come so far.
    pub fn counts(&self) -> Counts {
        Counts {
            messages: self.shared.messages.load(Ordering::Relaxed),
            malformed: self.shared.malformed.load(Ordering::Relaxed),
            dropped: self.shared.dropped.load(Ordering::Relaxed),
        }
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It naps for a moment at most; that it panicked is of no interest any more.
            let _ = thread.join();
        }
    }
}

/// What to do where a stream ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AtEnd {
    Stop,
    Wait,
}

struct Output {
    sender: SyncSender<Message>,
    shared: Arc<Shared>,
    wake: Box<dyn Fn() + Send>,
}

impl Output {
    fn is_over(&self) -> bool {
        self.shared.is_over.load(Ordering::Relaxed)
    }

    fn pass_on(&self, message: Message) {
        self.shared.messages.fetch_add(1, Ordering::Relaxed);
        if self.sender.try_send(message).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn note_malformed(&self, count: u64) {
        self.shared.malformed.fetch_add(count, Ordering::Relaxed);
    }

    fn take_line(&self, line: &str) {
        match parse_line(line) {
            Ok(Some(message)) => self.pass_on(message),
            Ok(None) => {}
            Err(_) => self.note_malformed(1),
        }
    }

    fn listen(&self, socket: &UdpSocket) {
        // Larger than any datagram.
        let mut packet = vec![0; 1 << 16];
        let mut messages = Vec::new();
        while !self.is_over() {
            // A timeout, and on some systems the refusal of an earlier answer, arrive as errors: listen on.
            let Ok((length, _)) = socket.recv_from(&mut packet) else { continue };
            let packet = &packet[..length];
            // OSC packets begin with an address or with `#bundle` and a zero byte; a comment has no zero byte.
            if packet.starts_with(b"/") || packet.starts_with(b"#bundle\0") {
                self.note_malformed(parse_osc(packet, &mut messages));
                messages.drain(..).for_each(|message| self.pass_on(message));
            } else {
                match str::from_utf8(packet) {
                    Ok(text) => text.lines().for_each(|line| self.take_line(line)),
                    Err(_) => self.note_malformed(1),
                }
            }
            (self.wake)();
        }
    }

    fn tail(&self, mut file: File, path: &std::path::Path) {
        // A log that was begun anew is shorter than what was read of it: then it is read from its beginning.
        while !self.is_over() {
            self.read_lines(&mut file, AtEnd::Wait);
            let rewound = file.seek(SeekFrom::Start(0)).is_ok();
            if !rewound || !path.exists() {
                return;
            }
        }
    }

    /// Reads lines until the end, or (waiting) until the file has become shorter.
    fn read_lines(&self, stream: impl Read + MaybeSized, at_end: AtEnd) {
        let mut reader = BufReader::new(stream);
        let mut line = Vec::new();
        let mut consumed = 0u64;
        let mut is_too_long = false;
        while !self.is_over() {
            let room = MAX_LINE_BYTES - line.len() as u64;
            let Ok(read) = reader.by_ref().take(room).read_until(b'\n', &mut line) else { return };
            consumed += read as u64;
            if line.last() == Some(&b'\n') {
                match str::from_utf8(&line) {
                    Ok(text) if !is_too_long => self.take_line(text),
                    _ => self.note_malformed(1),
                }
                line.clear();
                is_too_long = false;
                (self.wake)();
            } else if line.len() as u64 == MAX_LINE_BYTES {
                line.clear();
                is_too_long = true;
            } else if read == 0 {
                match at_end {
                    AtEnd::Stop => {
                        if let Ok(text) = str::from_utf8(&line) {
                            self.take_line(text);
                        }
                        return;
                    }
                    AtEnd::Wait => {
                        if reader.get_ref().size().is_some_and(|size| size < consumed) {
                            return;
                        }
                        thread::sleep(NAP);
                    }
                }
            }
        }
    }
}

/// A stream whose size may be known.
trait MaybeSized {
    fn size(&self) -> Option<u64>;
}

impl MaybeSized for &mut File {
    fn size(&self) -> Option<u64> {
        self.metadata().ok().map(|data| data.len())
    }
}

impl MaybeSized for io::Stdin {
    fn size(&self) -> Option<u64> {
        None
    }
}
