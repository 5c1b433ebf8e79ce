//! What rays are asked before things are.

use crate::row::{Verdict, ensure, row};
use crate::sight::sees;
use crate::support::{rendered, shipped, sized};
use zerkalo::primitive::Acceleration;
use zerkalo::scene::Scene;
use zerkalo::world::{AnyWorld, Options, Precision};

/// The bytes of a film.
fn film(scene: &Scene, acceleration: Acceleration, precision: Precision) -> Vec<u8> {
    let mut scene = sized(scene.clone(), [100, 70]);
    scene.trace.acceleration = acceleration;
    let rendering = rendered(&scene, 1, precision, 8);
    assert_eq!(rendering.film.bad_samples().count, 0);
    rendering.film.bytes()
}

/// The scene has the boxes that it asks for, the things are where their formulas say, and no way to leave
/// things out changes a bit of the picture.
fn has_boxes_of_its_own(meant: &Scene, shown: &Scene) -> Verdict {
    let world = AnyWorld::compile(shown, &Options::default());
    let inventory = world.inventory().to_string();
    ensure(inventory.contains("boxes of their own"), || inventory.clone())?;
    sees(meant, shown)?;
    for precision in [Precision::Single, Precision::Double] {
        let bare = film(meant, Acceleration::None, precision);
        for acceleration in Acceleration::ALL {
            let same = film(shown, acceleration, precision) == bare;
            ensure(same, || format!("{} in {precision:?} changes the film", acceleration.name()))?;
        }
    }
    Ok(())
}

#[test]
fn b9_extents() {
    let meant = shipped("extents.toml");
    let by = |acceleration| move |s: &mut Scene| s.trace.acceleration = acceleration;
    row(
        "extents.toml",
        |shown| has_boxes_of_its_own(&meant, shown),
        &[
            ("none", &by(Acceleration::None)),
            ("rectangles on the screen", &by(Acceleration::ScreenBounds)),
            ("boxes in the scene's space", &by(Acceleration::Aabb)),
            ("a tree", &by(Acceleration::Bvh)),
            ("by itself", &by(Acceleration::Auto)),
        ],
    );
}
