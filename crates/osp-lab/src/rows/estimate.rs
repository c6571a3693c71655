/// Number of standard deviations of a normal distribution within which 95 of 100 draws fall.
const Z_95: f64 = 1.96;

/// A median, and an interval that contains the true median in 95 of 100 cases if the values are independent.
/// Consecutive frames are not quite independent, so the interval is slightly too narrow.
///
/// The interval consists of order statistics, without any assumption about the distribution (W. J. Conover, "Practical
/// Nonparametric Statistics", 1971, section 3.2). With fewer than six values it spans all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    pub median: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Estimate {
    /// The median of `values`, which are sorted by the call; `None` without values.
    pub fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let (n, &first, &last) = (values.len(), values.first()?, values.last()?);
        let median = f64::midpoint(values[(n - 1) / 2], values[n / 2]);
        if n < 6 {
            return Some(Self { median, low: first, high: last });
        }
        // The number of values below the true median is binomial with p = 1/2.
        let (middle, spread) = (n as f64 / 2.0, Z_95 * (n as f64).sqrt() / 2.0);
        let low = (middle - spread).floor().max(1.0) as usize - 1;
        let high = (middle + spread).ceil().min(n as f64 - 1.0) as usize;
        Some(Self { median, low: values[low], high: values[high] })
    }
}

/// The value below which the share `q` (0 to 1) of the sorted values lies; 0 without values.
pub(crate) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = (q * sorted.len() as f64).ceil() as usize;
    sorted.get(at.saturating_sub(1)).or(sorted.last()).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_that_of_the_order_statistics() {
        assert_eq!(Estimate::of(&mut []), None);
        let of = |n: usize| Estimate::of(&mut (1..=n).rev().map(|i| i as f64).collect::<Vec<_>>());
        let estimate = |median, low, high| Some(Estimate { median, low, high });
        assert_eq!(of(1), estimate(1.0, 1.0, 1.0));
        assert_eq!(of(4), estimate(2.5, 1.0, 4.0));
        // Tables of the binomial distribution give the 40th and the 61st of 100 values.
        assert_eq!(of(100), estimate(50.5, 40.0, 61.0));
    }

    #[test]
    fn the_interval_holds_the_median_about_as_often_as_it_says() {
        // Uniform numbers, median 1/2.
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let hits = (0..1000)
            .filter(|_| {
                let estimate = Estimate::of(&mut [(); 60].map(|()| uniform())).expect("values");
                (estimate.low..=estimate.high).contains(&0.5)
            })
            .count();
        assert!((930..=985).contains(&hits), "{hits} of 1000");
    }

    #[test]
    fn quantiles_are_values_that_occurred() {
        let sorted: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(quantile(&sorted, 0.5), 100.0);
        assert_eq!(quantile(&sorted, 0.99), 198.0);
        assert_eq!(quantile(&sorted, 1.0), 200.0);
        assert_eq!(quantile(&[], 0.5), 0.0);
    }
}
