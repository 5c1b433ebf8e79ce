//! Compilation of a scene into a [`World`], step by step: geometry translated to the scene's
//! centre, materials, lights, transmission, culling.

use crate::analysis::inventory::inventory;
use crate::analysis::radiance_range::SceneDistances;
use crate::analysis::truncation_bias::{left_out, truncation_bounds};
use crate::any_world::Precision;
use crate::culling::screen_grid::{ScreenBounds, ScreenGrid};
use crate::culling::tile::{Culling, CullingMode, FrustumCuller, LightBounds, TileCandidates};
use crate::integrator::indirect_diffuse::{DiffuseLimits, MIN_WALK};
use crate::integrator::mirror_light::FlatMirror;
use crate::integrator::nested_dielectrics::{NestedDielectrics, may_reach};
use crate::integrator::surface_textures::SurfaceTextures;
use crate::lights::choice::LightChoice;
use crate::lights::emissive_sheets::{Emits, move_off_surfaces};
use crate::lights::emitters::{Emitters, ObjectGeometry};
use crate::lights::groups::{LightGroupSource, LightGroups};
use crate::lights::mirror_images::{MirrorFace, MirrorImages};
use crate::lights::on_surfaces::{OnSurface, WRITTEN};
use crate::world::{DeltaSource, EnvironmentSource, ShadowRayTarget, World, WorldInfo};
use glam::{DAffine3, DVec3};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use zerkalo_kernel::lanes::{Float, SimdFloat};
use zerkalo_kernel::primitive::{
    AccelerationStructure, Aggregate, BoundingSphere, F32_RAY_ERROR, Form, LightTarget, PrimitiveId,
};
use zerkalo_scene::camera::CompiledCamera;
use zerkalo_scene::light::{CompiledLight, DeltaLight, EmissiveSurface};
use zerkalo_scene::material::{Bsdf, Material};
use zerkalo_scene::{Acceleration, BelowHorizon, Filter, IntegratorSettings, RayTypes, Scene};

/// Geometry of all objects in double precision, relative to the scene's centre.
pub(crate) struct RecenteredGeometry {
    /// The scene's centre: that of the box around all bounded shapes, or else the eye.
    pub origin: DVec3,
    /// Canonical form of each object, with its transform applied.
    pub forms: Vec<Form>,
    /// Largest absolute coordinate, relative to `origin`, of the camera's lens and of all shapes
    /// with finite bounds.
    pub extent: f64,
    /// Number of the object of each form in the scene file.
    pub objects: Vec<u32>,
}

impl RecenteredGeometry {
    /// Returns `scene` without objects that are hidden, because a later one has their shape, place
    /// and material, and its geometry. Open transparent surfaces stay: each attenuates light.
    pub fn of_distinct(scene: &Scene) -> (Cow<'_, Scene>, Self) {
        let geometry = Self::new(scene);
        let transmits = |name| scene.materials.get(name).is_some_and(|m| m.transmission > 0.0);
        let mut last_at = HashMap::new();
        let is_hidden = |i: &usize| {
            let form = &geometry.forms[*i];
            let corners = form.bounds().map(|(low, high)| [low.to_array(), high.to_array()]);
            let bits = corners.map(|corners| corners.map(|corner| corner.map(f64::to_bits)));
            let last = *last_at.entry(bits).or_insert(*i);
            let [a, b] = [&scene.objects[last], &scene.objects[*i]];
            last != *i
                && (&a.shape, &a.transform, &a.material) == (&b.shape, &b.transform, &b.material)
                && (form.is_solid() || !a.materials().into_iter().any(transmits))
        };
        let hidden: HashSet<usize> = (0..geometry.forms.len()).rev().filter(is_hidden).collect();
        if hidden.is_empty() {
            return (Cow::Borrowed(scene), geometry);
        }
        let kept = || (0..geometry.forms.len()).filter(|i| !hidden.contains(i));
        let objects = kept().map(|i| scene.objects[i].clone()).collect();
        let forms = kept().map(|i| geometry.forms[i].clone()).collect();
        let numbers = kept().map(|i| i as u32).collect();
        let distinct = Scene { objects, ..scene.clone() };
        (Cow::Owned(distinct), Self { forms, objects: numbers, ..geometry })
    }

    pub fn new(scene: &Scene) -> Self {
        let forms: Vec<Form> = scene
            .objects
            .iter()
            .map(|object| object.shape.form().transformed(&object.scene_from_object()))
            .collect();
        let bounds = || forms.iter().filter_map(|form| form.bounds());
        let low = bounds().map(|b| b.0).reduce(DVec3::min);
        let high = bounds().map(|b| b.1).reduce(DVec3::max);
        let scene_eye = DVec3::from(scene.camera.eye);
        let origin = match (low, high) {
            (Some(low), Some(high)) => 0.5 * (low + high),
            _ => scene_eye,
        };
        let to_origin = DAffine3::from_translation(-origin);
        let forms: Vec<Form> = forms.into_iter().map(|f| f.transformed(&to_origin)).collect();
        let farthest_corners = forms
            .iter()
            .filter_map(|form| form.bounds())
            .map(|(low, high)| low.abs().max(high.abs()));
        let lens = (scene_eye - origin).abs() + DVec3::splat(scene.camera.lens_radius());
        let extent = farthest_corners.fold(lens, DVec3::max).max_element();
        let objects = (0..forms.len() as u32).collect();
        Self { origin, forms, extent, objects }
    }

    /// Returns the largest rounding error of the coordinates in the scene file.
    pub fn input_error(&self) -> f64 {
        f64::EPSILON * self.origin.abs().max_element()
    }
}

/// Distinct materials of a scene and their BSDFs.
struct CompiledMaterials<'a, S> {
    /// Distinct materials, in order of first use.
    materials: Vec<&'a Material>,
    bsdfs: Vec<Bsdf<S>>,
    /// Indices into `materials`, one for each part of each object.
    of_object: Vec<Vec<u32>>,
}

impl<'a, S: Float> CompiledMaterials<'a, S> {
    /// Compiles the materials of `scene`. `default` replaces names that the scene does not define.
    fn new(scene: &'a Scene, default: &'a Material) -> Self {
        let mut materials: Vec<&Material> = Vec::new();
        let mut index_of_name: HashMap<&'a str, u32> = HashMap::new();
        let mut index_of = |name: &'a str| {
            *index_of_name.entry(name).or_insert_with(|| {
                let material = scene.materials.get(name).unwrap_or(default);
                let known = materials.iter().position(|m| *m == material);
                if known.is_none() {
                    materials.push(material);
                }
                known.unwrap_or(materials.len() - 1) as u32
            })
        };
        let of_object = scene
            .objects
            .iter()
            .map(|object| {
                let parts = object.shape.part_materials(&object.material);
                parts.into_iter().map(&mut index_of).collect()
            })
            .collect();
        let reflects = scene.trace.ray_types == RayTypes::Full && scene.trace.max_depth > 0;
        let bsdfs = materials.iter().map(|material| Bsdf::new(material, reflects)).collect();
        Self { materials, bsdfs, of_object }
    }

    fn index(&self, primitive: &PrimitiveId) -> u32 {
        self.of_object[primitive.form][primitive.part]
    }

    fn of_parts(&self, object: usize) -> Vec<&'a Material> {
        self.of_object[object].iter().map(|index| self.materials[*index as usize]).collect()
    }

    /// Moves flat emissive objects off the opaque surfaces on which they lie. Returns `None` if no
    /// object is moved.
    fn move_emissive_sheets(
        &self,
        geometry: &RecenteredGeometry,
        eye: DVec3,
    ) -> Option<RecenteredGeometry> {
        let emits = |materials: &Vec<u32>| {
            let emissive = |index: &&u32| self.materials[**index as usize].emits();
            match materials.iter().find(emissive) {
                Some(index) if self.materials[*index as usize].two_sided => Emits::BothSides,
                Some(_) => Emits::Front,
                None => Emits::Nothing,
            }
        };
        let emits: Vec<Emits> = self.of_object.iter().map(emits).collect();
        if emits.iter().all(|emits| *emits == Emits::Nothing) {
            return None;
        }
        let transmits = |index: &u32| self.bsdfs[*index as usize].transmission.is_some();
        let of_object = self.of_object.iter();
        let transmits: Vec<bool> = of_object.map(|list| list.iter().any(transmits)).collect();
        move_off_surfaces(geometry, (&emits, &transmits), eye, emitter_lift::<S>(geometry))
    }

    fn has_direct(&self) -> bool {
        self.bsdfs.iter().any(|bsdf| bsdf.has_direct)
    }

    fn has_ambient(&self) -> bool {
        self.materials.iter().any(|m| m.ambient > 0.0 && m.color.0 != [0.0; 3])
    }

    /// Returns the limits of indirect diffuse light; `None` if the scene has none.
    fn diffuse_limits(&self, scene: &Scene) -> Option<DiffuseLimits> {
        let IntegratorSettings { max_diffuse_depth: depth, caustics, .. } = scene.trace;
        let is_diffuse = |m: &&Material| m.diffuse > 0.0 && m.color.0 != [0.0; 3];
        let traced = scene.trace.ray_types == RayTypes::Full && depth > 0;
        // Paths that transmit carry their media, which the queue does not hold.
        let walks = depth >= MIN_WALK && self.bsdfs.iter().all(|bsdf| bsdf.transmission.is_none());
        (traced && self.materials.iter().any(is_diffuse)).then_some(DiffuseLimits {
            depth,
            caustics,
            walks,
        })
    }

    fn has_secondary(&self) -> bool {
        self.bsdfs.iter().any(|bsdf| bsdf.reflection.is_some() || bsdf.transmission.is_some())
    }
}

/// Height by which lights with a size are moved off the surfaces that they touch. The unit is the
/// larger of two rounding errors: the error at the scene's extent, and the error of the coordinates
/// in the scene file. Rays that leave a surface start at about half this height, so that they can
/// hit the light.
const EMITTER_LIFT: f64 = 16.0;

/// Returns the height at which points are sampled above emissive objects, and by which lights with
/// a size are moved off the finite surfaces that they touch.
fn emitter_lift<S: Float>(geometry: &RecenteredGeometry) -> f64 {
    EMITTER_LIFT * (S::EPSILON * geometry.extent).max(geometry.input_error())
}

/// Largest distance by which [`light_lift`] moves a light that is a sphere or whose centre is on no
/// surface. The unit is the light's [`EmissiveSurface::thickness`].
const MAX_LIFT: f64 = 1e-4;

/// Returns the distance by which a light with the surface `surface` is moved off the surfaces that
/// it touches. On an infinite surface, which is no part of the scene's extent, the rounding error
/// of the light's own coordinates counts as well.
fn light_lift<S: Float>(geometry: &RecenteredGeometry, surface: &EmissiveSurface) -> f64 {
    let lift = emitter_lift::<S>(geometry);
    let center = surface.center() - geometry.origin;
    let largest = center.abs().max_element() + surface.radius();
    let lift_on_infinite = lift.max(EMITTER_LIFT * S::EPSILON * largest);
    let max_lift = MAX_LIFT * surface.thickness();
    // A sphere touches a flat surface at a single point, which is too small to see.
    if matches!(surface, EmissiveSurface::Sphere { .. }) {
        return lift.min(max_lift);
    }
    let lift_on = |form: &Form| {
        let (lift, size) = match form.bounds() {
            Some(_) => (lift, geometry.extent),
            None => (lift_on_infinite, geometry.extent.max(largest)),
        };
        let written = WRITTEN * size;
        if lift <= max_lift && lift >= written && form.bounds().is_some() {
            return None;
        }
        let distance = form.clearance(center)?;
        if distance <= lift { Some(lift) } else { (distance <= written).then_some(2.0 * written) }
    };
    let lifts = geometry.forms.iter().filter_map(lift_on);
    lifts.fold(lift.min(max_lift), f64::max)
}

/// Lights and emissive objects of a scene.
pub(super) struct CompiledLights<S> {
    /// Lights without a size to which all paths trace shadow rays.
    pub delta_lights: Vec<DeltaSource<S>>,
    /// Point and spot lights of which paths choose a few at each hit. `None` if shadow rays go to
    /// all lights.
    pub choice: Option<LightChoice<S>>,
    /// Lights with a size and emissive objects.
    pub emitters: Emitters<S>,
    pub environments: Vec<EnvironmentSource<S>>,
    /// Images of emitters towards which diffuse bounces go; `None` if there are none.
    pub mirror_images: Option<MirrorImages<S>>,
}

impl<S: Float> CompiledLights<S> {
    /// Compiles the lights in `groups`. Returns them, and each group's [scale](WorldInfo::scales).
    fn new(
        scene: &Scene,
        geometry: &RecenteredGeometry,
        materials: &CompiledMaterials<S>,
        primitives: &[PrimitiveId],
        camera: &CompiledCamera,
        groups: &LightGroups,
    ) -> (Self, Vec<f64>) {
        let materials_of = |object: usize| materials.of_parts(object);
        let distances = SceneDistances::new(scene, geometry, materials_of, camera, S::EPSILON);
        let (mut delta_lights, mut emitters, mut environments) =
            (Vec::new(), Vec::new(), Vec::new());
        let mut ranges = HashMap::new();
        for source in groups.sources(scene) {
            let LightGroupSource::Light(index) = *source.source else { continue };
            let light = &scene.lights[index];
            let lift = |surface: &EmissiveSurface| light_lift::<S>(geometry, surface);
            let Some(compiled) = light.compile(geometry.origin, lift) else { continue };
            ranges.insert(index, distances.light(&compiled, light.visible));
            match compiled {
                CompiledLight::Delta(delta) => {
                    let on_surface = light.apex().and_then(|position| {
                        let position = position - geometry.origin;
                        OnSurface::new(&geometry.forms, position, geometry.origin, S::EPSILON)
                    });
                    let target = ShadowRayTarget { light: delta, on_surface };
                    delta_lights.push(source.with_light(target, light.visible));
                }
                CompiledLight::Emitter(emitter) => {
                    emitters.push(source.with_light(Some(emitter), light.visible));
                }
                CompiledLight::Environment(sky) => {
                    environments.push(source.with_light(sky, light.visible));
                }
            }
        }
        let scales = groups.scales::<S>(scene, &ranges, &distances);
        let choice = LightChoice::take(&mut delta_lights, &groups.many, geometry.extent);
        let start = start_region(scene, camera);
        let is_entered = |form: usize| {
            let transmits = |index: &u32| materials.bsdfs[*index as usize].transmission.is_some();
            materials.of_object[form].iter().any(transmits)
                || may_reach(&start, &geometry.forms[form])
        };
        let objects = ObjectGeometry {
            scene,
            forms: &geometry.forms,
            primitives,
            lift: emitter_lift::<S>(geometry),
            is_entered: &is_entered,
        };
        let emitters = Emitters::new(emitters, &objects, groups);
        let faces = |id: &PrimitiveId| {
            let material = materials.materials[materials.index(id) as usize];
            MirrorFace::all_of(&geometry.forms[id.form], material)
        };
        let mirror_images = materials.diffuse_limits(scene).filter(|limits| limits.caustics);
        let mirror_images = mirror_images.and_then(|_| {
            let faces: Vec<MirrorFace> = primitives.iter().flat_map(faces).collect();
            MirrorImages::new(&faces, &emitters.outlines())
        });
        (Self { delta_lights, choice, emitters, environments, mirror_images }, scales)
    }

    /// Returns `true` if there are lights with a size, environment lights or emissive objects.
    #[inline(always)]
    pub fn has_emitters(&self) -> bool {
        !self.emitters.is_empty() || !self.environments.is_empty()
    }

    /// Returns the bounds of the lights, for each of which culling lists the possible occluders.
    fn bounds(&self) -> LightBounds {
        let vector = |v: &[S; 3]| DVec3::from(v.map(S::to_f64));
        let target_of = |source: &DeltaSource<S>| match &source.light.light {
            DeltaLight::Point { position, .. } => LightTarget::point(vector(position)),
            DeltaLight::Directional { wi } => LightTarget::Direction(vector(wi)),
        };
        let on_surfaces = self.delta_lights.iter().filter_map(|s| s.light.on_surface.as_ref());
        LightBounds {
            delta_lights: self.delta_lights.iter().map(target_of).collect(),
            max_end_offset: on_surfaces.map(OnSurface::farthest).fold(0.0, f64::max),
            emitters: self.emitters.balls().into_iter().map(LightTarget::Ball).collect(),
            strata: self
                .choice
                .iter()
                .flat_map(LightChoice::balls)
                .map(LightTarget::Ball)
                .collect(),
        }
    }
}

/// Returns the clear flat mirrors among the primitives, for `mirror_light`.
fn flat_mirrors<S: Float>(
    geometry: &RecenteredGeometry,
    primitives: &[PrimitiveId],
    materials: &CompiledMaterials<S>,
    lift: f64,
) -> Vec<FlatMirror<S>> {
    let faces = |(primitive, id): (u32, &PrimitiveId)| {
        let material = materials.materials[materials.index(id) as usize];
        let faces = MirrorFace::all_of(&geometry.forms[id.form], material).into_iter();
        faces
            .filter(|face| face.is_clear() && material.bump.is_none())
            .map(move |face| FlatMirror::new(primitive, &face, lift))
    };
    (0..).zip(primitives).flat_map(faces).collect()
}

/// Compiles the method that finds the candidates of rays.
fn culling<L: SimdFloat>(
    scene: &Scene,
    recentered: &RecenteredGeometry,
    geometry: &Aggregate<L>,
    camera: &CompiledCamera,
    lights: LightBounds,
    outside_only: &[bool],
) -> Culling<L::Scalar> {
    let mut all_candidates = TileCandidates::all(geometry, &lights);
    let mut light_buffers = Vec::new();
    let form_of = |primitive: &PrimitiveId| &recentered.forms[primitive.form];
    let forms = || geometry.sources.iter().map(form_of);
    let mode = match scene.trace.acceleration {
        Acceleration::Auto => {
            let culler = FrustumCuller::new(forms().collect(), outside_only, lights);
            all_candidates = culler.candidates(geometry, None);
            if geometry.has_bvh() {
                if scene.trace.ray_types >= RayTypes::Shadows {
                    light_buffers = culler.light_buffers(geometry);
                }
                let project = |primitive: u32| {
                    let form = form_of(&geometry.sources[primitive as usize]);
                    (primitive, ScreenBounds::project(form, camera))
                };
                let bounds = geometry.in_bvh().into_iter().map(project);
                let size = scene.film.size.map(|n| n as usize);
                CullingMode::ScreenGrid(ScreenGrid::new(size, bounds))
            } else if camera.is_panorama() {
                CullingMode::Off
            } else {
                CullingMode::Frusta(culler)
            }
        }
        Acceleration::ScreenBounds => CullingMode::ScreenBounds(
            forms().map(|form| ScreenBounds::project(form, camera)).collect(),
        ),
        Acceleration::None | Acceleration::Obb | Acceleration::Aabb | Acceleration::Bvh => {
            CullingMode::Off
        }
    };
    Culling { mode, all_candidates, light_buffers }
}

/// Returns for each primitive whether it is a convex solid that rays hit only from outside. Paths
/// are inside a solid only if they start there or are transmitted. `start` is a sphere around
/// the origins of camera rays.
fn outside_only<L: SimdFloat>(
    forms: &[Form],
    primitives: &[PrimitiveId],
    start: &BoundingSphere,
    nested_dielectrics: Option<&NestedDielectrics<L>>,
) -> Vec<bool> {
    let is_outside_only = |(primitive, id): (usize, &PrimitiveId)| {
        let form = &forms[id.form];
        let is_entered = nested_dielectrics.is_some_and(|nested| nested.is_entered(primitive));
        let may_contain_start = form.bounding_sphere().overlaps(start);
        form.is_convex() && form.is_solid() && !is_entered && !may_contain_start
    };
    primitives.iter().enumerate().map(is_outside_only).collect()
}

/// Compiles `forms`, with the acceleration structure that the scene selects.
fn aggregate<L: SimdFloat>(scene: &Scene, forms: &[Form]) -> Aggregate<L> {
    let structure = match scene.trace.acceleration {
        Acceleration::Auto => AccelerationStructure::fastest(forms),
        Acceleration::None => AccelerationStructure::List("bare list"),
        Acceleration::ScreenBounds => AccelerationStructure::List("screen rectangles"),
        Acceleration::Obb => AccelerationStructure::Boxes { oriented: true },
        Acceleration::Aabb => AccelerationStructure::Boxes { oriented: false },
        Acceleration::Bvh => AccelerationStructure::Bvh,
    };
    Aggregate::with_structure(forms, structure)
}

/// Returns a sphere around the eye that contains the lens and every start point on the near plane.
fn start_region(scene: &Scene, camera: &CompiledCamera) -> BoundingSphere {
    let size = scene.film.size.map(|n| n as usize);
    let corner_distances = camera.corners([0, 0], size).map(DVec3::length);
    let farthest_corner = corner_distances.into_iter().fold(0.0, f64::max);
    let near = scene.camera.near;
    let lens = camera.lens.map_or(0.0, |lens| {
        // The radius includes a margin for rounding errors of ray origins on the lens.
        let error = F32_RAY_ERROR * (lens.radius + camera.eye.abs().max_element());
        lens.blur(near) + error
    });
    BoundingSphere { center: camera.eye, radius: near * farthest_corner + lens }
}

impl<L: SimdFloat> World<L> {
    /// Compiles `scene`, which must have no validation errors.
    pub fn new(scene: &Scene) -> Self {
        let (scene, geometry) = RecenteredGeometry::of_distinct(scene);
        Self::compile(&scene, &geometry, false)
    }

    pub(super) fn compile(
        scene: &Scene,
        recentered: &RecenteredGeometry,
        merge_lights: bool,
    ) -> Self {
        let default_material = Material::default();
        let camera = CompiledCamera::new(&scene.camera, scene.film.size, recentered.origin);
        let materials = CompiledMaterials::new(scene, &default_material);
        let moved = materials.move_emissive_sheets(recentered, camera.eye);
        let recentered = moved.as_ref().unwrap_or(recentered);
        let reflected = (materials.has_direct(), materials.has_ambient());
        let groups = LightGroups::new(scene, reflected, merge_lights);
        let mut world = Self::from_parts(scene, recentered, camera, materials, groups);
        world.info.inventory = inventory(scene, &world);
        world
    }

    /// Compiles everything that depends on the geometry: lights, transmission, culling. The
    /// inventory stays empty.
    fn from_parts(
        scene: &Scene,
        recentered: &RecenteredGeometry,
        camera: CompiledCamera,
        materials: CompiledMaterials<L::Scalar>,
        groups: LightGroups,
    ) -> Self {
        let geometry = aggregate(scene, &recentered.forms);
        let primitives = &geometry.sources;
        let bsdf_of: Vec<u32> = primitives.iter().map(|id| materials.index(id)).collect();
        let textures = SurfaceTextures::new(scene, primitives, recentered.origin, |id| {
            materials.materials[materials.index(id) as usize]
        });
        let (lights, scales) =
            CompiledLights::new(scene, recentered, &materials, primitives, &camera, &groups);
        let start = start_region(scene, &camera);
        let nested_dielectrics =
            NestedDielectrics::new(recentered, primitives, &bsdf_of, &materials.bsdfs, &start);
        let nested = nested_dielectrics.as_ref();
        let outside_only = outside_only(&recentered.forms, primitives, &start, nested);
        let lift = emitter_lift::<L::Scalar>(recentered);
        let mirrors = match scene.trace.mirror_light && scene.trace.ray_types == RayTypes::Full {
            true => flat_mirrors(recentered, primitives, &materials, lift),
            false => Vec::new(),
        };
        let bounds = lights.bounds();
        let culling = culling(scene, recentered, &geometry, &camera, bounds, &outside_only);
        let smooth = geometry.is_smooth() || textures.is_bumped();
        let colored = geometry.is_colored() || textures.is_colored();
        let has_background = scene.background.color.0 != [0.0; 3];
        Self {
            smooth,
            colored,
            simple: !smooth
                && !colored
                && mirrors.is_empty()
                && !lights.has_emitters()
                && geometry.is_plain_list(),
            surface_textures: textures,
            shadows: scene.trace.ray_types >= RayTypes::Shadows && !geometry.is_empty(),
            depth: if materials.has_secondary() { scene.trace.max_depth } else { 0 },
            diffuse_limits: materials.diffuse_limits(scene),
            min_throughput: scene.trace.min_throughput,
            fold: scene.trace.below_horizon == BelowHorizon::Fold,
            mirrors,
            nested_dielectrics,
            geometry,
            objects: recentered.objects.clone(),
            outside_only,
            bsdf_of,
            bsdfs: materials.bsdfs,
            turned: None,
            ambient: groups.find(&LightGroupSource::Ambient),
            background: groups.find(&LightGroupSource::Background).filter(|_| has_background),
            info: WorldInfo {
                groups,
                scales,
                precision: Precision::of::<L>(),
                lanes: L::NAME,
                light_period: lights.choice.as_ref().map_or(1, |choice| choice.sets as u32),
                inventory: String::new(),
                biases: truncation_bounds(scene),
                left_out: left_out(scene),
                primitives: recentered.forms.iter().map(|f| f.triangles().max(1) as u64).sum(),
            },
            lights,
            culling,
            camera,
            jitter: scene.film.filter == Filter::Box,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::lanes::Single;

    /// Checks that of equal objects the last one remains, and all panes, and that hits have the
    /// numbers of the scene file.
    #[test]
    fn equal_objects_are_compiled_once() {
        let count = |keys: &str, shape: &str| {
            let object = format!("[[object]]\nmaterial = \"a\"\nshape.{shape}\n");
            let other = "[[object]]\nshape.sphere = { center = [9, 0, 0], radius = 1 }\n";
            let text = format!(
                "ambient.color = [1, 1, 1]\n[materials.a]\n{keys}\n{}{other}",
                object.repeat(100)
            );
            let world = World::<Single>::new(&Scene::parse(&text, "test").unwrap());
            assert_eq!(world.objects[world.objects.len() - 2..], [99, 100]);
            world.geometry.sources.len() - 1
        };
        let sphere = "sphere = { center = [0, 0, 0], radius = 1 }";
        let platform = "platform = { center = [0, 0, 0], size = [1, 1] }";
        let plane = "plane = { point = [0, 0, 0], normal = [0, 1, 0] }";
        let glass = "transmission = 0.9\ndiffuse = 0.0";
        for keys in ["color = [1, 0, 0]", "emission = 1.0", glass] {
            let sheets = if keys == glass { 100 } else { 1 };
            let counts = [sphere, platform, plane].map(|shape| count(keys, shape));
            assert_eq!(counts, [1, sheets, sheets], "{keys}");
        }
    }
}
