//! The report of a replay as tables, CSV, JSON and (feature `bench`) charts.

#[cfg(feature = "bench")]
mod chart;
mod columns;
mod csv;
mod drawing;
mod figures;
#[cfg(feature = "bench")]
mod insertion_film;
mod json;
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
mod structure;
#[cfg(feature = "bench")]
mod structure_picture;
mod views;

#[cfg(feature = "bench")]
pub use chart::draw_frame_times;
pub use columns::columns_table;
pub use csv::{CsvWriter, OcclusionColumns};
pub use drawing::{DrawReport, DrawnWhileCulling};
#[cfg(feature = "bench")]
pub use insertion_film::{InsertionFilm, InsertionWork};
pub use numbers::{short, thousands};
#[cfg(feature = "bench")]
pub(crate) use palette::{LineStyle, css_variables};
#[cfg(feature = "bench")]
pub(crate) use picture::{Area, Backend, Drawn, Picture, pixels};
#[cfg(feature = "bench")]
pub use picture::{ChartFormat, Side};
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
pub use structure_picture::{CellColors, StructurePanel, StructurePicture, StructureView};
pub use views::{AgainstOneView, RigReport, RigViewReport, ViewMeans, ViewsReport};
