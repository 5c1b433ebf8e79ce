//! Objects in exact contact, against the same objects with a gap that is too narrow to be visible.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use crate::random_scenes::layouts::Layout;
use crate::random_scenes::precisions::{levels, paired};
use crate::random_scenes::scene::seeds_of;
use crate::random_scenes::words::log;

/// Typical relative change of an object's size. The change of each object is 0.2 to 5 times this
/// value.
const GAP: f64 = 1e-5;
/// Largest allowed width of the widest gap, as a fraction of the smallest length of any object's
/// bounding box. Scenes with wider gaps are skipped.
const MAX_GAP: f64 = 1e-2;
const SAMPLES: u32 = 4;
/// Limit on the change of a block mean that gaps cause, in 8-bit levels.
const FLOOR: f64 = 1.0;

/// Turns off the lights that lie on surfaces of objects. Such a light shines on both sides of the
/// surface. If the object shrank, the light would lie outside of the object.
fn without_lights_on_surfaces(scene: &mut Scene) {
    let forms: Vec<_> = scene.objects.iter().map(|object| object.form()).collect();
    let is_on_surface = |position: DVec3| {
        forms.iter().any(|form| {
            form.bounds().is_some_and(|(low, high)| {
                let gap = 5.0 * GAP * (high - low).max_element();
                !form.normals_at(position, gap).is_empty()
            })
        })
    };
    for light in &mut scene.lights {
        let position = light.position().map(DVec3::from);
        light.on &= !position.is_some_and(is_on_surface);
    }
}

/// Changes of the sizes of all bounded objects in a scene.
#[derive(Clone, Copy)]
enum Change {
    /// All objects shrink, by different fractions.
    AllShrink,
    /// Transparent objects shrink. Opaque objects shrink, too, but less than the transparent ones.
    OpaqueShrink,
    /// Transparent objects shrink. Opaque objects grow, but by less than the transparent ones
    /// shrink.
    OpaqueGrow,
}

/// Returns `true` if some part of the object transmits rays.
fn is_transparent(scene: &Scene, object: &Object) -> bool {
    if scene.trace.ray_types != RayTypes::Full || scene.trace.max_depth == 0 {
        return false;
    }
    let transmits = |name: &&str| scene.materials.get(*name).is_some_and(|m| m.transmission > 0.0);
    object.shape.part_materials(&object.material).iter().any(transmits)
}

/// Returns the lengths of the sides of an object's bounding box. Returns `None` for flat and
/// unbounded objects, which keep their size.
fn lengths(object: &Object) -> Option<DVec3> {
    let (low, high) = object.form().bounds()?;
    let size = high - low;
    (size.min_element() > 1e-9 * size.max_element()).then_some(size)
}

/// Returns the largest and the smallest edge of the bounding boxes of all objects of the scene.
fn extreme_lengths(scene: &Scene) -> (f64, f64) {
    let sizes = || scene.objects.iter().filter_map(lengths);
    let longest = sizes().map(|size| size.max_element()).fold(0.0, f64::max);
    (longest, sizes().map(|size| size.min_element()).fold(f64::INFINITY, f64::min))
}

/// Returns the scene with every bounded object slightly smaller or larger about its centre, as
/// `change` says.
fn changed(mut scene: Scene, numbers: &mut Numbers, change: Change) -> Scene {
    let (_, least) = extreme_lengths(&scene);
    let transparent: Vec<bool> =
        scene.objects.iter().map(|object| is_transparent(&scene, object)).collect();
    for (object, transparent) in scene.objects.iter_mut().zip(transparent) {
        let (Some(size), Some((low, high))) = (lengths(object), object.form().bounds()) else {
            continue;
        };
        let middle: DVec3 = 0.5 * (low + high);
        let gap = GAP * log(numbers, 0.2, 5.0);
        // A face of an opaque object moves by at most half of the narrowest gap of a transparent
        // object.
        let least_gap = 0.1 * GAP * least / size.max_element();
        let factor = match change {
            _ if transparent => 1.0 - gap,
            Change::AllShrink => 1.0 - gap,
            Change::OpaqueShrink => 1.0 - least_gap,
            Change::OpaqueGrow => 1.0 + least_gap,
        };
        object.transform.extend([
            TransformOp::Translate((-middle).to_array()),
            TransformOp::Scale(Scale([factor; 3])),
            TransformOp::Translate(middle.to_array()),
        ]);
    }
    scene
}

/// Returns the scene with every bounded object slightly smaller. The eye is moved in the direction
/// `aside` by the largest change of any object's size. Returns `None` if this change is too large
/// for the smallest object, or if the scene gets validation errors.
fn with_gaps(scene: &Scene, numbers: &mut Numbers, aside: DVec3) -> Option<Scene> {
    let (longest, least) = extreme_lengths(scene);
    let mut scene = changed(scene.clone(), numbers, Change::AllShrink);
    let widest = 5.0 * GAP * longest;
    let moved = DVec3::from_array(scene.camera.eye) + aside * widest;
    scene.camera.eye = moved.to_array();
    (widest < MAX_GAP * least && scene.faults().is_empty()).then_some(scene)
}

/// Returns `true` if two coincident opaque surfaces are visible. This is the case if the picture
/// with slightly smaller opaque objects differs from that with slightly larger ones.
pub fn shows_coincident_opaque(scene: &Scene) -> bool {
    let variants = [Change::OpaqueShrink, Change::OpaqueGrow]
        .map(|change| changed(scene.clone(), &mut Numbers::new(1), change));
    if variants.iter().any(|variant| !variant.faults().is_empty()) {
        return false;
    }
    let [smaller, larger] = variants.map(|scene| levels(&scene, Precision::Double, SAMPLES));
    let verdict = paired(scene.film.size, ["smaller", "larger"], [&smaller, &larger], FLOOR);
    matches!(verdict, Verdict::Different(_))
}

/// Returns directions in which the eye is moved. For each surface that the eye is on, they include
/// both directions along its normal.
fn asides(scene: &Scene, numbers: &mut Numbers) -> Vec<DVec3> {
    let eye = DVec3::from_array(scene.camera.eye);
    let normals: Vec<DVec3> = scene
        .objects
        .iter()
        .flat_map(|object| {
            let slack = lengths(object).map_or(0.0, |size| 5.0 * GAP * size.max_element());
            object.form().normals_at(eye, slack.max(1e-9 * eye.abs().max_element()))
        })
        .flatten()
        .collect();
    let aside = numbers.direction();
    let into_edges = (-normals.iter().sum::<DVec3>()).try_normalize();
    let both_sides = normals.iter().flat_map(|normal| [*normal, -*normal]);
    [aside, -aside, numbers.direction()].into_iter().chain(both_sides).chain(into_edges).collect()
}

fn same_with_gaps(scene: &Scene) -> Verdict {
    let mut scene = scene.clone();
    scene.film.filter = Filter::Box;
    without_lights_on_surfaces(&mut scene);
    let size = scene.film.size;
    let mut numbers = Numbers::new(1);
    let asides = asides(&scene, &mut numbers);
    let variants: Option<Vec<Scene>> =
        asides.iter().map(|aside| with_gaps(&scene, &mut numbers, *aside)).collect();
    let Some(variants) = variants else { return Verdict::Skipped("sizes too different") };
    let render = |scene: &Scene| levels(scene, Precision::Double, SAMPLES);
    let gap_picture = render(&variants[0]);
    let against_gap = |other: &Scene| {
        paired(size, ["touching", "with gaps"], [&render(other), &gap_picture], FLOOR)
    };
    let equals_gap = |other: &Scene| matches!(against_gap(other), Verdict::Same);
    // If two coincident surfaces have the same outward normal, the object that shrinks less hides
    // the surface of the other one. An eye exactly on a surface is moved to one side of it, which
    // depends on the variant.
    if !variants[1..].iter().all(equals_gap) {
        return Verdict::Skipped(
            "the picture depends on which of two objects is larger, or on the side of the eye",
        );
    }
    let touching = against_gap(&scene);
    // Rounding decides which of two coincident opaque surfaces a ray hits. Where opaque solids
    // touch, both surfaces are visible only if the eye is inside one of the solids.
    if matches!(touching, Verdict::Different(_)) && shows_coincident_opaque(&scene) {
        return Verdict::Skipped("two coincident opaque surfaces are visible");
    }
    touching
}

scene_tests!(
    gaps,
    seeds_of(Layout::Contact, 0..12),
    many_gaps,
    seeds_of(Layout::Contact, many()),
    same_with_gaps
);
