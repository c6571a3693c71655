use glam::DVec3;

use super::artist::{Artist, Mirrored, RibbonStyle, Stance, Subject};
use super::path::{Course, in_space, on_plane};
use super::vector::turned;
use crate::recording::StrokeId;

/// Edge of a room, metres, from wall to wall.
const ROOM_M: f64 = 4.0;
const HEIGHT_M: f64 = 2.7;
const DOOR_WIDTH_M: f64 = 0.9;
const DOOR_HEIGHT_M: f64 = 2.05;

/// Number of polygons of a room. If a session would need more than [`MOST_ROOMS`] rooms, each room gets more polygons.
const POLYGONS_A_ROOM: u64 = 2000;

/// Largest number of rooms. Larger sessions fill the rooms more densely.
const MOST_ROOMS: usize = 36;

/// A flat of several rooms in rows. The artist walks through the rows in alternate directions. Each room has a door to
/// the next room of the walk.
#[derive(Debug)]
pub(super) struct Rooms {
    columns: usize,
    count: usize,
    /// The artist's current room, in the order of the walk.
    at: usize,
    built: usize,
    places: Vec<Place>,
    ornament: Ornament,
}

/// A flat rectangle of the room on which the artist can draw.
#[derive(Clone, Copy, Debug)]
struct Place {
    center: DVec3,
    normal: DVec3,
    /// Half extents along two directions, each horizontal or vertical.
    right: DVec3,
    up: DVec3,
}

#[derive(Debug)]
struct Ornament {
    place: Place,
    kind: OrnamentKind,
    color: (f64, f64, f64),
    strokes: Vec<StrokeId>,
    strokes_left: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OrnamentKind {
    /// Strokes on a surface: a picture, a rug, wood grain.
    Flat,
    /// Strokes that rise from a surface: a plant, grass, feathers.
    Plant,
    /// Long strokes that hang down: a curtain.
    Curtain,
}

impl Rooms {
    pub(super) fn new(artist: &mut Artist) -> Self {
        let count = (artist.wanted.div_ceil(POLYGONS_A_ROOM) as usize).clamp(4, MOST_ROOMS);
        let mut columns = 2;
        while columns * columns < count {
            columns += 1;
        }
        let nothing = Place { center: DVec3::ZERO, normal: DVec3::Y, right: DVec3::X, up: DVec3::Z };
        let ornament = Ornament {
            place: nothing,
            kind: OrnamentKind::Flat,
            color: (0.5, 0.5, 0.5),
            strokes: Vec::new(),
            strokes_left: 0,
        };
        let rooms = Self { columns, count, at: 0, built: 0, places: Vec::new(), ornament };
        artist.stand(rooms.center(0) + DVec3::Y * 1.65, DVec3::NEG_Z, 1.4);
        rooms
    }

    /// Edge of the root cube, metres: a power of two that contains the whole flat.
    pub(super) fn root_size_m(&self) -> f32 {
        let extent_m = self.columns as f64 * ROOM_M;
        let mut size_m = 4.0;
        while size_m < extent_m {
            size_m *= 2.0;
        }
        size_m as f32
    }

    fn cell(&self, room: usize) -> (usize, usize) {
        let (row, column) = (room / self.columns, room % self.columns);
        (if row.is_multiple_of(2) { column } else { self.columns - 1 - column }, row)
    }

    fn center(&self, room: usize) -> DVec3 {
        let (column, row) = self.cell(room);
        let half = self.columns as f64 * 0.5;
        DVec3::new((column as f64 + 0.5 - half) * ROOM_M, 0.0, (row as f64 + 0.5 - half) * ROOM_M)
    }

    /// The room behind a wall, if it is part of the plan.
    fn neighbour(&self, room: usize, outward: DVec3) -> Option<usize> {
        let behind = self.center(room) + outward * ROOM_M;
        (0..self.count).find(|&other| (self.center(other) - behind).length() < 0.1)
    }

    /// Walks through the door between two neighbouring rooms.
    fn go(&mut self, artist: &mut Artist, room: usize) {
        let eye = DVec3::Y * 1.65;
        let (from, to) = (self.center(self.at), self.center(room));
        let door = (from + to) * 0.5;
        let beyond = to + (to - door) * 0.5 + eye;
        for stop in [from * 0.3 + door * 0.7, door, to * 0.3 + door * 0.7] {
            artist.walk(Stance { eye: stop + eye, at: beyond });
        }
        self.at = room;
    }

    /// Walls, floor, ceiling and furniture of the room in which the artist is.
    fn build(&mut self, artist: &mut Artist) {
        self.places.clear();
        let room = self.at;
        let center = self.center(room);
        let eye = center + DVec3::Y * 1.65;
        let tint =
            (artist.rng.between(0.7, 0.95), artist.rng.between(0.7, 0.95), artist.rng.between(0.7, 0.95));
        let (x, z) = (DVec3::X * ROOM_M * 0.5, DVec3::Z * ROOM_M * 0.5);
        let floor = Place { center, normal: DVec3::Y, right: x, up: z };
        let ceiling = Place { center: center + DVec3::Y * HEIGHT_M, normal: DVec3::NEG_Y, right: x, up: -z };
        for (place, color) in [(floor, (0.45, 0.33, 0.22)), (ceiling, (0.9, 0.9, 0.88))] {
            let color = artist.rng.color_near(color, 0.05);
            artist.wall(place.corners(), color, Stance { eye, at: place.center });
        }
        self.places.push(Place { right: x * 0.6, up: z * 0.6, ..floor });
        for outward in [DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z] {
            let neighbour = self.neighbour(room, outward);
            if neighbour.is_some_and(|other| other < room) {
                continue; // The wall is there already.
            }
            let opening = match neighbour {
                Some(other) if other == room + 1 || artist.rng.chance(0.3) => Opening::Door,
                Some(_) => Opening::None,
                None => Opening::Window,
            };
            let color = artist.rng.color_near(tint, 0.04);
            self.side(artist, outward, opening, color);
        }
        for _ in 0..3 + artist.rng.index(3) {
            self.furniture(artist);
        }
    }

    /// One side of the room, as one, three or four walls around its opening.
    fn side(&mut self, artist: &mut Artist, outward: DVec3, opening: Opening, color: (f32, f32, f32, f32)) {
        let center = self.center(self.at);
        let foot = center + outward * (ROOM_M * 0.5);
        let right = outward.cross(DVec3::Y);
        let half = ROOM_M * 0.5;
        let piece = |left_m: f64, right_m: f64, low_m: f64, high_m: f64| Place {
            center: foot + right * ((left_m + right_m) * 0.5) + DVec3::Y * ((low_m + high_m) * 0.5),
            normal: -outward,
            right: right * ((right_m - left_m) * 0.5),
            up: DVec3::Y * ((high_m - low_m) * 0.5),
        };
        let (edge, top) = (DOOR_WIDTH_M * 0.5, DOOR_HEIGHT_M);
        let pieces = match opening {
            Opening::None => vec![piece(-half, half, 0.0, HEIGHT_M)],
            Opening::Door => vec![
                piece(-half, -edge, 0.0, HEIGHT_M),
                piece(edge, half, 0.0, HEIGHT_M),
                piece(-edge, edge, top, HEIGHT_M),
            ],
            Opening::Window => vec![
                piece(-half, -0.8, 0.0, HEIGHT_M),
                piece(0.8, half, 0.0, HEIGHT_M),
                piece(-0.8, 0.8, 0.0, 0.9),
                piece(-0.8, 0.8, 2.2, HEIGHT_M),
            ],
        };
        let eye = center + DVec3::Y * 1.65;
        for place in pieces {
            artist.wall(place.corners(), color, Stance { eye, at: place.center });
            artist.wait(0.4, Stance { eye, at: place.center });
            if place.right.length() > 0.5 && place.up.length() > 0.5 {
                let picture = place.center + DVec3::Y * (1.5 - place.center.y) - outward * 0.01;
                self.places.push(Place {
                    center: picture,
                    right: right * 0.45,
                    up: DVec3::Y * 0.35,
                    ..place
                });
            }
        }
    }

    /// A box of finished polygons: a table, a shelf, a seat.
    fn furniture(&mut self, artist: &mut Artist) {
        let rng = &mut artist.rng;
        let (width_m, depth_m, height_m) = rng.pick([
            (1.4, 0.7, 0.75),
            (0.9, 0.35, 1.9),
            (1.7, 0.8, 0.45),
            (0.5, 0.5, 0.5),
            (1.1, 0.5, 0.9),
        ]);
        let reach = ROOM_M * 0.5 - 0.55;
        let foot =
            self.center(self.at) + DVec3::new(rng.between(-reach, reach), 0.0, rng.between(-reach, reach));
        let angle = rng.normal() * 0.1 + if rng.chance(0.5) { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let x = turned(DVec3::X, DVec3::Y, angle) * (width_m * 0.5);
        let z = turned(DVec3::Z, DVec3::Y, angle) * (depth_m * 0.5);
        let y = DVec3::Y * height_m;
        let color = (rng.between(0.3, 0.8), rng.between(0.25, 0.6), rng.between(0.15, 0.5));
        let middle = foot + y * 0.5;
        let half = y * 0.5;
        let faces = [
            Place { center: foot + y, normal: DVec3::Y, right: x, up: -z },
            Place { center: middle + z, normal: z.normalize(), right: x, up: half },
            Place { center: middle - z, normal: -z.normalize(), right: -x, up: half },
            Place { center: middle + x, normal: x.normalize(), right: -z, up: half },
            Place { center: middle - x, normal: -x.normalize(), right: z, up: half },
        ];
        let stance = artist.standing(foot + y, (artist.eye() - foot).normalize_or(DVec3::Z));
        artist.walk(self.inside(stance));
        for face in faces {
            let color = artist.rng.color_near(color, 0.06);
            artist.polygon(&face.corners(), color);
        }
        self.places.extend_from_slice(&faces[..2]);
    }

    /// The stance with the head clamped to a distance from the walls.
    fn inside(&self, stance: Stance) -> Stance {
        let reach = ROOM_M * 0.5 - 0.3;
        let center = self.center(self.at);
        let off = stance.eye - center;
        let eye = center + DVec3::new(off.x.clamp(-reach, reach), off.y, off.z.clamp(-reach, reach));
        Stance { eye, ..stance }
    }

    fn next_ornament(&mut self, artist: &mut Artist) {
        let rng = &mut artist.rng;
        let place = self.places[rng.index(self.places.len())];
        let kind = if place.normal.y > 0.5 && place.center.y > 0.1 && rng.chance(0.6) {
            OrnamentKind::Plant
        } else if place.normal.y.abs() < 0.5 && place.up.y > 0.3 && rng.chance(0.25) {
            OrnamentKind::Curtain
        } else {
            OrnamentKind::Flat
        };
        self.ornament = Ornament {
            place,
            kind,
            color: (rng.unit(), rng.unit(), rng.unit()),
            strokes: Vec::new(),
            strokes_left: 5 + rng.index(12) as u32,
        };
    }

    /// Draws the ornament's next stroke.
    fn decorate(&mut self, artist: &mut Artist) {
        let Ornament { place, kind, color, .. } = self.ornament;
        let rng = &mut artist.rng;
        let spread = place.right * rng.between(-0.85, 0.85) + place.up * rng.between(-0.85, 0.85);
        let start = place.center + spread + place.normal * rng.between(0.003, 0.02);
        let color = rng.color_near(color, 0.15);
        let extent_m = place.right.length().min(place.up.length());
        let (nodes, width_m) = match kind {
            OrnamentKind::Flat => {
                let heading = turned(place.right, place.normal, rng.normal() * 0.8);
                let length_m = rng.log_normal(0.22, 0.5).clamp(0.05, extent_m.max(0.1) * 1.5);
                let mut course = Course::new(rng, start, heading, length_m);
                course.bend *= 3.0;
                (on_plane(rng, &course, place.normal), rng.between(0.008, 0.03))
            }
            OrnamentKind::Plant => {
                let start = place.center + spread * 0.2;
                let heading = place.normal + rng.direction() * 0.5;
                let length_m = rng.log_normal(0.30, 0.4).clamp(0.08, 0.8);
                let mut course = Course::new(rng, start, heading, length_m);
                course.bend *= 3.0;
                let facing = rng.direction();
                // Leaves hang down.
                let hang = |_| DVec3::NEG_Y * 0.8;
                (in_space(rng, &course, 1.0, facing, hang), rng.between(0.010, 0.035))
            }
            OrnamentKind::Curtain => {
                let top = DVec3::new(start.x, place.center.y + place.up.y, start.z);
                let length_m = (2.0 * place.up.y * rng.between(0.7, 1.0)).max(0.2);
                let mut course = Course::new(rng, top, DVec3::NEG_Y, length_m);
                course.bend *= 0.2;
                (on_plane(rng, &course, place.normal), rng.between(0.025, 0.040))
            }
        };
        let stance =
            artist.standing(nodes[0].p, place.normal * (1.0 - place.normal.y.abs()) + self.aside(nodes[0].p));
        let stance = self.inside(stance);
        let style = RibbonStyle { width_m, color, pace: 1.2, mirrored: Mirrored::No };
        let stroke = artist.ribbon(nodes, style, stance);
        self.ornament.strokes.push(stroke);
    }

    /// An offset of half a metre towards the middle of the room.
    fn aside(&self, p: DVec3) -> DVec3 {
        let inward = self.center(self.at) - p;
        DVec3::new(inward.x, 0.0, inward.z).normalize_or(DVec3::Z) * 0.5
    }

    /// Sometimes groups a finished ornament and shifts it.
    fn finish_ornament(&mut self, artist: &mut Artist) {
        if self.ornament.strokes.len() >= 4 && artist.rng.chance(0.25) {
            let rng = &mut artist.rng;
            let angle = if self.ornament.place.normal.y > 0.5 { rng.normal() * 0.2 } else { 0.0 };
            let by = self.ornament.place.right * rng.between(-0.1, 0.1);
            artist.group(&self.ornament.strokes, self.ornament.place.center, angle, by);
        }
        self.ornament.strokes.clear();
    }
}

impl Subject for Rooms {
    fn work(&mut self, artist: &mut Artist) {
        if self.built == 0 {
            self.built = 1;
            return self.build(artist);
        }
        if self.ornament.strokes_left == 0 {
            self.finish_ornament(artist);
            let due = (artist.progress() * self.count as f64) as usize;
            if due > self.at && self.at + 1 < self.count {
                self.go(artist, self.at + 1);
                self.built += 1;
                return self.build(artist);
            }
            self.next_ornament(artist);
        }
        self.ornament.strokes_left -= 1;
        self.decorate(artist);
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Opening {
    None,
    Door,
    Window,
}

impl Place {
    fn corners(&self) -> [DVec3; 4] {
        let Self { center, right, up, .. } = *self;
        [center - right - up, center + right - up, center + right + up, center - right + up]
    }
}
