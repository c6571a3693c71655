//! `osp send`: sends a session to a window, like a tracker.

use std::{
    net::{ToSocketAddrs, UdpSocket},
    thread,
    time::{Duration, Instant},
};

use anyhow::Context;

use super::{
    output::{Outcome, print_result, warn},
    session::OpenSession,
    sketch_args::SendArgs,
    tracker::key,
};
use osp_app::tracker::{EventEncoder, Message, TrackerKey, osc_keyed, osc_packet, write_line};
use osp_lab::report::thousands;
use osp_session::recording::{Pace, Pacer};

/// Largest number of bytes of the lines in a datagram. Together with a key, they fit the packet size of every network.
const PACKET_BYTES: usize = 1200;

pub(super) fn run(args: &SendArgs) -> anyhow::Result<Outcome> {
    let key = key()?;
    let no_address = || format!("--to {}: expected ADDRESS:PORT, such as 127.0.0.1:9327", args.to);
    let to = args.to.to_socket_addrs().with_context(no_address)?.next().with_context(no_address)?;
    let from = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = UdpSocket::bind(from).context("a socket")?;
    socket.connect(to).with_context(|| args.to.clone())?;

    let session = OpenSession::open(&args.file, &args.reading)?;
    let mut pacer = Pacer::new(session, args.pace);
    let mut sender = Sender { socket, osc: args.osc, key, packet: String::new(), packets: 0, refused: 0 };
    let mut encoder = EventEncoder::new();
    let (mut events, mut messages) = (Vec::new(), Vec::new());
    let mut sent = 0u64;
    let start = Instant::now();
    let mut frames = 0u32;
    while pacer.next_frame(&mut events)? {
        frames += 1;
        messages.clear();
        events.iter().for_each(|event| encoder.encode(event, &mut messages));
        for message in &messages {
            sender.send(message)?;
        }
        sender.flush()?;
        sent += messages.len() as u64;
        let due = Duration::from_secs_f64(f64::from(frames) / Pace::FRAMES_A_SECOND / args.speed);
        thread::sleep(due.saturating_sub(start.elapsed()));
    }
    print_result(&format!(
        "{} messages in {} packets sent to {to} in {:.1} s",
        thousands(sent),
        thousands(sender.packets),
        start.elapsed().as_secs_f64()
    ))?;
    if encoder.left_out > 0 {
        let what = "events were not sent, because a tracker cannot send them (moved strokes, groups, finished polygons)";
        warn(&format!("warning: {} {what}", thousands(encoder.left_out)));
    }
    if sender.refused > 0 {
        warn(&format!(
            "warning: {} packets were refused: does a window listen there (osp sketch --tracker udp://)?",
            thousands(sender.refused)
        ));
    }
    Ok(Outcome::Done)
}

struct Sender {
    socket: UdpSocket,
    osc: bool,
    key: Option<TrackerKey>,
    /// Lines that have not been sent yet.
    packet: String,
    packets: u64,
    refused: u64,
}

impl Sender {
    fn send(&mut self, message: &Message) -> anyhow::Result<()> {
        if self.osc {
            let packet = osc_packet(message);
            let keyed = self.key.as_ref().map(|key| osc_keyed(key.as_str(), &packet));
            return self.packet(&keyed.unwrap_or(packet));
        }
        let before = self.packet.len();
        write_line(message, &mut self.packet);
        if self.packet.len() > PACKET_BYTES {
            let line = self.packet.split_off(before);
            self.flush()?;
            self.packet = line;
        }
        Ok(())
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        if !self.packet.is_empty() {
            let mut packet = std::mem::take(&mut self.packet);
            if let Some(key) = &self.key {
                packet.insert_str(0, &format!("key {}\n", key.as_str()));
            }
            self.packet(packet.as_bytes())?;
        }
        Ok(())
    }

    fn packet(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        self.packets += 1;
        match self.socket.send(bytes) {
            Ok(_) => Ok(()),
            // The error belongs to an earlier packet: no window listens at the address.
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => {
                self.refused += 1;
                Ok(())
            }
            Err(error) => Err(error).context("the network"),
        }
    }
}
