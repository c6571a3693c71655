//! The measuring of many sessions, on one machine or on many: the rows of its table, the files that keep them, and what is
//! said of them.
//!
//! A [`StudyRow`] is one session through one index. Each session that was measured is kept as a [`StudyPart`], a file of JSON
//! named by what was measured and how, so that nothing is measured twice. The table of all is a Parquet file
//! ([`StudyWriter`], [`StudyReader`]). [`Disagreements`] are sessions of which two machines, or two indexes, saw different
//! polygons; [`study_page`] is a page with a verdict, charts and a row a session.

mod check;
mod compared;
mod file;
mod page;
mod part;
mod row;

pub use check::{Disagreement, Disagreements};
pub use compared::{Compared, SessionOutcome};
pub use file::{StudyError, StudyReader, StudyWriter, is_study};
pub use page::study_page;
pub use part::{PartError, StudyPart, WorkFolder};
pub use row::StudyRow;
