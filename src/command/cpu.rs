//! Whether this processor has what the program was compiled for.
//!
//! The build names a baseline (see `.cargo/config.toml`) and the compiler uses all of it everywhere,
//! so that an older processor would stop with an illegal instruction in the middle of something.
//! `is_x86_feature_detected!` does not help here: for a feature that the build assumes it answers
//! true without looking. So the processor is asked directly, in code so plain (integers and calls
//! into the standard library, which is compiled for the oldest processors) that nothing newer has a
//! place in it. Under an emulator of an older processor this was seen to work; should a compiler ever
//! find such a place, the outcome is the illegal instruction that there would be without this.

/// Ends the program with exit status 1 and a line on stderr if this processor lacks a feature that the
/// program was compiled for. To be called before anything else.
#[cfg(target_arch = "x86_64")]
#[inline(never)]
pub fn require() {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    // Bits: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A, CPUID.
    let basic = __cpuid(1).ecx;
    let more = if __cpuid(0).eax >= 7 { __cpuid_count(7, 0).ebx } else { 0 };
    let extended =
        if __cpuid(0x8000_0000).eax >= 0x8000_0001 { __cpuid(0x8000_0001).ecx } else { 0 };
    let lacks = |assumed: bool, register: u32, bit: u32| assumed && register >> bit & 1 == 0;
    // With the bit by which the operating system says that it keeps the wide registers.
    let os = lacks(cfg!(target_feature = "avx"), basic, 27);
    let avx = os || lacks(cfg!(target_feature = "avx"), basic, 28);
    let avx2 = lacks(cfg!(target_feature = "avx2"), more, 5);
    let fma = lacks(cfg!(target_feature = "fma"), basic, 12);
    let bits = lacks(cfg!(target_feature = "bmi1"), more, 3)
        || lacks(cfg!(target_feature = "bmi2"), more, 8)
        || lacks(cfg!(target_feature = "lzcnt"), extended, 5)
        || lacks(cfg!(target_feature = "movbe"), basic, 22)
        || lacks(cfg!(target_feature = "f16c"), basic, 29);
    let avx512 = lacks(cfg!(target_feature = "avx512f"), more, 16)
        || lacks(cfg!(target_feature = "avx512dq"), more, 17)
        || lacks(cfg!(target_feature = "avx512bw"), more, 30)
        || lacks(cfg!(target_feature = "avx512vl"), more, 31);
    if avx || avx2 || fma || bits || avx512 {
        refuse();
    }
}

/// Other architectures are compiled for their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub fn require() {}

#[cfg(target_arch = "x86_64")]
#[cold]
#[inline(never)]
fn refuse() -> ! {
    use std::io::Write;
    const MESSAGE: &[u8] = if cfg!(target_feature = "avx512f") {
        b"zerkalo was built for a processor with AVX-512, which this one lacks; build it on this machine\n"
    } else {
        b"zerkalo was built for a processor with AVX2 and FMA (x86-64-v3), which this one lacks; \
          RUSTFLAGS=\"-C target-cpu=native\" cargo build --release builds it for this one\n"
    };
    // If nobody can read it, the exit status is all there is to say.
    let _ = std::io::stderr().write_all(MESSAGE);
    std::process::exit(1)
}
