//! Acceleration structures: every choice renders the same image, bit for bit. `random_scenes` has
//! further scenes.

use crate::harness::*;

/// Picture size in pixels. Neither side is a multiple of a tile's side.
const SIZE: [u32; 2] = [37, 35];

fn same(name: &str, scene: &Scene, precision: Precision, count: u32) {
    let expected = accelerated(scene, Acceleration::Auto, precision, count).film.bytes();
    for acceleration in Acceleration::ALL.into_iter().filter(|a| *a != Acceleration::Auto) {
        let found = accelerated(scene, acceleration, precision, count).film.bytes();
        assert!(found == expected, "{name} in {precision:?}: {} differs", acceleration.name());
    }
}

#[test]
fn shipped_scenes_are_equal_under_every_acceleration() {
    for (name, scene) in all_shipped() {
        same(&name, &sized(scene.clone(), SIZE), Precision::Single, 3);
        same(&name, &sized(scene, [24, 18]), Precision::Double, 3);
    }
}

/// Compares the acceleration structures on a pyramid whose coordinates are large compared to its
/// size. At the pyramid's silhouette, the face that is closest to the rounded hit point may face
/// away from the ray.
#[test]
fn silhouette_edges_are_equal_under_every_acceleration() {
    let text = "film.size = [10, 30]\n\
         camera = { eye = [-3000.0, 0.4, 0.126], direction = [-2.11, -0.422, 0.0] }\n\
         [[light]]\ndirectional.direction = [0.0, 1.0, 0.0]\n\
         [[object]]\nshape.pyramid = { corner = [-3008.2618, -1.0, 1.0], side = 1.0404831432143558, \
         apex_height = 1.04, height = 1.0 }\n\
         transform = [{ translate = [3010.0, 0.502467749931503, -0.1] }, { scale = [1.0, 1.0, 0.4] }, \
         { translate = [-3010.0, 1.0, 0.12647119695611247] }]\n\
         [[object]]\nshape.sphere = { center = [1.0, 0.5, 0.5], radius = 1.0 }\n";
    same("pyramid", &parsed(text), Precision::Single, 64);
}

/// Returns a scene with objects of every kind on a coarse grid, so that some faces are coplanar
/// with faces of other objects. Eye and light are on the grid as well, mostly exactly on surfaces.
fn coplanar(numbers: &mut Numbers, count: usize, folder: &Path) -> Scene {
    let shapes = [
        "box = { center = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0] }",
        "mesh = { file = \"cube.obj\" }",
        "platform = { center = [0.0, -0.5, 0.0], size = [1.0, 1.0] }",
        "rectangle = { center = [0.0, 0.0, 0.5], size = [1.0, 1.0], normal = [0.0, 0.0, 1.0] }",
        "sphere = { center = [0.0, 0.0, 0.0], radius = 0.5 }",
        "cylinder = { base = [0.0, -0.5, 0.0], top = [0.0, 0.5, 0.0], radius = 0.5 }",
        "plane = { point = [0.0, -0.5, 0.0], normal = [0.0, 1.0, 0.0] }",
        "union.of = [{ shape.box = { center = [0.0, -0.25, 0.0], size = [1.0, 0.5, 1.0] } }, \
         { shape.sphere = { center = [0.0, 0.0, 0.0], radius = 0.5 } }]",
    ];
    let scale = [1e-3, 1.0, 1.0, 1.0, 700.0][numbers.below(5)];
    let offset = numbers.in_cube(1.0) * [0.0, 1.0, 1e4][numbers.below(3)] * scale;
    let (axis, degrees) = (numbers.direction(), [0.0, 0.0, 37.0][numbers.below(3)]);
    let rotation = DQuat::from_axis_angle(axis, f64::to_radians(degrees));
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), rotation, offset);
    let mut grid = |half: i32, step: f64| {
        let mut coordinate =
            || f64::from(numbers.below(2 * half as usize + 1) as i32 - half) * step;
        DVec3::new(coordinate(), coordinate(), coordinate())
    };
    let eye = place.transform_point3(grid(6, 0.5));
    let forward = rotation * (grid(2, 1.0) + DVec3::new(0.1, 0.0, 0.3));
    let light = place.transform_point3(grid(4, 0.5));
    let mut text = format!(
        "background.color = [0.2, 0.3, 0.4]\n\
         [camera]\neye = {}\ndirection = {}\nview_angle.vertical = 70.0\n\
         [[light]]\nname = \"a\"\npoint.position = {}\nfalloff = \"none\"\n\
         [[light]]\nname = \"b\"\ndirectional.direction = {}\n\
         [materials.matte]\ncolor = [0.7, 0.5, 0.3]\n\
         [materials.mirror]\ndiffuse = 0.2\nreflection = 0.7\n\
         [materials.glass]\ndiffuse = 0.1\ntransmission = 0.6\n",
        array(eye),
        array(forward),
        array(light),
        array(rotation * DVec3::new(0.3, -1.0, 0.2)),
    );
    let transparent = numbers.below(2);
    for _ in 0..count {
        let material = ["matte", "mirror", "glass"][numbers.below(2 + transparent)];
        let shape = shapes[numbers.below(shapes.len())];
        let mut grid = |low: i32, count: usize| f64::from(numbers.below(count) as i32 + low);
        let size = DVec3::new(grid(1, 3), grid(1, 3), grid(1, 3));
        let middle = DVec3::new(grid(-3, 7), grid(-3, 7), grid(-3, 7)) * 0.5;
        write!(
            text,
            "[[object]]\nmaterial = \"{material}\"\nshape.{shape}\n\
             transform = [{{ scale = {} }}, {{ translate = {} }}, {}]\n",
            array(size),
            array(middle),
            steps(&place)
        )
        .unwrap();
    }
    let path = folder.join("scene.toml");
    fs::write(folder.join("cube.obj"), obj_box(DVec3::splat(-0.5), DVec3::splat(0.5))).unwrap();
    fs::write(&path, &text).unwrap();
    Scene::read(&path).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Compares the acceleration structures on scenes with coplanar faces, one for each of `seeds`. Eye
/// and light are in planes of faces.
fn check_coplanar(seeds: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    for seed in seeds {
        let mut numbers = Numbers::new(seed);
        let count = [2, 3, 5, 12, 40, 120][numbers.below(6)];
        let scene = sized(coplanar(&mut numbers, count, folder.path()), [37, 26]);
        let precision = if seed % 3 == 2 { Precision::Double } else { Precision::Single };
        same(&format!("seed {seed}, {count} coplanar objects"), &scene, precision, 3);
    }
}

#[test]
fn coplanar_faces_are_equal_under_every_acceleration() {
    check_coplanar(0..56);
    // Regression: the offsets of a solid's face planes were rounded, so the faces missed the
    // corners of the solid.
    check_coplanar(1721..1722);
}

#[test]
#[ignore = "long: thousands of scenes"]
fn coplanar_faces_are_equal_under_every_acceleration_in_many_scenes() {
    check_coplanar(1000..4000);
}

#[test]
fn inventory_names_acceleration() {
    let text = "[[object]]\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n\
                [[object]]\nshape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }\n";
    for (acceleration, name) in [
        (Acceleration::Auto, "list"),
        (Acceleration::None, "bare list"),
        (Acceleration::ScreenBounds, "screen rectangles"),
        (Acceleration::Obb, "boxes of their own"),
        (Acceleration::Aabb, "boxes"),
        (Acceleration::Bvh, "tree"),
    ] {
        let mut scene = parsed(text);
        scene.trace.acceleration = acceleration;
        let world = AnyWorld::compile(&scene, &Options::default());
        let inventory = world.info().inventory.clone();
        assert!(inventory.contains(&format!("1 sphere ({name})")), "{acceleration:?}: {inventory}");
        assert!(inventory.contains("1 plane (list)"), "{acceleration:?}: {inventory}");
    }
}
