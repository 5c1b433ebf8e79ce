//! From a scene to a world.

use crate::camera::PinholeCamera;
use crate::lanes::{Double, Float, SimdFloat, Single};
use crate::light::DeltaLight;
use crate::material::{Bsdf, Material, ReflectionLobe};
use crate::primitive::{Acceleration, Aggregate, Form};
use crate::scene::{BelowHorizon, Filter, RayTypes, Scene};
use crate::world::culling::light_buffer::LightBuffer;
use crate::world::culling::screen_grid::{ScreenBounds, ScreenGrid};
use crate::world::culling::tile::{CullingMode, FrustumCuller, TileCandidates};
use crate::world::integrator::first_hit::FirstHit;
use crate::world::integrator::nested_dielectrics::NestedDielectrics;
use crate::world::integrator::surface_textures::SurfaceTextures;
use crate::world::inventory::Inventory;
use crate::world::light_groups::{LightGroupSource, LightGroups};
use crate::world::lights_on_surfaces::OnSurface;
use crate::world::precision;
use crate::world::radiance_range;
use crate::world::truncation_bias;
use glam::{DAffine3, DVec3};

/// The precision that a scene is traced in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// 24-bit significands, eight or sixteen lanes.
    Single,
    /// 53-bit significands, four or eight lanes.
    Double,
    /// Single where the scene's proportions allow it.
    #[default]
    Auto,
}

/// How scenes are compiled.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The precision.
    pub precision: Precision,
}

/// A light of the world: the lamp, its group, its weight in the group's samples.
pub(super) struct LightSource<S> {
    pub lamp: DeltaLight<S>,
    pub group: usize,
    /// `None`: 1 in every channel.
    pub weight: Option<[S; 3]>,
    /// Where shadow rays end, if the lamp lies on surfaces.
    pub on_surface: Option<OnSurface<S>>,
}

/// A scene, compiled for the lane type `L`.
pub struct World<L: SimdFloat> {
    pub(super) geometry: Aggregate<L>,
    /// For each item of the geometry, its finish.
    pub(super) bsdf_of: Vec<u32>,
    pub(super) bsdfs: Vec<Bsdf<L::Scalar>>,
    pub(super) sources: Vec<LightSource<L::Scalar>>,
    pub(super) ambient: Option<usize>,
    pub(super) background: Option<usize>,
    pub(super) shadows: bool,
    /// Light sees other normals than the surfaces' own.
    pub(super) smooth: bool,
    /// Things have colours of their own.
    pub(super) colored: bool,
    /// Neither smooth nor colored, and all things in lists: no trees, no boxes.
    pub(super) simple: bool,
    /// Textures and bumps; `None`: there are none.
    pub(super) surface_textures: Option<SurfaceTextures<L>>,
    /// What lets light through; `None`: nothing does.
    pub(super) nested_dielectrics: Option<NestedDielectrics<L>>,
    /// The most surfaces that a path meets after the first.
    pub(super) depth: u32,
    pub(super) min_weight: f64,
    pub(super) fold: bool,
    pub(super) view: PinholeCamera,
    pub(super) all_candidates: TileCandidates,
    /// For each light, if the geometry has a tree that may be gone round.
    pub(super) light_buffers: Vec<Option<LightBuffer<L::Scalar>>>,
    culling: CullingMode,
    groups: LightGroups,
    names: Vec<String>,
    scales: Vec<f64>,
    jitter: bool,
    glossy: bool,
    inventory: Inventory,
    biases: Vec<String>,
}

/// Geometry of every object, in double precision, around the scene's centre.
struct RecenteredGeometry {
    origin: DVec3,
    forms: Vec<Form>,
}

impl RecenteredGeometry {
    fn new(scene: &Scene) -> Self {
        let forms: Vec<Form> = scene
            .objects
            .iter()
            .map(|o| o.shape.form().transformed(&o.scene_from_object()))
            .collect();
        let corners = || forms.iter().filter_map(Form::bounds);
        let low = corners().map(|b| b.0).reduce(DVec3::min);
        let high = corners().map(|b| b.1).reduce(DVec3::max);
        let origin = match (low, high) {
            (Some(low), Some(high)) => 0.5 * (low + high),
            _ => DVec3::from(scene.camera.eye),
        };
        let back = DAffine3::from_translation(-origin);
        Self { origin, forms: forms.into_iter().map(|f| f.transformed(&back)).collect() }
    }

    /// Largest magnitude of a coordinate of things and eye.
    fn extent(&self, scene: &Scene) -> f64 {
        let eye = DVec3::from(scene.camera.eye) - self.origin;
        let things = self.forms.iter().filter_map(Form::bounds).map(|(l, h)| l.abs().max(h.abs()));
        things.fold(eye.abs(), DVec3::max).max_element()
    }
}

impl<L: SimdFloat> World<L> {
    /// Compiles a scene without faults.
    pub fn new(scene: &Scene) -> Self {
        Self::compile(scene, RecenteredGeometry::new(scene))
    }

    fn compile(scene: &Scene, placed: RecenteredGeometry) -> Self {
        let level = scene.trace.ray_types;
        let reflects = level == RayTypes::Full && scene.trace.max_depth > 0;
        let default = Material::default();
        let mut used: Vec<&Material> = Vec::new();
        let mut finish_of_object = Vec::new();
        for object in &scene.objects {
            let mut finish = |name: &str| {
                let material = scene.materials.get(name).unwrap_or(&default);
                let known = used.iter().position(|m| *m == material);
                if known.is_none() {
                    used.push(material);
                }
                known.unwrap_or(used.len() - 1) as u32
            };
            let parts = object.shape.part_materials(&object.material);
            finish_of_object.push(parts.into_iter().map(&mut finish).collect::<Vec<_>>());
        }
        let finishes: Vec<Bsdf<L::Scalar>> = used.iter().map(|m| Bsdf::new(m, reflects)).collect();
        let acceleration = scene.trace.acceleration;
        let geometry = Aggregate::accelerated(&placed.forms, acceleration);
        let finish_of: Vec<u32> =
            geometry.sources().iter().map(|item| finish_of_object[item.form][item.part]).collect();

        let of_part =
            |s: &crate::primitive::PrimitiveId| used[finish_of_object[s.form][s.part] as usize];
        let surface_textures =
            SurfaceTextures::new(scene, geometry.sources(), placed.origin, of_part);

        let lit = finishes.iter().any(|f| f.has_direct);
        let ambient = used.iter().any(|m| m.ambient > 0.0 && m.color.0 != [0.0; 3]);
        let groups = LightGroups::new(scene, lit, ambient);
        let extent = placed.extent(scene);
        let view = PinholeCamera::new(&scene.camera, scene.film.size, placed.origin);
        let materials_of = |form: usize| {
            finish_of_object[form].iter().map(|finish| used[*finish as usize]).collect()
        };
        let surroundings = radiance_range::SceneDistances::new(
            scene,
            &placed.forms,
            materials_of,
            &view,
            (extent, L::EPSILON),
        );
        let scales = groups.scales::<L::Scalar>(scene, placed.origin, &surroundings);
        let sources: Vec<_> = groups
            .lights(scene)
            .into_iter()
            .filter_map(|(light, group, weight)| {
                let lamp = DeltaLight::new(&scene.lights[light], placed.origin)?;
                let weight = (weight != [1.0; 3]).then(|| weight.map(L::Scalar::from_f64));
                let position = scene.lights[light].point.map(|p| DVec3::from(p.position));
                let on_surface = position.and_then(|position| {
                    let origin = placed.origin;
                    OnSurface::new(&placed.forms, position - origin, origin, L::EPSILON)
                });
                Some(LightSource { lamp, group, weight, on_surface })
            })
            .collect();
        let off_lamps = sources.iter().filter_map(|s| s.on_surface.as_ref());
        let off_lamps = off_lamps.map(OnSurface::farthest).fold(0.0, f64::max);
        let going_on = finishes.iter().any(|f| f.reflection.is_some() || f.transmission.is_some());
        let glossy = |f: &Bsdf<_>| matches!(f.reflection, Some((_, s)) if !matches!(s, ReflectionLobe::Mirror));
        let precision = if L::EPSILON > 1e-10 { "single" } else { "double" };
        let inventory = Inventory::new(
            scene,
            geometry.to_string(),
            &surface_textures.as_ref().map(SurfaceTextures::words).unwrap_or_default(),
            &finishes,
            &groups.members,
            sources.len(),
            precision,
        );
        // Rays that begin on the near plane may begin inside a thing.
        let eye = (scene.camera.near == 0.0).then(|| view.eye());
        let forms = || geometry.sources().iter().map(|s| &placed.forms[s.form]);
        let lamps: Vec<_> = sources.iter().map(|s| s.lamp).collect();
        let size = scene.film.size.map(|n| n as usize);
        let farthest =
            view.corners([0, 0], size).map(DVec3::length).into_iter().fold(0.0, f64::max);
        let begin = (view.eye(), scene.camera.near * farthest);
        let given = f64::EPSILON * placed.origin.abs().max_element();
        let nested_dielectrics = NestedDielectrics::new(
            &placed.forms,
            geometry.sources(),
            &finish_of,
            &finishes,
            begin,
            given,
        );
        let entered = nested_dielectrics
            .as_ref()
            .map_or(vec![false; finish_of.len()], NestedDielectrics::entered);
        let mut all_candidates = TileCandidates::all(&geometry, lamps.len());
        let mut light_buffers = Vec::new();
        let culling = match acceleration {
            Acceleration::Auto => {
                let of = FrustumCuller::new(forms().collect(), eye, &entered, (&lamps, off_lamps));
                all_candidates = of.candidates(&geometry, None);
                if geometry.has_tree() {
                    if level >= RayTypes::Shadows {
                        light_buffers = of.light_buffers(&geometry);
                    }
                    let things = geometry.in_tree().into_iter();
                    let seen = |item: u32| {
                        let source = geometry.sources()[item as usize];
                        (item, ScreenBounds::project(&placed.forms[source.form], &view))
                    };
                    CullingMode::ScreenGrid(ScreenGrid::new(size, things.map(seen)))
                } else {
                    CullingMode::Frusta(of)
                }
            }
            Acceleration::ScreenBounds => CullingMode::ScreenBounds(
                forms().map(|form| ScreenBounds::project(form, &view)).collect(),
            ),
            _ => CullingMode::Off,
        };
        let smooth = geometry.is_smooth()
            || surface_textures.as_ref().is_some_and(SurfaceTextures::is_bumped);
        let colored = geometry.is_colored()
            || surface_textures.as_ref().is_some_and(SurfaceTextures::is_colored);
        Self {
            all_candidates,
            light_buffers,
            culling,
            ambient: groups.find(&LightGroupSource::Ambient),
            background: (scene.background.color.0 != [0.0; 3])
                .then(|| groups.find(&LightGroupSource::Background))
                .flatten(),
            smooth,
            colored,
            simple: !smooth && !colored && geometry.has_no_tree(),
            surface_textures,
            shadows: level >= RayTypes::Shadows && !geometry.is_empty(),
            depth: if going_on { scene.trace.max_depth } else { 0 },
            min_weight: scene.trace.min_throughput,
            fold: scene.trace.below_horizon == BelowHorizon::Fold,
            view,
            names: groups.names(scene),
            jitter: scene.film.filter == Filter::Box,
            glossy: finishes.iter().any(glossy),
            biases: truncation_bias::truncation_bounds(scene),
            nested_dielectrics,
            geometry,
            bsdf_of: finish_of,
            bsdfs: finishes,
            sources,
            groups,
            scales,
            inventory,
        }
    }

    /// Number of light groups.
    pub fn groups(&self) -> usize {
        self.scales.len()
    }

    /// Steps per unit of radiance in the film's integers, per group.
    pub fn scales(&self) -> &[f64] {
        &self.scales
    }

    /// Whether samples move inside their pixel.
    pub fn jitter(&self) -> bool {
        self.jitter
    }

    /// Whether any surface has a glossy lobe.
    pub fn glossy(&self) -> bool {
        self.glossy
    }

    /// The camera.
    pub fn view(&self) -> &PinholeCamera {
        &self.view
    }

    /// What camera rays through a rectangle of the raster may meet; `None`: that is not ruled out here.
    pub fn candidates(&self, origin: [usize; 2], extent: [usize; 2]) -> Option<TileCandidates> {
        let lamps = self.sources.len();
        self.culling.candidates(&self.geometry, lamps, &self.view, (origin, extent))
    }

    /// Whether all camera rays that have this outlook meet nothing, and nothing is black.
    pub fn is_black(&self, candidates: &TileCandidates) -> bool {
        self.background.is_none() && candidates.primary.is_empty()
    }

    /// What it contains.
    pub fn inventory(&self) -> &Inventory {
        &self.inventory
    }
}

/// A world in the precision that the scene or the user asked for.
pub enum AnyWorld {
    /// Single precision.
    Single(World<Single>),
    /// Double precision.
    Double(World<Double>),
}

/// The same expression for either instance.
macro_rules! either {
    ($any:expr, $world:ident => $value:expr) => {
        match $any {
            AnyWorld::Single($world) => $value,
            AnyWorld::Double($world) => $value,
        }
    };
}

impl AnyWorld {
    /// Compiles a scene without faults.
    pub fn compile(scene: &Scene, options: &Options) -> Self {
        let placed = RecenteredGeometry::new(scene);
        let single = match options.precision {
            Precision::Single => true,
            Precision::Double => false,
            Precision::Auto => {
                let extent = placed.extent(scene);
                precision::single_suffices(scene, &placed.forms, placed.origin, extent)
            }
        };
        if single {
            Self::Single(World::compile(scene, placed))
        } else {
            Self::Double(World::compile(scene, placed))
        }
    }

    /// `single` or `double`.
    pub fn precision(&self) -> &'static str {
        match self {
            Self::Single(_) => "single",
            Self::Double(_) => "double",
        }
    }

    /// Name of the lane type.
    pub fn lanes(&self) -> &'static str {
        match self {
            Self::Single(_) => Single::NAME,
            Self::Double(_) => Double::NAME,
        }
    }

    /// A name for each light group.
    pub fn group_names(&self) -> Vec<String> {
        either!(self, w => w.names.clone())
    }

    /// The light groups.
    pub fn light_groups(&self) -> &LightGroups {
        either!(self, w => &w.groups)
    }

    /// What the camera sees through each of `points` of the raster (columns and rows in pixels, with
    /// fractions), into `seen` of the same length.
    pub fn first_hit(&self, points: &[[f64; 2]], seen: &mut [FirstHit]) {
        either!(self, w => w.first_hit(points, seen))
    }

    /// Steps per unit of radiance in the film's integers, per group: powers of two.
    pub fn group_scales(&self) -> Vec<f64> {
        either!(self, w => w.scales.clone())
    }

    /// Weight of each group in the picture of `scene`, which may differ from the compiled scene in
    /// colours, intensities and switches of lights.
    pub fn mix(&self, scene: &Scene) -> Vec<[f64; 3]> {
        either!(self, w => w.groups.mix(scene))
    }

    /// What it contains.
    pub fn inventory(&self) -> &Inventory {
        either!(self, w => &w.inventory)
    }

    /// What limits cut off, in words, one for each limit that does.
    pub fn biases(&self) -> Vec<String> {
        either!(self, w => w.biases.clone())
    }
}
