//! The camera: a pinhole.

use serde::{Deserialize, Serialize};

/// Where the picture is taken from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    /// The eye.
    pub eye: [f64; 3],
    /// The point looked at; exactly one of `target` and `direction`.
    pub target: Option<[f64; 3]>,
    /// The direction looked in.
    pub direction: Option<[f64; 3]>,
    /// What is up in the picture.
    pub up: [f64; 3],
    /// Opening angle; exactly one of its keys.
    pub view_angle: ViewAngle,
    /// Nothing nearer than this, measured along the view direction, is seen.
    pub near: f64,
}

/// Opening angle of the picture [degrees], between 0 and 180.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ViewAngle {
    /// Across the picture's height.
    Vertical(f64),
    /// Across the picture's width.
    Horizontal(f64),
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            eye: [0.0, 1.0, 5.0],
            target: None,
            direction: None,
            up: [0.0, 1.0, 0.0],
            view_angle: ViewAngle::Vertical(40.0),
            near: 0.0,
        }
    }
}
