use std::io::{self, Write};

use super::{RigReport, RunReport};
use osp_session::replay::LaneFrame;

#[derive(Debug)]
pub struct CsvWriter<W> {
    out: W,
    occlusion: OcclusionColumns,
    /// Number of screens and eyes of the rig that have columns.
    views: usize,
}

/// Whether the CSV has columns for occlusion culling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OcclusionColumns {
    /// No columns for occlusion culling.
    Without,
    /// Columns for occlusion culling at the end.
    With,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the line of column names. With a rig each screen and eye has columns.
    pub fn new(mut out: W, occlusion: OcclusionColumns, rig: Option<&RigReport>) -> io::Result<Self> {
        write!(
            out,
            "recording,index,frame,measured,polygons,inserted,removed,updated,insert_ns,cull_ns,total_ns,visible,culled,nodes,\
             boxes,planes,taken_whole,allocations,fingerprint"
        )?;
        let more = match occlusion {
            OcclusionColumns::Without => "",
            OcclusionColumns::With => {
                ",occlusion,used,occluded,occlusion_us,select_us,build_us,query_us,occluders,tests,drawn_fingerprint"
            }
        };
        write!(out, "{more}")?;
        if let Some(rig) = rig {
            write!(out, ",views,one_view_ns")?;
            for view in &rig.views {
                let name = view.name().replace('"', "\"\"");
                write!(out, ",\"{name}: in view\",\"{name}: drawn\"")?;
            }
        }
        writeln!(out)?;
        Ok(Self { out, occlusion, views: rig.map_or(0, |rig| rig.views.len()) })
    }

    /// Writes a frame. `measured` is 0 if the index had skipped frames before, because the times are then not those of
    /// a single frame.
    pub fn write(&mut self, recording: &str, run: &RunReport, frame: &LaneFrame) -> io::Result<()> {
        let r = &frame.record;
        let index = &run.index;
        let quoted = recording.replace('"', "\"\"");
        write!(
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
            r.culled(),
            r.work.nodes,
            r.work.boxes,
            r.work.planes,
            r.work.taken_whole,
            r.allocations(),
            frame.in_view
        )?;
        if self.occlusion == OcclusionColumns::With {
            let o = &r.occlusion;
            let us = |ns: u64| ns as f64 / 1000.0;
            write!(
                self.out,
                ",{},{},{},{},{},{},{},{},{},{:016x}",
                run.occlusion.as_ref().map_or("none", |occlusion| occlusion.method),
                u8::from(o.used),
                o.occluded,
                us(o.total_ns()),
                us(o.select.ns),
                us(o.build.ns),
                us(o.query.ns),
                o.occluders,
                o.tests,
                frame.drawn
            )?;
        }
        if let (1.., Some(views)) = (self.views, &run.views) {
            let number = |count: Option<u64>| count.map_or_else(String::new, |count| count.to_string());
            write!(self.out, ",{},{}", r.views, number(views.one_view_ns))?;
            for counts in views.last() {
                let [in_view, drawn] =
                    [counts.map(|of| of.0), counts.map(|of| of.1)].map(|count| number(count.map(u64::from)));
                write!(self.out, ",{in_view},{drawn}")?;
            }
        }
        writeln!(self.out)
    }

    /// Flushes and returns the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
