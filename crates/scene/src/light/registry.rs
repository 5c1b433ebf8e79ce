//! Table of light kinds. A new kind needs a file of its own, its `mod` and one line in this table.

use crate::light::{
    Directional, DiskLight, Environment, Falloff, Light, LightForm, LightUnit, Point,
    RectangleLight, SphereLight, Spot,
};
use crate::value::{
    Color, Description, Field, KeyNode, TomlError, TomlValue, ValidationError, ValueType,
    description, doc_text, round_nice, round_significant,
};
use glam::DVec3;
use toml::Spanned;
use toml::de::DeValue;

/// Description of one kind of light, with the keys that users write in scene files.
pub trait LightDesc: Description {
    /// Converts the description, which must be valid, to its canonical form.
    fn form(&self) -> LightForm<'_>;

    /// Returns the validation errors that involve several keys or a file.
    fn faults(&self) -> Vec<ValidationError> {
        Vec::new()
    }

    /// Returns the values that edits of position and direction change.
    fn handles(&mut self) -> Handles<'_>;

    /// Creates a light with those values of `placement` for which the kind has keys.
    fn placed(placement: &Placement) -> Self;
}

/// Values of a light that determine its position and direction.
#[derive(Debug, Default)]
pub struct Handles<'a> {
    /// Position of the light, or centre of its surface.
    pub position: Option<&'a mut [f64; 3]>,
    /// Direction in which the light travels, axis of its cone, or normal of its surface.
    pub direction: Option<&'a mut [f64; 3]>,
    pub up: Option<&'a mut [f64; 3]>,
}

/// Position, direction and size of a light that is created.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Position of the light, or centre of its surface.
    pub position: [f64; 3],
    /// Direction in which the light travels.
    pub direction: [f64; 3],
    /// Radius of the surface, or half of the side of a square.
    pub radius: f64,
}

macro_rules! kinds {
    ($($(#[doc = $doc:literal])+ $key:ident => $variant:ident($kind:ident),)+) => {
        #[derive(Clone, Debug, PartialEq)]
        pub enum LightKind {
            $($(#[doc = $doc])+ $variant($kind),)+
        }

        $(
            impl From<$kind> for LightKind {
                fn from(kind: $kind) -> Self {
                    Self::$variant(kind)
                }
            }
        )+

        /// Every kind of light, with its key, its fields and its help text. A light has exactly one
        /// of these keys.
        pub const KINDS: &[Field] = &[$(
            Field::required(
                stringify!($key),
                ValueType::Table($kind::FIELDS),
                "",
                doc_text(concat!($($doc),+)),
            ),
        )+];

        pub const KIND_KEYS: &[&str] = &[$(stringify!($key)),+];

        impl LightKind {
            /// Creates a light of the kind `key`, see [`LightDesc::placed`]. Returns `None` if there
            /// is no such kind.
            pub fn placed(key: &str, placement: &Placement) -> Option<Self> {
                match key {
                    $(stringify!($key) => Some(Self::$variant($kind::placed(placement))),)+
                    _ => None,
                }
            }

            fn node(&self) -> &dyn KeyNode {
                match self {
                    $(Self::$variant(kind) => kind,)+
                }
            }

            fn node_mut(&mut self) -> &mut dyn KeyNode {
                match self {
                    $(Self::$variant(kind) => kind,)+
                }
            }

            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => stringify!($key),)+
                }
            }

            pub fn form(&self) -> LightForm<'_> {
                match self {
                    $(Self::$variant(kind) => kind.form(),)+
                }
            }

            /// Returns the validation errors that involve several keys or a file.
            pub(super) fn faults(&self) -> Vec<ValidationError> {
                match self {
                    $(Self::$variant(kind) => kind.faults(),)+
                }
            }

            /// Returns the values that edits of position and direction change.
            pub fn handles(&mut self) -> Handles<'_> {
                match self {
                    $(Self::$variant(kind) => kind.handles(),)+
                }
            }
        }

        description! {
            /// A light: exactly one of the kinds, with a colour and an intensity.
            pub struct LightTable: Default {
                /// Name of the light; every light has a different one.
                name: String, or "a number";
                $(
                    $(#[doc = $doc])+
                    $key: Option<$kind>, or "another kind is needed";
                )+
                /// Colour, by which the intensity is multiplied.
                color: Color = [1.0, 1.0, 1.0], in LIGHT;
                /// Sphere, rectangle or disk: radiance or power, as `unit` says. Environment: factor
                /// of its radiance. Point or spot: radiant intensity [W/sr], of a spot inside its
                /// inner cone, if `falloff` is `inverse-square`. Directional light, or point or spot
                /// without falloff: the brightness of a white diffuse surface that faces the light.
                intensity: f64 = 1.0, in LIGHT "W/(sr m²), W, W/sr, or irradiance / π";
                /// Unit of the intensity of a sphere, rectangle or disk.
                unit: LightUnit = "radiance";
                /// Falloff of a point or spot light with the distance.
                falloff: Falloff = "none";
                /// `false` hides a light with a size, or an environment, from the camera and from
                /// mirrors. It still lights diffuse surfaces and makes highlights.
                visible: bool = true;
                /// `false` switches the light off.
                on: bool = true;
            }
        }

        impl LightTable {
            fn kinds(&mut self) -> Vec<(&'static str, LightKind)> {
                let kinds = [
                    $(self.$key.take().map(|kind| (stringify!($key), LightKind::from(kind))),)+
                ];
                kinds.into_iter().flatten().collect()
            }

            fn set_kind(&mut self, kind: &LightKind) {
                match kind {
                    $(LightKind::$variant(kind) => self.$key = Some(kind.clone()),)+
                }
            }
        }
    };
}

kinds! {
    /// Light from one point, such as a lamp.
    point => Point(Point),
    /// Light from infinitely far away, such as the sun.
    directional => Directional(Directional),
    /// Light from one point into a cone, such as a spotlight.
    spot => Spot(Spot),
    /// Light from a sphere, such as a bulb: soft shadows.
    sphere => Sphere(SphereLight),
    /// Light from one side of a rectangle, such as a window.
    rectangle => Rectangle(RectangleLight),
    /// Light from one side of a disk.
    disk => Disk(DiskLight),
    /// Light from all directions, such as the sky.
    environment => Environment(Environment),
}

impl LightTable {
    fn with_kind(self, kind: LightKind) -> Light {
        let Self { name, color, intensity, unit, falloff, visible, on, .. } = self;
        Light { name, kind, color, intensity, unit, falloff, visible, on }
    }
}

impl From<&Light> for LightTable {
    fn from(light: &Light) -> Self {
        let Light { name, kind, color, intensity, unit, falloff, visible, on } = light.clone();
        let mut table =
            Self { name, color, intensity, unit, falloff, visible, on, ..Self::default() };
        table.set_kind(&kind);
        table
    }
}

impl Light {
    /// Creates a white light of intensity 1, without a name.
    pub fn new(kind: impl Into<LightKind>) -> Self {
        LightTable::default().with_kind(kind.into())
    }
}

/// Keys of the table of a light: its kind stands beside the other keys.
impl KeyNode for Light {
    fn child(&self, key: &str) -> Option<&dyn KeyNode> {
        match key {
            "name" => Some(&self.name),
            "color" => Some(&self.color),
            "intensity" => Some(&self.intensity),
            "unit" => Some(&self.unit),
            "falloff" => Some(&self.falloff),
            "visible" => Some(&self.visible),
            "on" => Some(&self.on),
            key => (key == self.kind.key()).then(|| self.kind.node()),
        }
    }

    fn child_mut(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        match key {
            "name" => Some(&mut self.name),
            "color" => Some(&mut self.color),
            "intensity" => Some(&mut self.intensity),
            "unit" => Some(&mut self.unit),
            "falloff" => Some(&mut self.falloff),
            "visible" => Some(&mut self.visible),
            "on" => Some(&mut self.on),
            key => (key == self.kind.key()).then(|| self.kind.node_mut()),
        }
    }
}

impl TomlValue for Light {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        let mut table = LightTable::from_toml(value)?;
        let mut kinds = table.kinds();
        let given: Vec<_> = kinds.iter().map(|(key, _)| *key).collect();
        let error = |(found, _)| TomlError::new(value.span(), found);
        check_kinds(&given).map_err(error)?;
        Ok(table.with_kind(kinds.remove(0).1))
    }

    fn to_toml(&self) -> toml::Value {
        LightTable::from(self).to_toml()
    }
}

/// Checks that `given`, the keys of kinds in the table of a light, is exactly one key.
///
/// # Errors
/// Returns a phrase that states the error, and one that states what is expected.
pub fn check_kinds(given: &[&str]) -> Result<(), (String, String)> {
    match given {
        [_] => Ok(()),
        [] => {
            let (last, others) = KIND_KEYS.split_last().unwrap_or((&"", &[]));
            let example = "point = { position = [2.0, 4.0, 3.0] }";
            let expected = format!("one of {} and {last}, such as {example}", others.join(", "));
            Err(("the light has no kind".to_string(), expected))
        }
        [first, second, ..] => Err((
            format!("both {first} and {second} are given"),
            "exactly one kind; a second light needs its own [[light]]".to_string(),
        )),
    }
}

/// Returns `center`, rounded to multiples of a power of ten that is at most 1e-4 x `radius`, and
/// `radius`, rounded to two significant digits.
pub(super) fn rounded_ball(placement: &Placement) -> ([f64; 3], f64) {
    let Placement { position, radius, .. } = *placement;
    let center = DVec3::from(position).map(|x| round_nice(x, radius)).to_array();
    (center, round_significant(radius, 2))
}
