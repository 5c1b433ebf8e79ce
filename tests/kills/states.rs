//! Expected texts of a scene file after key presses, computed by the dashboard's model without
//! running the program.

use crate::harness::*;
use zerkalo::dashboard::message::{Effect, Message};
use zerkalo::dashboard::model::Model;
use zerkalo::dashboard::update::update;

/// Text of a scene that renders quickly.
pub const SCENE: &str = r#"# A ball before a mirror.
film.size = [24, 18]
[camera]
eye = [0.0, 1.0, 4.0]   # at the door
target = [0.0, 0.5, 0.0]
[[light]]
name = "lamp"
point = { position = [2.0, 4.0, 3.0] }
intensity = 1.0 # changed by keys
[materials.red]
color = [0.8, 0.2, 0.1]
[materials.mirror]
reflection = 0.9
roughness = 0.3
[[object]]
name = "ball"
material = "red"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }
[[object]]
name = "mirror"
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -1.0], size = [4.0, 2.0], normal = [0.0, 0.0, 1.0] }
"#;

/// Keys that a test presses: the name of each, and the bytes that a terminal sends for it. The
/// effect of each key on the scene is independent of the time between keys.
pub const KEYS: [(&str, &str); 10] = [
    ("'", "'"),
    (";", ";"),
    ("]", "]"),
    ("[", "["),
    ("Left", "\x1b[D"),
    ("Up", "\x1b[A"),
    ("H", "H"),
    ("Ctrl-s", "\x13"),
    ("p", "p"),
    ("P", "P"),
];
/// Index in `KEYS` of the key that saves the scene.
pub const SAVE: usize = 7;

/// Returns the texts that a save would write after each prefix of `keys`, which are indices into
/// [`KEYS`]. The first text is that before any key, the last that after all keys.
pub fn states(keys: &[usize]) -> Vec<String> {
    let path = PathBuf::from("scene.toml");
    let mut document = Document::parse(SCENE.to_string(), "scene.toml").expect("a scene");
    let scene = Ok(Arc::new(document.scene().clone()));
    let mut model = Model::new(Some(path.clone()), "", scene, Stop::default());
    update(&mut model, Message::Resize([60, 18]), Duration::ZERO);
    let mut texts = vec![SCENE.to_string()];
    for (i, key) in keys.iter().enumerate() {
        let now = Duration::from_secs(i as u64);
        let key = Message::Key(KEYS[*key].0.parse().expect("a key"));
        for effect in update(&mut model, key, now) {
            if let Effect::Save { scene, .. } = effect {
                update(&mut model, Message::Saved(scene, Ok(path.clone())), now);
            }
        }
        document.apply(model.history.scene());
        texts.push(document.text().to_string());
    }
    texts
}
