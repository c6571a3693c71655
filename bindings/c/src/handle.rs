//! The object behind a handle. Several threads may read it at once, or one may change it. Nobody waits: a call that
//! would have to wait is refused, and so is every call after a panic in a change.

use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

use crate::status::{Failure, OspStatus, Outcome};

pub(crate) struct Guarded<T>(RwLock<T>);

impl<T> Guarded<T> {
    pub(crate) fn new(object: T) -> Self {
        Self(RwLock::new(object))
    }

    pub(crate) fn read(&self) -> Outcome<RwLockReadGuard<'_, T>> {
        self.0.try_read().map_err(|e| refusal(&e, "another thread is changing it"))
    }

    pub(crate) fn change(&self) -> Outcome<RwLockWriteGuard<'_, T>> {
        self.0.try_write().map_err(|e| refusal(&e, "another thread is using it"))
    }
}

fn refusal<T>(error: &TryLockError<T>, busy: &str) -> Failure {
    match error {
        TryLockError::WouldBlock => Failure::new(OspStatus::Busy, busy),
        TryLockError::Poisoned(_) => {
            Failure::new(OspStatus::Poisoned, "a change of it has failed inside of osp: it can only be freed")
        }
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
