//! The report of `osp replay --world` on a flight.

use hdrhistogram::Histogram;
use indicatif::HumanBytes;
use serde_json::json;

use super::{
    output::one_line,
    world_args::{WorldArgs, world_name},
};
use osp_lab::{
    report::{short, thousands},
    rows::csv_cell,
};
use osp_net::world::{Frame, WalkCounts, World};
use osp_session::replay::SessionFingerprint;

/// Upper limit of the recorded frame times, nanoseconds: an hour.
const LONGEST_NS: u64 = 3_600_000_000_000;

/// The measurements of a flight.
pub(super) struct WorldReport {
    world: String,
    camera: String,
    options: WorldArgs,
    polygons: u64,
    blocks: u64,
    objects: u64,
    sources: Vec<String>,
    map_bytes: u64,
    frames: u64,
    /// Times in nanoseconds.
    work: Histogram<u64>,
    visible: u64,
    in_view: u64,
    late_frames: u64,
    waited: Part,
    missing: Part,
    missing_polygons_max: u64,
    fingerprint: SessionFingerprint,
    pub(super) counts: WalkCounts,
}

/// Statistics of a value: the number of frames with a value above 0, the sum, and the largest value.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    frames: u64,
    sum: u64,
    max: u64,
}

impl Part {
    fn add(&mut self, value: u64) {
        self.frames += u64::from(value > 0);
        self.sum += value;
        self.max = self.max.max(value);
    }
}

impl WorldReport {
    /// The columns of the CSV file, which has a line for each frame.
    pub(super) const COLUMNS: &str =
        "world,frame,blocks,visible,late_blocks,missing_blocks,missing_polygons,work_us,wait_us,fingerprint";

    pub(super) fn new(address: &str, world: &World, options: &WorldArgs, camera: String) -> Self {
        let manifest = &world.manifest;
        let sources = manifest.sources.iter().map(|source| match source.copies {
            1 => source.name.clone(),
            copies => format!("{} ({copies} times)", source.name),
        });
        Self {
            world: world_name(address),
            camera,
            options: options.clone(),
            polygons: manifest.polygon_count(),
            blocks: manifest.blocks.len() as u64,
            objects: manifest.object_count() as u64,
            sources: sources.collect(),
            map_bytes: world.bytes() as u64,
            frames: 0,
            work: Histogram::new_with_bounds(1, LONGEST_NS, 3).expect("these bounds are allowed"),
            visible: 0,
            in_view: 0,
            late_frames: 0,
            waited: Part::default(),
            missing: Part::default(),
            missing_polygons_max: 0,
            fingerprint: SessionFingerprint::new(),
            counts: WalkCounts::default(),
        }
    }

    /// Returns the line of a frame.
    pub(super) fn line(world: &str, frame: &Frame) -> String {
        let name = csv_cell(world);
        format!(
            "{name},{},{},{},{},{},{},{:.3},{:.3},{:016x}",
            frame.number,
            frame.blocks,
            frame.visible,
            frame.late,
            frame.missing_blocks,
            frame.missing_polygons,
            frame.work_ns as f64 / 1.0e3,
            frame.wait_ns as f64 / 1.0e3,
            frame.fingerprint,
        )
    }

    pub(super) fn add(&mut self, frame: &Frame) {
        self.frames += 1;
        self.work.saturating_record(frame.work_ns);
        self.visible += frame.visible;
        self.in_view += frame.blocks;
        self.late_frames += u64::from(frame.late > 0);
        self.waited.add(frame.wait_ns);
        self.missing.add(frame.missing_blocks);
        self.missing_polygons_max = self.missing_polygons_max.max(frame.missing_polygons);
        self.fingerprint.add(frame.number, frame.fingerprint);
    }

    fn work_us(&self, quantile: f64) -> f64 {
        self.work.value_at_quantile(quantile) as f64 / 1.0e3
    }

    fn mean(&self, sum: u64) -> f64 {
        sum as f64 / self.frames.max(1) as f64
    }

    /// Returns the fingerprint of all frames. `None` if some frame had missing blocks.
    fn fingerprint(&self) -> Option<String> {
        (self.missing.frames == 0).then(|| format!("{:016x}", self.fingerprint.value()))
    }

    pub(super) fn to_json(&self) -> String {
        let options = &self.options;
        let us = |ns: u64| ns as f64 / 1.0e3;
        json!({
            "world": self.world,
            "polygons": self.polygons,
            "blocks": self.blocks,
            "objects": self.objects,
            "sources": self.sources,
            "camera": self.camera,
            "frames": self.frames,
            "memory_limit_bytes": options.memory,
            "waits": options.wait,
            "frames_a_second": if options.wait { 0 } else { options.rate },
            "prefetch_frames": options.prefetch,
            "frame_us": {
                "p50": self.work_us(0.5),
                "p95": self.work_us(0.95),
                "p99": self.work_us(0.99),
                "max": self.work_us(1.0),
            },
            "visible_mean": self.mean(self.visible),
            "blocks_in_view_mean": self.mean(self.in_view),
            "late_frames": self.late_frames,
            "waited": { "frames": self.waited.frames, "total_us": us(self.waited.sum), "max_us": us(self.waited.max) },
            "missing": {
                "frames": self.missing.frames,
                "blocks_max": self.missing.max,
                "blocks_mean": self.mean(self.missing.sum),
                "polygons_max": self.missing_polygons_max,
            },
            "bytes_read": self.counts.bytes_read,
            "blocks_read": self.counts.blocks_read,
            "most_resident_bytes": self.counts.most_resident_bytes,
            "map_bytes": self.map_bytes,
            "fingerprint": self.fingerprint(),
        })
        .to_string()
    }

    pub(super) fn text(&self) -> String {
        let mut table = comfy_table::Table::new();
        table.load_preset(comfy_table::presets::NOTHING);
        let mut row = |name: &str, value: String| {
            table.add_row([name.to_owned(), value]);
        };
        let ms = |ns: u64| short(ns as f64 / 1.0e6);
        let quantiles = [0.5, 0.95, 0.99, 1.0].map(|quantile| short(self.work_us(quantile)));
        row("frame p50, p95, p99, max", format!("{} µs", quantiles.join(", ")));
        row(
            "in view (mean)",
            format!(
                "{} polygons, {} blocks",
                thousands(self.mean(self.visible).round() as u64),
                short(self.mean(self.in_view))
            ),
        );
        if self.options.wait {
            row(
                "waited",
                match self.waited.frames {
                    0 => "in no frame".to_owned(),
                    frames => format!(
                        "in {} frames: {} ms in all, {} ms at most",
                        thousands(frames),
                        ms(self.waited.sum),
                        ms(self.waited.max)
                    ),
                },
            );
        } else {
            row(
                "missing blocks",
                match self.missing.frames {
                    0 => "in no frame".to_owned(),
                    frames => format!(
                        "in {} frames: at most {} blocks of {} polygons",
                        thousands(frames),
                        thousands(self.missing.max),
                        thousands(self.missing_polygons_max)
                    ),
                },
            );
        }
        row(
            "read",
            format!(
                "{} in {} blocks",
                HumanBytes(self.counts.bytes_read),
                thousands(self.counts.blocks_read)
            ),
        );
        row(
            "blocks in memory, at most",
            format!("{} of {}", HumanBytes(self.counts.most_resident_bytes), HumanBytes(self.options.memory)),
        );
        row("boxes of all blocks", HumanBytes(self.map_bytes).to_string());
        row("fingerprint", self.fingerprint().unwrap_or_else(|| "none: --wait makes one".to_owned()));
        format!(
            "{}: {} polygons in {} blocks, {} objects; {} frames ({})\n{table}",
            one_line(&self.world),
            thousands(self.polygons),
            thousands(self.blocks),
            thousands(self.objects),
            thousands(self.frames),
            one_line(&self.camera),
        )
    }
}
