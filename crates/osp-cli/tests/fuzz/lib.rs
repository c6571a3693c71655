//! The targets of `crates/osp-cli/tests/fuzzing`, for libFuzzer.
#![allow(missing_docs, reason = "the targets explain themselves in their modules")]

#[path = "../fuzzing/mod.rs"]
pub mod fuzzing;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;

/// A binary of libFuzzer around a target.
#[macro_export]
macro_rules! fuzz {
    ($target:ident) => {
        libfuzzer_sys::fuzz_target!(|data: &[u8]| $crate::fuzzing::$target::run(data));
    };
}
