//! Time that edits of large scene files take. Each test compares ratios of processor times, all
//! from the same run.

use super::*;
use crate::harness::*;

fn spheres(count: usize, has_names: bool) -> String {
    let mut text = "# Spheres.\nambient.color = [1, 1, 1]\n".to_string();
    for i in 0..count {
        let name = if has_names { format!("name = \"ball {i}\"\n") } else { String::new() };
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "\n[[object]]   # number {i}\n{name}shape.sphere = {{ center = [{i}, 0, 0], radius = 0.3 }}"
        );
    }
    text
}

/// Returns the processor time of this thread in seconds.
fn cpu_seconds() -> f64 {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    times.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}

/// Returns the processor time, in seconds, of updating the text of a document after `edit` has
/// changed its scene.
fn seconds(document: &Document, edit: fn(&mut Scene)) -> f64 {
    let count = document.scene().objects.len();
    let times = (0..3).map(|_| {
        let (mut document, mut scene) = (document.clone(), document.scene().clone());
        edit(&mut scene);
        let start = cpu_seconds();
        document.apply(&scene);
        let elapsed = cpu_seconds() - start;
        assert!(document.text().contains(&format!("# number {}", count - 1)));
        elapsed
    });
    times.fold(f64::INFINITY, f64::min)
}

fn move_object(object: &mut Object) {
    if let Shape::Sphere(sphere) = &mut object.shape {
        sphere.center[1] += 0.5;
    }
}

type NamedEdit = (&'static str, fn(&mut Scene));

/// Checks that the time of updating the text after an edit grows at most by the factor `limit` if
/// the number of objects doubles. The time for `fewest` objects is compared with that for four
/// times as many, after two doublings.
fn check_growth(fewest: usize, limit: f64) {
    let edits: [NamedEdit; 3] = [
        ("one moved", |scene| {
            let middle = scene.objects.len() / 2;
            move_object(&mut scene.objects[middle]);
        }),
        ("one deleted", |scene| {
            scene.objects.remove(0);
        }),
        ("all moved", |scene| scene.objects.iter_mut().for_each(move_object)),
    ];
    for has_names in [true, false] {
        let documents = [fewest, 4 * fewest].map(|count| document(&spheres(count, has_names)));
        for (name, edit) in edits {
            let times = documents.each_ref().map(|document| seconds(document, edit));
            println!("{name}, with names: {has_names}: {times:.3?} s");
            assert!(times[1] / times[0] < limit * limit, "{name}, {has_names}: {times:?} s");
        }
    }
}

/// Checks the growth of the time of an edit from 2,000 to 8,000 objects; fewer are too few for a
/// clock with ticks of 4 ms. The limit for a doubling is halfway between linear (2) and quadratic
/// (4), on a logarithmic scale. The growth is not exactly linear, because only small scenes fit into
/// the caches.
#[test]
#[cfg(target_os = "linux")]
fn edits_of_many_objects_are_written_in_linear_time() {
    check_growth(2_000, 8_f64.sqrt());
}
