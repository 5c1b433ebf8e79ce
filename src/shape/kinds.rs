//! The table of kinds. A new kind of shape is one file and one line here.

use super::Form;
use super::{Cube, Cuboid, Plane, Platform, Prism, Pyramid, Rectangle, Sphere};
use crate::value::{Fault, Field, Takes};
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
