#[cfg(feature = "parquet")]
use parquet_derive::ParquetRecordWriter;
use serde::{Deserialize, Deserializer, Serialize, de::Error};
use serde_json::value::RawValue;

use crate::{bench::Machine, report::RunReport};

/// One session through one index; of a session that cannot be read, its error. The fields are the columns of the table.
///
/// Times are of the machine that the row names. `None` (null in the table) is what an error leaves unknown, and what belongs to
/// occlusion culling where there was none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "parquet", derive(ParquetRecordWriter))]
pub struct StudyRow {
    /// The file: its path below the folder that was named, or as it was named, with `/` between names.
    pub file: String,
    /// 32 hexadecimal digits of the contents (XXH3, 128 bits), with those of files that are read with it.
    pub file_hash: Option<String>,
    /// Size of the file or files, bytes.
    pub file_bytes: u64,
    /// Short name of the format.
    pub format: Option<String>,
    /// Why the session could not be measured.
    pub error: Option<String>,
    /// What a person should know of the session, such as that its last line is cut off.
    pub remarks: Option<String>,
    /// Damaged pieces that were passed over.
    pub skipped: Option<u64>,
    /// Strokes of the session.
    pub strokes: Option<u64>,
    /// Control points.
    pub points: Option<u64>,
    /// Polygons made.
    pub polygons: Option<u64>,
    /// Frames played.
    pub frames: Option<u64>,
    /// Whether all indexes of this session saw the same polygons in every frame.
    pub indexes_agree: Option<bool>,
    /// Name of the index.
    pub index: Option<String>,
    /// Name of the method of occlusion culling.
    pub occlusion: Option<String>,
    /// Inserting a polygon, nanoseconds, median.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub insert_ns_per_polygon: Option<f64>,
    /// Culling a frame, microseconds, median.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub cull_us: Option<f64>,
    /// A frame, microseconds, median.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub frame_p50_us: Option<f64>,
    /// A frame, microseconds, 95th percentile.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub frame_p95_us: Option<f64>,
    /// A frame, microseconds, 99th percentile.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub frame_p99_us: Option<f64>,
    /// The slowest frame, microseconds.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub frame_max_us: Option<f64>,
    /// Polygons in the frustum, mean over the frames.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub visible_mean: Option<f64>,
    /// The other polygons, mean over the frames.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub culled_mean: Option<f64>,
    /// Polygons culled by occlusion, mean over the frames.
    #[serde(default, deserialize_with = "exact_or_none")]
    pub occluded_mean: Option<f64>,
    /// Memory of the index at the end, bytes.
    pub index_bytes: Option<u64>,
    /// Allocations in insertion and culling over the second half of the session.
    pub allocations_steady: Option<u64>,
    /// Frames whose times were taken.
    pub frames_measured: Option<u64>,
    /// Frames that the fingerprint is of.
    pub frames_fingerprinted: Option<u64>,
    /// Changes that the index refused.
    pub refused: Option<u64>,
    /// Fingerprint of the polygons in the frustum, 16 hexadecimal digits.
    pub fingerprint: Option<String>,
    /// Fingerprint of the polygons left by occlusion culling.
    pub drawn_fingerprint: Option<String>,
    /// The pace, as on the command line.
    pub pace: String,
    /// The camera, as on the command line.
    pub camera: String,
    /// Whether damaged pieces are passed over.
    pub lenient: bool,
    /// Largest number of polygons of a session.
    pub max_polygons: u64,
    /// All options, in one line.
    pub options: String,
    /// Sessions that were measured at the same time.
    pub jobs: u64,
    /// Time to read and measure the session with all its indexes, seconds.
    #[serde(deserialize_with = "exact")]
    pub measuring_s: f64,
    /// Name of the machine.
    pub host: String,
    /// Name of its processor.
    pub processor: String,
    /// Hardware threads that the program might use.
    pub threads: u64,
    /// Operating system and architecture.
    pub system: String,
    /// Instruction set of the box tests.
    pub simd: String,
    /// Version of osp.
    pub osp_version: String,
    /// Commit that osp was built from.
    pub osp_commit: String,
    /// Whether osp was compiled with optimisation.
    pub optimized: bool,
}

impl StudyRow {
    /// The row with the machine and the program that it is measured with.
    #[must_use]
    pub fn on(mut self, machine: &Machine, host: &str) -> Self {
        host.clone_into(&mut self.host);
        self.processor.clone_from(&machine.processor);
        self.threads = machine.threads as u64;
        self.system.clone_from(&machine.system);
        self.simd.clone_from(&machine.simd);
        self.osp_version.clone_from(&machine.version);
        self.osp_commit.clone_from(&machine.commit);
        self.optimized = machine.optimized;
        self
    }

    /// The row with what a run gave: the figures of `osp replay --json`.
    #[must_use]
    pub fn with_run(mut self, run: &RunReport) -> Self {
        let occlusion = run.occlusion.as_ref();
        self.index = Some(run.index.clone());
        self.occlusion = occlusion.map(|occlusion| occlusion.method.to_owned());
        self.insert_ns_per_polygon = Some(run.insert_ns_per_polygon());
        self.cull_us = Some(run.cull_us());
        self.frame_p50_us = Some(run.frame_us(0.5));
        self.frame_p95_us = Some(run.frame_us(0.95));
        self.frame_p99_us = Some(run.frame_us(0.99));
        self.frame_max_us = Some(run.frame_us(1.0));
        self.visible_mean = Some(run.visible_mean());
        self.culled_mean = Some(run.culled_mean());
        self.occluded_mean = occlusion.map(|_| run.occluded_mean());
        self.index_bytes = Some(run.bytes as u64);
        self.allocations_steady = Some(run.allocations_steady());
        self.frames_measured = Some(run.measured_frames());
        self.frames_fingerprinted = Some(run.frames().len() as u64);
        self.refused = Some(run.refused);
        self.fingerprint = Some(format!("{:016x}", run.fingerprint()));
        self.drawn_fingerprint = occlusion.map(|occlusion| format!("{:016x}", occlusion.fingerprint.value()));
        self
    }

    /// The index, and its method of occlusion culling if it has one.
    pub fn run_name(&self) -> Option<String> {
        let index = self.index.as_deref()?;
        Some(match &self.occlusion {
            Some(method) => format!("{index} + {method}"),
            None => index.to_owned(),
        })
    }

    /// Whether the fingerprint is of every frame of the session.
    pub fn is_complete(&self) -> bool {
        self.frames_fingerprinted.is_some() && self.frames_fingerprinted == self.frames
    }
}

/// A number to its last bit. serde_json rounds numbers of many digits twice; the standard library does not.
fn exact<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Box::<RawValue>::deserialize(from)?.get().parse().map_err(D::Error::custom)
}

/// A number to its last bit, or null.
fn exact_or_none<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    let number = Option::<Box<RawValue>>::deserialize(from)?;
    number.map(|number| number.get().parse().map_err(D::Error::custom)).transpose()
}
