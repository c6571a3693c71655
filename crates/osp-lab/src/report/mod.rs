//! The report of a replay as tables, CSV, JSON and (feature `bench`) charts.

#[cfg(feature = "bench")]
mod chart;
#[cfg(feature = "bench")]
mod colors;
mod columns;
mod csv;
mod drawing;
mod figures;
#[cfg(feature = "bench")]
mod insertion_film;
mod json;
#[cfg(feature = "bench")]
mod legend;
mod line;
mod numbers;
#[cfg(feature = "bench")]
mod palette;
#[cfg(feature = "bench")]
mod picture;
mod pins;
mod printable;
#[cfg(feature = "bench")]
mod rig_plan;
mod run;
#[cfg(feature = "bench")]
mod shadow_dot;
#[cfg(feature = "bench")]
mod shadow_look;
#[cfg(feature = "bench")]
mod shadow_picture;
#[cfg(feature = "bench")]
mod shapes;
#[cfg(feature = "bench")]
mod structure;
#[cfg(feature = "bench")]
mod structure_picture;
#[cfg(feature = "bench")]
mod themes;
mod views;

#[cfg(feature = "bench")]
pub use chart::draw_frame_times;
#[cfg(feature = "bench")]
pub(crate) use chart::register_font;
pub use columns::columns_table;
pub use csv::{CsvWriter, OcclusionColumns};
pub use drawing::{DrawReport, DrawnWhileCulling};
#[cfg(feature = "bench")]
pub use insertion_film::{InsertionFilm, InsertionWork};
#[cfg(feature = "bench")]
pub(crate) use line::json_line;
pub use numbers::{short, thousands};
#[cfg(feature = "bench")]
pub(crate) use palette::LineStyle;
#[cfg(feature = "bench")]
pub use picture::{ChartError, ChartFormat};
pub use pins::{Pin, PinError, Pins, pinned_name};
pub use printable::{one_line, printable, push_html};
#[cfg(feature = "bench")]
pub use rig_plan::RigPlan;
#[cfg(feature = "bench")]
pub(crate) use run::first_disagreement;
pub use run::{OcclusionReport, ReplayReport, RunReport};
#[cfg(feature = "bench")]
pub use shadow_look::{ShadowCounts, ShadowLook, ShadowPanel};
#[cfg(feature = "bench")]
pub use shadow_picture::ShadowPicture;
#[cfg(feature = "bench")]
pub use structure::{NodeFields, SplitOutline, Structure, StructureNode};
#[cfg(feature = "bench")]
pub use structure_picture::{CellColors, Side, StructurePanel, StructurePicture, StructureView};
#[cfg(feature = "bench")]
pub(crate) use themes::css_variables;
pub use views::{AgainstOneView, RigReport, RigViewReport, ViewMeans, ViewsReport};
