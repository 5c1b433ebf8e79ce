//! Test of the scene of the reflecting tracks.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;

fn generated_tracks() -> Scene {
    let mut text = String::from(
        "film.size = [640, 480]\n\
         camera = { eye = [5, 0, 40], target = [0, 0, 0], up = [0, 1, 0], view_angle.horizontal = 40 }\n\
         background.color = [0, 0, 0]\n\
         light = [{ point.position = [2, 2, 1] }, { point.position = [-3, 5, 3] }]\n\
         [materials.large]\ncolor = [0.6, 0.6, 0.4]\ndiffuse = 0.2\nspecular = 0.4\nexponent = 10\n\
         reflection = 1\ntransmission = 0.2\nior = 1.4286\n\
         [[object]]\nmaterial = \"large\"\nshape.sphere = { center = [20, 0, -40], radius = 15 }\n",
    );
    for i in 0..40 {
        for j in 0..10 {
            let (x, y, z) = (i - 9, 7.0 - 5.0 * f64::from(i).sqrt(), 6 - j * j);
            let (red, blue) = (0.02 * f64::from(i * j), 0.01 * f64::from(i * j));
            write!(
                text,
                "[materials.track-{i}-{j}]\ncolor = [{red}, 0.7, {blue}]\ndiffuse = 0.4\n\
                 specular = 0.4\nexponent = 10\n[[object]]\nmaterial = \"track-{i}-{j}\"\n\
                 shape.sphere = {{ center = [{x}, {y:?}, {z}], radius = 0.8 }}\n"
            )
            .unwrap();
        }
    }
    parsed(&text)
}

#[test]
fn c1_reflecting_tracks() {
    let original = generated_tracks();
    assert_eq!(original.objects.len(), 401);
    let without_reflections = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.trace.ray_types = RayTypes::Shadows;
        scene
    };
    let check = |tested: &Scene| {
        ensure(tested.film.size == [640, 480], || format!("{:?} pixels", tested.film.size))?;
        hits_agree(&original, tested)?;
        agrees_exactly(&without_reflections(&original), &without_reflections(tested))?;
        agrees(&original, tested, 64)
    };
    row(
        "reflecting-tracks.toml",
        check,
        &[
            ("the large ball a plane", &|s| {
                s.objects[0].shape = shape("plane = { point = [20, 0, -25], normal = [0, 0, 1] }");
            }),
            ("nothing reflected", &|s| {
                s.materials.values_mut().for_each(|m| m.reflection = 0.0);
            }),
            ("another colour", &|s| {
                s.materials.values_mut().for_each(|m| m.color = Color([0.7; 3]))
            }),
            ("half the balls", &|s| s.objects.truncate(201)),
            ("one light", &|s| s.lights.truncate(1)),
            ("the angle across the height", &|s| {
                s.camera.view_angle = zerkalo_scene::camera::ViewAngle::Vertical(40.0);
            }),
        ],
    );
}
