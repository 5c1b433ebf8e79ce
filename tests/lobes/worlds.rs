//! Whole paths: white furnaces, parallel mirrors, samples traced alone and in packets.

use crate::harness::*;
use crate::lobes::setup::*;

#[test]
fn extreme_20_without_roughness_every_lobe_is_the_mirror() {
    let mut scene = parsed(
        &std::fs::read_to_string(concat!(env!("ZERKALO_ROOT"), "scenes/features/lobe-square.toml"))
            .unwrap(),
    );
    scene.film.size = [40, 30];
    let with = |scene: &mut Scene, lobe: Lobe, roughness: f64| {
        for material in scene.materials.values_mut().filter(|m| m.reflection > 0.0) {
            (material.lobe, material.roughness) = (lobe, roughness);
        }
        samples::<Double>(scene, 4)
    };
    let mirror = with(&mut scene, Lobe::Mirror, 0.0);
    assert!(mirror.iter().any(|s| s[0] > 0.0));
    for lobe in Lobe::ALL {
        assert!(with(&mut scene, lobe, 0.0) == mirror, "{lobe:?}");
    }
    let differing = |roughness: f64, scene: &mut Scene| {
        let near = with(scene, Lobe::Square, roughness);
        let far = |(a, b): &(&Vector, &Vector)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-6);
        near.iter().zip(&mirror).filter(far).count()
    };
    assert_eq!(differing(1e-9, &mut scene), 0);
    report(20, "double", "bit-equal to the mirror at 0");
    assert!(differing(0.3, &mut scene) > 100);
}

fn parallel_mirrors(depth: u32) -> Scene {
    parsed(&format!(
        "film = {{ size = [4, 4] }}
        trace.max_depth = {depth}
        camera = {{ eye = [0.0, 0.0, 0.0], target = [0.3, 0.2, -1.0] }}
        ambient.color = [1.0, 1.0, 1.0]
        [materials.m]
        color = [1.0, 0.5, 0.25]
        diffuse = 0.0
        reflection = 0.999
        [[object]]
        material = \"m\"
        shape.plane = {{ point = [0.0, 0.0, -1.0], normal = [0.0, 0.0, 1.0] }}
        [[object]]
        material = \"m\"
        shape.plane = {{ point = [0.0, 0.0, 1.0], normal = [0.0, 0.0, -1.0] }}"
    ))
}

/// Checks two parallel emissive mirrors with the reflectance rho = 0.999. The sum of rho^k over all
/// images k is 1000. The part of the sum beyond the depth limit must equal the reported bias. In
/// single precision the error of the sum is at most 1e-4. It has two parts: the rounding of rho by
/// up to 3e-8, multiplied by 1000 images, and the roundings of 10,000 terms.
#[test]
fn extreme_26_parallel_mirrors() {
    let rho: f64 = 0.999;
    let mut worst = [0f64; 2];
    for depth in [16, 10_000] {
        let scene = parallel_mirrors(depth);
        let options = |precision| Options { precision, ..Options::default() };
        let double = AnyWorld::compile(&scene, &options(Precision::Double));
        let first = rho.powi(depth as i32 + 1);
        let cut = first / (1.0 - rho);
        let told = double.info().biases.clone();
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].contains(&format!("max_depth {depth} ")), "{told:?}");
        // The report shows the bound with three digits, rounded up.
        let (_, bound) = told[0].split_once("at most ").expect("a bound");
        let bound: f64 = bound.split(' ').next().unwrap().parse().expect("a number");
        assert!(bound >= cut && bound < 1.01 * cut, "{told:?}, {cut}");
        let (infinite, truncated) = (1.0 / (1.0 - rho), (1.0 - first) / (1.0 - rho));
        for sample in samples::<Double>(&scene, 4) {
            let [r, g, b] = sample;
            assert!((r / truncated - 1.0).abs() < 1e-10, "{r} for {truncated}");
            worst[0] = worst[0].max((r / truncated - 1.0).abs());
            assert!(infinite - r <= cut * (1.0 + 1e-9), "more is missing than reported");
            assert!((g / r - 0.5).abs() < 1e-12 && (b / r - 0.25).abs() < 1e-12);
        }
        for [r, ..] in samples::<Single>(&scene, 8) {
            assert!((r / truncated - 1.0).abs() < 1e-4, "single: {r} for {truncated}");
            worst[1] = worst[1].max((r / truncated - 1.0).abs());
        }
    }
    report(26, "double", &format!("{:.0e} off (relative)", worst[0]));
    report(26, "single", &format!("{:.0e} off (relative)", worst[1]));
}

fn physical() -> Scene {
    sized(shipped("mirror-room-physical.toml"), [48, 36])
}

#[test]
fn packets_equal_samples_traced_alone() {
    let (lobe, mut lambert, mut mirror) = (physical(), physical(), physical());
    for (name, scene) in [("floor", &mut lambert), ("mirror", &mut mirror)] {
        let floor = scene.materials["floor"].clone();
        let material = scene.materials.get_mut("mirror").unwrap();
        *material = floor;
        if name == "mirror" {
            (material.reflection, material.lobe) = (0.9, Lobe::Mirror);
        }
    }
    let glass = ["glass.toml", "transmission.toml", "water-glass.toml"]
        .map(|file| (file, sized(shipped(file), [24, 20])));
    // Mirrors and matte surfaces side by side, in packets that offer different numbers of hits.
    let mut bounce = mirror.clone();
    bounce.trace.max_diffuse_depth = 1;
    let others = [
        ("lobe", lobe),
        ("no reflection", lambert),
        ("ideal mirror", mirror),
        ("one diffuse bounce", bounce),
    ];
    for (name, scene) in others.into_iter().chain(glass) {
        assert!(samples::<Single>(&scene, 8) == lone_samples::<Single>(&scene, 8), "{name}");
        assert!(samples::<Double>(&scene, 8) == lone_samples::<Double>(&scene, 8), "{name}");
    }
}
