//! The thread that exchanges messages with the server. It reads the log, publishes the member's own events, and reconnects
//! when no messages come.
//!
//! The client library takes a quarter of a minute to notice a lost subscription, so this thread checks more often. It
//! requests the log again, from the last message read, in two cases: a message of this member does not come back within
//! [`RESEND_AFTER`], or the server has messages that were not received. Unacknowledged messages are sent again.

use std::sync::{Arc, mpsc};
use std::time::Duration;

use async_nats::{
    Client, Subscriber,
    connection::State,
    jetstream::{Context, consumer::pull, message::PublishMessage, stream::Info},
};
use futures_util::{FutureExt as _, StreamExt as _};
use tokio::sync::mpsc as queue;
use xxhash_rust::xxh3::xxh3_64;

use super::{
    Address, Connection, LiveError, Role, Status,
    member::{Member, News, new_sender},
    outbox::Outgoing,
    server::{self, Complaints, NoAnswer},
    state::{Command, Shared},
};

/// Time after which a message of this member that has not come back is sent again. The time doubles with each attempt,
/// up to [`LONGEST_RESEND_AFTER`].
const RESEND_AFTER: Duration = Duration::from_millis(400);
const LONGEST_RESEND_AFTER: Duration = Duration::from_millis(3200);

/// Time without an answer after which the connection is closed and opened again.
const GIVE_UP: Duration = Duration::from_secs(4);

/// Interval between checks for timeouts.
const TICK: Duration = Duration::from_millis(25);

/// Interval between checks of the length of the server's log.
const CHECK_EVERY: Duration = Duration::from_secs(1);

/// Time for which requests are repeated after an error that seems permanent.
const RETRY_FOR: Duration = Duration::from_secs(3);

/// Largest number of events that the program has not read. If there are more, the thread does not read the log.
const MOST_UNTAKEN: usize = 1 << 18;

/// Largest number of messages that are processed in one call.
const AT_ONCE: usize = 256;

/// The state of the log on the server, or the reason why the request failed.
type StreamInfo = Result<Info, NoAnswer>;

struct Exchange<'a> {
    address: &'a Address,
    role: &'a Role,
    todo: queue::UnboundedReceiver<Command>,
    out: &'a mpsc::Sender<Result<News, LiveError>>,
    wake: &'a (dyn Fn() + Send),
    shared: &'a Shared,
    complaints: Arc<Complaints>,
    member: Member,
    state: Connection,
    /// Creation time of the stream, by the server's clock.
    made: Option<i128>,
    /// Number of the last message of the log when the log was opened.
    read_up_to: u64,
    has_caught_up: bool,
    /// Whether the log was opened and no message was received since.
    is_just_opened: bool,
    /// The last message read: its number, the server's time stamp, and the XXH3 of its contents.
    last_read: Option<(u64, u64, u64)>,
    /// Whether the program has stopped receiving events.
    program_has_left: bool,
}

/// Exchanges messages with the server until the connection fails permanently.
pub(super) async fn exchange(
    address: &Address,
    role: &Role,
    todo: queue::UnboundedReceiver<Command>,
    out: &mpsc::Sender<Result<News, LiveError>>,
    wake: &(dyn Fn() + Send),
    shared: &Shared,
) -> Result<(), LiveError> {
    let may_send = match role {
        Role::Author(who) => Some((who.clone(), new_sender())),
        Role::Watcher => None,
    };
    let mut exchange = Exchange {
        address,
        role,
        todo,
        out,
        wake,
        shared,
        complaints: Arc::default(),
        member: Member::new(may_send),
        state: Connection::Connecting,
        made: None,
        read_up_to: 0,
        has_caught_up: false,
        is_just_opened: true,
        last_read: None,
        program_has_left: false,
    };
    let complaints = Arc::clone(&exchange.complaints);
    let client = exchange.meanwhile(server::connect(address, &complaints)).await?;
    let presence = client.subscribe(address.presence()).await;
    let presence = presence
        .map_err(|error| LiveError::NotAllowed { server: address.server(), why: error.to_string() })?;
    let mut server =
        Server { logs: server::logs(&client), client, presence, connections: 0, forced: Duration::ZERO };
    // Headers count towards the limit, too.
    exchange.member.set_limit_bytes(server.client.max_payload().saturating_sub(1024));
    let mut resend_after = RESEND_AFTER;
    while !exchange.program_has_left {
        let messages = exchange.open(&mut server).await?;
        let again = exchange.member.again();
        exchange.publish(&server, again).await;
        let answered = exchange.member.counts.own_messages;
        exchange.read(&mut server, messages, resend_after).await?;
        if let Some(why) = complaints.forbids(&address.subject()) {
            return Err(LiveError::NotAllowed { server: address.server(), why });
        }
        let is_better = exchange.member.counts.own_messages > answered;
        resend_after = if is_better { RESEND_AFTER } else { LONGEST_RESEND_AFTER.min(resend_after * 2) };
        exchange.member.counts.reopened += 1;
    }
    Ok(())
}

struct Server {
    client: Client,
    logs: Context,
    presence: Subscriber,
    /// Number of connections when the log was opened.
    connections: u64,
    /// Time at which the connection was last closed by force.
    forced: Duration,
}

impl Server {
    fn is_connected(&self) -> bool {
        self.client.connection_state() == State::Connected
    }
}

impl Exchange<'_> {
    fn now(&self) -> Duration {
        self.shared.started.elapsed()
    }

    /// Waits for `work`, and meanwhile accepts the program's commands.
    async fn meanwhile<T>(&mut self, work: impl Future<Output = T>) -> T {
        let mut work = std::pin::pin!(work);
        loop {
            tokio::select! {
                done = &mut work => return done,
                () = tokio::time::sleep(TICK) => {
                    while let Ok(command) = self.todo.try_recv() {
                        self.take_command(command);
                    }
                    self.member.interrupted(self.now());
                    self.show();
                }
            }
        }
    }

    fn take_command(&mut self, command: Command) {
        match command {
            Command::Send(events, at) => {
                self.member.hand_over(events, at.saturating_duration_since(self.shared.started));
            }
            Command::Leave => self.member.leave(self.now()),
        }
    }

    /// Opens the log at the last message read; retries until the log is open.
    async fn open(&mut self, server: &mut Server) -> Result<pull::Stream, LiveError> {
        let mut failing_since: Option<Duration> = None;
        loop {
            let was_there = self.made.is_some();
            server.connections = self.complaints.get().1.max(1);
            let (address, role) = (self.address, self.role);
            let asked = server::stream(&server.logs, address, role, was_there);
            let answer = self.meanwhile(asked).await;
            let now = self.now();
            let is_for_good = matches!(answer, Err(NoAnswer::NoStreams(_)))
                || (was_there && matches!(answer, Err(NoAnswer::NoStream)));
            if !is_for_good {
                failing_since = None;
            }
            let is_hopeless =
                is_for_good && now.saturating_sub(*failing_since.get_or_insert(now)) > RETRY_FOR;
            match answer {
                Ok(info) => {
                    let known = self.member.last_sequence;
                    self.check(&info, known)?;
                    // The log is read from the last known message on, to check that this message is still the same.
                    let opened = server::messages(&server.logs, address, known.max(1));
                    match self.meanwhile(opened).await {
                        Ok(messages) => {
                            self.opened(&info);
                            return Ok(messages);
                        }
                        Err(why) => self.complaints.set(why),
                    }
                }
                Err(NoAnswer::NoStream) if was_there && is_hopeless => return Err(self.lost()),
                Err(NoAnswer::NoStreams(why)) if !was_there && is_hopeless => {
                    return Err(LiveError::NoJetStream { server: address.server(), why });
                }
                Err(NoAnswer::NoStream) => self.complaints.set("nobody has begun this session yet"),
                Err(NoAnswer::NoStreams(why) | NoAnswer::Later(why)) => self.complaints.set(why),
            }
            if was_there {
                self.state = Connection::Silent;
            }
            self.force(server).await;
            self.meanwhile(tokio::time::sleep(Duration::from_millis(200))).await;
        }
    }

    /// Checks that the server still has the log that was read. `known` is the last message that was read before the
    /// request.
    fn check(&self, info: &Info, known: u64) -> Result<(), LiveError> {
        let made = info.created.unix_timestamp_nanos();
        let is_other = self.made.is_some_and(|known| known != made);
        if is_other || info.state.last_sequence < known {
            return Err(self.lost());
        }
        Ok(())
    }

    fn lost(&self) -> LiveError {
        LiveError::Lost { session: self.address.to_string() }
    }

    fn opened(&mut self, info: &Info) {
        let now = self.now();
        self.made = Some(info.created.unix_timestamp_nanos());
        self.read_up_to = info.state.last_sequence;
        if info.state.messages > 0 {
            let age_nanos = unix_nanos() - info.state.first_timestamp.unix_timestamp_nanos();
            self.member.set_age((age_nanos as f64 / 1.0e9).max(0.0), now);
        }
        self.is_just_opened = true;
        self.member.interrupted(now);
        self.member.hold(now);
        self.complaints.clear();
    }

    /// Reads the log and publishes messages until the log has to be opened again.
    async fn read(
        &mut self,
        server: &mut Server,
        mut messages: pull::Stream,
        resend_after: Duration,
    ) -> Result<(), LiveError> {
        let mut ticks = tokio::time::interval(TICK);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let (mut ticked, mut asked_since, mut look_known) = (self.now(), self.now(), u64::MAX);
        let (sender, mut answers) = queue::channel::<StreamInfo>(1);
        // Number of the last message that was read before the server's state was requested.
        let mut looking: Option<u64> = None;
        self.show();
        while !self.program_has_left {
            let can_read = self.shared.untaken() < MOST_UNTAKEN;
            tokio::select! {
                Some(command) = self.todo.recv() => self.take_command(command),
                message = messages.next(), if can_read => {
                    let goes_on = self.take_messages(message, &mut messages)?;
                    // News is passed on before the state shows that the whole log is read.
                    self.pass_on();
                    if !goes_on {
                        return Ok(());
                    }
                }
                Some(received) = server.presence.next() => self.member.receive(&received.payload, self.now()),
                Some(answer) = answers.recv() => {
                    let asked_at = looking.take().unwrap_or_default();
                    match answer {
                        Ok(info) => {
                            self.check(&info, asked_at)?;
                            let known = self.member.last_sequence;
                            // No message was read since the last check, so the missing messages do not arrive.
                            if can_read && info.state.last_sequence > known && known == look_known {
                                return Ok(());
                            }
                            look_known = known;
                        }
                        Err(NoAnswer::NoStream) => return Ok(()),
                        Err(NoAnswer::Later(why) | NoAnswer::NoStreams(why)) => self.complaints.set(why),
                    }
                }
                _ = ticks.tick() => {
                    let now = self.now();
                    // This program was suspended, or the log was not read, so the silence of other members does not count.
                    if now.saturating_sub(ticked) > Duration::from_secs(1) || !server.is_connected() || !can_read {
                        self.member.interrupted(now);
                    }
                    ticked = now;
                    if !can_read || self.is_reading() {
                        self.member.hold(now);
                    }
                    if self.complaints.get().1 > server.connections {
                        return Ok(());
                    }
                    if self.member.waits_for(now).is_some_and(|waits| waits > resend_after) && server.is_connected() {
                        self.force(server).await;
                        return Ok(());
                    }
                    if looking.is_none() && now.saturating_sub(asked_since) > CHECK_EVERY && server.is_connected() {
                        (looking, asked_since) = (Some(self.member.last_sequence), now);
                        let (logs, address, sender) = (server.logs.clone(), self.address.clone(), sender.clone());
                        tokio::spawn(async move {
                            let answer = server::stream(&logs, &address, &Role::Watcher, true).await;
                            let _ = sender.send(answer).await;
                        });
                    }
                    self.publish_presence(server, now).await;
                    self.update(server, now);
                }
            }
            self.pass_on();
            let now = self.now();
            // After a reconnection an earlier message may be lost, so later messages would leave a gap.
            let is_new_connection = self.complaints.get().1 > server.connections;
            if server.is_connected() && !is_new_connection && !self.is_reading_first() {
                let out = self.member.pump(now);
                self.publish(server, out).await;
            }
            if self.is_reading() || self.state != Connection::Live {
                self.update(server, now);
            }
        }
        Ok(())
    }

    /// Whether messages that the log had when it was opened are still unread.
    fn is_reading(&self) -> bool {
        self.member.last_sequence < self.read_up_to
    }

    /// Whether the log is being read for the first time. The member joins afterwards, because the log returns its
    /// messages only after all earlier messages.
    fn is_reading_first(&self) -> bool {
        !self.has_caught_up && self.is_reading()
    }

    /// Whether a message continues the messages read; `false` if a message was lost on the way. After the log is
    /// opened, its first message must be the last message read or, if no message was read, number 1. Otherwise the
    /// server has another log.
    fn goes_on(&mut self, sequence: u64, stamp: u64, payload: &[u8]) -> Result<bool, LiveError> {
        let is_first = std::mem::take(&mut self.is_just_opened);
        let known = self.member.last_sequence;
        let is_same = match self.last_read {
            _ if !is_first => return Ok(sequence <= known + 1),
            None => sequence == 1,
            Some(last) => last == (sequence, stamp, xxh3_64(payload)),
        };
        if is_same { Ok(true) } else { Err(self.lost()) }
    }

    /// Processes a message, and further messages that were already received. Returns whether the log continues without
    /// a gap.
    fn take_messages(
        &mut self,
        first: Option<Result<async_nats::jetstream::Message, pull::MessagesError>>,
        messages: &mut pull::Stream,
    ) -> Result<bool, LiveError> {
        let mut next = first;
        for taken in 1.. {
            let Some(Ok(message)) = next else {
                // The consumer no longer exists, or the server does not answer.
                return Ok(false);
            };
            if let Ok(info) = message.info() {
                let stamp = u64::try_from(info.published.unix_timestamp_nanos()).unwrap_or_default();
                if !self.goes_on(info.stream_sequence, stamp, &message.payload)? {
                    return Ok(false);
                }
                if info.stream_sequence > self.member.last_sequence {
                    self.last_read = Some((info.stream_sequence, stamp, xxh3_64(&message.payload)));
                }
                let before = self.member.counts.own_messages;
                self.member.take(info.stream_sequence, stamp, &message.payload, self.now());
                if self.member.counts.own_messages > before {
                    self.complaints.clear();
                }
            }
            if taken == AT_ONCE {
                break;
            }
            match messages.next().now_or_never() {
                Some(message) => next = message,
                None => break,
            }
        }
        Ok(true)
    }

    /// Publishes this member's presence, and messages about authors who are gone.
    async fn publish_presence(&mut self, server: &Server, now: Duration) {
        if !server.is_connected() || self.is_reading() {
            return;
        }
        if let Some(text) = self.member.presence(now) {
            let sent = server.client.publish(self.address.presence(), text.into());
            let _ = tokio::time::timeout(RESEND_AFTER, sent).await;
        }
        if let Some(message) = self.member.message_of_absence(now) {
            self.publish(server, vec![message]).await;
        }
    }

    /// Closes a connection on which nothing is received, although the client library has not noticed its end.
    async fn force(&mut self, server: &mut Server) {
        let now = self.now();
        let is_silent = self.member.waits_for(now).is_some_and(|waits| waits > GIVE_UP);
        if is_silent && server.is_connected() && now.saturating_sub(server.forced) > GIVE_UP {
            server.forced = now;
            let _ = tokio::time::timeout(RESEND_AFTER, server.client.force_reconnect()).await;
        }
    }

    async fn publish(&self, server: &Server, out: Vec<Outgoing>) {
        for Outgoing { id, bytes } in out {
            // Messages that are not sent now are sent again later.
            if !server.is_connected() {
                return;
            }
            let message = PublishMessage::build().payload(bytes.into()).message_id(id);
            let sent = server.logs.send_publish(self.address.subject(), message);
            match tokio::time::timeout(RESEND_AFTER, sent).await {
                Ok(Ok(stored)) => {
                    let complaints = Arc::clone(&self.complaints);
                    tokio::spawn(async move {
                        if let Err(error) = stored.await {
                            complaints.set(error.to_string());
                        }
                    });
                }
                Ok(Err(error)) => self.complaints.set(error.to_string()),
                Err(_) => return,
            }
        }
    }

    /// Longest wait for an answer before the server counts as silent. It is longer while the session is crowded, because
    /// this member then retries more rarely.
    fn silence(&self) -> Duration {
        if self.member.is_crowded { GIVE_UP } else { Duration::from_secs(1) }
    }

    fn update(&mut self, server: &Server, now: Duration) {
        self.has_caught_up |= !self.is_reading();
        let is_silent =
            !server.is_connected() || self.member.waits_for(now).is_some_and(|waits| waits > self.silence());
        self.state = if is_silent {
            Connection::Silent
        } else if self.member.is_crowded {
            Connection::Crowded
        } else if self.member.is_full {
            Connection::Full
        } else if self.is_reading() {
            Connection::Reading { read: self.member.last_sequence, of: self.read_up_to }
        } else {
            Connection::Live
        };
        self.member.counts.connections = self.complaints.get().1;
        self.show();
    }

    /// Passes the news on to the program.
    fn pass_on(&mut self) {
        if self.member.news.is_empty() {
            return;
        }
        // The state is updated first, so that events that the program receives no longer count as pending.
        self.show();
        for news in self.member.news.drain(..) {
            if let News::Events { events, .. } = &news {
                self.shared.note_untaken(events.len());
            }
            self.program_has_left |= self.out.send(Ok(news)).is_err();
        }
        (self.wake)();
    }

    fn show(&self) {
        let member = &self.member;
        let status = Status {
            connection: self.state.clone(),
            trouble: self.complaints.get().0,
            author: member.author(),
            authors: member.authors(),
            pending: member.pending(),
            has_caught_up: self.has_caught_up,
            counts: member.counts,
            last_passed: member.last_passed.clone(),
        };
        self.shared.set(status, &member.latency_us);
    }
}

fn unix_nanos() -> i128 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    i128::try_from(since.as_nanos()).unwrap_or(i128::MAX)
}
