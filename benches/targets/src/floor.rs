//! A lower bound for the time of a query in any structure. Every query must read the boxes that a plane cuts, 24 bytes
//! each, because no other data tells whether they are visible. It must write its result: four bytes for each polygon,
//! or two bytes for each block of sixteen. A plain loop over this number of bytes measures the bound. The loop
//! alternates with the queries of the rivals, so its caches are as cold as theirs.

use std::{hint::black_box, time::Instant};

use osp::math::{Aabb, Containment, Frustum};

use crate::median;

/// The lower bound of a query's time, and its bytes. For each view, the time is the median of the rounds; the fields
/// contain the mean of all views.
#[derive(Clone, Copy, Debug, Default)]
pub struct LowerBound {
    pub ids_us: f64,
    pub ids_kb: f64,
    pub blocks_us: f64,
    pub blocks_kb: f64,
}

/// Counts and times of a view.
struct View {
    /// Number of visible boxes that a plane cuts.
    cut: usize,
    seen: usize,
    /// Number of blocks of sixteen with visible polygons.
    blocks: usize,
    ids_us: Vec<f64>,
    blocks_us: Vec<f64>,
}

pub struct Floor {
    boxes: Vec<[f32; 6]>,
    ids: Vec<u32>,
    masks: Vec<u16>,
    views: Vec<View>,
}

impl Floor {
    /// `found` contains the ids in each view, ascending.
    pub fn new(boxes: &[Aabb], views: &[Frustum], found: &[Vec<u32>]) -> Self {
        let views = views.iter().zip(found).map(|(frustum, ids)| {
            let is_cut = |id: &&u32| frustum.classify(&boxes[**id as usize]) == Containment::Intersects;
            let mut blocks: Vec<u32> = ids.iter().map(|id| id / 16).collect();
            blocks.dedup();
            View {
                cut: ids.iter().filter(is_cut).count(),
                seen: ids.len(),
                blocks: blocks.len(),
                ids_us: Vec::new(),
                blocks_us: Vec::new(),
            }
        });
        Self {
            boxes: boxes.iter().map(|b| [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z]).collect(),
            ids: vec![0; boxes.len()],
            masks: vec![0; boxes.len().div_ceil(16)],
            views: views.collect(),
        }
    }

    /// Measures one round of all views.
    pub fn measure(&mut self) {
        for view in &mut self.views {
            let start = Instant::now();
            read(&self.boxes[..view.cut]);
            let ids = &mut self.ids[..view.seen];
            ids.iter_mut().zip(0..).for_each(|(id, number)| *id = number);
            black_box(ids);
            view.ids_us.push(start.elapsed().as_secs_f64() * 1.0e6);
        }
        for view in &mut self.views {
            let start = Instant::now();
            read(&self.boxes[..view.cut]);
            let masks = &mut self.masks[..view.blocks];
            masks.iter_mut().zip(0..).for_each(|(mask, number)| *mask = number);
            black_box(masks);
            view.blocks_us.push(start.elapsed().as_secs_f64() * 1.0e6);
        }
    }

    pub fn lower_bound(&mut self) -> LowerBound {
        let mut all = LowerBound::default();
        let share = 1.0 / self.views.len() as f64;
        for view in &mut self.views {
            all.ids_us += median(&mut view.ids_us) * share;
            all.blocks_us += median(&mut view.blocks_us) * share;
            all.ids_kb += (24 * view.cut + 4 * view.seen) as f64 / 1000.0 * share;
            all.blocks_kb += (24 * view.cut + 2 * view.blocks) as f64 / 1000.0 * share;
        }
        all
    }
}

/// Reads all boxes; the compiler uses SIMD.
fn read(boxes: &[[f32; 6]]) {
    let mut bits = [0u32; 6];
    for chunk in boxes {
        for (bits, number) in bits.iter_mut().zip(chunk) {
            *bits ^= number.to_bits();
        }
    }
    black_box(bits);
}
