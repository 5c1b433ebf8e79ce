//! Whether this processor has what the program was compiled for.
//!
//! The build names a baseline (see `.cargo/config.toml`) and the compiler uses all of it everywhere,
//! so that an older processor would stop with an illegal instruction in the middle of something.
//! `is_x86_feature_detected!` does not help here: for a feature that the build assumes it answers
//! true without looking. So the processor is asked directly.

/// The features that the program assumes and this processor lacks, by name; empty if all is well.
#[cfg(target_arch = "x86_64")]
pub fn missing_features() -> Vec<&'static str> {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    let has = |register: u32, bit: u32| register >> bit & 1 != 0;
    let highest = __cpuid(0).eax;
    let basic = __cpuid(1);
    let more = (highest >= 7).then(|| __cpuid_count(7, 0));
    let extended =
        (__cpuid(0x8000_0000).eax >= 0x8000_0001).then(|| __cpuid(0x8000_0001)).map_or(0, |r| r.ecx);
    let more_ebx = more.map_or(0, |r| r.ebx);
    // Bits: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A, CPUID. OSXSAVE
    // tells that the operating system keeps the wide registers.
    let assumed = [
        ("avx", cfg!(target_feature = "avx"), has(basic.ecx, 28) && has(basic.ecx, 27)),
        ("avx2", cfg!(target_feature = "avx2"), has(more_ebx, 5)),
        ("fma", cfg!(target_feature = "fma"), has(basic.ecx, 12)),
        ("bmi1", cfg!(target_feature = "bmi1"), has(more_ebx, 3)),
        ("bmi2", cfg!(target_feature = "bmi2"), has(more_ebx, 8)),
        ("f16c", cfg!(target_feature = "f16c"), has(basic.ecx, 29)),
        ("lzcnt", cfg!(target_feature = "lzcnt"), has(extended, 5)),
        ("movbe", cfg!(target_feature = "movbe"), has(basic.ecx, 22)),
        ("avx512f", cfg!(target_feature = "avx512f"), has(more_ebx, 16)),
        ("avx512dq", cfg!(target_feature = "avx512dq"), has(more_ebx, 17)),
        ("avx512bw", cfg!(target_feature = "avx512bw"), has(more_ebx, 30)),
        ("avx512vl", cfg!(target_feature = "avx512vl"), has(more_ebx, 31)),
    ];
    let missing = assumed.into_iter().filter(|(_, needed, there)| *needed && !there);
    missing.map(|(name, _, _)| name).collect()
}

/// Other architectures are compiled for their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub fn missing_features() -> Vec<&'static str> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_processor_that_runs_this_test_lacks_nothing() {
        assert_eq!(super::missing_features(), Vec::<&str>::new());
    }
}
