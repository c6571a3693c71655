//! Background work on threads. A web page has no threads: there the caller's thread does the work.

/// An event from another thread, or from a page, which wakes the event loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wake;

/// Runs work on a new thread. A web page has no threads, so there the call itself runs the work.
pub(crate) fn in_background(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    if cfg!(target_arch = "wasm32") {
        work();
        return Ok(());
    }
    std::thread::Builder::new().name(name.to_owned()).spawn(work).map(drop)
}

/// Runs `make`, and runs `take` on another thread. `take` gets the items that `make` passes on, in order. At most
/// `ahead` items wait. Passing on an item returns `false` once `take` has failed.
pub(crate) fn hand_over<T: Send, E: Send, R>(
    ahead: usize,
    take: impl FnMut(T) -> Result<(), E> + Send,
    make: impl FnOnce(&mut dyn FnMut(T) -> bool) -> R,
) -> (R, Result<(), E>) {
    std::thread::scope(|scope| {
        let (send, things) = std::sync::mpsc::sync_channel(ahead);
        let taking = scope.spawn(move || things.into_iter().try_for_each(take));
        let made = make(&mut |thing| send.send(thing).is_ok());
        drop(send);
        (made, taking.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// Waits for a future, then passes its result to `then`. A web page cannot wait, so there the result is passed later.
pub(crate) fn when_done<T: 'static>(work: impl Future<Output = T> + 'static, then: impl FnOnce(T) + 'static) {
    #[cfg(not(target_arch = "wasm32"))]
    then(pollster::block_on(work));
    #[cfg(target_arch = "wasm32")]
    wasm_bindgen_futures::spawn_local(async move { then(work.await) });
}

/// Waits a moment for another program; does nothing on a web page.
pub(crate) fn pause(time: std::time::Duration) {
    if !cfg!(target_arch = "wasm32") {
        std::thread::sleep(time);
    }
}

#[cfg(test)]
mod tests {
    use super::hand_over;

    #[test]
    fn things_are_taken_in_their_order_until_one_is_refused() {
        let mut taken = Vec::new();
        let take = |n: u32| {
            taken.push(n);
            if n == 700 { Err(n) } else { Ok(()) }
        };
        let (made, outcome) = hand_over(3, take, |give| (0..1000).take_while(|&n| give(n)).count());
        assert_eq!(outcome, Err(700));
        assert!((701..=705).contains(&made), "{made}: it stops soon after that");
        assert!(taken.iter().copied().eq(0..=700));
    }
}
