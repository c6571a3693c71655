use std::{thread, time::Duration};

/// Number of tries after which a test says what it waits for.
const MANY: u32 = 2_000;
/// Number of tries after which it fails. They take at least fifteen minutes.
const ALL: u32 = 180_000;

/// Waits until something is found. On the slowest machine no wait takes as long as the tries that end a test that hangs.
#[expect(clippy::print_stderr, reason = "a test that hangs says why")]
pub fn wait_for<T>(what: &str, mut find: impl FnMut() -> Option<T>) -> T {
    for tries in 0..ALL {
        if let Some(found) = find() {
            return found;
        }
        if tries == MANY {
            eprintln!("still waiting for {what}");
        }
        thread::sleep(Duration::from_millis(5));
    }
    panic!("waited in vain for {what}");
}

/// Waits until this is so. See [`wait_for`].
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    wait_for(what, || is_so().then_some(()));
}
