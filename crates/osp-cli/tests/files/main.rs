//! Files: of other programs, damaged, forged, and made of noise.

mod fuzz;
mod importers;
mod pvs_file;
