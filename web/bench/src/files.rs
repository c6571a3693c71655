//! Files in the worker's memory.

use std::cell::RefCell;

use osp_session::recording::{MemoryFiles, OpenOptions, Session};
use wasm_bindgen::prelude::*;

thread_local! {
    static FILES: RefCell<MemoryFiles> = RefCell::default();
}

/// Puts a file where [`measure`](crate::measure) and [`Race`](crate::Race) find it.
#[wasm_bindgen]
pub fn put(path: &str, bytes: Vec<u8>) {
    FILES.with_borrow_mut(|files| files.insert(path, bytes));
}

pub(super) fn open(path: &str) -> Result<Session, JsError> {
    Ok(FILES.with_borrow(|files| files.open(path, &OpenOptions::default()))?)
}
