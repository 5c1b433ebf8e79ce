//! The scene files that come with the program, and the ones that must be refused.
use zerkalo::scene::Scene;
#[test]
fn physical() {
    let scene = Scene::read("scenes/mirror-room-physical.toml".as_ref()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.objects.len(), 6);
    println!("{:?}", scene.warnings());
    for o in &scene.objects { println!("{} {:?}", o.name, o.shape.form()); }
}
