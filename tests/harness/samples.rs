//! Single samples of pixels, z-tests of their means, and parts of scene texts.

use super::*;
use zerkalo_world::Path;

/// Returns a vector as a TOML array.
pub fn array(v: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

/// Returns the steps of a transform as TOML: uniform scaling, rotation, translation.
pub fn steps(place: &DAffine3) -> String {
    let (scale, rotation, offset) = place.to_scale_rotation_translation();
    let (axis, angle) = rotation.to_axis_angle();
    format!(
        "{{ scale = {:?} }}, {{ rotate = {{ axis = {}, degrees = {:?} }} }}, {{ translate = {} }}",
        scale.x,
        array(axis),
        angle.to_degrees(),
        array(offset)
    )
}

/// Keys of a white diffuse material.
pub const WHITE: &str = "color = [1.0, 1.0, 1.0]\nambient = 0.0\ndiffuse = 1.0";

/// Returns the text of a scene whose only pixel shows a receiver at the origin. `material` has the
/// keys of the receiver's material. `rest` is the text of further objects and lights; objects may
/// have the materials `black`, `lamp` (black and emissive) and `front` (the same, one-sided).
pub fn receiver_text(normal: DVec3, material: &str, rest: &str) -> String {
    format!(
        "film = {{ size = [1, 1], filter = \"point\" }}\n\
         camera = {{ eye = {eye}, direction = {direction}, up = {up}, view_angle.vertical = 0.1 }}\n\
         [materials.tested]\n{material}\n\
         [materials.black]\ncolor = [0.0, 0.0, 0.0]\n\
         [materials.lamp]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\n\
         [materials.front]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\ntwo_sided = false\n\
         [[object]]\nmaterial = \"tested\"\n\
         shape.rectangle = {{ center = [0.0, 0.0, 0.0], size = [0.01, 0.01], normal = {normal}, up = {up} }}\n{rest}",
        eye = array(normal * 0.01),
        direction = array(-normal),
        up = array(normal.any_orthonormal_vector()),
        normal = array(normal),
    )
}

pub fn receiver(normal: DVec3, material: &str, rest: &str) -> Scene {
    parsed(&receiver_text(normal, material, rest))
}

/// Returns the OBJ text of a box between two corners.
pub fn obj_box(low: DVec3, high: DVec3) -> String {
    let mut out = String::new();
    for z in [low.z, high.z] {
        for (x, y) in [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)] {
            out += &format!("v {x} {y} {z}\n");
        }
    }
    out + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n"
}

/// Returns the radiance of as many samples of a pixel as the SIMD type has lanes, from index
/// `first` on. The values of lanes outside of `active` have no meaning. The order of values is
/// `[sample][group][channel]`.
pub fn trace_packet<L: SimdFloat>(
    world: &World<L>,
    sampler: &Sampler<L>,
    pixel: (u32, u32),
    first: u32,
    active: L::Mask,
) -> Vec<Vec<[f64; 3]>> {
    let points = sampler.block(first, L::WIDTH);
    let draws = points.for_pixel(sampler.key(pixel, 0));
    let half = L::from_f64(0.5);
    let jitter = if world.jitter { draws.pixel() } else { (half, half) };
    let corner = Vec3::splat(world.camera.pixel_corner_direction(pixel));
    let mut path = Path::new(world.camera.rays(corner, jitter));
    let mut radiance = Radiance::black();
    world.trace(&mut path, None, &draws, active, &mut radiance, None);
    let groups = &radiance.groups[..world.info.scales.len()];
    let of_lane = |lane| groups.iter().map(|g| g.lane(lane).map(Float::to_f64)).collect();
    (0..L::WIDTH).map(of_lane).collect()
}

/// Passes the samples `0..count` of every pixel to `visit`, each as the radiance of every light
/// group. A light with a group of its own counts with unit intensity, and lights in a shared group
/// count with their own intensities. If `alone` is `true`, each sample is traced alone: it is the
/// only active lane of its packet.
fn each_sample<L: SimdFloat>(
    scene: &Scene,
    settings: SampleSettings,
    count: u32,
    alone: bool,
    visit: &mut dyn FnMut(&[[f64; 3]]),
) {
    let world = World::<L>::new(scene);
    let sampler = Sampler::<L>::new(settings, world.camera_dimensions());
    let only = |lane: usize| {
        L::from_fn(|i| L::Scalar::from_f64(f64::from(u8::from(i == lane)))).gt(L::zero())
    };
    let [width, height] = scene.film.size;
    for pixel in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let packet = |first, active| trace_packet(&world, &sampler, pixel, first, active);
        for first in (0..count).step_by(L::WIDTH) {
            let samples = if alone {
                (0..L::WIDTH).map(|lane| packet(first, only(lane)).swap_remove(lane)).collect()
            } else {
                packet(first, L::mask(true))
            };
            samples.iter().for_each(|groups| visit(groups));
        }
    }
}

fn collected<L: SimdFloat>(scene: &Scene, count: u32, alone: bool) -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    each_sample::<L>(scene, sobol(3), count, alone, &mut |groups| {
        out.push(groups.iter().map(|g| DVec3::from(*g)).sum::<DVec3>().to_array());
    });
    out
}

/// Returns the samples `0..count` of every pixel, traced in full packets. Each is the sum over the
/// light groups, with the weight 1 for all lights.
pub fn samples<L: SimdFloat>(scene: &Scene, count: u32) -> Vec<[f64; 3]> {
    collected::<L>(scene, count, false)
}

/// Returns the same values as [`samples`], each sample traced alone.
pub fn lone_samples<L: SimdFloat>(scene: &Scene, count: u32) -> Vec<[f64; 3]> {
    collected::<L>(scene, count, true)
}

/// Returns the mean red radiance of each light group over all pixels, and the standard error of the
/// mean, from `count` independent samples of each pixel. The last value is that of the sum over all
/// groups.
pub fn group_means<L: SimdFloat>(scene: &Scene, count: u32, seed: u64) -> Vec<(f64, f64)> {
    let settings = SampleSettings { seed, kind: SamplerKind::Random };
    let (mut n, mut sums) = (0.0, Vec::new());
    each_sample::<L>(scene, settings, count, false, &mut |groups| {
        n += 1.0;
        sums.resize(groups.len() + 1, (0.0, 0.0));
        let all: f64 = groups.iter().map(|g| g[0]).sum();
        assert!(all.is_finite(), "seed {seed}, sample {n}: {groups:?}");
        let values = groups.iter().map(|g| g[0]).chain([all]);
        for ((sum, squares), value) in sums.iter_mut().zip(values) {
            *sum += value;
            *squares += value * value;
        }
    });
    let mean_and_error = |(sum, squares): &(f64, f64)| {
        let mean = sum / n;
        (mean, ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
    };
    sums.iter().map(mean_and_error).collect()
}

/// Returns the mean red radiance and its standard error, as [`group_means`] does for all groups.
pub fn radiance<L: SimdFloat>(scene: &Scene, count: u32, seed: u64) -> (f64, f64) {
    group_means::<L>(scene, count, seed).pop().expect("the sum over all groups")
}

fn in_both_precisions(scene: &Scene, count: u32, seed: u64) -> [(f64, f64); 2] {
    [radiance::<Single>(scene, count, seed), radiance::<Double>(scene, count, seed)]
}

/// Checks the mean radiance of each scene against its expected value, by z-tests in both
/// precisions, whose level is corrected for their number. Each test takes `count` samples of each
/// pixel. `rounding` has the allowed relative rounding errors in single and double precision.
pub fn check_means(cases: &[(String, Scene, f64)], count: u32, rounding: [f64; 2]) {
    let limit = two_sided_z(1e-3 / (2.0 * cases.len() as f64));
    for (seed, (name, scene, expected)) in (1..).zip(cases) {
        for ((mean, error), rounding) in
            in_both_precisions(scene, count, seed).into_iter().zip(rounding)
        {
            let off = (mean - expected).abs() - rounding * expected;
            assert!(
                off <= limit * error,
                "{name}, seed {seed}, rounding {rounding:e}: {mean} ± {error}, expected {expected}, \
                 in the scene\n{}",
                scene.to_text()
            );
        }
    }
}

/// Allowed relative rounding errors of [`means_agree`] in single and double precision. They arise because
/// sampled points are lifted off emitters and rays start above surfaces.
pub const ROUNDING: [f64; 2] = [1e-4, 1e-9];

/// Checks that the mean radiances of the scenes `a` and `b`, each over `count` samples, differ by
/// no more than chance explains.
pub fn means_agree(name: &str, a: &Scene, b: &Scene, count: u32) {
    let [a, b] = [(a, 1), (b, 2)].map(|(scene, seed)| in_both_precisions(scene, count, seed));
    for ((a, b), rounding) in a.into_iter().zip(b).zip(ROUNDING) {
        let off = (a.0 - b.0).abs() - rounding * a.0;
        assert!(a.0 > 0.0, "{name}: black");
        let error = a.1.hypot(b.1);
        assert!(off <= two_sided_z(1e-5) * error, "{name}, rounding {rounding:e}: {a:?} and {b:?}");
    }
}
