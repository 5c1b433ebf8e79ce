//! Check of the processor for the features that the program was compiled for.
//!
//! The build names a processor (see `.cargo/config.toml`), and the compiler uses all of its features
//! everywhere; an older processor would stop with an illegal instruction at any moment.
//! `is_x86_feature_detected!` returns `true` without a test for features that the build assumes.
//! Therefore plain code reads CPUID directly.
//!
//! This holds for builds for a named processor, such as x86-64-v3, and was tested under an emulator of older
//! ones. An optimised build for `native` compiles the standard library again, including the code before `main`, and
//! that code may contain the illegal instruction.

/// Ends the program at the first listed feature that the build assumes and whose CPUID bit is 0.
#[cfg(target_arch = "x86_64")]
macro_rules! need {
    ($($name:literal $register:ident $bit:literal)*) => {
        $(if cfg!(target_feature = $name) && $register >> $bit & 1 == 0 {
            refuse($name);
        })*
    };
}

/// Ends the program with exit status 1 and a line on stderr if this processor lacks a feature that the
/// program was compiled for. `main` calls it first.
#[cfg(target_arch = "x86_64")]
#[inline(never)]
pub fn require() {
    use std::arch::x86_64::{__cpuid, __cpuid_count, CpuidResult};
    // Bits: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A, CPUID; AMD64
    // Architecture Programmer's Manual, volume 3, appendix E (those of leaf 8000_0001).
    let none = CpuidResult { eax: 0, ebx: 0, ecx: 0, edx: 0 };
    // Bit 27 (OSXSAVE): the operating system saves the extended registers. AVX needs it.
    let basic = __cpuid(1).ecx;
    let basic = if basic >> 27 & 1 == 1 { basic } else { basic & !(1 << 28) };
    let seven = if __cpuid(0).eax >= 7 { __cpuid_count(7, 0) } else { none };
    let (more, newer, newest) = (seven.ebx, seven.ecx, seven.edx);
    let last = if seven.eax >= 1 { __cpuid_count(7, 1).eax } else { 0 };
    let has_extended = __cpuid(0x8000_0000).eax >= 0x8000_0001;
    let extended = if has_extended { __cpuid(0x8000_0001).ecx } else { 0 };
    need! {
        "avx" basic 28 "avx2" more 5 "fma" basic 12
        "avx512f" more 16 "avx512dq" more 17 "avx512cd" more 28 "avx512bw" more 30 "avx512vl" more 31
        "avx512ifma" more 21 "avx512vbmi" newer 1 "avx512vbmi2" newer 6 "avx512vnni" newer 11
        "avx512bitalg" newer 12 "avx512vpopcntdq" newer 14 "avx512fp16" newest 23 "avx512bf16" last 5
        "avxvnni" last 4 "gfni" newer 8 "vaes" newer 9 "vpclmulqdq" newer 10
        "bmi1" more 3 "bmi2" more 8 "lzcnt" extended 5 "movbe" basic 22 "f16c" basic 29
        "sse3" basic 0 "pclmulqdq" basic 1 "ssse3" basic 9 "sse4.1" basic 19 "sse4.2" basic 20
        "popcnt" basic 23 "aes" basic 25 "rdrand" basic 30 "rdseed" more 18 "adx" more 19 "sha" more 29
        "sse4a" extended 6 "tbm" extended 21
    }
}

/// Other architectures are compiled for their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub fn require() {}

#[cfg(target_arch = "x86_64")]
#[cold]
#[inline(never)]
fn refuse(lacking: &str) -> ! {
    use std::io::Write;
    let mut err = std::io::stderr();
    // With a closed stderr the exit status is the only message.
    let _ = err.write_all(b"zerkalo was built for a processor with ");
    let _ = err.write_all(lacking.as_bytes());
    let _ = err.write_all(
        b", which this one lacks; \"cargo clean\" and \"cargo build --release\" build it for this one\n",
    );
    std::process::exit(1)
}
