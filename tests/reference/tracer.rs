//! Reference path tracer in double precision. It traces one sample at a time and is optimised for
//! readability.

use crate::harness::*;
use crate::reference::compounds::{Body, Leaf, Meeting};
use crate::reference::emission::Shine;
use crate::reference::lamps::Lamp;
use crate::reference::meshes;
use crate::reference::paint::Pixels;
use crate::reference::reflection::{highlight, reflect, reflects_highlight, wide_lobe};
use crate::reference::transmission::{Way, medium};
use std::sync::LazyLock;

/// Deliberate error of the reference tracer that the comparison has to detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mutation {
    /// No deliberate error.
    None,
    WiderLobe,
    /// The densities of lobes are overestimated by 5 %.
    LobeDensity,
    /// Shadow rays start 1e-3 scene units too far towards the light.
    ShadowOffset,
    /// Lobe directions below the horizon are absorbed.
    Absorb,
    /// For the first light, the cosine at the lit surface is omitted.
    NoCosine,
    /// The intensity of a spot light falls linearly, instead of by a smoothstep, from the inner to
    /// the outer cone.
    LinearCone,
    /// Light that enters a solid is not refracted.
    NoBending,
    /// Texture coordinates u and v are exchanged.
    SidewaysTexture,
    /// Shadow rays start on the triangles of smooth meshes.
    Unlifted,
    /// Bump heights are negated.
    SunkenBumps,
    /// Diffuse bounces are distributed uniformly over the hemisphere.
    UniformBounce,
    /// Ambient light is also added at diffuse bounces.
    AmbientTwice,
    /// Points of the lens are distributed over the square around it.
    SquareLens,
    /// Rays through the lens keep the direction of the ray through its centre.
    UnfocusedLens,
    /// Refracted rays have the density of the microfacet normals, without Jacobian.
    NoJacobian,
    /// The Jacobian of the half vector of refraction contains the index of the incident side
    /// instead of the transmitted side.
    OtherIndex,
    /// Absorption is computed for half of the distance.
    HalfAbsorption,
    /// The cosine at the surface of a lamp is omitted.
    NoLampCosine,
    /// The cosine at the surface of an emissive object is omitted.
    NoEmissionCosine,
    /// Rays that miss all surfaces do not see environments.
    NoSky,
    /// Reflected rays also see lamps whose reflected light was already found at sampled points of
    /// the lamp. The results of two sampling techniques are thus added without weights.
    LampSeenTwice,
}

/// Reference tracer of a scene.
pub struct Tracer<'a> {
    pub scene: &'a Scene,
    pub bodies: Vec<Body>,
    /// Lamp of each light of the scene; `None` for a light without a size.
    lamps: Vec<Option<Lamp>>,
    /// Emissive surface of each body; `None` for a body from which no points are sampled.
    shines: Vec<Option<Shine>>,
    /// Transmitting material of each body; `None` for an opaque body and for a surface without a
    /// volume.
    pub media: Vec<Option<&'a Material>>,
    /// Images of textures and bump maps, by file name.
    pub images: HashMap<String, Pixels>,
    /// Materials of the simple shapes of each body.
    pub materials: Vec<Vec<&'a Material>>,
    /// `true` if some material absorbs light.
    pub absorbs: bool,
    pub mutation: Mutation,
}

/// Material of objects that name none.
static PLAIN: LazyLock<Material> = LazyLock::new(Material::default);

/// Mean of one pixel's samples, and variance of this mean.
#[derive(Clone, Copy, Default)]
pub struct Estimate {
    pub mean: DVec3,
    pub variance: DVec3,
}

pub struct Hit<'a> {
    pub point: DVec3,
    /// Unit geometric normal on the viewer's side.
    pub normal: DVec3,
    /// Shading normal. It differs from the geometric normal on smooth meshes and with bump maps.
    pub seen: DVec3,
    /// Point from which lights are seen, above the hit point on convex smooth meshes.
    pub lifted: DVec3,
    /// Factor of the albedo: vertex colour times texture.
    pub tint: DVec3,
    pub material: &'a Material,
    /// Index of the body that is hit.
    pub body: usize,
    /// `true` if the ray hits the outside of a solid, or the front of a flat surface.
    pub front: bool,
    /// `true` if the ray hits the back of a one-sided surface.
    pub bare: bool,
}

impl Hit<'_> {
    /// Returns `true` if the triangle that is hit hides lights in the direction `towards` without a
    /// shadow ray.
    fn is_behind(&self, towards: DVec3) -> bool {
        self.lifted == self.point && self.normal.dot(towards) <= 0.0
    }
}

impl<'a> Tracer<'a> {
    /// Creates the reference tracer of `scene` with the deliberate error `mutation`.
    ///
    /// # Errors
    ///
    /// Names a feature of the scene that this tracer does not support.
    pub fn new(scene: &'a Scene, mutation: Mutation) -> Result<Self, String> {
        let bodies = scene.objects.iter().map(Body::new).collect::<Result<Vec<_>, _>>()?;
        let images = HashMap::new();
        let lamps = scene.lights.iter().map(Lamp::new).collect();
        let shines = bodies.iter().map(Shine::new).collect();
        let media = bodies.iter().map(|body| medium(scene, body)).collect();
        let material = |leaf: &Leaf| scene.materials.get(&leaf.material).unwrap_or(&*PLAIN);
        let materials =
            bodies.iter().map(|body| body.leaves.iter().map(material).collect()).collect();
        let absorbs = scene.materials.values().any(|m| m.attenuation_color != Color::WHITE);
        let mut tracer =
            Self { scene, bodies, lamps, shines, media, images, materials, absorbs, mutation };
        if scene.trace.mirror_light {
            return Err("light that mirrors throw".to_string());
        }
        if scene.lights.iter().any(|l| l.environment().is_some_and(|e| e.file().is_some())) {
            return Err("an image around the scene".to_string());
        }
        for material in scene.materials.values() {
            unknown_keys(material)?;
            tracer.open_images(material)?;
        }
        for (body, materials) in tracer.bodies.iter().zip(&tracer.materials) {
            if body.is_mesh() && materials[0].transmission > 0.0 {
                return Err("a mesh that lets light through".to_string());
            }
        }
        let no_shadows = scene.trace.ray_types == RayTypes::Primary;
        if no_shadows && scene.materials.values().any(Material::emits) {
            return Err("emission without shadows".to_string());
        }
        Ok(tracer)
    }

    /// Returns `true` if the scene is slow to trace: it has meshes, whose boxes of triangles are
    /// tested one by one.
    pub fn is_slow(&self) -> bool {
        self.bodies.iter().any(Body::is_mesh)
    }

    /// Estimates the radiance of the pixel in column `x` and row `y` from `samples` samples.
    pub fn pixel(&self, x: u32, y: u32, samples: u32, numbers: &mut Numbers) -> Estimate {
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..samples {
            let value = self.sample(x, y, numbers);
            sum += value;
            squares += value * value;
        }
        let n = f64::from(samples);
        let mean = sum / n;
        let spread = (squares / n - mean * mean).max(DVec3::ZERO);
        Estimate { mean, variance: spread / (n - 1.0) }
    }

    fn sample(&self, x: u32, y: u32, numbers: &mut Numbers) -> DVec3 {
        let (dx, dy) = match self.scene.film.filter {
            Filter::Box => (numbers.unit(), numbers.unit()),
            Filter::Point => (0.5, 0.5),
        };
        let (origin, direction) = self.camera_ray(f64::from(x) + dx, f64::from(y) + dy, numbers);
        self.radiance(origin, direction, 0, numbers)
    }

    /// Returns the radiance along a ray that starts after `diffuse` diffuse bounces.
    fn radiance(
        &self,
        mut origin: DVec3,
        mut direction: DVec3,
        diffuse: u32,
        numbers: &mut Numbers,
    ) -> DVec3 {
        let trace = &self.scene.trace;
        let max_depth = if diffuse > 0 && !trace.caustics { 0 } else { trace.max_depth };
        let mut weight = DVec3::ONE;
        let mut radiance = DVec3::ZERO;
        // `false` after a surface at which the light of lamps was found by sampling points of the
        // lamps: after a diffuse bounce, or after a wide lobe.
        let mut sees_lamps = diffuse == 0;
        // `false` after a diffuse bounce, because the direct light at the surface already contains
        // the light of environments.
        let mut sees_sky = diffuse == 0;
        for bounce in 0.. {
            let hit = self.meet(origin, direction);
            let end = hit.as_ref().map_or(f64::INFINITY, |hit| hit.point.distance(origin));
            // Lamps are added before absorption, because they are outside of absorbing solids.
            if sees_lamps || self.mutation == Mutation::LampSeenTwice {
                radiance += weight * self.glow(origin, direction, end);
            }
            weight *= self.transmittance(origin, hit.as_ref().map(|hit| hit.point), direction);
            let mut own = DVec3::ZERO;
            let Some(hit) = hit else {
                let sky = if sees_sky { self.sky(direction) } else { DVec3::ZERO };
                return radiance + weight * (sky + DVec3::from(self.scene.background.color.0));
            };
            // After a diffuse bounce, the emission of a body is added only if no points of the body
            // are sampled. Otherwise the direct light at the previous surface already contains it.
            if !hit.bare && (sees_sky || self.shines[hit.body].is_none()) {
                own = DVec3::from(hit.material.emitted());
            }
            let before = (sees_lamps, sees_sky);
            (sees_lamps, sees_sky) = (true, true);
            let through = trace.ray_types == RayTypes::Full && hit.material.transmission > 0.0;
            if through && trace.max_depth > 0 {
                let way = self.through(&hit, direction, numbers);
                if matches!(way, Way::On(_)) && !hit.bare {
                    radiance += weight * own;
                    radiance += weight * self.lit(&hit, -direction, diffuse, numbers);
                }
                let next = match way {
                    Way::Straight => Some((direction, DVec3::ONE)),
                    Way::On(next) => next,
                };
                let Some((next, factor)) = next.filter(|_| bounce < max_depth) else {
                    return radiance;
                };
                weight *= factor;
                // Light that a pane lets through reaches the surface before it by shadow rays.
                if next == direction && self.is_clear_pane(hit.body) {
                    (sees_lamps, sees_sky) = before;
                }
                (origin, direction) = (hit.point, next);
                continue;
            }
            if hit.bare {
                return radiance;
            }
            radiance += weight * own;
            radiance += weight * self.lit(&hit, -direction, diffuse, numbers);
            let reflects = hit.material.reflection > 0.0 && trace.ray_types == RayTypes::Full;
            if !reflects || bounce == max_depth {
                return radiance;
            }
            let lamps_in_lobe = self.lamps_in_lobe(&hit, -direction, numbers);
            radiance += weight * lamps_in_lobe.unwrap_or_default();
            sees_lamps = lamps_in_lobe.is_none();
            let turned = reflect(
                hit.material,
                hit.seen,
                -direction,
                trace.below_horizon,
                self.mutation,
                numbers,
            );
            let Some((mut next, factor)) = turned else { return radiance };
            // Directions into the surface are mirrored out of it.
            next -= 2.0 * next.dot(hit.normal).min(0.0) * hit.normal;
            weight *= factor;
            if weight.max_element() <= 0.0 || weight.max_element() < trace.min_throughput {
                return radiance;
            }
            (origin, direction) = (hit.point, next);
        }
        unreachable!("the depth ends every path");
    }

    /// Returns the camera ray through a random point of the lens and the point `x`, `y` of the
    /// picture, in pixels from its upper left corner.
    pub fn camera_ray(&self, x: f64, y: f64, numbers: &mut Numbers) -> (DVec3, DVec3) {
        let camera = &self.scene.camera;
        let eye = DVec3::from(camera.eye);
        let forward = match (camera.target, camera.direction) {
            (Some(target), _) => DVec3::from(target) - eye,
            (_, Some(direction)) => DVec3::from(direction),
            (None, None) => panic!("a camera looks somewhere"),
        }
        .normalize();
        let right = forward.cross(DVec3::from(camera.up)).normalize();
        let up = right.cross(forward);
        let [width, height] = self.scene.film.size.map(f64::from);
        if camera.projection == Projection::Equirectangular {
            let (azimuth, polar) = (TAU * (x / width - 0.5), PI * y / height);
            let level = right * azimuth.sin() + forward * azimuth.cos();
            return (eye, level * polar.sin() + up * polar.cos());
        }
        let pixel = match camera.view_angle {
            ViewAngle::Vertical(degrees) => 2.0 * (0.5 * degrees).to_radians().tan() / height,
            ViewAngle::Horizontal(degrees) => 2.0 * (0.5 * degrees).to_radians().tan() / width,
        };
        let toward =
            forward + right * ((x - 0.5 * width) * pixel) - up * ((y - 0.5 * height) * pixel);
        let radius = match camera.aperture {
            None => 0.0,
            Some(Aperture::Radius(radius)) => radius,
            Some(Aperture::FNumber(number)) => {
                // The f-number belongs to a film of 36 x 24 mm that the camera sees under its view
                // angle.
                let (film, pixels) = match camera.view_angle {
                    ViewAngle::Vertical(_) => (0.024, height),
                    ViewAngle::Horizontal(_) => (0.036, width),
                };
                let focal_length = film / (pixels * pixel);
                0.5 * focal_length / number
            }
        };
        if radius == 0.0 {
            return (eye + toward * camera.near, toward.normalize());
        }
        let ahead = |point: [f64; 3]| (DVec3::from(point) - eye).dot(forward);
        let focus = match (camera.focus, camera.target) {
            (Some(Focus::Distance(distance)), _) => distance,
            (Some(Focus::Point(point)), _) | (None, Some(point)) => ahead(point),
            (None, None) => panic!("a lens has a focus"),
        };
        let on_lens = loop {
            let [a, b] = [numbers.between(-1.0, 1.0), numbers.between(-1.0, 1.0)];
            if a * a + b * b <= 1.0 || self.mutation == Mutation::SquareLens {
                break right * (a * radius) + up * (b * radius);
            }
        };
        // All rays through the same point of the picture meet in a point of the plane in focus.
        let mut onward = eye + toward * focus - (eye + on_lens);
        if self.mutation == Mutation::UnfocusedLens {
            onward = toward * focus;
        }
        (eye + on_lens + onward * (camera.near / focus), onward.normalize())
    }

    /// Returns the smallest distance of hits from the ray origin `origin`. It is larger than the
    /// rounding error of the origin's coordinates.
    fn clearance(origin: DVec3) -> f64 {
        1e-10 * (1.0 + origin.abs().max_element())
    }

    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Option<Hit<'_>> {
        let from = Self::clearance(origin);
        let mut nearest: Option<(Meeting, usize)> = None;
        for (i, body) in self.bodies.iter().enumerate() {
            let end = nearest.map_or(f64::INFINITY, |((t, ..), _)| t);
            nearest = body.meet(origin, direction, from, end).map(|hit| (hit, i)).or(nearest);
        }
        let ((t, normal, leaf, facet), i) = nearest?;
        let material = self.materials[i][leaf];
        let leaf = &self.bodies[i].leaves[leaf];
        let front = normal.dot(direction) < 0.0;
        let (point, normal) = (origin + direction * t, if front { normal } else { -normal });
        let smooth = leaf.smooth(facet, point);
        let mut seen = smooth.map_or(normal, |smooth| meshes::seen(smooth, normal, direction));
        let outward = if front { 1.0 } else { -1.0 };
        let spot = leaf.spot(facet, point, normal * outward);
        if material.bump.is_some() {
            let raised = self.raised(material, &spot, leaf.own_normal(seen * outward));
            seen = meshes::seen(leaf.scene_normal(raised) * outward, normal, direction);
        }
        Some(Hit {
            point,
            normal,
            seen,
            lifted: match self.mutation {
                Mutation::Unlifted => point,
                _ => leaf.lifted(facet, point, normal),
            },
            tint: leaf.color(facet) * self.painted(material, &spot),
            material,
            body: i,
            front,
            bare: !front && !material.two_sided,
        })
    }

    /// Returns the radiance of the visible lamps that a ray reaches before the distance `end`.
    fn glow(&self, origin: DVec3, direction: DVec3, end: f64) -> DVec3 {
        let lamps = self.scene.lights.iter().zip(&self.lamps).filter(|(l, _)| l.on && l.visible);
        let seen = lamps.filter_map(|(light, lamp)| {
            let lamp = lamp.as_ref()?;
            // A lamp in the plane of a surface counts as in front of the surface.
            let t = lamp.meet(origin, direction)? * (1.0 - 1e-9);
            let radiance = lamp.radiance(light.unit) * light.intensity;
            (t < end).then_some(DVec3::from(light.color.0) * radiance)
        });
        seen.sum()
    }

    /// Returns the light that a wide lobe reflects from the visible lamps, estimated at one sampled
    /// point of each lamp. Returns `None` if reflected rays find the lamps instead.
    fn lamps_in_lobe(&self, hit: &Hit, view: DVec3, numbers: &mut Numbers) -> Option<DVec3> {
        let (m, horizon) = (hit.material, self.scene.trace.below_horizon);
        if hit.seen != hit.normal {
            return None;
        }
        let lamps = self.scene.lights.iter().zip(&self.lamps).filter(|(l, _)| l.on && l.visible);
        let mut sum = DVec3::ZERO;
        wide_lobe(m, hit.seen, view, hit.seen, horizon)?;
        for (light, lamp) in lamps.filter_map(|(light, lamp)| Some((light, lamp.as_ref()?))) {
            let Some((towards, distance, irradiance)) =
                lamp.sample(hit.point, self.mutation, numbers)
            else {
                continue;
            };
            let distance = distance * (1.0 - 1e-9);
            let passed = self.passed(hit.point, towards, distance);
            if hit.normal.dot(towards) <= 0.0 || passed == 0.0 {
                continue;
            }
            let value = wide_lobe(m, hit.seen, view, towards, horizon)?;
            let radiance = light.intensity * lamp.radiance(light.unit) * passed;
            sum += value * DVec3::from(light.color.0) * (radiance * irradiance);
        }
        Some(sum)
    }

    /// Returns the radiance of the visible environments in a direction.
    fn sky(&self, direction: DVec3) -> DVec3 {
        if self.mutation == Mutation::NoSky {
            return DVec3::ZERO;
        }
        let visible = self.scene.lights.iter().filter(|light| light.on && light.visible);
        visible.map(|light| sky(light, direction)).sum()
    }

    /// Returns the reflected direct light plus the light of one more diffuse bounce. `diffuse` is
    /// the number of diffuse bounces before the hit `hit`.
    fn lit(&self, hit: &Hit, view: DVec3, diffuse: u32, numbers: &mut Numbers) -> DVec3 {
        let trace = &self.scene.trace;
        let albedo = DVec3::from(hit.material.color.0) * hit.tint * hit.material.diffuse;
        let bounces = trace.ray_types == RayTypes::Full
            && diffuse < trace.max_diffuse_depth
            && albedo.max_element() > 0.0;
        let mut sum =
            self.shade(hit, view, !bounces || self.mutation == Mutation::AmbientTwice, numbers);
        if bounces {
            // The direction from the hit to a uniform point of the unit sphere that touches the
            // surface there is cosine-distributed.
            let mut onward = (hit.seen + numbers.direction()).normalize_or(hit.seen);
            if self.mutation == Mutation::UniformBounce {
                onward = numbers.direction();
                onward *= onward.dot(hit.seen).signum();
            }
            if onward.dot(hit.normal) > 0.0 {
                sum += albedo * self.radiance(hit.point, onward, diffuse + 1, numbers);
            }
        }
        sum
    }

    /// Returns the reflected direct light of all lights, with ambient light if `ambient` is `true`.
    fn shade(&self, hit: &Hit, view: DVec3, ambient: bool, numbers: &mut Numbers) -> DVec3 {
        let m = hit.material;
        let color = DVec3::from(m.color.0) * hit.tint;
        let ambient = if ambient { m.ambient } else { 0.0 };
        let mut sum = color * ambient * DVec3::from(self.scene.ambient.color.0);
        for (i, light) in self.scene.lights.iter().enumerate().filter(|(_, l)| l.on) {
            let is_sized = self.lamps[i].is_some() || light.environment().is_some();
            let (towards, distance, irradiance) = match &self.lamps[i] {
                None if light.environment().is_some() => {
                    // Uniform directions of the whole sphere.
                    let towards = numbers.direction();
                    (towards, f64::INFINITY, sky(light, towards) * (4.0 * PI))
                }
                None => arrival(light, hit.lifted, self.mutation),
                Some(lamp) => {
                    let Some(sample) = lamp.sample(hit.lifted, self.mutation, numbers) else {
                        continue;
                    };
                    let radiance = light.intensity * lamp.radiance(light.unit);
                    let irradiance = DVec3::from(light.color.0) * (radiance * sample.2);
                    (sample.0, sample.1 * (1.0 - 1e-9), irradiance)
                }
            };
            let mut cos = hit.seen.dot(towards);
            let behind = cos <= 0.0 || hit.is_behind(towards);
            let passed = if behind { 0.0 } else { self.passed(hit.lifted, towards, distance) };
            if passed == 0.0 {
                continue;
            }
            let irradiance = irradiance * passed;
            let is_reflected = light.visible && is_sized && reflects_highlight(m);
            let shine =
                if is_reflected { DVec3::ZERO } else { highlight(m, hit.seen, view, towards) };
            if i == 0 && self.mutation == Mutation::NoCosine {
                cos = 1.0;
            }
            sum += irradiance * (color * (m.diffuse * cos / PI) + shine);
        }
        for (materials, shine) in self.materials.iter().zip(&self.shines) {
            let Some(shine) = shine else { continue };
            let material = materials[0];
            if !material.emits() {
                continue;
            }
            let (point, normal, area) = shine.point(numbers);
            let distance = point.distance(hit.lifted);
            let towards = (point - hit.lifted) / distance;
            let mut cos_there = -normal.dot(towards);
            if material.two_sided {
                cos_there = cos_there.abs();
            }
            let cos = hit.seen.dot(towards);
            let behind = cos <= 0.0 || hit.is_behind(towards) || cos_there <= 0.0;
            let end = distance * (1.0 - 1e-9);
            let passed = if behind { 0.0 } else { self.passed(hit.lifted, towards, end) };
            if passed == 0.0 {
                continue;
            }
            if self.mutation == Mutation::NoEmissionCosine {
                cos_there = 1.0;
            }
            let irradiance = DVec3::from(material.emitted())
                * (passed * area * cos_there / (distance * distance));
            let shine = match reflects_highlight(m) {
                true => DVec3::ZERO,
                false => highlight(m, hit.seen, view, towards),
            };
            sum += irradiance * (color * (m.diffuse * cos / PI) + shine);
        }
        sum
    }

    /// Returns the fraction of light that reaches `point` from the direction `towards` and `distance`:
    /// clear panes let a part of it through, other bodies nothing.
    fn passed(&self, point: DVec3, towards: DVec3, distance: f64) -> f64 {
        if self.scene.trace.ray_types == RayTypes::Primary {
            return 1.0;
        }
        let offset = if self.mutation == Mutation::ShadowOffset { 1e-3 } else { 0.0 };
        let from = Self::clearance(point) + offset;
        let end = distance * (1.0 - 1e-12);
        let met = |i: usize| self.bodies[i].meet(point, towards, from, end).is_some();
        let (panes, others): (Vec<_>, Vec<_>) =
            (0..self.bodies.len()).partition(|i| self.is_clear_pane(*i));
        if others.into_iter().any(met) {
            return 0.0;
        }
        if !panes.into_iter().any(met) {
            return 1.0;
        }
        let (mut origin, mut left, mut passed) = (point, end, 1.0);
        while let Some(hit) = self.meet(origin, towards) {
            left -= hit.point.distance(origin);
            if left <= 0.0 {
                break;
            }
            passed *= self.pane_transmittance(&hit, towards);
            origin = hit.point;
        }
        passed
    }
}

/// Returns the radiance of an environment light in a direction; black for other lights.
fn sky(light: &Light, direction: DVec3) -> DVec3 {
    let Some(environment) = light.environment() else { return DVec3::ZERO };
    let end = if direction.y > 0.0 { environment.zenith } else { environment.nadir };
    let (horizon, height) = (DVec3::from(environment.horizon.0), direction.y.abs());
    let radiance = horizon * (1.0 - height) + DVec3::from(end.0) * height;
    radiance * DVec3::from(light.color.0) * light.intensity
}

/// Returns three values of a light at `point`: direction to the light, distance, and irradiance of
/// a surface that faces the light.
fn arrival(light: &Light, point: DVec3, mutation: Mutation) -> (DVec3, f64, DVec3) {
    let strength = DVec3::from(light.color.0) * light.intensity;
    let (position, cone) = match &light.kind {
        LightKind::Directional(directional) => {
            let towards = -DVec3::from(directional.direction).normalize();
            return (towards, f64::INFINITY, strength * PI);
        }
        LightKind::Point(point) => (DVec3::from(point.position), None),
        LightKind::Spot(spot) => (DVec3::from(spot.position), Some(spot)),
        kind => panic!("a {} light has no single direction", kind.key()),
    };
    let distance = position.distance(point);
    let irradiance = match light.falloff {
        Falloff::None => strength * PI,
        Falloff::InverseSquare => strength / (distance * distance),
    };
    let towards = (position - point) / distance;
    let factor = cone.map_or(1.0, |spot| spot_factor(spot, -towards, mutation));
    (towards, distance, irradiance * factor)
}

/// Returns the share of a spot light's intensity in the unit direction `along`: 1 inside the inner
/// cone, 0 outside the outer one. Between the cones it is the smoothstep of the cosine.
fn spot_factor(spot: &Spot, along: DVec3, mutation: Mutation) -> f64 {
    let cos = DVec3::from(spot.direction).normalize().dot(along);
    let (inner, outer) = (spot.inner_angle.to_radians().cos(), spot.outer_angle.to_radians().cos());
    if cos <= outer {
        return 0.0;
    }
    if cos >= inner {
        return 1.0;
    }
    let t = (cos - outer) / (inner - outer);
    if mutation == Mutation::LinearCone { t } else { 3.0 * t.powi(2) - 2.0 * t.powi(3) }
}

/// Keys of materials that the reference tracer supports.
const KNOWN: &str = "color ambient diffuse specular exponent highlight reflection transmission ior \
     attenuation_color attenuation_distance roughness lobe alpha masking fresnel f0 metal \
     emission emission_color two_sided texture bump";

/// Returns an error if the reference tracer does not support a key that the material sets to a
/// value other than the default.
fn unknown_keys(material: &Material) -> Result<(), String> {
    let plain = Material::default().to_table();
    for (key, value) in material.to_table() {
        if KNOWN.split(' ').all(|known| known != key) && plain.get(&key) != Some(&value) {
            return Err(format!("the material key `{key}`"));
        }
    }
    Ok(())
}
