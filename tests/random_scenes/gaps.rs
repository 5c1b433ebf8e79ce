//! Things in exact contact look like things with a gap between them that is too narrow to be seen.

use crate::common::Numbers;
use crate::driver::{Verdict, compare, many};
use crate::layouts::Layout;
use crate::precisions::{codes, paired};
use crate::scene::of;
use crate::words::log;
use glam::DVec3;
use zerkalo::scene::{Filter, Scale, Scene, TransformOp};
use zerkalo::world::Precision;

/// The gap beside the size of a thing.
const GAP: f64 = 1e-5;
/// The widest gap beside the least length of any thing.
const NARROW: f64 = 1e-2;
const SAMPLES: u32 = 4;
/// What the gap itself may change in the mean of a block, in codes.
const FLOOR: f64 = 1.0;

/// Lamps on the surfaces of things go out: such a lamp shines on both sides, and a gap leaves it outside.
fn without_lamps_on_surfaces(scene: &mut Scene) {
    let forms: Vec<_> = scene.objects.iter().map(|object| object.form()).collect();
    let touches = |position: DVec3| {
        forms.iter().any(|form| {
            form.bounds().is_some_and(|(low, high)| {
                let gap = 5.0 * GAP * (high - low).max_element();
                !form.normals_at(position, gap).is_empty()
            })
        })
    };
    for light in &mut scene.lights {
        let on = light.point.as_ref().is_some_and(|point| touches(DVec3::from(point.position)));
        light.on &= !on;
    }
}

/// Every bounded thing a little smaller, about its middle; `None`: what is little for one thing is much for another.
/// The eye steps `aside` by a gap.
fn apart(mut scene: Scene, numbers: &mut Numbers, aside: DVec3) -> Option<Scene> {
    let (mut widest, mut least) = (0f64, f64::INFINITY);
    for object in &mut scene.objects {
        let Some((low, high)) = object.form().bounds() else { continue };
        let middle: DVec3 = 0.5 * (low + high);
        let size = high - low;
        // What is flat stays in its plane.
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
    // An eye on a surface is on one side of it or the other.
    let moved = DVec3::from_array(scene.camera.eye) + aside * widest;
    scene.camera.eye = moved.to_array();
    (widest < NARROW * least && scene.faults().is_empty()).then_some(scene)
}

fn same_with_gaps(scene: &Scene) -> Verdict {
    let mut scene = scene.clone();
    scene.film.filter = Filter::Box;
    without_lamps_on_surfaces(&mut scene);
    let size = scene.film.size;
    let mut numbers = Numbers::new(1);
    let aside = numbers.direction();
    let variants: Option<Vec<Scene>> = [aside, -aside, numbers.direction()]
        .into_iter()
        .map(|aside| apart(scene.clone(), &mut numbers, aside))
        .collect();
    let Some(variants) = variants else { return Verdict::Skipped("sizes too different") };
    let render = |scene: &Scene| codes(scene, Precision::Double, SAMPLES);
    let with_gaps: Vec<_> = variants.iter().map(render).collect();
    let same = |a, b, names| paired(size, names, [a, b], FLOOR);
    // Of surfaces that coincide and face the same side either is seen: there is no gap between them.
    for other in &with_gaps[1..] {
        if !matches!(same(&with_gaps[0], other, ["", ""]), Verdict::Same) {
            return Verdict::Skipped(
                "it matters which of two is larger, or on which side of a surface the eye is",
            );
        }
    }
    same(&render(&scene), &with_gaps[0], ["touching", "with gaps"])
}

#[test]
fn gaps() {
    compare("gaps", of(Layout::Contact, 0..24), same_with_gaps);
}

#[test]
#[ignore = "as many scenes as the environment asks for"]
fn many_gaps() {
    compare("gaps", of(Layout::Contact, many()), same_with_gaps);
}
