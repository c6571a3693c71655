//! Stands for `verify_drawn` in a build that cannot draw: there are no trials.

use serde::Serialize;

/// Nothing is drawn in this build.
pub(super) enum DrawnTrials {}

/// Nothing is drawn in this build.
#[derive(Serialize)]
pub(super) enum DrawnRun {}
