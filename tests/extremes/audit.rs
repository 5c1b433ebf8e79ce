//! Audit of the thirty numbered tests of extremes: each exists once, in the file that the table
//! names.

use crate::harness::*;

/// Table of the thirty numbered extremes. Each has a subject, a criterion, the name of a test
/// without the prefix `extreme_NN_`, and the file of the test. Further tests may have the same
/// number.
const EXTREMES: [(&str, &str, &str, &str); 30] = [
    (
        "a unit sphere from 1e2 .. 1e9 away",
        "right hits except within a rounding of the limb; points 1e-9 r from the surface",
        "sphere_far_away",
        "tests/extremes/sphere.rs",
    ),
    (
        "a sphere of radius 1e9 as ground",
        "horizon within 0.01 px, no dark point",
        "sphere_as_ground",
        "tests/extremes/sphere.rs",
    ),
    (
        "a sphere of radius 1e-6 at distance 1",
        "area of the silhouette within 1 %",
        "tiny_sphere",
        "tests/extremes/sphere.rs",
    ),
    (
        "a camera inside a solid or a cavity",
        "only exits, in turn, for 1e5 rays",
        "camera_inside",
        "tests/extremes/degenerate.rs",
    ),
    (
        "rays tangent to sphere, cylinder, cone",
        "no NaN; chords of 1e-6 at most (single: 2e-2)",
        "tangent_to_a_sphere",
        "tests/extremes/sphere.rs",
    ),
    (
        "rays in faces, with zeros of both signs",
        "as exact fractions say, no NaN",
        "ray_in_a_face",
        "tests/extremes/degenerate.rs",
    ),
    (
        "Cauchy's laws for every convex kind, 1e6 lines",
        "shares and chords within 4 sigma",
        "cauchy",
        "tests/extremes/cauchy.rs",
    ),
    (
        "parity, of random compounds up to depth 8",
        "in and out in turn (single: all but 1e-4)",
        "parity",
        "tests/extremes/compound.rs",
    ),
    (
        "algebra and volumes of compounds",
        "surfaces within 1e-12 t (single: 1e-5, all but 1e-4); volumes 4 sigma",
        "csg_algebra",
        "tests/extremes/compound.rs",
    ),
    (
        "faces that coincide within 4 ulp",
        "no skin, no leak",
        "coincident_faces",
        "tests/extremes/coincident.rs",
    ),
    (
        "tapers of 1e-15, heights of 1e-9 and 1e9",
        "no step above 1e-9; no taper: bit-equal",
        "tapered_cylinders",
        "tests/extremes/tapered.rs",
    ),
    (
        "rays along generators and through the apex",
        "finite; right lengths within 1e-6",
        "along_a_generator",
        "tests/extremes/tapered.rs",
    ),
    (
        "boxes, prisms and pyramids of aspect 1e-6",
        "Cauchy within 4 sigma, parity",
        "slivers",
        "tests/extremes/cauchy.rs",
    ),
    (
        "closed meshes hit on edges and corners",
        "no ray gets through",
        "mesh_watertight",
        "tests/extremes/mesh.rs",
    ),
    (
        "self-shadow at scales 1e-6 .. 1e6, light at 0.01 degrees",
        "no falsely dark point",
        "self_shadow",
        "tests/extremes/shadow.rs",
    ),
    (
        "the shadow in a gap of 1e-6",
        "no leak beyond the gap",
        "thin_gap",
        "tests/extremes/shadow.rs",
    ),
    (
        "odd cameras and rasters",
        "finite rays or a located error",
        "odd_cameras",
        "tests/extremes/camera.rs",
    ),
    (
        "bases around a million normals",
        "orthonormal within 1e-15 (single: 5e-7)",
        "orthonormal_bases",
        "tests/extremes/camera.rs",
    ),
    (
        "a cone lobe before a half-space",
        "shares within 4 sigma, slope -0.7",
        "cone_in_a_half_space",
        "tests/lobes/closed_forms.rs",
    ),
    (
        "a square lobe before a half-space",
        "shares within 4 sigma; at 0 the mirror",
        "square_in_a_half_space",
        "tests/lobes/closed_forms.rs",
    ),
    (
        "lobes at 89.999 degrees",
        "folded: all light within 1e-12 (single: 1e-6); absorbed: 4 sigma",
        "lobe_at_the_horizon",
        "tests/lobes/closed_forms.rs",
    ),
    (
        "directions against their density",
        "chi-square, level 0.01 / tests",
        "chi_square",
        "tests/lobes/chi_square.rs",
    ),
    (
        "Cook-Torrance in a furnace",
        "table within 0.003, never above 1.001",
        "furnace_of_cook_torrance",
        "tests/lobes/albedo.rs",
    ),
    (
        "Fresnel at every reflectance",
        "in [0, 1], F(1) = F0 within 1e-7",
        "fresnel",
        "src/material/fresnel.rs",
    ),
    (
        "total reflection around the critical angle",
        "R + T = 1 within 1e-12, no NaN",
        "total_reflection",
        "src/material/refraction.rs",
    ),
    (
        "10,000 images between two mirrors",
        "the sum within 1e-10 (single: 1e-4), no overflow",
        "parallel_mirrors",
        "tests/lobes/worlds.rs",
    ),
    (
        "the shift by a slab at 0 .. 89.9 degrees",
        "within 1e-10 t (single: 1.5e-3 t)",
        "slab_displacement",
        "tests/lobes/transmission.rs",
    ),
    (
        "1e9 samples in the film",
        "within 1e-8, saturation flagged",
        "milliard_samples",
        "tests/film.rs",
    ),
    (
        "the same bytes from threads, orders, parts",
        "byte-equal",
        "determinism",
        "tests/determinism.rs",
    ),
    (
        "the estimated error is the true error",
        "true / estimated 0.9 .. 1.1; at most 1.1 times the target",
        "estimated_error_is_the_true_error",
        "tests/error_estimates/mod.rs",
    ),
];

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Returns the names and files of all tests that begin with `extreme_`, except ignored ones.
fn extreme_tests() -> Vec<(String, String)> {
    let root = Path::new(env!("ZERKALO_ROOT"));
    let mut paths = Vec::new();
    for folder in ["src", "tests"] {
        rust_files(&root.join(folder), &mut paths);
    }
    let mut found = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        for pair in lines.windows(2) {
            let name = pair[1].strip_prefix("fn ").and_then(|l| l.split('(').next());
            if let Some(name) = name.filter(|n| pair[0] == "#[test]" && n.starts_with("extreme_")) {
                let file = path.strip_prefix(root).unwrap().to_str().unwrap().to_string();
                found.push((name.to_string(), file));
            }
        }
    }
    found
}

#[test]
fn all_thirty_extremes_have_tests() {
    let found = extreme_tests();
    for (i, (about, criterion, name, file)) in EXTREMES.iter().enumerate() {
        let name = format!("extreme_{:02}_{name}", i + 1);
        let places = found.iter().filter(|(n, f)| *n == name && f == file).count();
        assert_eq!(places, 1, "{name} ({about}) in {file}");
        report(i + 1, "about", about);
        report(i + 1, "criterion", criterion);
    }
    for (name, file) in &found {
        let number: usize = name[8..10].parse().unwrap();
        assert!((1..=30).contains(&number) && &name[10..11] == "_", "{name} in {file}");
    }
}
