use std::time::SystemTime;

use osp_session::platform;

/// A moment in universal time, to the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moment {
    year: u64,
    month: u64,
    day: u64,
    second_of_day: u64,
}

impl Moment {
    pub(super) fn now() -> Self {
        Self::of(platform::time::now())
    }

    /// Converts a time to a date with Howard Hinnant's algorithm ("chrono-Compatible Low-Level Date Algorithms", 2013).
    pub(super) fn of(time: SystemTime) -> Self {
        let secs = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        // Eras of 400 years begin in March, so that the leap day is the last day of a year.
        let shifted = secs / 86_400 + 719_468;
        let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
        let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
        let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
        let march_month = (5 * day_of_year + 2) / 153;
        let day = day_of_year - (153 * march_month + 2) / 5 + 1;
        let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
        let year = year_of_era + era * 400 + u64::from(month <= 2);
        Self { year, month, day, second_of_day: secs % 86_400 }
    }

    fn clock(&self) -> (u64, u64, u64) {
        (self.second_of_day / 3600, self.second_of_day / 60 % 60, self.second_of_day % 60)
    }

    /// A text such as `20260131-235959`.
    pub(super) fn for_file_name(&self) -> String {
        let Self { year, month, day, .. } = self;
        let (hour, minute, second) = self.clock();
        format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{second:02}")
    }

    /// A text such as `2026-01-31 23:59:59 UTC`.
    pub(super) fn for_people(&self) -> String {
        let Self { year, month, day, .. } = self;
        let (hour, minute, second) = self.clock();
        format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC")
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn dates_are_dates() {
        let at = |secs| Moment::of(SystemTime::UNIX_EPOCH + Duration::from_secs(secs));
        assert_eq!(at(0).for_file_name(), "19700101-000000");
        assert_eq!(at(951_782_400).for_file_name(), "20000229-000000");
        assert_eq!(at(1_767_225_599).for_file_name(), "20251231-235959");
        assert_eq!(at(1_767_225_599).for_people(), "2025-12-31 23:59:59 UTC");
        assert_eq!(at(1_767_225_600).for_file_name(), "20260101-000000");
    }
}
