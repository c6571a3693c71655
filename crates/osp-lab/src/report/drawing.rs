/// The drawing times of a run's frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawReport {
    /// Time from submission to completion of each frame, sorted, nanoseconds.
    draw_ns: Vec<u64>,
    /// Time to upload new polygons, sort and upload the draw list, for each frame, sorted, nanoseconds.
    send_ns: Vec<u64>,
    /// Number of frames with culling while drawing, and their sums.
    culling: Option<(u64, DrawnWhileCulling)>,
    /// GPU times of these frames, sorted: depth pass, Hi-Z test, colour pass; nanoseconds.
    gpu_ns: [Vec<u64>; 3],
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawnWhileCulling {
    pub groups_tested: u64,
    /// Number of polygons drawn in the depth pass.
    pub first_pass: u64,
    /// Number of polygons drawn in the colour pass.
    pub second_pass: u64,
    pub hidden: u64,
    /// GPU times of depth pass, test and colour pass, nanoseconds, if the adapter supports timestamps.
    pub gpu_ns: Option<[u64; 3]>,
}

impl DrawReport {
    /// Adds a frame: the time from submission to completion, and the time before submission, nanoseconds.
    pub fn add(&mut self, draw_ns: u64, send_ns: u64) {
        insert(&mut self.draw_ns, draw_ns);
        insert(&mut self.send_ns, send_ns);
    }

    pub fn add_culling(&mut self, frame: DrawnWhileCulling) {
        let (frames, sum) = self.culling.get_or_insert_default();
        *frames += 1;
        sum.groups_tested += frame.groups_tested;
        sum.first_pass += frame.first_pass;
        sum.second_pass += frame.second_pass;
        sum.hidden += frame.hidden;
        for (times, ns) in self.gpu_ns.iter_mut().zip(frame.gpu_ns.into_iter().flatten()) {
            insert(times, ns);
        }
    }

    pub fn has_culling(&self) -> bool {
        self.culling.is_some()
    }

    /// The mean of a count over the frames that were culled while drawing; 0 without such frames.
    pub fn culling_mean(&self, of: impl Fn(&DrawnWhileCulling) -> u64) -> f64 {
        self.culling.as_ref().map_or(0.0, |(frames, sum)| of(sum) as f64 / (*frames).max(1) as f64)
    }

    /// Median GPU times of depth pass, test and colour pass, microseconds; `None` if the adapter has no timestamps.
    pub fn gpu_us(&self) -> Option<[f64; 3]> {
        (!self.gpu_ns[0].is_empty()).then(|| [0, 1, 2].map(|pass| at(&self.gpu_ns[pass], 0.5)))
    }

    pub fn frames(&self) -> u64 {
        self.draw_ns.len() as u64
    }

    /// A quantile, 0 to 1, of the time from submission to completion, microseconds; 0 if no frame was drawn.
    pub fn draw_us(&self, quantile: f64) -> f64 {
        at(&self.draw_ns, quantile)
    }

    /// A quantile, 0 to 1, of the time before submission, microseconds; 0 if no frame was drawn.
    pub fn send_us(&self, quantile: f64) -> f64 {
        at(&self.send_ns, quantile)
    }
}

fn insert(sorted_ns: &mut Vec<u64>, ns: u64) {
    let at = sorted_ns.partition_point(|&other| other <= ns);
    sorted_ns.insert(at, ns);
}

fn at(sorted_ns: &[u64], quantile: f64) -> f64 {
    let rank = (quantile.clamp(0.0, 1.0) * sorted_ns.len() as f64).ceil() as usize;
    sorted_ns.get(rank.saturating_sub(1)).map_or(0.0, |&ns| ns as f64 / 1000.0)
}
