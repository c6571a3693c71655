#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "entering a function compiled for an instruction set that was found at run time"
    )
)]

use std::{mem::MaybeUninit, sync::OnceLock};

#[cfg(target_arch = "aarch64")]
use super::aarch64_neon::Neon;
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
use super::scalar::Scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::wasm_simd128::Simd128;
#[cfg(target_arch = "x86_64")]
use super::{x86_avx2::Avx2, x86_avx512::Avx512, x86_sse2::Sse2};

use super::{Boxes, EyeBoxes, PreparedPlane};

/// Wide box tests. Every method gives the same answer on every kernel, bit for bit.
pub trait Kernel: Copy {
    /// The lanes whose box lies wholly behind the plane. Lanes without a box answer anything.
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32;

    /// The lanes behind one of six planes.
    fn behind_any(self, planes: &[PreparedPlane; 6], boxes: &Boxes<16>) -> u32;

    /// Of the eight lanes from `at` (at most `N - 8`) those wholly behind the plane, and those wholly on its inner
    /// side.
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> (u32, u32);

    /// Writes `first + lane` (modulo 2^32) for every lane of `mask`, ascending, to the front of `out` (what follows is clobbered);
    /// returns how many.
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize;

    /// Writes the sixteen ids from `first` on.
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]);

    /// Copies sixteen numbers.
    fn copy(self, numbers: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]);

    /// Writes the numbers of `mask`'s lanes to the front of `out` (what follows is clobbered); returns how many.
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize;

    /// The lanes of 8 or 16 whose number is 0 or more; not those of NaN.
    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        numbers.iter().enumerate().fold(0, |lanes, (i, &number)| lanes | u32::from(number >= 0.0) << i)
    }

    /// The lanes that lie wholly beyond a plane by their slack, and those wholly before it by theirs. The plane has a unit
    /// normal and this distance from the eye.
    #[inline(always)]
    fn beyond_and_before(self, normal: [f64; 3], distance: f64, boxes: &EyeBoxes) -> (u32, u32) {
        let [x, y, z] = normal;
        let (mut beyond, mut before) = (0, 0);
        for lane in 0..16 {
            let ([cx, cy, cz], [hx, hy, hz]) = (&boxes.center, &boxes.half);
            let middle = x * cx[lane] + y * cy[lane] + z * cz[lane];
            let reach = x.abs() * hx[lane] + y.abs() * hy[lane] + z.abs() * hz[lane];
            let slack = boxes.slack[lane];
            beyond |= u32::from((middle - reach) - distance >= slack) << lane;
            before |= u32::from((middle + reach) - distance <= -slack) << lane;
        }
        (beyond, before)
    }
}

/// Code that runs on whichever kernel there is. `run` should be `#[inline(always)]`, so that it is compiled anew for
/// each instruction set.
pub trait WithKernel {
    /// What it returns.
    type Output;

    /// Runs it.
    fn run<K: Kernel>(self, kernel: K) -> Self::Output;
}

/// An instruction set that the box tests can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Plain Rust, as the compiler vectorises it for the target.
    Scalar,
    /// x86-64 with SSE2, which all have: four boxes an instruction.
    Sse2,
    /// ARM with NEON, which all of 64 bits have: four boxes an instruction.
    Neon,
    /// WebAssembly built with `simd128`: four boxes an instruction.
    Simd128,
    /// x86-64 with AVX2: eight boxes an instruction.
    Avx2,
    /// x86-64 with AVX-512: sixteen boxes an instruction.
    Avx512,
}

/// Names a backend that is taken instead of the best one.
const OVERRIDE: &str = "OSP_SIMD";

impl Backend {
    /// All of them, the best last.
    pub const ALL: &'static [Self] =
        &[Self::Scalar, Self::Sse2, Self::Neon, Self::Simd128, Self::Avx2, Self::Avx512];

    /// The best one that this processor has, or the one that the environment variable `OSP_SIMD` names if the
    /// processor has it (asked once).
    pub fn detect() -> Self {
        static CHOSEN: OnceLock<Backend> = OnceLock::new();
        *CHOSEN.get_or_init(|| {
            let named = std::env::var(OVERRIDE).ok().and_then(|name| Self::from_name(&name));
            named.filter(|backend| backend.is_available()).unwrap_or_else(Self::best)
        })
    }

    /// The best one that this processor has.
    fn best() -> Self {
        Self::ALL.iter().rev().copied().find(|backend| backend.is_available()).unwrap_or(Self::Scalar)
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => !cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => Avx2::detect().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => Avx512::detect().is_some(),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => true,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => true,
            #[allow(unreachable_patterns, reason = "those of the other targets")]
            _ => false,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Neon => "neon",
            Self::Simd128 => "simd128",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// The backend with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|backend| backend.name() == name)
    }

    /// Runs `work` on this kernel; on the plain one if the processor does not have it.
    #[inline]
    pub fn run<W: WithKernel>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => match Avx512::detect() {
                // SAFETY: the token exists only where AVX-512 was found.
                Some(kernel) => unsafe { run_avx512(work, kernel) },
                None => work.run(Scalar),
            },
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => match Avx2::detect() {
                // SAFETY: the token exists only where AVX2 was found.
                Some(kernel) => unsafe { run_avx2(work, kernel) },
                None => work.run(Scalar),
            },
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => work.run(Sse2::new()),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => work.run(Neon::new()),
            // The module runs where these instructions are, or nowhere: without a second copy of all code it is three quarters as large.
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            _ => work.run(Simd128::new()),
            #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
            _ => work.run(Scalar),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx512<W: WithKernel>(work: W, kernel: Avx512) -> W::Output {
    work.run(kernel)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx2<W: WithKernel>(work: W, kernel: Avx2) -> W::Output {
    work.run(kernel)
}
