//! The table of kinds. A new kind of shape is one file and one line here.

use super::Form;
use super::{Cube, Cuboid, Plane, Platform, Prism, Pyramid, Rectangle, Sphere};
use crate::value::{Fault, Field, Takes, rounded_to};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What every kind's description says of itself.
pub trait Kind {
    /// What it is, in a sentence or two.
    const DOC: &'static str;
    /// A line for a scene file.
    const EXAMPLE: &'static str;
    /// Its keys.
    const FIELDS: &'static [Field];

    /// The geometry, in double precision. Of a description without faults.
    fn form(&self) -> Form;

    /// What is wrong with it.
    fn faults(&self) -> Vec<Fault>;

    /// One of this kind that stands upright on `base`, the middle of its lower side, and fills about
    /// a box with the lengths `size` along x, y and z, all greater than 0.
    fn standing(base: DVec3, size: DVec3) -> Self;

    /// The point that moves it: adding a vector to it moves the whole shape by that vector.
    fn anchor(&mut self) -> &mut [f64; 3];

    /// Turns it by `degrees` about the vertical through its middle, counter-clockwise seen from
    /// above. `false`: it has no key for that, and nothing was done.
    fn turn(&mut self, degrees: f64) -> bool;
}

/// The angle `rotation + degrees` as it is written in a file: above -180, at most 180.
pub(super) fn turned_rotation(rotation: f64, degrees: f64) -> f64 {
    let turn = rounded_to((rotation + degrees).rem_euclid(360.0), -6);
    if turn > 180.0 { rounded_to(turn - 360.0, -6) } else { turn }
}

macro_rules! kinds {
    ($($key:literal => $kind:ident),+ $(,)?) => {
        /// What an object looks like: one kind with its parameters. In files a table with one key.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Shape {
            $(
                #[doc = concat!("`shape.", $key, "`")]
                #[serde(rename = $key)]
                $kind($kind),
            )+
        }

        /// Every kind: its key, its fields, what it is.
        pub const KINDS: &[Field] = &[
            $(Field::required($key, Takes::Table($kind::FIELDS), "", $kind::DOC),)+
        ];

        /// Every kind's key with an example as it stands in an `[[object]]`.
        pub const EXAMPLES: &[(&str, &str)] = &[$(($key, $kind::EXAMPLE),)+];

        impl Shape {
            /// The key of its kind.
            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => $key,)+
                }
            }

            /// The geometry, in double precision, before the object's transform. Only of a shape
            /// without faults.
            pub fn form(&self) -> Form {
                match self {
                    $(Self::$kind(kind) => kind.form(),)+
                }
            }

            /// What is wrong with it; keys begin with the kind's.
            pub fn faults(&self) -> Vec<Fault> {
                let faults = match self {
                    $(Self::$kind(kind) => kind.faults(),)+
                };
                faults.into_iter().map(|f| f.under(self.key())).collect()
            }

            /// The kind with this key as [`Kind::standing`] makes it; `None`: no kind has it.
            pub fn standing(key: &str, base: DVec3, size: DVec3) -> Option<Self> {
                match key {
                    $($key => Some(Self::$kind($kind::standing(base, size))),)+
                    _ => None,
                }
            }

            /// The point that moves it: adding a vector to it moves the whole shape by that vector.
            pub fn anchor(&mut self) -> &mut [f64; 3] {
                match self {
                    $(Self::$kind(kind) => kind.anchor(),)+
                }
            }

            /// Turns it by `degrees` about the vertical through its middle, counter-clockwise seen
            /// from above. `false`: its kind has no key for that, and nothing was done.
            pub fn turn(&mut self, degrees: f64) -> bool {
                match self {
                    $(Self::$kind(kind) => kind.turn(degrees),)+
                }
            }
        }
    };
}

kinds! {
    "sphere" => Sphere,
    "cube" => Cube,
    "box" => Cuboid,
    "pyramid" => Pyramid,
    "prism" => Prism,
    "platform" => Platform,
    "rectangle" => Rectangle,
    "plane" => Plane,
}
