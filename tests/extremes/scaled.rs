//! The same scene a million times smaller or larger, and ten million units away: the same picture.

use crate::support::{picture, rendered, shipped, sized};
use glam::DVec3;
use zerkalo::film::{Display, Replicates};
use zerkalo::light::Falloff;
use zerkalo::scene::{Scale, Scene, TransformOp};
use zerkalo::world::Precision;

const SIZE: [u32; 2] = [64, 48];
const SAMPLES: u32 = 16;

/// One scene of each family: cone lobes, Beckmann lobes with light that falls off, glass, compounds,
/// meshes.
const SCENES: [&str; 5] = [
    "mirror-room.toml",
    "mirror-room-physical.toml",
    "glass.toml",
    "compound-nested.toml",
    "shape-mesh.toml",
];

/// Every length `s` times as large, and the strength of lights whose light falls off with the square of
/// the distance by s^2; then everything moved by `by`.
fn changed(mut scene: Scene, s: f64, by: DVec3) -> Scene {
    let place = |p: &mut [f64; 3]| *p = (DVec3::from(*p) * s + by).to_array();
    place(&mut scene.camera.eye);
    scene.camera.target.as_mut().map(place);
    scene.camera.near *= s;
    for light in &mut scene.lights {
        if let Some(point) = &mut light.point {
            place(&mut point.position);
            if light.falloff == Falloff::InverseSquare {
                light.intensity *= s * s;
            }
        }
    }
    for object in &mut scene.objects {
        if s != 1.0 {
            object.transform.push(TransformOp::Scale(Scale([s; 3])));
        }
        if by != DVec3::ZERO {
            object.transform.push(TransformOp::Translate(by.to_array()));
        }
    }
    assert!(scene.faults().is_empty(), "{:?}", scene.faults());
    scene
}

/// Root mean square difference of two pictures of the same samples, in codes, without the `left_out` pixels
/// that differ most.
fn apart(a: &Scene, b: &Scene, precision: Precision, left_out: usize) -> f64 {
    let display = Display::default();
    let codes = |scene: &Scene| -> Vec<[f64; 3]> {
        let rendering = rendered(scene, 5, precision, SAMPLES);
        assert_eq!(rendering.film.bad_samples().count, 0);
        picture(&rendering, Replicates::Both).iter().map(|p| display.codes(*p)).collect()
    };
    let (a, b) = (codes(a), codes(b));
    let of_pixel =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut squares: Vec<f64> = a.iter().zip(&b).map(of_pixel).collect();
    squares.sort_by(f64::total_cmp);
    let (most, flipped) = squares.split_at(squares.len() - left_out);
    // One of the samples of a pixel, in the steep part of the tone curve.
    let one_path = 4.0 * 255.0 / f64::from(SAMPLES);
    assert!(flipped.iter().all(|s| s.sqrt() < 3f64.sqrt() * one_path), "{flipped:?}");
    (most.iter().sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

/// Checks all scenes under one change; `limits`: codes in double precision and by `auto`; `flipped`: the
/// pixels in which a path by `auto` may differ.
fn check(name: &str, s: f64, by: DVec3, limits: [f64; 2], flipped: usize) {
    for file in SCENES {
        let scene = sized(shipped(file), SIZE);
        let other = changed(scene.clone(), s, by);
        for (precision, limit) in [Precision::Double, Precision::Auto].into_iter().zip(limits) {
            let left_out = if precision == Precision::Double { 0 } else { flipped };
            let codes = apart(&scene, &other, precision, left_out);
            println!("{name}, {file}, {precision:?}: {codes:.2e} codes");
            assert!(codes <= limit, "{name}, {file}, {precision:?}: {codes} codes");
        }
    }
}

/// By powers of two nothing at all changes; by powers of ten, roundings do.
#[test]
fn scaled_scenes_give_the_same_picture() {
    for exponent in [-6, -3, 3, 6] {
        let name = format!("scaled by 1e{exponent}");
        check(&name, 10f64.powi(exponent), DVec3::ZERO, DOUBLE_AUTO, FLIPPED);
    }
    check("scaled by 2^20", 1_048_576.0, DVec3::ZERO, [0.0; 2], 0);
}

/// In so many of the 3,072 pixels a path of single precision may pass the other side of an edge.
const FLIPPED: usize = 2;

/// What RMSE of the same samples roundings may make, in double precision and by `auto`: found are 3e-7
/// codes, and 5e-5 in single precision.
const DOUBLE_AUTO: [f64; 2] = [1e-6, 2e-4];

/// Ten million units away the file's own numbers end at 2e-9.
#[test]
fn shifted_scenes_give_the_same_picture() {
    let aside = DVec3::new(1.0, -0.7, 0.3);
    for by in [1.0, 1e3, 1e5, 1e7] {
        check(&format!("shifted by {by:e}"), 1.0, aside * by, DOUBLE_AUTO, FLIPPED);
    }
}
