//! Every scene of the folder `scenes`: its inventory and its picture are compared with expected
//! ones.
//!
//! `ZERKALO_BLESS=1 cargo test --release --test engine scenes::` writes the expected values.
//! `ZERKALO_BLESS=NAME.toml` writes those of one scene, and keeps the stored ones of all others.

use crate::harness::*;

/// Width and height in pixels of the compared pictures.
const SIZE: [u32; 2] = [48, 32];
const COUNT: u32 = 32;
/// Side in pixels of the blocks whose mean colours are compared.
const BLOCK: usize = 8;
const REFERENCE_SEEDS: std::ops::Range<u64> = 1..65;
/// Number of decimals of the stored means.
const DECIMALS: usize = 6;

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("ZERKALO_ROOT")).join("tests/golden").join(name)
}

/// Returns the expected text from the file `name`. If `ZERKALO_BLESS` is set, first writes `actual`
/// to this file.
fn expected(name: &str, actual: impl FnOnce() -> String) -> String {
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        fs::write(golden(name), actual()).unwrap();
    }
    fs::read_to_string(golden(name)).unwrap()
}

fn compiled(scene: &Scene) -> AnyWorld {
    AnyWorld::compile(scene, &world::Options::default())
}

#[test]
fn every_scene_compiles_to_its_inventory() {
    let mut actual = String::new();
    for (name, scene) in all_shipped() {
        writeln!(actual, "{name}: {}", compiled(&scene).info().inventory).unwrap();
    }
    let expected = expected("inventories.txt", || actual.clone());
    for (expected, actual) in expected.lines().zip(actual.lines()) {
        assert_eq!(actual, expected);
    }
    assert_eq!(actual.lines().count(), expected.lines().count());
}

/// Returns two values for each block, row by row: its mean colour, and the squared standard error
/// of that mean. The standard error of a pixel is estimated as half the difference of its two
/// replicates. The squares are added, because pixels are independent.
fn blocks(rendering: &RenderState) -> Vec<[(f64, f64); 3]> {
    let [columns, rows] = SIZE.map(|n| n as usize / BLOCK);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(rendering, part));
    let mut blocks = vec![[(0.0, 0.0); 3]; columns * rows];
    let pixels = (BLOCK * BLOCK) as f64;
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
        let block = &mut blocks[y / BLOCK * columns + x / BLOCK];
        for c in 0..3 {
            block[c].0 += 0.5 * (a[c] + b[c]) / pixels;
            block[c].1 += (0.5 * (a[c] - b[c]) / pixels).powi(2);
        }
    }
    blocks
}

/// Returns the reference of a scene as text, with one line for each block of pixels. A line
/// contains six numbers: for the three channels the mean over the renders with all seeds, and for
/// the three channels the standard error of this mean in a single render.
fn reference(scene: &Scene) -> String {
    let pool = pool(2);
    let seeds = REFERENCE_SEEDS.count() as f64;
    let mut sums: Vec<[(f64, f64); 3]> = Vec::new();
    for seed in REFERENCE_SEEDS {
        let mut rendering = begin(scene, seed, Precision::Auto);
        uniform(&mut rendering, 0, COUNT, &pool);
        let blocks = blocks(&rendering);
        sums.resize(blocks.len(), [(0.0, 0.0); 3]);
        for (sum, block) in sums.iter_mut().flatten().zip(blocks.iter().flatten()) {
            sum.0 += block.0 / seeds;
            sum.1 += block.1 / seeds;
        }
    }
    let mut text = String::new();
    for block in sums {
        let means = block.map(|(mean, _)| format!("{mean:.DECIMALS$}")).join(" ");
        let errors = block.map(|(_, variance)| format!("{:.1e}", variance.sqrt())).join(" ");
        writeln!(text, "{means} {errors}").unwrap();
    }
    text
}

/// Means and standard errors of the blocks of each scene, by the scene's file name.
type References = BTreeMap<String, Vec<[(f64, f64); 3]>>;

fn parse_references(text: &str) -> References {
    let mut references = References::new();
    let mut name = String::new();
    for line in text.lines() {
        if let Some(scene) = line.strip_prefix("# ") {
            name = scene.to_string();
            continue;
        }
        let numbers: Vec<f64> = line.split(' ').map(|n| n.parse().unwrap()).collect();
        let block = [0, 1, 2].map(|c| (numbers[c], numbers[c + 3]));
        references.entry(name.clone()).or_default().push(block);
    }
    references
}

/// Returns a bound in standard errors. The largest of `n` deviations exceeds the bound with the
/// probability with which a single deviation exceeds four standard errors (Sidak).
fn threshold(n: usize) -> f64 {
    two_sided_z(1.0 - (1.0 - tail(4.0)).powf(1.0 / n as f64))
}

#[test]
fn thresholds_follow_the_normal_distribution() {
    assert!((tail(4.0) / 6.334e-5 - 1.0).abs() < 1e-3);
    assert!((threshold(1) - 4.0).abs() < 1e-9);
    assert!((threshold(2880) - 5.59).abs() < 0.02, "{}", threshold(2880));
}

#[test]
fn every_scene_renders_its_golden_picture() {
    let scenes: Vec<_> =
        all_shipped().into_iter().map(|(name, scene)| (name, sized(scene, SIZE))).collect();
    let text = expected("scenes.txt", || {
        let stored = fs::read_to_string(golden("scenes.txt")).unwrap();
        let stored: BTreeMap<_, _> =
            stored.split("# ").filter_map(|s| s.split_once('\n')).collect();
        let wanted = std::env::var("ZERKALO_BLESS").unwrap_or_default();
        let one = |(name, scene): &(String, Scene)| match stored.get(name.as_str()) {
            Some(values) if wanted != "1" && wanted != *name => format!("# {name}\n{values}"),
            _ => format!("# {name}\n{}", reference(scene)),
        };
        scenes.iter().map(one).collect()
    });
    let references = parse_references(&text);
    let values = references.values().flatten().count() * 3;
    let threshold = threshold(values);
    // The reference is the mean over the renders with `REFERENCE_SEEDS`, rounded.
    let with_reference = (1.0 + 1.0 / REFERENCE_SEEDS.count() as f64).sqrt();
    let rounding = 10f64.powi(-(DECIMALS as i32));
    let mut wrong = Vec::new();
    let mut worst = 0.0f64;
    for (name, scene) in &scenes {
        let rendering = rendered(scene, 0, Precision::Auto, COUNT);
        assert_eq!(rendering.film.bad_samples(), 0, "{name}");
        assert_eq!(rendering.film.saturated_pixels(), 0, "{name}");
        let reference = references.get(name).unwrap_or_else(|| panic!("no reference of {name}"));
        let blocks = blocks(&rendering);
        assert_eq!(blocks.len(), reference.len(), "{name}");
        for (i, (got, expected)) in blocks.iter().zip(reference).enumerate() {
            for c in 0..3 {
                let ((got, _), (mean, error)) = (got[c], expected[c]);
                let deviation = (got - mean).abs();
                let allowed = threshold * error * with_reference + rounding;
                worst = worst.max((deviation - rounding) / (error * with_reference).max(1e-9));
                if deviation.is_nan() || deviation > allowed {
                    wrong.push(format!(
                        "{name}, block {i}, channel {c}: {got:.6}, expected {mean:.6} +- {error:.1e}"
                    ));
                }
            }
        }
    }
    println!("largest deviation: {worst:.2} standard errors of {threshold:.2} allowed");
    assert_eq!(references.len(), scenes.len(), "a reference without a scene");
    assert!(wrong.is_empty(), "{} of {values}:\n{}", wrong.len(), wrong.join("\n"));
}
