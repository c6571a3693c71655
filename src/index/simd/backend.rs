#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "entering a function compiled for an instruction set that was found at run time"
    )
)]

use std::sync::OnceLock;

use super::{WithKernel, narrow::Narrow};
#[cfg(target_arch = "x86_64")]
use super::{x86_avx2::Avx2, x86_avx512::Avx512};

/// An instruction set that the box tests can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Plain Rust, for targets without any of the other instruction sets.
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
    /// processor has it. The call detects it once and stores it for the process.
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
            Self::Scalar => ![Self::Sse2, Self::Neon, Self::Simd128].into_iter().any(Self::is_available),
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
            #[allow(unreachable_patterns, reason = "the patterns of other targets")]
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

    /// Runs `work` on this backend's kernel. If the processor lacks its instructions, `work` runs on the kernel that
    /// every processor of the target supports. Each kernel costs a copy of `work`, so a target omits needless kernels.
    #[inline]
    pub fn run<W: WithKernel>(self, work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Avx512 => {
                if let Some(kernel) = Avx512::detect() {
                    // SAFETY: the token exists only where AVX-512 was found.
                    return unsafe { run_avx512(work, kernel) };
                }
            }
            Self::Avx2 => {
                if let Some(kernel) = Avx2::detect() {
                    // SAFETY: the token exists only where AVX2 was found.
                    return unsafe { run_avx2(work, kernel) };
                }
            }
            _ => {}
        }
        work.run(Narrow)
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
