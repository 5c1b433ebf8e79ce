//! Test of the processor for the features that the compiled program uses.
//!
//! The build names a processor (see `.cargo/config.toml`), and the compiler may use all of its
//! features anywhere. On an older processor the program would stop with an illegal instruction at
//! any moment. `is_x86_feature_detected!` returns `true`, without a test, for features that the
//! build assumes. This module therefore reads CPUID directly.
//!
//! The test works in builds for a named processor, such as x86-64-v3, and was tested under an
//! emulator of older processors. The test may fail in an optimised build for `native`, the
//! processor of the building machine. Such a build also compiles the standard library for this
//! processor, including code that runs before `main`. This code may already contain an illegal
//! instruction.

/// Ends the program if the processor lacks a feature of the build. Each group of arguments is a
/// feature with its CPUID register and bit.
#[cfg(target_arch = "x86_64")]
macro_rules! need {
    ($($name:literal $register:ident $bit:literal)*) => {
        $(if cfg!(target_feature = $name) && $register >> $bit & 1 == 0 {
            refuse($name);
        })*
    };
}

/// Ends the program with a message if the processor lacks a feature of the build. `main` calls this
/// first.
#[cfg(target_arch = "x86_64")]
#[inline(never)]
pub fn require() {
    use std::arch::x86_64::{__cpuid, __cpuid_count, CpuidResult};
    // Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A, CPUID; for leaf
    // 8000_0001, AMD64 Architecture Programmer's Manual, volume 3, appendix E.
    let none = CpuidResult { eax: 0, ebx: 0, ecx: 0, edx: 0 };
    // AVX (bit 28) requires that the system saves the extended registers (bit 27, OSXSAVE).
    let leaf1_ecx = __cpuid(1).ecx;
    let leaf1_ecx = if leaf1_ecx >> 27 & 1 == 1 { leaf1_ecx } else { leaf1_ecx & !(1 << 28) };
    let leaf7 = if __cpuid(0).eax >= 7 { __cpuid_count(7, 0) } else { none };
    let (leaf7_ebx, leaf7_ecx, leaf7_edx) = (leaf7.ebx, leaf7.ecx, leaf7.edx);
    let leaf7_1_eax = if leaf7.eax >= 1 { __cpuid_count(7, 1).eax } else { 0 };
    let has_extended = __cpuid(0x8000_0000).eax >= 0x8000_0001;
    let extended_ecx = if has_extended { __cpuid(0x8000_0001).ecx } else { 0 };
    need! {
        "avx" leaf1_ecx 28 "avx2" leaf7_ebx 5 "fma" leaf1_ecx 12 "avx512f" leaf7_ebx 16
        "avx512dq" leaf7_ebx 17 "avx512cd" leaf7_ebx 28 "avx512bw" leaf7_ebx 30
        "avx512vl" leaf7_ebx 31 "avx512ifma" leaf7_ebx 21 "avx512vbmi" leaf7_ecx 1
        "avx512vbmi2" leaf7_ecx 6 "avx512vnni" leaf7_ecx 11 "avx512bitalg" leaf7_ecx 12
        "avx512vpopcntdq" leaf7_ecx 14 "avx512fp16" leaf7_edx 23 "avx512bf16" leaf7_1_eax 5
        "avxvnni" leaf7_1_eax 4 "gfni" leaf7_ecx 8 "vaes" leaf7_ecx 9 "vpclmulqdq" leaf7_ecx 10
        "bmi1" leaf7_ebx 3 "bmi2" leaf7_ebx 8 "lzcnt" extended_ecx 5 "movbe" leaf1_ecx 22
        "f16c" leaf1_ecx 29 "sse3" leaf1_ecx 0 "pclmulqdq" leaf1_ecx 1 "ssse3" leaf1_ecx 9
        "sse4.1" leaf1_ecx 19 "sse4.2" leaf1_ecx 20 "popcnt" leaf1_ecx 23 "aes" leaf1_ecx 25
        "rdrand" leaf1_ecx 30 "rdseed" leaf7_ebx 18 "adx" leaf7_ebx 19 "sha" leaf7_ebx 29
        "sse4a" extended_ecx 6 "tbm" extended_ecx 21
    }
}

/// Does nothing: other processors need no optional features.
#[cfg(not(target_arch = "x86_64"))]
pub fn require() {}

#[cfg(target_arch = "x86_64")]
#[cold]
#[inline(never)]
fn refuse(lacking: &str) -> ! {
    use std::io::Write;
    let mut err = std::io::stderr();
    // If stderr is closed, the exit status is the only message.
    let _ = err.write_all(b"zerkalo was built for a processor with ");
    let _ = err.write_all(lacking.as_bytes());
    let _ = err.write_all(
        b", which this one lacks; \"cargo clean\" and \"cargo build --release\" build it for this one\n",
    );
    std::process::exit(1)
}
