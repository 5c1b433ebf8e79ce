//! Error of a picture as displayed, divided into its causes.

use std::fmt;

/// RMSE in levels of rounding to 8 bits, 1 / sqrt(12).
pub const ROUNDING_TO_8_BITS: f64 = 0.288_675_134_594_812_9;

/// Target of [`ErrorParts::total`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorTarget {
    pub levels: f64,
    /// Value of [`ErrorParts::quantization`] for the file to be written.
    pub quantization: f64,
}

/// Parts of a picture's error, each an RMSE in 8-bit levels.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorParts {
    pub noise: f64,
    /// Error of single precision. `None` if it was not measured.
    pub rounding: Option<f64>,
    /// Upper limit of the light of paths that the scene's limits cut; infinite without a limit.
    /// `None` if it was not measured.
    pub cut_paths: Option<f64>,
    /// Number of pixels in which rounding and cut paths were measured.
    pub probed_pixels: u32,
    /// Error of the integers in the picture file.
    pub quantization: f64,
    /// Light that the model leaves out, such as `no bounces`. It is no part of the total.
    pub left_out: Vec<&'static str>,
    /// `true` if the render ends at a target of the total.
    pub is_target: bool,
}

impl ErrorParts {
    /// Returns the root of the sum of squares of noise, rounding and quantisation, plus the limit
    /// of cut paths. Parts that were not measured count as 0.
    pub fn total(&self) -> f64 {
        let squares = [self.noise, self.rounding.unwrap_or(0.0), self.quantization];
        squares.map(|part| part * part).iter().sum::<f64>().sqrt() + self.cut_paths.unwrap_or(0.0)
    }

    /// Returns `true` if the error has no upper limit, or a part of it was not measured.
    pub fn is_open(&self) -> bool {
        self.rounding.is_none() || self.cut_paths.is_none_or(f64::is_infinite)
    }

    /// Returns the sign before the total: it is a lower limit if a part was not measured, and an
    /// upper limit if most of it is the upper limit of cut paths, as after few probes.
    pub fn sign(&self) -> &'static str {
        if self.is_open() {
            ">= "
        } else if self.cut_paths.unwrap_or(0.0) > 0.5 * self.total() {
            "<= "
        } else {
            ""
        }
    }

    /// Returns the name of the largest part.
    pub fn largest(&self) -> &'static str {
        let parts = [
            ("noise", self.noise),
            ("rounding", self.rounding.unwrap_or(0.0)),
            ("cut paths", self.cut_paths.unwrap_or(0.0)),
            ("8 bits", self.quantization),
        ];
        parts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or("", |(name, _)| name)
    }

    /// Returns name and value of the parts except the noise, as text.
    pub fn others(&self) -> String {
        let part = |value: Option<f64>, sign: &str| match value {
            None => "not measured".to_string(),
            Some(value) if value.is_infinite() => "without bound".to_string(),
            Some(0.0) => "0".to_string(),
            Some(value) => format!("{sign}{value:.2}"),
        };
        let (rounding, cut) = (part(self.rounding, ""), part(self.cut_paths, "<= "));
        let none_found = self.cut_paths == Some(0.0) && self.probed_pixels > 0;
        let pixels = self.probed_pixels;
        let found = if none_found { format!(" in {pixels} pixels") } else { String::new() };
        let bits = if self.quantization > 0.1 { ", 8 bits 0.29" } else { "" };
        let semicolon = if self.left_out.is_empty() { "" } else { "; " };
        let left_out = self.left_out.join(", ");
        format!("rounding {rounding}, cut paths {cut}{found}{bits}{semicolon}{left_out}")
    }
}

impl fmt::Display for ErrorParts {
    /// Writes the line, such as `error 0.61 levels: noise 0.52, rounding 0.01, cut paths <= 0.04, 8
    /// bits 0.29; no bounces`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let total = self.total();
        match total {
            _ if total.is_infinite() => write!(f, "error without bound")?,
            _ => write!(f, "error {}{total:.2} levels", self.sign())?,
        }
        write!(f, ": noise {:.2}, {}", self.noise, self.others())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_has_all_parts_and_their_sum() {
        let parts = ErrorParts {
            noise: 0.52,
            rounding: Some(0.01),
            cut_paths: Some(0.04),
            probed_pixels: 2720,
            quantization: ROUNDING_TO_8_BITS,
            left_out: vec!["no bounces", "no caustics"],
            is_target: false,
        };
        assert_eq!(
            parts.to_string(),
            "error 0.63 levels: noise 0.52, rounding 0.01, cut paths <= 0.04, 8 bits 0.29; no \
             bounces, no caustics"
        );
        assert_eq!((parts.largest(), parts.is_open()), ("noise", false));
        let unbounded = ErrorParts { cut_paths: Some(f64::INFINITY), ..parts.clone() };
        assert!(unbounded.to_string().starts_with("error without bound: noise 0.52"));
        assert_eq!((unbounded.largest(), unbounded.is_open()), ("cut paths", true));
        let early = ErrorParts { cut_paths: Some(9.0), ..parts.clone() };
        assert!(early.to_string().starts_with("error <= 9.59 levels: noise 0.52"), "{early}");
        let uncut = ErrorParts { cut_paths: Some(0.0), ..parts.clone() };
        assert!(uncut.to_string().contains(", cut paths 0 in 2720 pixels, 8 bits"), "{uncut}");
        let unmeasured = ErrorParts { rounding: None, quantization: 0.0, ..parts };
        let text = "error >= 0.56 levels: noise 0.52, rounding not measured, cut paths <= 0.04; no";
        assert!(unmeasured.to_string().starts_with(text), "{unmeasured}");
    }
}
