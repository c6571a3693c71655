//! Strokes of brushes as a scene stores them, sample by sample.

use osp_session::{
    brush::{self, Brush},
    recording::{NormalRule, Tool},
    stroke::{Drops, Piece, Pieces, Sample, StrokeBuilder, StrokeSettings},
};

pub(super) fn named(name: &str) -> &'static Brush {
    brush::find(name).expect("a brush of the table")
}

pub(super) fn settings(brush: &'static Brush, width_m: f32) -> StrokeSettings {
    StrokeSettings {
        brush: Some(brush),
        tool: Tool::Ribbon,
        width_m,
        thinnest: brush.pressure_size_min,
        normal: NormalRule::Travel,
        seed: 7,
        scale: 1.0,
    }
}

pub(super) struct Stroke {
    builder: StrokeBuilder,
    out: Pieces,
    pub(super) pieces: Vec<Piece>,
    pub(super) drops: Drops,
    /// Largest number of polygons that one sample has changed.
    pub(super) most_replaced: usize,
    /// Number of polygons built and repainted in total.
    pub(super) work: usize,
}

impl Stroke {
    pub(super) fn new(settings: StrokeSettings) -> Self {
        Self {
            builder: StrokeBuilder::new(settings),
            out: Pieces::default(),
            pieces: Vec::new(),
            drops: Drops::default(),
            most_replaced: 0,
            work: 0,
        }
    }

    fn change(&mut self, with: impl FnOnce(&mut StrokeBuilder, &mut Pieces, &mut Drops)) {
        self.out.begin(self.pieces.len() as u32, 0);
        with(&mut self.builder, &mut self.out, &mut self.drops);
        let kept = self.out.kept() as usize;
        assert!(kept <= self.pieces.len(), "it keeps what there is");
        self.most_replaced = self.most_replaced.max(self.pieces.len() - kept);
        self.pieces.truncate(kept);
        self.pieces.extend(self.out.fresh());
        self.work += self.out.fresh().len();
        assert_eq!(self.pieces.len(), self.out.len() as usize);
    }

    pub(super) fn push(&mut self, sample: Sample) {
        self.change(|builder, out, drops| builder.push(sample, out, drops));
    }

    pub(super) fn repaint(&mut self) {
        let mut painted = Vec::new();
        self.builder.repaint(&mut painted);
        assert!(painted.is_sorted_by(|a, b| a.0 < b.0), "places ascend");
        self.work += painted.len();
        for (place, surface) in painted {
            self.pieces[place as usize].surface = surface;
        }
    }

    pub(super) fn finish(&mut self) {
        self.change(|builder, out, drops| builder.finish(out, drops));
        self.repaint();
    }

    /// Calls `each` after every frame with the samples so far.
    pub(super) fn in_frames(
        settings: StrokeSettings,
        samples: &[Sample],
        frame: usize,
        mut each: impl FnMut(&Self, &[Sample]),
    ) -> Self {
        let mut stroke = Self::new(settings);
        let mut count = 0;
        for of_frame in samples.chunks(frame) {
            of_frame.iter().for_each(|&sample| stroke.push(sample));
            stroke.change(|builder, out, drops| builder.settle(out, drops));
            stroke.repaint();
            count += of_frame.len();
            each(&stroke, &samples[..count]);
        }
        stroke.finish();
        stroke
    }
}
