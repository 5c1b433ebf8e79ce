//! Bounding boxes and the other acceleration structures.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_scene::Acceleration;

/// Returns the bytes of the film of `scene` with the given acceleration structure.
fn film(scene: &Scene, acceleration: Acceleration, precision: Precision) -> Vec<u8> {
    let mut scene = sized(scene.clone(), [100, 70]);
    scene.trace.acceleration = acceleration;
    let rendering = rendered(&scene, 1, precision, 8);
    assert_eq!(rendering.film.bad_samples(), 0);
    rendering.film.bytes()
}

/// Checks that the scene is compiled with bounding boxes of objects, that its objects are where
/// their formulas say, and that no acceleration structure changes a bit of the picture.
fn uses_object_boxes(original: &Scene, tested: &Scene) -> Verdict {
    let world = AnyWorld::compile(tested, &Options::default());
    let inventory = world.info().inventory.clone();
    ensure(inventory.contains("boxes of their own"), || inventory.clone())?;
    hits_agree(original, tested)?;
    for precision in [Precision::Single, Precision::Double] {
        let unaccelerated = film(original, Acceleration::None, precision);
        for acceleration in Acceleration::ALL {
            let same = film(tested, acceleration, precision) == unaccelerated;
            ensure(same, || format!("{} in {precision:?} changes the film", acceleration.name()))?;
        }
    }
    Ok(())
}

#[test]
fn b9_extents() {
    let original = shipped("extents.toml");
    let with_acceleration = |acceleration| move |s: &mut Scene| s.trace.acceleration = acceleration;
    row(
        "extents.toml",
        |tested| uses_object_boxes(&original, tested),
        &[
            ("none", &with_acceleration(Acceleration::None)),
            ("screen rectangles", &with_acceleration(Acceleration::ScreenBounds)),
            ("world-space boxes", &with_acceleration(Acceleration::Aabb)),
            ("a BVH", &with_acceleration(Acceleration::Bvh)),
            ("automatic", &with_acceleration(Acceleration::Auto)),
        ],
    );
}
