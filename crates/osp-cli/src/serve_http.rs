//! The server of `osp serve`. The memory and time of each connection are bounded, whatever the client sends.

use std::{
    convert::Infallible,
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    pin::pin,
    sync::Arc,
    time::Duration,
};

use anyhow::{Context, bail};
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    service::TowerToHyperService,
};
use tokio::{
    net::{TcpListener, TcpStream},
    runtime,
    sync::{OwnedSemaphorePermit, Semaphore, watch},
    time::{sleep, timeout},
};
use tokio_io_timeout::TimeoutStream;
use tower::service_fn;
use tower_http::compression::{Compression, Predicate, predicate::SizeAbove};

use super::{
    outcome::Outcome,
    output::{print_result, warn},
    serve_answer::{Site, answer, is_worth_compressing, with_headers},
    serve_args::ServeArgs,
};

/// Largest number of concurrent connections. Further connections wait until a connection ends. A browser opens six.
const MOST_CONNECTIONS: usize = 64;
/// Largest number of bytes in the head of a request. Also the size of a connection's buffer.
const MOST_HEAD_BYTES: usize = 16 << 10;
/// Largest number of header lines of a request.
const MOST_HEAD_LINES: usize = 64;
/// Longest time to receive the head of a request, from the start of the connection or the end of the last answer.
const HEAD_TIME: Duration = Duration::from_secs(10);
/// Longest time without progress in sending an answer.
const STALL_TIME: Duration = Duration::from_secs(10);
/// Time after which a connection accepts no further request. Its last answer may take the same time again.
const CONNECTION_TIME: Duration = Duration::from_secs(300);
/// Time for unfinished answers after a signal.
const CLOSING_TIME: Duration = Duration::from_secs(2);
/// Pause after an attempt to accept a connection has failed.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Files smaller than this are sent uncompressed.
const LEAST_COMPRESSED_BYTES: u64 = 1024;

pub(super) fn run(args: &ServeArgs) -> anyhow::Result<Outcome> {
    let folder = folder(&args.folder)?;
    let runtime =
        runtime::Builder::new_multi_thread().enable_all().build().context("the server's threads")?;
    let outcome = runtime.block_on(serve(args, folder));
    // A file system that does not answer must not keep the program running.
    runtime.shutdown_background();
    outcome.map(|()| Outcome::Done)
}

fn folder(given: &Path) -> anyhow::Result<PathBuf> {
    let folder = std::fs::canonicalize(given).with_context(|| match given == Path::new("web/dist") {
        true => "web/dist: `web/build` makes it".to_owned(),
        false => given.display().to_string(),
    })?;
    if !folder.is_dir() {
        bail!("{}: expected a folder; found a file", given.display());
    }
    Ok(folder)
}

/// Accepts connections until a signal comes.
async fn serve(args: &ServeArgs, folder: PathBuf) -> anyhow::Result<()> {
    let wanted = SocketAddr::from((Ipv4Addr::LOCALHOST, args.port));
    let listener = TcpListener::bind(wanted).await.with_context(|| wanted.to_string())?;
    let address = listener.local_addr().with_context(|| wanted.to_string())?;
    let (end, mut ending) = watch::channel(false);
    end_on_signals(end.clone());
    print_result(&format!("{} is at http://{address}/ until Ctrl+C", args.folder.display()))?;
    let site = Arc::new(Site::new(folder, address.port()));
    let free = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    let connections = async {
        loop {
            let place = Arc::clone(&free).acquire_owned().await.context("the connections")?;
            match listener.accept().await {
                Ok((stream, _)) => {
                    tokio::spawn(serve_connection(stream, Arc::clone(&site), end.subscribe(), place));
                }
                // The browser has closed the connection, or the process is out of file descriptors.
                Err(error) => {
                    warn(&format!("warning: {address}: {error}"));
                    sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    };
    tokio::select! {
        never = connections => return never,
        _ = ending.wait_for(|is_ending| *is_ending) => {}
    }
    drop(listener);
    // Waits until all connections have ended. Cuts off slower answers.
    let _ = timeout(CLOSING_TIME, free.acquire_many(MOST_CONNECTIONS as u32)).await;
    Ok(())
}

/// Answers the requests of a connection.
async fn serve_connection(
    stream: TcpStream,
    site: Arc<Site>,
    mut ending: watch::Receiver<bool>,
    _place: OwnedSemaphorePermit,
) {
    // Turns off the delay of Nagle's algorithm.
    let _ = stream.set_nodelay(true);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(STALL_TIME));
    let answers = service_fn(move |request| answer(Arc::clone(&site), request));
    let compressed = Compression::new(answers)
        .compress_when(SizeAbove::new(LEAST_COMPRESSED_BYTES).and(is_worth_compressing));
    let isolated = service_fn(move |request| {
        let answer = tower::Service::call(&mut compressed.clone(), request);
        async move { Ok::<_, Infallible>(with_headers(answer.await?)) }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .max_buf_size(MOST_HEAD_BYTES)
        .max_headers(MOST_HEAD_LINES)
        .title_case_headers(true)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(isolated));
    let mut connection = pin!(connection);
    // Errors of a connection do not affect the other connections.
    tokio::select! {
        _ = connection.as_mut() => return,
        () = sleep(CONNECTION_TIME) => {}
        _ = ending.wait_for(|is_ending| *is_ending) => {}
    }
    connection.as_mut().graceful_shutdown();
    let _ = timeout(CONNECTION_TIME, connection).await;
}

/// Ends the server on Ctrl-C and other signals. Unfinished answers then have `CLOSING_TIME` to end.
fn end_on_signals(end: watch::Sender<bool>) {
    osp_session::atomic_file::on_signal(Some(Box::new(move || {
        end.send_replace(true);
        // The program normally ends during this time. If not, the signal ends it.
        std::thread::sleep(2 * CLOSING_TIME);
    })));
}
