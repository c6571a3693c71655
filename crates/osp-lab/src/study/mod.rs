//! The measuring of many sessions, on one machine or on many: the rows of its table, the files that keep them, and what is
//! said of them.
//!
//! A [`StudyRow`] is one session through one index. Each session that was measured is kept as a [`StudyPart`], a file of JSON
//! named by what was measured and how, so that nothing is measured twice. The table of all rows has lines of JSON, or Parquet with
//! the feature `parquet` ([`StudyWriter`], [`StudyReader`], [`TableFormat`]). [`Disagreements`] are sessions of which two machines,
//! or two indexes, saw different polygons; [`study_page`] is a page with a verdict, charts and a row a session.

mod check;
mod compared;
mod line_table;
mod page;
#[cfg(feature = "parquet")]
mod parquet_table;
mod part;
mod row;
mod table;

pub use check::{Disagreement, Disagreements};
pub use compared::{Compared, SessionOutcome};
pub use page::study_page;
pub use part::{PartError, StudyPart, WorkFolder};
pub use row::StudyRow;
pub use table::{StudyError, StudyReader, StudyWriter, TableFormat, is_study};
