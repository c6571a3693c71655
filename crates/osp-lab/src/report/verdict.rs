use super::{ReplayReport, RunReport, numbers::short};

/// Which index took the least time, and how many times as long the others took, each over the frames that both were
/// measured in. `None` if there is nothing to compare, or if occlusion culling makes it a question of drawing, too.
pub fn verdict(report: &ReplayReport) -> Option<String> {
    let runs: Vec<&RunReport> = report.runs.iter().filter(|run| run.measured_frames() > 0).collect();
    if runs.len() < 2 || runs.iter().any(|run| run.occlusion.is_some() || run.draw.is_some()) {
        return None;
    }
    // One that was too slow for all frames is not the fastest.
    let complete = runs.iter().filter(|run| run.is_complete());
    let best = complete.min_by(|a, b| a.frame_us(0.5).total_cmp(&b.frame_us(0.5)))?;
    let others = runs.iter().filter(|run| run.name() != best.name());
    let mut ratios: Vec<(String, f64)> =
        others.filter_map(|run| Some((run.name(), ratio(best, run)?))).collect();
    ratios.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (nearest, rest) = ratios.split_first()?;
    let mut line = format!(
        "{} took the least time: {} µs a frame (median). In the same frames {} took {} times as long",
        best.name(),
        short(best.frame_us(0.5)),
        nearest.0,
        short(nearest.1)
    );
    for (name, ratio) in rest {
        line += &format!(", {name} {}", short(*ratio));
    }
    Some(line + ".")
}

/// The median of a run divided by that of another, over the frames that both were measured in.
fn ratio(best: &RunReport, other: &RunReport) -> Option<f64> {
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut all = best.curve().iter().peekable();
    for of_other in other.curve() {
        while all.next_if(|of_best| of_best.frame < of_other.frame).is_some() {}
        if let Some(of_best) = all.next_if(|of_best| of_best.frame == of_other.frame) {
            ours.push(of_best.total_ns);
            theirs.push(of_other.total_ns);
        }
    }
    let median = |mut times: Vec<u64>| {
        times.sort_unstable();
        times.get(times.len() / 2).copied()
    };
    Some(median(theirs)? as f64 / median(ours)?.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::frame::{FrameRecord, Stage};
    use osp_session::replay::LaneFrame;

    /// A run in which each of these frames took so many microseconds.
    fn run(name: &str, session_frames: u64, frames: &[(u64, u64)]) -> RunReport {
        let mut run = RunReport::new(name, session_frames);
        for &(frame, us) in frames {
            let cull = Stage { ns: us * 1000, allocations: 0 };
            let record = FrameRecord { frame, cull, ..FrameRecord::default() };
            run.add(&LaneFrame {
                record,
                in_view: 0,
                drawn: 0,
                fingerprinting: Stage::default(),
                catches_up: false,
            });
        }
        run
    }

    fn report(runs: Vec<RunReport>) -> ReplayReport {
        ReplayReport {
            recording: String::new(),
            strokes: 0,
            points: 0,
            polygons: 0,
            frames: 4,
            pace: String::new(),
            camera: String::new(),
            rig: None,
            runs,
        }
    }

    #[test]
    fn times_are_compared_over_the_frames_that_both_were_measured_in() {
        let fast = run("fast", 4, &[(1, 10), (2, 10), (3, 30), (4, 30)]);
        let slow = run("slow", 4, &[(1, 40), (2, 40), (3, 60), (4, 60)]);
        // Measured in the short frames alone, where its median would flatter it.
        let partial = run("partial", 4, &[(1, 15), (2, 15)]);
        let said = verdict(&report(vec![slow, partial, fast])).expect("three to compare");
        assert_eq!(
            said,
            "fast took the least time: 10.0 µs a frame (median). In the same frames partial took 1.50 times as long, slow 2.00."
        );
        assert_eq!(verdict(&report(vec![run("alone", 4, &[(1, 10)])])), None);
    }
}
