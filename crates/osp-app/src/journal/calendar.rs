use std::time::SystemTime;

use jiff::Timestamp;

/// A time in UTC, to the second, such as `2026-01-31 23:59:59 UTC`.
pub(super) fn for_people(time: SystemTime) -> String {
    written(time, "%Y-%m-%d %H:%M:%S UTC")
}

/// A time in UTC, to the second, such as `20260131-235959`.
pub(super) fn for_file_name(time: SystemTime) -> String {
    written(time, "%Y%m%d-%H%M%S")
}

/// A time that has no date becomes the beginning of 1970.
fn written(time: SystemTime, format: &str) -> String {
    Timestamp::try_from(time).unwrap_or(Timestamp::UNIX_EPOCH).strftime(format).to_string()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn times_are_written_in_utc() {
        let at = SystemTime::UNIX_EPOCH + Duration::from_millis(951_782_400_700);
        assert_eq!(for_file_name(at), "20000229-000000");
        assert_eq!(for_people(at), "2000-02-29 00:00:00 UTC");
    }
}
