use std::io::{self, Write};

use crate::visibility::LaneFrame;

/// Writes one line for each index and frame.
#[derive(Debug)]
pub struct CsvWriter<W> {
    out: W,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the line of column names.
    ///
    /// # Errors
    /// The output could not be written.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(
            out,
            "recording,index,frame,measured,polygons,inserted,removed,updated,insert_ns,cull_ns,total_ns,visible,culled,nodes,\
             boxes,planes,taken_whole,allocations,fingerprint"
        )?;
        Ok(Self { out })
    }

    /// Writes a frame. `measured` is 0 where the index had skipped frames before: the times are then not the frame's own.
    ///
    /// # Errors
    /// The output could not be written.
    pub fn write(&mut self, recording: &str, index: &str, frame: &LaneFrame) -> io::Result<()> {
        let r = &frame.record;
        let quoted = recording.replace('"', "\"\"");
        writeln!(
            self.out,
            "\"{quoted}\",{index},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:016x}",
            r.frame,
            u8::from(!frame.catches_up),
            r.polygons,
            r.inserted,
            r.removed,
            r.updated,
            r.insert.ns,
            r.cull.ns,
            r.total_ns(),
            r.visible,
            r.polygons - r.visible.min(r.polygons),
            r.work.nodes,
            r.work.boxes,
            r.work.planes,
            r.work.taken_whole,
            r.allocations(),
            r.fingerprint
        )
    }

    /// Hands everything to the system.
    ///
    /// # Errors
    /// The output could not be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}
