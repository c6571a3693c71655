use glam::Vec2;

use super::{
    Drops, Pieces, QuadPieces, Sample, StrokeSettings,
    random::Random,
    refresh::Refresh,
    sections::{LANES, Rims, Section},
    track::Track,
};
use crate::brush::{Brush, Outline, Surface, Uv};

/// Smallest number of knots of the last segment. A shorter last segment is dropped.
const LEAST_KNOTS: usize = 6;

/// Builds a ribbon whose pieces share their edges. Its section is flat, tapered, thick or a box.
///
/// Source of its rules and constants: the flat, thick and square geometry brushes of Tilt Brush (Apache-2.0).
#[derive(Clone, Debug)]
pub struct WeldedBuilder {
    brush: &'static Brush,
    uv: Uv,
    section: Section,
    random: Random,
    track: Track,
    /// The piece at each node of the track.
    links: Vec<Link>,
    /// Length of the last segment when it was last rebuilt as a whole, metres.
    made_m: f32,
    /// Number of links that were dropped from the start of `links`.
    forgotten: usize,
    /// The start of the segment that was last painted, and the state of its painting.
    painted: (usize, Refresh),
    is_finished: bool,
}

/// The piece of ribbon that ends at a node, or no piece.
#[derive(Clone, Copy, Debug)]
struct Link {
    is_linked: bool,
    /// Seed of the segment's random numbers. It differs between segments, so it also identifies the segment.
    segment: u32,
    /// Index of the first link of its segment, counted from the start of the stroke.
    start: usize,
    /// Length of the segment up to the piece's start and up to its end, metres.
    along_m: [f32; 2],
    /// Texture coordinate by distance, at both ends.
    u: [f32; 2],
    alpha: [f32; 2],
    /// The sections at the piece's start and end.
    rims: [Rims; 2],
    pieces: [QuadPieces; LANES],
}

impl Link {
    fn place(&self) -> u32 {
        self.pieces[0].first()
    }
}

impl WeldedBuilder {
    pub fn new(settings: StrokeSettings, brush: &'static Brush, uv: Uv, shape: Outline) -> Self {
        let section = match shape {
            Outline::Plain => Section::Flat,
            Outline::DoubleTaper => Section::Tapered,
            Outline::Bolt => Section::Bolt,
        };
        Self::with_section(settings, brush, uv, section, brush.has_short_pressure_window)
    }

    /// A ribbon that is raised in the middle.
    pub fn thick(settings: StrokeSettings, brush: &'static Brush) -> Self {
        Self::with_section(settings, brush, Uv::Distance, Section::Diamond, true)
    }

    pub fn bar(settings: StrokeSettings, brush: &'static Brush) -> Self {
        Self::with_section(settings, brush, Uv::Distance, Section::Box, true)
    }

    fn with_section(
        settings: StrokeSettings,
        brush: &'static Brush,
        uv: Uv,
        section: Section,
        is_old: bool,
    ) -> Self {
        Self {
            brush,
            uv,
            section,
            random: Random::new(settings.seed),
            track: Track::new(&settings, brush, is_old, section.vertices()),
            links: Vec::new(),
            made_m: 0.0,
            forgotten: 0,
            painted: (0, Refresh::default()),
            is_finished: false,
        }
    }

    /// Processes a sample: replaces a provisional end, and changes at most two pieces before it. A segment whose shape
    /// depends on its length is rebuilt when the length has grown by an eighth: a few pieces per sample on average.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some(changed) = self.track.push(sample, drops) else { return };
        // A section also depends on the next node, or on its absence.
        let mut from = changed.saturating_sub(1);
        let mut place = self.links.get(from).map(Link::place);
        self.links.truncate(from);
        self.measure();
        if self.section.depends_on_length() {
            let total_m = self.length_m();
            let is_open = self.links.last().is_some_and(|link| link.is_linked);
            let is_far = total_m > 1.125 * self.made_m || total_m < 0.875 * self.made_m;
            if is_far || (!is_open && total_m != self.made_m) {
                self.made_m = total_m;
                let start = self.start_of(&self.links);
                if start < from {
                    (from, place) = (start, self.links.get(start).map(Link::place));
                }
            }
        }
        if let Some(place) = place {
            out.truncate(place);
        }
        self.make(from, out, drops);
    }

    pub fn finish(&mut self, out: &mut Pieces, drops: &mut Drops) {
        let nodes = &self.track.nodes;
        let has_end = nodes.len() > self.track.kept && nodes.last().is_some_and(|node| node.is_linked);
        if let Some(last_break) = nodes.iter().rposition(|node| !node.is_linked)
            && has_end
            && !self.track.is_old
            && nodes[last_break].vertices > 0
            && nodes.len() - last_break < LEAST_KNOTS
        {
            if let Some(link) = self.links.get(last_break + 1) {
                out.truncate(link.place());
            }
            self.track.truncate(last_break + 1);
            self.links.truncate(last_break + 1);
        }
        self.is_finished = true;
        let start = self.start_of(&self.links);
        if self.section.depends_on_length()
            && let Some(link) = self.links.get(start)
        {
            self.made_m = self.length_m();
            out.truncate(link.place());
            self.make(start, out, drops);
        }
    }

    /// Repaints the pieces whose surface may have changed since the last call. Pieces that can no longer change are
    /// dropped.
    pub fn repaint(&mut self, out: &mut Vec<(u32, Surface)>) {
        let mut settled = self.track.kept.saturating_sub(2);
        if self.uv == Uv::Stretched {
            let start = self.start_of(&self.links);
            // After the end of the stroke this is the last call.
            let closed = if self.is_finished { self.links.len() } else { start };
            for segment in self.links[..closed].chunk_by(|a, b| a.segment == b.segment) {
                self.stretch(segment, segment.len(), out);
            }
            let open = &self.links[closed..];
            let open = &open[..open.iter().rposition(|link| link.is_linked).map_or(0, |last| last + 1)];
            if let Some(last) = open.last() {
                let mut painted = std::mem::take(&mut self.painted);
                if painted.0 != last.start {
                    painted = (last.start, Refresh::default());
                }
                self.stretch(open, painted.1.parts(open.len(), last.along_m[1]), out);
                self.painted = painted;
            }
            // The next sample can take back a segment that begins at a provisional end.
            let certain = self.start_of(&self.links[..settled.min(self.links.len())]);
            settled = settled.min(start.min(certain).saturating_sub(1));
        }
        let forgotten = self.track.forget(settled);
        self.links.drain(..forgotten);
        self.forgotten += forgotten;
    }

    /// Repaints the last `count` links of a segment.
    fn stretch(&self, segment: &[Link], count: usize, out: &mut Vec<(u32, Surface)>) {
        let total_m = segment.last().map_or(0.0, |link| link.along_m[1]);
        for link in &segment[segment.len() - count.min(segment.len())..] {
            for (lane, pieces) in link.pieces.iter().enumerate().take(self.section.lanes()) {
                out.extend(pieces.painted(self.surface(link, lane, total_m)));
            }
        }
    }

    /// Index of the first piece of the last segment of these first links.
    fn start_of(&self, links: &[Link]) -> usize {
        let last = links.iter().rfind(|link| link.is_linked);
        last.map_or(links.len(), |link| link.start.saturating_sub(self.forgotten))
    }

    fn length_m(&self) -> f32 {
        self.links.iter().rev().find(|link| link.is_linked).map_or(0.0, |link| link.along_m[1])
    }

    /// Computes the links of new nodes.
    fn measure(&mut self) {
        for i in self.links.len()..self.track.nodes.len() {
            let node = &self.track.nodes[i];
            let mut link = Link {
                is_linked: node.is_linked,
                segment: u32::MAX - 1,
                start: self.forgotten + i,
                along_m: [0.0; 2],
                u: [0.0; 2],
                alpha: [node.opacity; 2],
                rims: [Rims::default(); 2],
                pieces: [QuadPieces::default(); LANES],
            };
            if node.is_linked && i > 0 {
                let (before, behind) = (&self.track.nodes[i - 1], &self.links[i - 1]);
                let is_start = !behind.is_linked;
                // The original application counts from the vertex before the segment's first vertex.
                link.segment = if is_start { before.vertices.wrapping_sub(1) } else { behind.segment };
                link.start = if is_start { link.start } else { behind.start };
                let before_m = if is_start { 0.0 } else { behind.along_m[1] };
                link.along_m = [before_m, before_m + node.length_m];
                let u = if is_start { self.random.unit(link.segment) } else { behind.u[1] };
                let u = u - u.floor();
                let tiles = self.brush.tile_rate * (node.length_m / node.size_m.max(f32::MIN_POSITIVE));
                link.u = [u, u + if tiles < 1.0e6 { tiles } else { 0.0 }];
                link.alpha[0] = before.opacity;
            }
            if self.section == Section::Box {
                link.alpha = [1.0; 2];
            }
            self.links.push(link);
        }
    }

    /// Rebuilds all pieces from index `from` on.
    fn make(&mut self, from: usize, out: &mut Pieces, drops: &mut Drops) {
        // Drops of rebuilt and provisional pieces are not counted here.
        let mut uncounted = Drops::default();
        let mut segment = from..from;
        for i in from..self.links.len() {
            if !segment.contains(&i) {
                let of_segment = |link: &&Link| link.segment == self.links[i].segment;
                segment = i..i + self.links[i..].iter().take_while(of_segment).count();
            }
            let is_new = i + 1 == self.links.len() && i < self.track.kept;
            let total_m = self.links[segment.end - 1].along_m[1];
            self.make_piece(i, total_m, out, if is_new { drops } else { &mut uncounted });
        }
    }

    /// Builds the piece that ends at node `i`, in a segment of length `total_m`.
    fn make_piece(&mut self, i: usize, total_m: f32, out: &mut Pieces, drops: &mut Drops) {
        let mut link = self.links[i];
        link.pieces = [out.no_quad(); LANES];
        if link.is_linked && i > 0 {
            let behind = &self.links[i - 1];
            let start = if behind.is_linked { behind.rims[1] } else { self.section.at_start(&self.track, i) };
            let envelope = self.section.envelope(part(link.along_m[1], total_m));
            link.rims = [start, self.section.at(&self.track, i, envelope)];
            let [back, front] = &link.rims;
            for lane in 0..self.section.lanes() {
                let ([left, right], [front_left, front_right]) = (back[lane].ends, front[lane].ends);
                let surface = self.surface(&link, lane, total_m);
                let corners = [left, right, front_right, front_left];
                link.pieces[lane] = out.push_quad(corners, surface, drops);
            }
            if self.section == Section::Box {
                let is_end = self.links.get(i + 1).is_none_or(|next| !next.is_linked);
                let caps = [(back, [3, 2, 1, 0], !behind.is_linked), (front, [0, 1, 2, 3], is_end)];
                for (rims, lanes, _) in caps.into_iter().filter(|(.., is_closed)| *is_closed) {
                    let surface = Surface::flat([Vec2::splat(0.5); 4], [1.0; 4]);
                    out.push_quad(lanes.map(|lane: usize| rims[lane].ends[0]), surface, drops);
                }
            }
        }
        self.links[i] = link;
    }

    /// Surface of a piece along one lane, in a segment of length `total_m`.
    fn surface(&self, link: &Link, lane: usize, total_m: f32) -> Surface {
        let random = self.random.unit(link.segment);
        let rows = u32::from(self.brush.atlas_rows.max(1));
        let row = ((random * 3331.0) as u32 % rows) as f32;
        let [v0, v1] = self.section.across(lane).map(|v| (row + v) / rows as f32);
        let [u0, u1] = match self.uv {
            Uv::Stretched => link.along_m.map(|along_m| part(along_m, total_m)),
            Uv::Distance => link.u,
            Uv::EachQuad => [0.0, 1.0],
        };
        let ([a0, a1], [back, front]) = (link.alpha, &link.rims);
        let ([n0, n1], [n3, n2]) = (back[lane].normals, front[lane].normals);
        let uv = [(u0, v0), (u0, v1), (u1, v1), (u1, v0)].map(Vec2::from);
        Surface::smooth([n0, n1, n2, n3], uv, [a0, a0, a1, a1])
    }
}

fn part(along_m: f32, total_m: f32) -> f32 {
    if total_m > 0.0 { along_m / total_m } else { 0.0 }
}
