//! The JSON form that all reports share.

use serde::Serialize;

/// A report as one JSON object on one line.
pub(crate) fn json_line(report: &impl Serialize) -> String {
    serde_json::to_string(report).unwrap_or_else(|e| format!("{{\"error\":{:?}}}", e.to_string()))
}
