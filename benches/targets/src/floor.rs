//! The least time of a query in any structure. A query must read the boxes that a plane cuts, 24 bytes each, because
//! nothing else shows whether they are visible. It must write its result, four bytes a polygon or two a block of
//! sixteen. A plain pass over as many bytes measures this time. It takes turns with the rivals, so it begins with the
//! caches that they leave.

use std::{hint::black_box, time::Instant};

use osp::math::{Aabb, Containment, Frustum};

use crate::median;

/// The least time of a query, and the bytes: means over the views of the medians over the rounds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Least {
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
    /// `found` are the ids seen in each view, ascending.
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

    /// One round.
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

    pub fn least(&mut self) -> Least {
        let mut all = Least::default();
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

/// Reads boxes, several at once.
fn read(boxes: &[[f32; 6]]) {
    let mut bits = [0u32; 6];
    for chunk in boxes {
        for (bits, number) in bits.iter_mut().zip(chunk) {
            *bits ^= number.to_bits();
        }
    }
    black_box(bits);
}
