//! Audit of the numbered tests of extremes: each number has a test.

use crate::harness::*;

/// Table of the numbered extremes: subject and criterion. The tests `extreme_NN_...` belong to line
/// NN.
const EXTREMES: &str = "\
a unit sphere from 1e2 .. 1e9 away | right hits except within a rounding of the limb; points 1e-9 r from the surface
a sphere of radius 1e9 as ground | horizon within 0.01 px, no dark point
a sphere of radius 1e-6 at distance 1 | area of the silhouette within 1 %
a camera inside a solid or a cavity | only exits, in turn, for 1e5 rays
rays tangent to sphere, cylinder, cone | no NaN; chords of 1e-6 at most (single: 2e-2)
rays in faces, with zeros of both signs | as exact fractions say, no NaN
Cauchy's laws for every convex kind, 1e6 lines | shares and chords within 4 sigma
parity, of random compounds up to depth 8 | in and out in turn (single: all but 1e-4)
algebra and volumes of compounds | surfaces within 1e-12 t (single: 1e-5, all but 1e-4); volumes 4 sigma
faces that coincide within 4 ulp | no skin, no leak
tapers of 1e-15, heights of 1e-9 and 1e9 | no step above 1e-9; no taper: bit-equal
rays along generators and through the apex | finite; right lengths within 1e-6
boxes, prisms and pyramids of aspect 1e-6 | Cauchy within 4 sigma, parity
closed meshes hit on edges and corners | no ray gets through
self-shadow at scales 1e-6 .. 1e6, light at 0.01 degrees | no falsely dark point
the shadow in a gap of 1e-6 | no leak beyond the gap
odd cameras and rasters | finite rays or a located error
bases around a million normals | orthonormal within 1e-15 (single: 5e-7)
a cone lobe before a half-space | shares within 4 sigma, slope -0.7
a square lobe before a half-space | shares within 4 sigma; at 0 the mirror
lobes at 89.999 degrees | folded: all light within 1e-12 (single: 1e-6); absorbed: 4 sigma
directions against their density | chi-square, level 0.01 / tests
Cook-Torrance in a furnace | table within 0.003, never above 1.001
Fresnel at every reflectance | in [0, 1], F(1) = F0 within 1e-7
total reflection around the critical angle | R + T = 1 within 1e-12, no NaN
10,000 images between two mirrors | the sum within 1e-10 (single: 1e-4), no overflow
the shift by a slab at 0 .. 89.9 degrees | within 1e-10 t (single: 1.5e-3 t)
1e9 samples in the film | within 1e-8, saturation flagged
the same bytes from threads, orders, parts | byte-equal
the estimated error is the true error | true / estimated 0.9 .. 1.1; at most 1.1 times the target";

/// Returns the names of all tests in `folder` that begin with `extreme_`, except ignored ones.
fn extreme_tests(folder: &Path, names: &mut BTreeSet<String>) {
    for path in fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            extreme_tests(&path, names);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let after = text.split("#[test]").skip(1).filter_map(|t| t.trim().strip_prefix("fn "));
            let first = after.filter_map(|text| text.split('(').next());
            names.extend(first.filter(|n| n.starts_with("extreme_")).map(String::from));
        }
    }
}

#[test]
fn all_thirty_extremes_have_tests() {
    let mut names = BTreeSet::new();
    for folder in ["src", "crates", "tests"] {
        extreme_tests(&Path::new(env!("ZERKALO_ROOT")).join(folder), &mut names);
    }
    let numbers: BTreeSet<usize> = names.iter().map(|name| name[8..10].parse().unwrap()).collect();
    assert!(numbers.into_iter().eq(1..=30), "{names:?}");
    for (i, line) in EXTREMES.lines().enumerate() {
        let (about, criterion) = line.split_once(" | ").unwrap();
        report(i + 1, "about", about);
        report(i + 1, "criterion", criterion);
    }
}
