//! Rectangle anywhere: the flat mirror.

use super::{Form, Kind};
use crate::value::{Checks, Fault, Field, Range, Takes};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A flat rectangle. Its front is the side that `normal` points to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    /// Centre.
    pub center: [f64; 3],
    /// Width (across) and height (along `up`).
    pub size: [f64; 2],
    /// Direction in which the front faces; any length but 0.
    pub normal: [f64; 3],
    /// Direction of the height, made perpendicular to the normal; any length but 0.
    #[serde(default = "up")]
    pub up: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

impl Rectangle {
    /// Unit vectors to the right (seen from the front), up and to the front; `None` if `up` lies along
    /// the normal.
    fn frame(&self) -> Option<[DVec3; 3]> {
        // First to length 1, so that no length that a file can hold over- or underflows below.
        let front = unit(self.normal)?;
        let right = unit(self.up)?.cross(front);
        // Within 1e-6 of parallel the direction is noise.
        (right.length() > 1e-6).then(|| {
            let right = right.normalize();
            [right, front.cross(right), front]
        })
    }
}

fn unit(direction: [f64; 3]) -> Option<DVec3> {
    let v = DVec3::from_array(direction);
    (v / v.abs().max_element()).try_normalize()
}

impl Kind for Rectangle {
    const DOC: &'static str =
        "A flat rectangle, such as a mirror. Its front is the side that `normal` points to.";
    const EXAMPLE: &'static str = "shape.rectangle = { center = [0.0, 1.5, -2.0], size = [4.0, 3.0], normal = [0.0, 0.0, 1.0] }";
    const FIELDS: &'static [Field] = &[
        Field::required("center", Takes::Numbers(3, Range::COORDINATE), "scene units", "Centre."),
        Field::required(
            "size",
            Takes::Numbers(2, Range::SIZE),
            "scene units",
            "Width (across) and height (along `up`).",
        ),
        Field::required("normal", Takes::Direction, "", "Direction in which the front faces."),
        Field::preset(
            "up",
            Takes::Direction,
            "",
            "[0.0, 1.0, 0.0]",
            "Direction of the height, made perpendicular to `normal`; not parallel to it.",
        ),
    ];

    fn form(&self) -> Form {
        let [right, up, _] = self.frame().unwrap_or([DVec3::X, DVec3::Y, DVec3::Z]);
        let (u, v) = (right * self.size[0], up * self.size[1]);
        Form::Parallelogram { corner: DVec3::from_array(self.center) - (u + v) / 2.0, u, v }
    }

    fn faults(&self) -> Vec<Fault> {
        let checks = Checks::new(Self::FIELDS)
            .numbers("center", &self.center)
            .numbers("size", &self.size)
            .numbers("normal", &self.normal)
            .numbers("up", &self.up)
            .ratio(&self.size.map(|s| ("size", s)), &self.center);
        let parallel = checks.clean() && self.frame().is_none();
        checks
            .and(parallel.then(|| {
                Fault::new(
                    "up",
                    "up is parallel to normal, so that the rectangle could lie any way round",
                    "an `up` across the normal, such as [0.0, 0.0, -1.0] for a rectangle that lies flat",
                )
            }))
            .faults()
    }
}
