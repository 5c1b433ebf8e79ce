//! Simulated environment of a dashboard for story tests, without terminal, renderer or disk. Keys
//! are given by name, and effects are answered at once.

use super::*;
use zerkalo::dashboard::editor::Editor;
use zerkalo::dashboard::pictures::KeptPicture;
use zerkalo::dashboard::scene_source::{NEW, SceneSource};
use zerkalo_render::film::LinearImage;
use zerkalo_world::Precision;

/// Path of the scene file.
pub const FILE: &str = "room.toml";

/// Text of the scene of a room with a light, a mirror and three objects.
pub const ROOM: &str = r#"# A room.
[film]
size = [64, 48]

[camera]
eye = [0.0, 1.0, 5.0]   # at the door
target = [0.0, 1.0, 0.0]
view_angle.vertical = 40.0

[ambient]
color = [0.1, 0.1, 0.1]

[[light]]
name = "lamp"
point = { position = [2.0, 4.0, 3.0] }
intensity = 1.0

[materials.red]
color = [0.8, 0.1, 0.1] # like a brick

[materials.mirror]
reflection = 0.5
roughness = 0.05

[[object]]
name = "floor"
material = "red"
shape.platform = { center = [0.0, 0.0, 0.0], size = [6.0, 6.0] }

[[object]]
name = "ball"
material = "red"
shape.sphere = { center = [0.0, 1.0, 0.0], radius = 0.5 }

[[object]]
name = "glass"
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -2.0], size = [3.0, 2.0], normal = [0.0, 0.0, 1.0] }
"#;

/// Dashboard with its simulated environment.
pub struct Desk {
    pub model: Model,
    pub now: Duration,
    /// Effects that the dashboard has requested since the list was last cleared.
    pub effects: Vec<Effect>,
    /// Simulated files: path and text of each.
    pub disk: BTreeMap<PathBuf, String>,
    /// Labels of the commands that were run by keys or from the command palette.
    pub fired: HashSet<&'static str>,
    pub document: Document,
    begun_with: Document,
    /// `true` if requests of the dashboard to load the file are answered, `false` if they are
    /// ignored. The test of random events ignores them, because each load restarts the undo
    /// history.
    pub reads: bool,
}

fn parse(text: &str) -> Document {
    Document::parse(text.to_string(), FILE).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

impl Desk {
    /// Opens the dashboard on a scene file with the text `text`.
    pub fn new(text: &str) -> Self {
        let document = parse(text);
        let scene = Arc::new(document.scene().clone());
        let stop = noise_stop(0.5);
        let model = Model::new(Some(FILE.into()), FILE, Ok(scene), stop);
        let disk = [(PathBuf::from(FILE), text.to_string())].into();
        let (effects, fired) = (Vec::new(), HashSet::new());
        let begun_with = document.clone();
        let mut desk = Self {
            model,
            now: Duration::ZERO,
            effects,
            disk,
            fired,
            document,
            begun_with,
            reads: true,
        };
        desk.effects = update(&mut desk.model, Message::Resize([120, 36]), Duration::ZERO);
        desk
    }

    /// Opens the dashboard on a scene file that does not exist.
    pub fn on_new_file() -> Self {
        let mut desk = Self::new(NEW);
        desk.disk.clear();
        desk.model.file.is_new = true;
        desk
    }

    /// Returns the text that a save would write to the scene file.
    pub fn text(&self) -> String {
        let mut document = self.document.clone();
        document.apply(self.model.history.scene());
        document.text().to_string()
    }

    /// Returns the document of the scene file as it was opened.
    pub fn original(&self) -> Document {
        self.begun_with.clone()
    }

    /// Returns the scene as the view shows it.
    pub fn scene(&self) -> &Scene {
        self.model.seen()
    }

    pub fn select(&mut self, target: Target) {
        assert!(target.exists(self.scene()), "{target:?}");
        self.model.selection = target;
    }

    /// Sends a message to the dashboard and answers the effects that it requests.
    pub fn send(&mut self, message: Message) {
        let effects = update(&mut self.model, message, self.now);
        for effect in effects {
            self.effects.push(effect.clone());
            if let Some(answer) = self.answers(effect) {
                self.send(answer);
            }
        }
    }

    fn answers(&mut self, effect: Effect) -> Option<Message> {
        Some(match effect {
            Effect::Save { scene, path, overwrite } => {
                let is_own_file = path.is_none();
                let path = path.unwrap_or_else(|| FILE.into());
                let result = if self.disk.contains_key(&path) && !is_own_file && !overwrite {
                    Err(SaveError::Exists(path))
                } else {
                    self.document.apply(&scene);
                    self.disk.insert(path.clone(), self.document.text().to_string());
                    Ok(path)
                };
                Message::Saved(scene, result)
            }
            Effect::Load if self.reads => {
                let text = self.disk.get(Path::new(FILE)).cloned().unwrap_or_default();
                let read = Document::parse(text, FILE);
                if let Ok(document) = &read {
                    self.document = document.clone();
                }
                Message::Loaded(Box::new(read.map(|d| Arc::new(d.scene().clone()))))
            }
            Effect::ListScenes => Message::Scenes(vec![
                (FILE.to_string(), "file"),
                ("lamp-and-mirror".to_string(), "built in"),
            ]),
            Effect::Open(source) if self.reads => {
                let name = match &source {
                    SceneSource::File(path) => path.display().to_string(),
                    SceneSource::New | SceneSource::BuiltIn(_) => String::new(),
                };
                let text = self.disk.get(Path::new(&name)).cloned();
                let read = match text {
                    Some(text) => Document::parse(text, &name),
                    None => source.open(Arc::default()).map(|file| file.document),
                };
                Message::Opened(Box::new(read.map(|document| {
                    self.document = document;
                    OpenedScene {
                        scene: Arc::new(self.document.scene().clone()),
                        path: (!name.is_empty()).then(|| name.clone().into()),
                        is_new: !self.disk.contains_key(Path::new(&name)),
                        name: self.document.name.clone(),
                    }
                })))
            }
            Effect::Export(format) => Message::Exported(Ok(Exported {
                path: format!("room-1.{}", format.extension()).into(),
                description: "64x48  16 spp  noise 2.50 levels".into(),
                advice: "scp me@here:room-1.png .".into(),
                is_image: true,
            })),
            Effect::Checkpoint(_) => Message::Exported(Ok(Exported {
                path: "room-1.zk".into(),
                description: "checkpoint".into(),
                advice: "`zerkalo room-1.zk` continues it".into(),
                is_image: false,
            })),
            Effect::Pin { step, is_pinned } => {
                let header = Header {
                    width: 64,
                    height: 48,
                    scales: vec![1.0],
                    seed: 0,
                    precision: Precision::Single,
                };
                let mix = LightWeights { weights: vec![[1.0; 3]] };
                Message::Pinned(KeptPicture {
                    image: Arc::new(LinearImage::of_film(&Film::new(header), &mix)),
                    spp: 16.0,
                    noise_levels: None,
                    generation: 1,
                    step,
                    is_pinned,
                })
            }
            _ => return None,
        })
    }

    /// Presses a key, a tenth of a second after the last event.
    pub fn key(&mut self, key: Key) {
        self.now += Duration::from_millis(100);
        self.fired.extend(self.would_fire(key));
        self.send(Message::Key(key));
    }

    /// Returns the labels of the commands that `key` would run in the current state.
    fn would_fire(&self, key: Key) -> Vec<&'static str> {
        if self.editor().is_some_and(|editor| editor.clone().key(key)) {
            return Vec::new();
        }
        let types = matches!(key, Key { code: Code::Char(_), ctrl: false, alt: false, .. });
        if types && self.model.overlay.is_some() {
            return Vec::new();
        }
        let command = lookup(COMMANDS, self.model.context(), key);
        let mut fired: Vec<_> = command.map(|command| command.label).into_iter().collect();
        if key.code == Code::Enter {
            fired.extend(self.picked_command());
        }
        fired
    }

    /// Returns the label of the command under the cursor of the command palette.
    pub fn picked_command(&self) -> Option<&'static str> {
        let Some(Overlay::Pick(pick)) = &self.model.overlay else { return None };
        let name = &pick.entries[*pick.found.get(pick.at.index)?].name;
        COMMANDS.iter().map(|command| command.label).find(|label| label == name)
    }

    /// Presses the keys with the given names. Text between backquotes is typed character by
    /// character.
    pub fn keys(&mut self, keys: &str) -> &mut Self {
        for (i, part) in keys.split('`').enumerate() {
            if i % 2 == 1 {
                let plain = |c| Key { code: Code::Char(c), ctrl: false, alt: false, shift: false };
                part.chars().for_each(|c| self.key(plain(c)));
            } else {
                for name in part.split_whitespace() {
                    self.key(name.parse().unwrap_or_else(|e| panic!("{e}")));
                }
            }
        }
        self
    }

    /// Finds a command by its label in the command palette and runs it.
    pub fn palette(&mut self, label: &str) -> &mut Self {
        self.keys(": ").keys(&format!("`{label}`"));
        let Some(Overlay::Pick(pick)) = &self.model.overlay else { panic!("no palette") };
        let downs = pick.found.iter().position(|found| pick.entries[*found].name == label);
        let downs = downs.unwrap_or_else(|| panic!("{label} is not found by its own name"));
        assert!(downs < 10, "{label} is {downs} lines down");
        for _ in 0..downs {
            self.keys("Down");
        }
        self.keys("Enter")
    }

    pub fn mouse(&mut self, kind: MouseKind, column: u16, row: u16) -> &mut Self {
        self.now += Duration::from_millis(20);
        self.send(Message::Mouse(Mouse { kind, column, row, modified: false }));
        self
    }

    pub fn click(&mut self, column: u16, row: u16) -> &mut Self {
        self.mouse(MouseKind::Press(Button::Left), column, row);
        self.mouse(MouseKind::Release(Button::Left), column, row)
    }

    /// Drags the mouse from the cell `from` by `by` cells, in steps of one cell.
    pub fn drag(&mut self, button: Button, from: [u16; 2], by: [i16; 2]) -> &mut Self {
        self.mouse(MouseKind::Press(button), from[0], from[1]);
        let steps = by[0].abs().max(by[1].abs()).max(1);
        let cell_of_step = |i: i16| {
            let along = |c: usize| from[c].saturating_add_signed(by[c] * i / steps);
            [along(0), along(1)]
        };
        for i in 1..=steps {
            let [column, row] = cell_of_step(i);
            self.mouse(MouseKind::Drag(button), column, row);
        }
        let [column, row] = cell_of_step(steps);
        self.mouse(MouseKind::Release(button), column, row)
    }

    pub fn undo_all(&mut self) {
        while self.model.history.undo().is_some() {}
    }

    pub fn asked(&self, what: impl Fn(&Effect) -> bool) -> bool {
        self.effects.iter().any(what)
    }

    /// Returns the text of the notice on the screen, or an empty string.
    pub fn notice(&self) -> &str {
        self.model.notice.as_ref().map_or("", |notice| &notice.text)
    }

    /// Returns the text editor that receives the keys; `None` if no text is edited.
    pub fn editor(&self) -> Option<&Editor> {
        match &self.model.overlay {
            Some(Overlay::Pick(pick)) => Some(&pick.editor),
            Some(Overlay::Prompt(prompt)) => Some(&prompt.editor),
            None | Some(Overlay::Form(_)) => {
                let list = self.model.field_list();
                list.filter.as_ref().or(list.editor.as_ref())
            }
            Some(_) => None,
        }
    }

    pub fn problem(&self) -> Option<&str> {
        self.editor()?.problem.as_deref()
    }
}
