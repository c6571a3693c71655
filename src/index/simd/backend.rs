#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "entering a function compiled for an instruction set that was found at run time"
    )
)]

use std::sync::OnceLock;

#[cfg(target_arch = "aarch64")]
use super::aarch64_neon::Neon;
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
use super::scalar::Scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::wasm_simd128::Simd128;
#[cfg(target_arch = "x86_64")]
use super::{x86_avx2::Avx2, x86_avx512::Avx512, x86_sse2::Sse2};

use super::WithKernel;

/// An instruction set that the box tests can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Plain Rust; the compiler vectorises it for the target.
    Scalar,
    /// x86-64 with SSE2: four boxes an instruction. Every x86-64 processor has SSE2.
    Sse2,
    /// ARM with NEON: four boxes an instruction. Every 64-bit ARM processor has NEON.
    Neon,
    /// WebAssembly built with `simd128`: four boxes an instruction.
    Simd128,
    /// x86-64 with AVX2: eight boxes an instruction.
    Avx2,
    /// x86-64 with AVX-512: sixteen boxes an instruction.
    Avx512,
}

/// Environment variable that names the backend to use instead of the best one.
const OVERRIDE: &str = "OSP_SIMD";

impl Backend {
    /// All backends, the best last.
    pub const ALL: &'static [Self] =
        &[Self::Scalar, Self::Sse2, Self::Neon, Self::Simd128, Self::Avx2, Self::Avx512];

    /// The best backend of this processor, or the backend that the environment variable `OSP_SIMD` names if the
    /// processor has it. It is detected once a process.
    pub fn detect() -> Self {
        static CHOSEN: OnceLock<Backend> = OnceLock::new();
        *CHOSEN.get_or_init(|| {
            let named = std::env::var(OVERRIDE).ok().and_then(|name| Self::from_name(&name));
            named.filter(|backend| backend.is_available()).unwrap_or_else(Self::best)
        })
    }

    /// The best backend that this processor has.
    fn best() -> Self {
        Self::ALL.iter().rev().copied().find(|backend| backend.is_available()).unwrap_or(Self::Scalar)
    }

    /// Whether this processor has the instructions.
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

    /// The name of the backend, as in `OSP_SIMD`.
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

    /// Runs `work` on this backend's kernel, or on the scalar kernel if the processor lacks the instructions.
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
            // A module built with `simd128` runs only on engines that have these instructions. Without a second copy of
            // all code the module is three quarters as large.
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
