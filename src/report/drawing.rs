/// What drawing the frames of a run took.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawReport {
    /// Submission to completion, nanoseconds.
    draw_ns: Vec<u64>,
    /// Sending what is new, sorting, sending the list: nanoseconds.
    send_ns: Vec<u64>,
}

impl DrawReport {
    /// A report without frames.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a frame: from submission to completion, and what came before the submission, nanoseconds.
    pub fn add(&mut self, draw_ns: u64, send_ns: u64) {
        for (times, ns) in [(&mut self.draw_ns, draw_ns), (&mut self.send_ns, send_ns)] {
            let at = times.partition_point(|&other| other <= ns);
            times.insert(at, ns);
        }
    }

    /// Frames drawn.
    pub fn frames(&self) -> u64 {
        self.draw_ns.len() as u64
    }

    /// From submission to completion at a quantile from 0 to 1, microseconds; 0 where nothing was drawn.
    pub fn draw_us(&self, quantile: f64) -> f64 {
        at(&self.draw_ns, quantile)
    }

    /// What comes before the submission at a quantile from 0 to 1, microseconds; 0 where nothing was drawn.
    pub fn send_us(&self, quantile: f64) -> f64 {
        at(&self.send_ns, quantile)
    }
}

fn at(sorted_ns: &[u64], quantile: f64) -> f64 {
    let rank = (quantile.clamp(0.0, 1.0) * sorted_ns.len() as f64).ceil() as usize;
    sorted_ns.get(rank.saturating_sub(1)).map_or(0.0, |&ns| ns as f64 / 1000.0)
}
