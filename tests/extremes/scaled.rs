//! Scenes that are scaled by a millionth to a million, against the original scene: the pictures are
//! equal. `linearity` has scenes that are moved.

use crate::harness::*;

const SIZE: [u32; 2] = [64, 48];
const SAMPLES: u32 = 16;

/// Files of scenes with different features: cone lobes, Beckmann lobes and lights with falloff,
/// glass, compounds, meshes.
const SCENES: &str = "mirror-room mirror-room-physical glass compound-nested shape-mesh";

/// Returns the scene with every length multiplied by `s`. The intensity of lights with
/// inverse-square falloff is multiplied by s^2.
fn scaled(mut scene: Scene, s: f64) -> Scene {
    let place = |p: &mut [f64; 3]| *p = p.map(|x| x * s);
    place(&mut scene.camera.eye);
    scene.camera.target.as_mut().map(place);
    scene.camera.near *= s;
    for light in &mut scene.lights {
        if let Some(position) = light.position_mut() {
            place(position);
            if light.falloff == Falloff::InverseSquare {
                light.intensity *= s * s;
            }
        }
    }
    for object in &mut scene.objects {
        object.transform.push(TransformOp::Scale(Scale([s; 3])));
    }
    assert!(scene.faults().is_empty(), "{:?}", scene.faults());
    scene
}

/// Returns the root mean square difference between the pictures of the scenes `a` and `b` with
/// equal samples, in 8-bit levels. The `left_out` pixels that differ most are left out.
fn rms_difference(a: &Scene, b: &Scene, precision: Precision, left_out: usize) -> f64 {
    let display = Display::default();
    let levels_of_picture = |scene: &Scene| -> Vec<[f64; 3]> {
        let rendering = rendered(scene, 5, precision, SAMPLES);
        assert_eq!(rendering.film.bad_samples(), 0);
        picture(&rendering, Replicates::Both).iter().map(|p| display.levels(*p)).collect()
    };
    let (a, b) = (levels_of_picture(a), levels_of_picture(b));
    let square_difference =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut squares: Vec<f64> = a.iter().zip(&b).map(square_difference).collect();
    squares.sort_by(f64::total_cmp);
    let (most, flipped) = squares.split_at(squares.len() - left_out);
    // Largest change of a pixel by one of its samples, in 8-bit levels. The factor 4 allows for the
    // steep part of the tone curve.
    let one_path = 4.0 * 255.0 / f64::from(SAMPLES);
    assert!(flipped.iter().all(|s| s.sqrt() < 3f64.sqrt() * one_path), "{flipped:?}");
    (most.iter().sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

/// Compares the picture of each scene with that of a copy that is scaled by `s`. `limits` are the
/// largest RMS differences in 8-bit levels: first in double precision, then in the precision that
/// `auto` selects. In the latter, the `flipped` pixels that differ most are left out. In them, a
/// path may pass an edge on another side than in the original scene.
fn check(s: f64, limits: [f64; 2], flipped: usize) {
    for file in SCENES.split(' ') {
        let scene = sized(shipped(&format!("{file}.toml")), SIZE);
        let other = scaled(scene.clone(), s);
        for (precision, limit) in [Precision::Double, Precision::Auto].into_iter().zip(limits) {
            let left_out = if precision == Precision::Double { 0 } else { flipped };
            let levels = rms_difference(&scene, &other, precision, left_out);
            println!("{s:e}, {file}, {precision:?}: {levels:.2e} levels");
            assert!(levels <= limit, "{s:e}, {file}, {precision:?}: {levels} levels");
        }
    }
}

/// Checks scenes of other sizes. Scaling by a power of two changes no bit; scaling by a power of
/// ten changes roundings.
#[test]
fn scaled_scenes_give_the_same_picture() {
    for exponent in [-6, 6] {
        check(10f64.powi(exponent), DOUBLE_AUTO, FLIPPED);
    }
    check(1_048_576.0, [0.0; 2], 0);
}

/// Number of the 3,072 pixels that may differ by more than rounding from the original picture,
/// because a path in single precision passes an edge on another side.
const FLIPPED: usize = 2;

/// Largest RMS difference between two pictures with equal samples that rounding may cause, in 8-bit
/// levels: in double precision, and in the precision that `auto` selects. Measured are 3e-7 in
/// double and 5e-5 in single precision.
const DOUBLE_AUTO: [f64; 2] = [1e-6, 2e-4];
