//! Conversion of linear colours from other RGB primaries to those of sRGB.

use glam::{DMat3, DVec3};

/// Chromaticities (x, y) of red, green, blue and white in the CIE 1931 diagram.
pub type Chromaticities = [[f32; 2]; 4];

/// Chromaticities of sRGB and Rec. 709.
const SRGB: Chromaticities = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]];

/// Largest difference to the chromaticities of sRGB that counts as rounding.
const ROUNDING: f32 = 1e-3;

/// Bradford matrix: cone responses from X, Y, Z. Source: G. Finlayson, S. Süsstrunk, "Performance of
/// a chromatic adaptation transform based on spectral sharpening", 2000.
const CONES_FROM_XYZ: DMat3 = DMat3::from_cols_array_2d(&[
    [0.8951, -0.7502, 0.0389],
    [0.2664, 1.7135, -0.0685],
    [-0.1614, 0.0367, 1.0296],
]);

/// Returns the matrix to linear sRGB from colours with the primaries `chromaticities`. White stays
/// white (Bradford adaptation). Returns `None` if the primaries are those of sRGB. Fails with a clause
/// if the chromaticities do not determine colours.
pub fn srgb_from(chromaticities: Chromaticities) -> Result<Option<DMat3>, String> {
    let pairs = || chromaticities.as_flattened().iter().zip(SRGB.as_flattened());
    if pairs().all(|(x, srgb)| (x - srgb).abs() <= ROUNDING) {
        return Ok(None);
    }
    let [theirs, ours] = [chromaticities, SRGB].map(|c| c.map(xyz));
    let [cones, our_cones] = [theirs, ours].map(|[.., white]| CONES_FROM_XYZ * white);
    let adaptation =
        CONES_FROM_XYZ.inverse() * DMat3::from_diagonal(our_cones / cones) * CONES_FROM_XYZ;
    let matrix = xyz_from_rgb(ours).inverse() * adaptation * xyz_from_rgb(theirs);
    let fault = || format!("the chromaticities {chromaticities:?} determine no colours");
    let is_valid = (matrix * DVec3::ONE).abs_diff_eq(DVec3::ONE, 1e-6);
    if is_valid { Ok(Some(matrix)) } else { Err(fault()) }
}

/// Returns the colour X, Y, Z with the luminance 1.
fn xyz([x, y]: [f32; 2]) -> DVec3 {
    let (x, y) = (f64::from(x), f64::from(y));
    DVec3::new(x, y, 1.0 - x - y) / y
}

/// Returns the matrix to X, Y, Z from amounts of red, green and blue that are 1 in white.
fn xyz_from_rgb([red, green, blue, white]: [DVec3; 4]) -> DMat3 {
    let primaries = DMat3::from_cols(red, green, blue);
    primaries * DMat3::from_diagonal(primaries.inverse() * white)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the matrices of Bruce Lindbloom's *RGB working space matrices* and of the Academy
    /// (ACEScg to sRGB), to four digits.
    #[test]
    fn primaries_are_converted_and_white_stays_white() {
        let wide = [[0.713, 0.293], [0.165, 0.83], [0.128, 0.044], [0.32168, 0.33767]];
        let expected = [
            [1.705_051, -0.621_792, -0.083_259],
            [-0.130_256, 1.140_805, -0.010_548],
            [-0.024_003, -0.128_969, 1.152_972],
        ];
        let matrix = srgb_from(wide).unwrap().unwrap().transpose().to_cols_array_2d();
        for (row, expected) in matrix.into_iter().zip(expected) {
            for (x, expected) in row.into_iter().zip(expected) {
                assert!((x - expected).abs() < 1e-3, "{matrix:?}");
            }
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6, "{row:?}");
        }
        assert_eq!(srgb_from(SRGB), Ok(None));
        let mut rounded = SRGB;
        rounded[3] = [0.3127, 0.3291];
        assert_eq!(srgb_from(rounded), Ok(None));
    }

    #[test]
    fn degenerate_primaries_are_refused() {
        let [red, green, blue, white] = SRGB;
        for bad in [
            [[0.0; 2]; 4],
            [red, red, blue, white],
            [red, green, blue, [0.3, 0.0]],
            [red, green, blue, [f32::NAN; 2]],
            [red, green, [f32::INFINITY, 0.1], white],
        ] {
            assert!(srgb_from(bad).is_err(), "{bad:?}");
        }
    }
}
