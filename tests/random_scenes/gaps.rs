//! Objects in exact contact against objects with a gap that is too narrow to be visible.

use crate::common::Numbers;
use crate::random_scenes::driver::{Verdict, compare, many};
use crate::random_scenes::layouts::Layout;
use crate::random_scenes::precisions::{codes, paired};
use crate::random_scenes::scene::seeds_of;
use crate::random_scenes::words::log;
use glam::DVec3;
use zerkalo::scene::{Filter, Scale, Scene, TransformOp};
use zerkalo::world::Precision;

/// Width of the gap, relative to the size of an object.
const GAP: f64 = 1e-5;
/// Largest gap, relative to the smallest length of any object.
const MAX_GAP: f64 = 1e-2;
const SAMPLES: u32 = 4;
/// Allowed effect of the gap on the mean of a block \[8-bit levels\].
const FLOOR: f64 = 1.0;

/// Turns off the lights on surfaces. Such a light shines on both sides of its surface; a gap would
/// leave it outside.
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

/// Shrinks every bounded object slightly about its centre, and moves the eye by a gap in the
/// direction `aside`. Returns `None` if the sizes of the objects differ too much.
fn with_gaps(mut scene: Scene, numbers: &mut Numbers, aside: DVec3) -> Option<Scene> {
    let (mut widest, mut least) = (0f64, f64::INFINITY);
    for object in &mut scene.objects {
        let Some((low, high)) = object.form().bounds() else { continue };
        let middle: DVec3 = 0.5 * (low + high);
        let size = high - low;
        // Flat objects stay in their plane.
        if size.min_element() <= 1e-9 * size.max_element() {
            continue;
        }
        let gap = GAP * log(numbers, 0.2, 5.0);
        widest = widest.max(5.0 * GAP * size.max_element());
        least = least.min(size.min_element());
        object.transform.extend([
            TransformOp::Translate((-middle).to_array()),
            TransformOp::Scale(Scale([1.0 - gap; 3])),
            TransformOp::Translate(middle.to_array()),
        ]);
    }
    // An eye exactly on a surface has no defined side.
    let moved = DVec3::from_array(scene.camera.eye) + aside * widest;
    scene.camera.eye = moved.to_array();
    (widest < MAX_GAP * least && scene.faults().is_empty()).then_some(scene)
}

fn same_with_gaps(scene: &Scene) -> Verdict {
    let mut scene = scene.clone();
    scene.film.filter = Filter::Box;
    without_lights_on_surfaces(&mut scene);
    let size = scene.film.size;
    let mut numbers = Numbers::new(1);
    let aside = numbers.direction();
    let variants: Option<Vec<Scene>> = [aside, -aside, numbers.direction()]
        .into_iter()
        .map(|aside| with_gaps(scene.clone(), &mut numbers, aside))
        .collect();
    let Some(variants) = variants else { return Verdict::Skipped("sizes too different") };
    let render = |scene: &Scene| codes(scene, Precision::Double, SAMPLES);
    let gap_pictures: Vec<_> = variants.iter().map(render).collect();
    let same = |a, b, names| paired(size, names, [a, b], FLOOR);
    // Of coincident surfaces that face the same side either is visible: no gap separates them.
    for other in &gap_pictures[1..] {
        if !matches!(same(&gap_pictures[0], other, ["", ""]), Verdict::Same) {
            return Verdict::Skipped(
                "the picture depends on which of two objects is larger, or on the side of the eye",
            );
        }
    }
    same(&render(&scene), &gap_pictures[0], ["touching", "with gaps"])
}

#[test]
fn gaps() {
    compare("gaps", seeds_of(Layout::Contact, 0..24), same_with_gaps);
}

#[test]
#[ignore = "long: ZERKALO_SCENES scenes"]
fn many_gaps() {
    compare("gaps", seeds_of(Layout::Contact, many()), same_with_gaps);
}
