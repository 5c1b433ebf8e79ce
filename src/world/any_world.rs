//! Worlds in single or double precision behind one type.

use crate::lanes::{Double, SimdFloat, Single};
use crate::scene::Scene;
use crate::world::compile::RecenteredGeometry;
use crate::world::integrator::first_hit::FirstHit;
use crate::world::inventory::Inventory;
use crate::world::light_choice::LightChoice;
use crate::world::light_groups::LightGroups;
use crate::world::precision;
use crate::world::world::World;

/// Floating-point precision in which a scene is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// 24-bit significands, eight or sixteen lanes.
    Single,
    /// 53-bit significands, four or eight lanes.
    Double,
    /// Single precision where the scene's proportions allow it, double precision elsewhere.
    #[default]
    Auto,
}

/// Options of scene compilation.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Precision in which the world is compiled.
    pub precision: Precision,
    /// `true` if all lights share one light group, which makes the film smaller. The samples then
    /// contain the colours and intensities of the lights.
    pub merge_lights: bool,
}

/// A world in the precision that the scene requires or that the user has chosen.
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

impl AnyWorld {
    /// Compiles `scene`, which has no validation errors.
    pub fn compile(scene: &Scene, options: &Options) -> Self {
        let geometry = RecenteredGeometry::new(scene);
        let single = match options.precision {
            Precision::Single => true,
            Precision::Double => false,
            Precision::Auto => {
                let RecenteredGeometry { origin, forms, extent } = &geometry;
                precision::single_suffices(scene, forms, *origin, *extent)
            }
        };
        if single {
            Self::Single(World::compile(scene, &geometry, options.merge_lights))
        } else {
            Self::Double(World::compile(scene, &geometry, options.merge_lights))
        }
    }

    /// Name of the precision: `single` or `double`.
    pub fn precision(&self) -> &'static str {
        match self {
            Self::Single(_) => "single",
            Self::Double(_) => "double",
        }
    }

    /// Name of the lane type, such as `f32x8`.
    pub fn lanes(&self) -> &'static str {
        match self {
            Self::Single(_) => Single::NAME,
            Self::Double(_) => Double::NAME,
        }
    }

    /// Name of each light group.
    pub fn group_names(&self) -> Vec<String> {
        dispatch!(self, world => world.group_names.clone())
    }

    /// Light groups of the world: the parts of the picture that the film stores separately.
    pub fn light_groups(&self) -> &LightGroups {
        dispatch!(self, world => &world.groups)
    }

    /// Writes the first hit of the camera ray through each of `points` into `hits`, a slice of the
    /// same length. A point is a column and a row of the raster in pixels, with fractions.
    pub fn first_hit(&self, points: &[[f64; 2]], hits: &mut [FirstHit]) {
        dispatch!(self, world => world.first_hit(points, hits))
    }

    /// Scale of each light group: the number of integer steps per unit of radiance in the film, a
    /// power of two.
    pub fn group_scales(&self) -> Vec<f64> {
        dispatch!(self, world => world.scales.clone())
    }

    /// Weight of each light group in the picture of `scene`. The scene may differ from the compiled
    /// one in colours, intensities and switches of lights.
    pub fn mix(&self, scene: &Scene) -> Vec<[f64; 3]> {
        dispatch!(self, world => world.groups.mix(scene))
    }

    /// Number of successive samples of a pixel that ask each light once; 1 if every sample asks all
    /// lights.
    pub fn light_period(&self) -> u32 {
        dispatch!(self, world => world.light_choice.as_ref().map_or(1, LightChoice::period))
    }

    /// Features that the world contains.
    pub fn inventory(&self) -> &Inventory {
        dispatch!(self, world => &world.inventory)
    }

    /// Returns one sentence for each limit of the scene that ends paths early, such as `max_depth`,
    /// with a bound of the lost light.
    pub fn biases(&self) -> Vec<String> {
        dispatch!(self, world => world.truncation_biases.clone())
    }
}
