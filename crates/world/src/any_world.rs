//! Worlds in single or double precision behind one type.

use crate::analysis::precision;
use crate::compile::RecenteredGeometry;
use crate::integrator::first_hit::FirstHit;
use crate::lights::choice::LightChoice;
use crate::lights::groups::LightGroups;
use crate::world::World;
use zerkalo_kernel::lanes::{Double, SimdFloat, Single};
use zerkalo_scene::Scene;

/// Floating-point precision in which a scene is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// Single precision: 24-bit significands, eight or sixteen SIMD lanes.
    Single,
    /// Double precision: 53-bit significands, four or eight SIMD lanes.
    Double,
    /// Single if its errors are too small to be visible in the picture, otherwise double.
    #[default]
    Auto,
}

/// Options of scene compilation.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Precision for which the scene is compiled.
    pub precision: Precision,
    /// `true` if all lights and emissive materials share one light group. The film is then smaller,
    /// but a change of a light's emission requires new samples.
    pub merge_lights: bool,
}

/// Compiled scene in the precision that the scene requires or that the user has chosen.
pub enum AnyWorld {
    /// Single precision.
    Single(World<Single>),
    /// Double precision.
    Double(World<Double>),
}

/// Evaluates an expression with `$world` bound to the [`World`] of an [`AnyWorld`].
macro_rules! dispatch {
    ($any:expr, $world:ident => $value:expr) => {
        match $any {
            AnyWorld::Single($world) => $value,
            AnyWorld::Double($world) => $value,
        }
    };
}

/// Returns `true` if [`Precision::Auto`] chooses double precision for `scene`.
pub fn requires_double(scene: &Scene) -> bool {
    !single_suffices(scene, &RecenteredGeometry::new(scene))
}

fn single_suffices(scene: &Scene, geometry: &RecenteredGeometry) -> bool {
    let RecenteredGeometry { origin, forms, extent } = geometry;
    precision::single_suffices(scene, forms, *origin, *extent)
}

impl AnyWorld {
    /// Compiles `scene`, which must have no validation errors, with the given options.
    pub fn compile(scene: &Scene, options: &Options) -> Self {
        let geometry = RecenteredGeometry::new(scene);
        let single = match options.precision {
            Precision::Single => true,
            Precision::Double => false,
            Precision::Auto => single_suffices(scene, &geometry),
        };
        if single {
            Self::Single(World::compile(scene, &geometry, options.merge_lights))
        } else {
            Self::Double(World::compile(scene, &geometry, options.merge_lights))
        }
    }

    /// Returns the name of the precision: `single` or `double`.
    pub fn precision(&self) -> &'static str {
        match self {
            Self::Single(_) => "single",
            Self::Double(_) => "double",
        }
    }

    /// Returns the name of the SIMD type, such as `f32x8`.
    pub fn lanes(&self) -> &'static str {
        match self {
            Self::Single(_) => Single::NAME,
            Self::Double(_) => Double::NAME,
        }
    }

    /// Returns the name of each light group.
    pub fn group_names(&self) -> Vec<String> {
        dispatch!(self, world => world.group_names.clone())
    }

    /// Returns the light groups.
    pub fn light_groups(&self) -> &LightGroups {
        dispatch!(self, world => &world.groups)
    }

    /// Writes the first hit of the camera ray through each of `points`, positions in the picture
    /// \[pixels\], into `hits`, a slice of the same length.
    pub fn first_hit(&self, points: &[[f64; 2]], hits: &mut [FirstHit]) {
        dispatch!(self, world => world.first_hit(points, hits))
    }

    /// Returns the scale of each light group: the number of integer steps per unit of radiance in
    /// the film, a power of two.
    pub fn group_scales(&self) -> Vec<f64> {
        dispatch!(self, world => world.scales.clone())
    }

    /// Returns the factors of each light group in the picture of `scene`, see [`LightGroups::mix`].
    pub fn mix(&self, scene: &Scene) -> Vec<[f64; 3]> {
        dispatch!(self, world => world.groups.mix(scene))
    }

    /// Returns the number of successive samples of a pixel that together trace a shadow ray to each
    /// light once; 1 if every sample traces shadow rays to all lights.
    pub fn light_period(&self) -> u32 {
        dispatch!(self, world => world.light_choice.as_ref().map_or(1, LightChoice::period))
    }

    /// Returns the list of features that the compiled scene contains.
    pub fn inventory(&self) -> &str {
        dispatch!(self, world => &world.inventory)
    }

    /// Returns one sentence for each setting of the scene that ends paths early, such as
    /// `max_depth`. Each sentence gives an upper bound of the light that is lost.
    pub fn biases(&self) -> Vec<String> {
        dispatch!(self, world => world.truncation_biases.clone())
    }
}
