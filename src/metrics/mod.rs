//! What a frame cost and what it found: the stage clock, the record of a frame, fingerprints, and what a session holds.

mod clock;
mod fingerprint;
mod record;
mod summary;

pub use clock::{Reading, Stage, StageClock};
pub use fingerprint::{SessionFingerprint, fingerprint_of_frame, fingerprint_of_views};
pub use record::{FrameRecord, OcclusionRecord};
pub use summary::{Summary, summarize};
