//! The report on a replay as tables, CSV, JSON and charts.

mod chart;
mod columns;
mod csv;
mod drawing;
mod palette;
mod picture;
mod pins;
mod printable;
mod rig_plan;
mod run;
mod structure;
mod structure_picture;
mod table;
mod themes;
mod verdict;
mod views;

pub(crate) use chart::register_font;
pub use chart::{ChartError, ChartFormat, draw_frame_times};
pub use columns::columns_table;
pub use csv::{CsvWriter, OcclusionColumns};
pub use drawing::{DrawReport, DrawnWhileCulling};
pub(crate) use palette::{GREEN, INK, LineStyle, ORANGE, PURPLE, SKY, VERMILION};
pub use pins::{Pin, PinError, Pins, pinned_name};
pub use printable::{one_line, printable, push_html};
pub use rig_plan::RigPlan;
pub use run::{OcclusionReport, ReplayReport, RunReport};
pub use structure::{Structure, StructureNode};
pub use structure_picture::{
    CellColors, Side, SplitOutline, StructurePanel, StructurePicture, StructureView,
};
pub use table::{replay_table, short, thousands};
pub(crate) use themes::{FAINT_MESH, MESH, css_variables, themed};
pub use verdict::verdict;
pub use views::{AgainstOneView, RigReport, RigViewReport, ViewMeans, ViewsReport};
