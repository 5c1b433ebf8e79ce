//! Worlds in single or double precision behind one type.

use crate::analysis::precision::single_suffices;
use crate::compile::RecenteredGeometry;
use crate::integrator::first_hit::FirstHit;
use crate::world::{World, WorldInfo};
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

impl Precision {
    /// Returns the precision of the numbers in `L`.
    pub(crate) fn of<L: SimdFloat>() -> Self {
        if size_of::<L::Scalar>() == size_of::<f32>() { Self::Single } else { Self::Double }
    }

    /// Returns the name in film and plan files and in printed results. It never changes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Double => "double",
            Self::Auto => "auto",
        }
    }

    /// Returns the precision that film and plan files call `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Single, Self::Double].into_iter().find(|precision| precision.name() == name)
    }
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

/// Returns `true` if [`Precision::Auto`] chooses double precision for `scene`.
pub fn requires_double(scene: &Scene) -> bool {
    let (scene, geometry) = RecenteredGeometry::of_distinct(scene);
    !single_suffices(&scene, &geometry)
}

impl AnyWorld {
    /// Compiles `scene`, which must have no validation errors, with the given options.
    pub fn compile(scene: &Scene, options: &Options) -> Self {
        let (scene, geometry) = RecenteredGeometry::of_distinct(scene);
        let scene = &*scene;
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

    /// Returns the properties of the world that do not depend on its precision.
    pub fn info(&self) -> &WorldInfo {
        match self {
            Self::Single(world) => &world.info,
            Self::Double(world) => &world.info,
        }
    }

    /// Divides the lobe of the material that is rougher than in the world `inner`, compiled from an
    /// otherwise equal scene. Returns the share of the narrower lobe in it; `None` if lobes of this
    /// kind or these paths cannot be divided.
    pub fn turn(&mut self, inner: &Self) -> Option<f64> {
        match (self, inner) {
            (Self::Single(world), Self::Single(inner)) => world.turn(inner),
            (Self::Double(world), Self::Double(inner)) => world.turn(inner),
            (Self::Single(_), Self::Double(_)) | (Self::Double(_), Self::Single(_)) => None,
        }
    }

    /// Sets the order of the samples that are traced next; 0 for samples of the whole lobe.
    pub fn set_order(&mut self, order: usize) {
        let turned = match self {
            Self::Single(world) => &mut world.turned,
            Self::Double(world) => &mut world.turned,
        };
        turned.iter_mut().for_each(|turned| turned.order = order);
    }

    /// Writes the first hit of the camera ray through each of `points`, positions in the picture
    /// \[pixels\], into `hits`, a slice of the same length.
    pub fn first_hit(&self, points: &[[f64; 2]], hits: &mut [FirstHit]) {
        match self {
            Self::Single(world) => world.first_hit(points, hits),
            Self::Double(world) => world.first_hit(points, hits),
        }
    }
}
