//! Compares every kernel with the scalar one, bit for bit.
#![allow(clippy::print_stderr, reason = "a skipped test prints the reason")]

use std::mem::MaybeUninit;

use glam::Vec3;

use super::{Backend, Boxes, Kernel, PlaneSet, PreparedPlane, WithKernel};
use crate::math::{Aabb, Frustum, Plane};

/// The kernel in plain Rust.
#[derive(Clone, Copy)]
struct Scalar;

fn lanes<const N: usize>(
    plane: &PreparedPlane,
    rows: [usize; 3],
    boxes: &Boxes<N>,
    test: impl Fn(f32) -> bool,
) -> u32 {
    let [x, y, z] = rows.map(|row| &boxes.rows[row / 8]);
    let [nx, ny, nz] = plane.normal;
    (0..N).fold(0, |mask, i| mask | u32::from(test(((nx * x[i] + ny * y[i]) + nz * z[i]) + plane.d)) << i)
}

impl Kernel for Scalar {
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        lanes(plane, plane.far, boxes, |distance| distance < 0.0)
    }

    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        planes.iter().fold(0, |behind, plane| behind | self.behind(plane, boxes))
    }

    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>) -> (u32, u32) {
        let behind = lanes(plane, plane.far, boxes, |distance| distance < 0.0);
        (behind, lanes(plane, plane.near, boxes, |distance| distance >= 0.0))
    }
}

/// Results of a kernel for one case.
#[derive(Debug, PartialEq)]
struct KernelResults {
    behind: [u32; 6],
    behind_any: u32,
    not_negative: [u32; 2],
    half_planes: [u64; 2],
    selected: [u32; 16],
    sides: [(u32, u32); 6],
    sides_of_eight: [(u32, u32); 6],
    ids: Vec<u32>,
    sixteen: Vec<u32>,
    packed: Vec<u32>,
}

struct Case {
    planes: [PreparedPlane; 6],
    boxes: Boxes<16>,
    first: u32,
    mask: u32,
    numbers: [u32; 16],
}

/// The first `count` entries, which the kernel must have written.
fn written(count_and_entries: (usize, [MaybeUninit<u32>; 16])) -> Vec<u32> {
    let (count, entries) = count_and_entries;
    // `unwritten` has set every entry before the kernel wrote to it.
    entries[..count].iter().map(|entry| read(*entry)).collect()
}

#[expect(unsafe_code, reason = "the entry was set by `unwritten`")]
fn read(entry: MaybeUninit<u32>) -> u32 {
    // SAFETY: `unwritten` has set all entries.
    unsafe { entry.assume_init() }
}

fn unwritten() -> [MaybeUninit<u32>; 16] {
    [MaybeUninit::new(0xDEAD_BEEF); 16]
}

impl WithKernel for &Case {
    type Output = KernelResults;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> KernelResults {
        let mut eight = Boxes::<8>::EMPTY;
        for lane in 0..8 {
            eight.set(lane, &self.boxes.get(lane));
        }
        let write = |write: &mut dyn FnMut(&mut [MaybeUninit<u32>; 16]) -> usize| {
            let mut out = unwritten();
            (write(&mut out), out)
        };
        KernelResults {
            behind: std::array::from_fn(|i| kernel.behind(&self.planes[i], &self.boxes)),
            behind_any: kernel.behind_any(&self.planes, &self.boxes),
            not_negative: [
                kernel.not_negative(&self.boxes.rows[0]),
                kernel.not_negative(self.boxes.rows[1][4..].first_chunk::<8>().expect("twelve")),
            ],
            selected: {
                let [inside, outside] = [&self.boxes.rows[0], &self.boxes.rows[1]];
                kernel.select(self.mask, inside, outside).map(f32::to_bits)
            },
            half_planes: {
                let [at, across, up] =
                    [0, 1, 2].map(|row| *self.boxes.rows[row].first_chunk::<3>().expect("eight"));
                [kernel.half_planes(at, across, up), kernel.half_planes([at[0]], [across[0]], [up[0]])]
            },
            sides: std::array::from_fn(|i| kernel.sides(&self.planes[i], &self.boxes)),
            sides_of_eight: std::array::from_fn(|i| kernel.sides(&self.planes[i], &eight)),
            ids: written(write(&mut |out| kernel.write_ids(self.first, self.mask, out))),
            sixteen: written(write(&mut |out| {
                kernel.write_sixteen(self.first, out);
                16
            })),
            packed: written(write(&mut |out| kernel.pack(&self.numbers, self.mask, out))),
        }
    }
}

/// A step of Knuth's linear congruential generator.
fn next(state: &mut u64) -> u32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 32) as u32
}

fn number(state: &mut u64) -> f32 {
    match next(state) % 24 {
        0 => 0.0,
        1 => -0.0,
        2 => f32::INFINITY,
        3 => f32::NEG_INFINITY,
        4 => f32::NAN,
        5 => f32::MAX,
        6 => f32::MIN_POSITIVE / 8.0,
        7 => 1.0,
        8 => -1.0,
        _ => (next(state) as i32 as f32) * 1.0e-9,
    }
}

fn case(state: &mut u64) -> Case {
    let mut point = || Vec3::new(number(state), number(state), number(state));
    let planes: [Plane; 6] = std::array::from_fn(|_| Plane { normal: point(), d: point().x });
    let mut boxes = Boxes::<16>::EMPTY;
    for lane in 0..16 {
        let (a, b) = (point(), point());
        boxes.set(lane, &Aabb::new(a.min(b), a.max(b)));
    }
    let planes = PlaneSet::new(&Frustum::new(planes));
    let masks = [0, 0xFFFF, next(state) & 0xFFFF, next(state) & next(state) & 0xFFFF];
    Case {
        planes: std::array::from_fn(|i| planes.plane(i)),
        boxes,
        first: if next(state).is_multiple_of(8) { u32::MAX - 3 } else { next(state) },
        mask: masks[next(state) as usize % 4],
        numbers: std::array::from_fn(|_| next(state)),
    }
}

#[test]
fn every_kernel_returns_the_same() {
    let mut state = 7;
    let cases: Vec<Case> = (0..3000).map(|_| case(&mut state)).collect();
    for &backend in Backend::ALL {
        if !backend.is_available() {
            eprintln!("skipped: this processor has no {}", backend.name());
            continue;
        }
        for (i, case) in cases.iter().enumerate() {
            assert_eq!(backend.run(case), case.run(Scalar), "{}, case {i}", backend.name());
        }
    }
}

/// Compares the scalar kernel with the test of a frustum against one box.
#[test]
fn the_scalar_kernel_agrees_with_the_frustum() {
    let mut state = 8;
    for _ in 0..500 {
        let case = case(&mut state);
        let results = (&case).run(Scalar);
        for lane in 0..16 {
            let bounds = case.boxes.get(lane);
            for (i, plane) in case.planes.iter().enumerate() {
                let [x, y, z] = plane.normal;
                let plane = Plane { normal: Vec3::new(x, y, z), d: plane.d };
                let behind = plane.signed_distance(plane.positive_vertex(&bounds)) < 0.0;
                let inside = plane.signed_distance(plane.negative_vertex(&bounds)) >= 0.0;
                assert_eq!(results.behind[i] >> lane & 1 == 1, behind);
                let sides = results.sides[i];
                assert_eq!((sides.0 >> lane & 1 == 1, sides.1 >> lane & 1 == 1), (behind, inside));
            }
        }
        let ids = (0..16).filter(|lane| case.mask >> lane & 1 == 1).map(|lane| case.first.wrapping_add(lane));
        assert_eq!(results.ids, ids.collect::<Vec<_>>());
    }
}

/// The cells to the right of a line, and the cells that also lie above another line.
struct Cells;

impl WithKernel for Cells {
    type Output = [u64; 2];

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> [u64; 2] {
        let right = kernel.half_planes([-3.5], [1.0], [0.0]);
        [right, kernel.half_planes([-3.5, -6.0], [1.0, 0.0], [0.0, 1.0])]
    }
}

#[test]
fn half_planes_are_cut_out_of_the_cells_row_by_row() {
    for &backend in Backend::ALL.iter().filter(|backend| backend.is_available()) {
        assert_eq!(backend.run(Cells), [0xF0F0_F0F0_F0F0_F0F0, 0xF0F0_0000_0000_0000], "{}", backend.name());
    }
}

#[test]
fn a_name_selects_its_backend() {
    for &backend in Backend::ALL {
        assert_eq!(Backend::from_name(backend.name()), Some(backend));
    }
    assert_eq!(Backend::from_name("mmx"), None);
    assert!(Backend::detect().is_available());
}
