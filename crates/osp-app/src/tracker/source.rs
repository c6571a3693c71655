use std::{
    io::{self, BufRead, BufReader, Read},
    net::{SocketAddr, UdpSocket},
    path::PathBuf,
    str::FromStr,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, SyncSender, TrySendError, sync_channel},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use thiserror::Error;

use super::{
    Message, TrackerOptions,
    admittance::{Admission, Admittance, is_osc},
    line::parse_line_noting,
    osc::parse_osc_noting,
};
use osp_session::{platform::time::Instant, recording::Paint, small_file::open_regular};

/// Largest number of messages that wait for the next frame. Later messages of a socket are dropped and counted; a
/// stream waits.
const WAITING: usize = 1 << 16;
/// Largest number of messages of one datagram; further messages are dropped and counted.
const MESSAGES_A_DATAGRAM: usize = 1024;
/// Longest line, bytes; longer lines are malformed. The limit bounds the memory for a stream without newlines.
const MAX_LINE_BYTES: u64 = 4096;
/// Number of bytes without a newline after which reading a stream ends, because the stream cannot be a tracker's.
const MAX_UNBROKEN_BYTES: u64 = 1 << 20;
const MOST_UNKNOWN_BRUSHES: usize = 20;
/// Interval at which a thread checks whether it should end, and whether a file has grown.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The source of a tracker's messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TrackerAddress {
    /// Datagrams sent to this local address.
    Udp(SocketAddr),
    /// Lines of standard input.
    StandardInput,
    /// Lines of a file, from its beginning and while it grows.
    File(PathBuf),
}

/// Default port on which a window listens to a tracker.
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

impl TrackerAddress {
    /// A warning if the address accepts datagrams from other machines, because these can then draw.
    pub fn warning(&self, options: &TrackerOptions) -> Option<String> {
        let Self::Udp(address) = self else { return None };
        let advice = match options.key {
            None => {
                "a key in OSP_TRACKER_KEY restricts it to senders with the key, and udp://127.0.0.1 to this machine"
            }
            Some(_) => "only senders with the key are read, but the key is sent unencrypted",
        };
        let others = !address.ip().is_loopback();
        others.then(|| format!("udp://{address} accepts data from every machine that reaches it: {advice}"))
    }
}

/// Parses an address; the default is this machine only.
fn parse_address(text: &str) -> Option<SocketAddr> {
    let text = text.trim_end_matches('/');
    match text.strip_prefix(':') {
        Some(port) => port.parse().ok().map(|port| SocketAddr::from(([127, 0, 0, 1], port))),
        None if text.is_empty() => Some(SocketAddr::from(([127, 0, 0, 1], DEFAULT_PORT))),
        None => text.parse().ok(),
    }
}

/// Reason for which a tracker cannot be read.
#[derive(Debug, Error)]
#[error("tracker {what}: {cause}")]
pub struct TrackerError {
    what: String,
    cause: io::Error,
}

/// Counts of a tracker's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of valid messages.
    pub messages: u64,
    /// Number of malformed lines or packets.
    pub malformed: u64,
    /// Number of messages that were dropped because too many waited for a frame, or a datagram had too many. Includes
    /// datagrams beyond the limit per second.
    pub dropped: u64,
    /// Number of datagrams that were not read, because their sender is not accepted or they lack the key.
    pub refused: u64,
    /// Whether reading the stream has ended because it has no lines.
    pub has_given_up: bool,
}

#[derive(Debug, Default)]
struct Shared {
    tally: Mutex<Tally>,
    is_over: AtomicBool,
    /// Whether `wake` was called since the last [`Tracker::take`].
    is_woken: AtomicBool,
}

#[derive(Debug, Default)]
struct Tally {
    counts: Counts,
    /// Unknown brushes that messages have chosen.
    unknown: Vec<String>,
    /// Number of unknown brushes that were reported to the caller.
    reported: usize,
}

impl Shared {
    fn tally(&self) -> MutexGuard<'_, Tally> {
        // The tally is consistent even if a thread panicked while it held the lock.
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note_unknown(&self, name: &str) {
        let name = &name[..name.floor_char_boundary(Paint::MAX_NAME_BYTES)];
        let names = &mut self.tally().unknown;
        if names.len() < MOST_UNKNOWN_BRUSHES && !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
}

/// A received message, with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedMessage {
    /// Time of arrival.
    pub at: Instant,
    pub message: Message,
}

/// A tracker that is read on a separate thread.
#[derive(Debug)]
pub struct Tracker {
    messages: Receiver<ReceivedMessage>,
    shared: Arc<Shared>,
    /// The address of the socket, with the port that the system assigned; `None` for a stream.
    pub local_address: Option<SocketAddr>,
    /// The reading thread; `None` for standard input, because its read cannot be interrupted.
    thread: Option<JoinHandle<()>>,
}

impl Tracker {
    /// Starts to read. `wake` is called on the thread when a message was received, but at most once before the next
    /// [`Tracker::take`].
    ///
    /// # Errors
    /// The address is in use or does not belong to this machine, or the file cannot be opened.
    pub fn open(
        address: &TrackerAddress,
        options: &TrackerOptions,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, TrackerError> {
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
                socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(failed(name.clone()))?;
                local_address = socket.local_addr().ok();
                let admittance = Admittance::new(options.clone());
                builder.spawn(move || output.listen(&socket, admittance)).map_err(failed(name))
            }
            TrackerAddress::StandardInput => {
                builder.spawn(move || output.read_lines(io::stdin(), false)).map_err(failed("-".to_owned()))
            }
            TrackerAddress::File(path) => {
                let name = path.display().to_string();
                let file = open_regular(path).map_err(failed(name.clone()))?;
                builder.spawn(move || output.read_lines(file, true)).map_err(failed(name))
            }
        };
        let thread = Some(spawned?).filter(|_| *address != TrackerAddress::StandardInput);
        Ok(Self { messages, shared, local_address, thread })
    }

    /// The next message, if one was received.
    pub fn take(&self) -> Option<Message> {
        self.take_received().map(|came| came.message)
    }

    /// The next message, if one was received, with its time and sender.
    pub fn take_received(&self) -> Option<ReceivedMessage> {
        self.shared.is_woken.store(false, Ordering::SeqCst);
        self.messages.try_recv().ok()
    }

    /// The unknown brushes that messages have chosen since the last call; each is reported once.
    pub fn unknown_brushes(&self) -> Vec<String> {
        let mut tally = self.shared.tally();
        let reported = tally.reported;
        tally.reported = tally.unknown.len();
        tally.unknown[reported..].to_vec()
    }

    /// The counts so far.
    pub fn counts(&self) -> Counts {
        self.shared.tally().counts
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The thread sleeps only for a moment. Its panic no longer matters.
            let _ = thread.join();
        }
    }
}

struct Output {
    sender: SyncSender<ReceivedMessage>,
    shared: Arc<Shared>,
    wake: Box<dyn Fn() + Send>,
}

impl Output {
    fn is_over(&self) -> bool {
        self.shared.is_over.load(Ordering::Relaxed)
    }

    /// Queues a message of a socket if the queue has space; otherwise drops the message, because newer messages follow.
    fn pass_on(&self, message: Message) {
        self.shared.tally().counts.messages += 1;
        if self.sender.try_send(ReceivedMessage { at: Instant::now(), message }).is_err() {
            self.note_dropped(1);
        }
    }

    /// Queues a message of a stream. Waits for space in the queue, because a stream is a complete drawing and can wait.
    fn pass_on_patiently(&self, message: Message) {
        self.shared.tally().counts.messages += 1;
        let mut received = ReceivedMessage { at: Instant::now(), message };
        while let Err(TrySendError::Full(back)) = self.sender.try_send(received) {
            if self.is_over() {
                return;
            }
            received = back;
            thread::sleep(POLL_INTERVAL);
        }
    }

    fn note_malformed(&self, count: u64) {
        self.shared.tally().counts.malformed += count;
    }

    fn note_dropped(&self, count: u64) {
        self.shared.tally().counts.dropped += count;
    }

    fn wake(&self) {
        if !self.shared.is_woken.swap(true, Ordering::SeqCst) {
            (self.wake)();
        }
    }

    fn listen(&self, socket: &UdpSocket, mut admittance: Admittance) {
        // The buffer is larger than any datagram.
        let mut packet = vec![0; 1 << 16];
        let mut messages = Vec::new();
        while !self.is_over() {
            // A timeout arrives as an error. All errors are ignored.
            let Ok((length, from)) = socket.recv_from(&mut packet) else { continue };
            let packet = &packet[..length];
            let now = Instant::now();
            match admittance.admit(from, packet, now) {
                Admission::Read => {}
                Admission::Refused => {
                    self.shared.tally().counts.refused += 1;
                    continue;
                }
                Admission::TooMany => {
                    self.note_dropped(1);
                    continue;
                }
            }
            self.read_packet(packet, &mut messages);
            if !messages.is_empty() {
                admittance.note_understood(from, now);
            }
            self.note_dropped(messages.len().saturating_sub(MESSAGES_A_DATAGRAM) as u64);
            messages.drain(..).take(MESSAGES_A_DATAGRAM).for_each(|message| self.pass_on(message));
            self.wake();
        }
    }

    fn read_packet(&self, packet: &[u8], messages: &mut Vec<Message>) {
        if is_osc(packet) {
            self.note_malformed(parse_osc_noting(packet, messages, &mut |name| {
                self.shared.note_unknown(name)
            }));
            return;
        }
        let Ok(text) = str::from_utf8(packet) else { return self.note_malformed(1) };
        for line in text.lines() {
            match parse_line_noting(line, &mut |name| self.shared.note_unknown(name)) {
                Ok(message) => messages.extend(message),
                Err(_) => self.note_malformed(1),
            }
        }
    }

    fn take_line(&self, line: &str) {
        match parse_line_noting(line, &mut |name| self.shared.note_unknown(name)) {
            Ok(Some(message)) => self.pass_on_patiently(message),
            Ok(None) => {}
            Err(_) => self.note_malformed(1),
        }
    }

    /// Reads lines until the end. A file may grow; it is followed until the tracker is closed.
    fn read_lines(&self, stream: impl Read, may_grow: bool) {
        let mut reader = BufReader::new(stream);
        let mut line = Vec::new();
        // Number of bytes of the current line.
        let mut unbroken = 0u64;
        while !self.is_over() {
            let room = MAX_LINE_BYTES - line.len() as u64;
            let Ok(read) = reader.by_ref().take(room).read_until(b'\n', &mut line) else { return };
            unbroken += read as u64;
            let is_over = read == 0 && !may_grow;
            if line.last() == Some(&b'\n') || is_over {
                match str::from_utf8(&line) {
                    Ok(text) if unbroken <= MAX_LINE_BYTES => self.take_line(text),
                    _ => self.note_malformed(1),
                }
                line.clear();
                unbroken = 0;
                self.wake();
                if is_over {
                    return;
                }
            } else if unbroken > MAX_UNBROKEN_BYTES {
                self.note_malformed(1);
                self.shared.tally().counts.has_given_up = true;
                self.wake();
                return;
            } else if line.len() as u64 == MAX_LINE_BYTES {
                line.clear();
            } else if read == 0 {
                thread::sleep(POLL_INTERVAL);
            }
        }
    }
}
