//! The object of a handle. Several threads may read it at once, or one thread may change it. No call blocks: a call
//! that would have to wait returns an error, and after a panic in a change every call does.

use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

use crate::status::{Failure, OspStatus, Outcome};

pub(crate) struct Guarded<T>(RwLock<T>);

impl<T> Guarded<T> {
    pub(crate) fn new(object: T) -> Self {
        Self(RwLock::new(object))
    }

    pub(crate) fn read(&self) -> Outcome<RwLockReadGuard<'_, T>> {
        self.0.try_read().map_err(|e| refusal(&e, "another thread is changing the culler"))
    }

    pub(crate) fn change(&self) -> Outcome<RwLockWriteGuard<'_, T>> {
        self.0.try_write().map_err(|e| refusal(&e, "another thread is using the culler"))
    }
}

fn refusal<T>(error: &TryLockError<T>, busy: &str) -> Failure {
    match error {
        TryLockError::WouldBlock => Failure::new(OspStatus::Busy, busy),
        TryLockError::Poisoned(_) => Failure::new(
            OspStatus::Poisoned,
            "an earlier change of the culler failed inside of osp: the culler can only be freed",
        ),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_stands_behind_a_handle_may_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<crate::OspCuller>();
    }
}
