//! Command palette: actions, properties and parts of the scene, found by words, and typed commands
//! such as `set roughness 0.3`.

use crate::dashboard::panel_lines::inspector;
use crate::dashboard::update::Coalesce;
use crate::dashboard::update::commands::Command;
use crate::dashboard::{
    Effect, FieldLine, Focus, KeyContext, Overlay, PanelLine, PickEntry, UpdateContext,
};
use std::collections::HashSet;
use zerkalo_scene::edit::{self, SceneSettings, Target, outline};

/// Number of palette entries that come first because they were chosen last.
const RECENT: usize = 12;

/// Other words for properties: the key's last part, and the words.
const SYNONYMS: &[(&str, &str)] = &[
    ("size", "resolution width height settings"),
    ("rays_per_pixel", "samples spp settings"),
    ("max_depth", "rays bounces reflections depth settings"),
    ("vertical", "fov zoom"),
    ("horizontal", "fov zoom"),
    ("roughness", "blur crisp sharp glossy"),
    ("metal", "gold silver copper iron"),
    ("preset", "gold glass metal plastic"),
    ("ior", "refraction glass index"),
    ("transmission", "glass transparent"),
    ("reflection", "mirror"),
    ("intensity", "bright power"),
    ("color", "colour paint"),
    ("eye", "position"),
    ("center", "position place"),
];

/// Effect of an entry of the palette.
enum Choice {
    Run(&'static Command),
    /// Jumps to a property.
    Edit(Box<FieldLine>),
    Select(Target),
}

impl PickEntry {
    fn of(command: &Command, watching: bool) -> Self {
        Self {
            name: command.label.to_string(),
            note: command.chapter.to_string(),
            keys: command.formatted_keys(watching, str::to_string),
            also: command.also.to_string(),
            comes_late: false,
        }
    }
}

impl UpdateContext<'_> {
    /// Opens the palette. In `zerkalo watch`, it has actions only.
    pub(super) fn open_palette(&mut self) {
        let mut entries: Vec<_> = self.palette().into_iter().map(|(entry, _)| entry).collect();
        let recent = |entry: &PickEntry| {
            self.model.recent.iter().position(|name| *name == entry.name).unwrap_or(usize::MAX)
        };
        entries.sort_by_key(recent);
        let title = "actions, fields and parts · w  q  q!  wq  x  e FILE  set FIELD VALUE";
        self.open_pick(title, entries, 0, |c, name| c.choose(name));
        if let Some(Overlay::Pick(pick)) = &mut self.model.overlay {
            pick.takes_commands = true;
        }
    }

    /// Opens the list of all actions: first those of the focused panel or mode, then those that
    /// have keys everywhere.
    pub(super) fn open_help(&mut self) {
        let context = self.model.context();
        let watching = self.model.watch.is_some();
        let has_keys = |command: &Command, place: KeyContext| {
            command.keys.iter().any(|(context, _)| *context == place)
        };
        let rank = |command: &&Command| {
            let place = context.chain().position(|place| has_keys(command, place));
            place.unwrap_or(usize::MAX)
        };
        let mut commands: Vec<_> =
            self.model.preferences.commands.iter().filter(|c| c.is_listed(self.model)).collect();
        commands.sort_by_key(rank);
        let entry = |command: &Command| {
            let entry = PickEntry::of(command, watching);
            let here = |place| command.keys.iter().find(|(context, _)| *context == place);
            // The place of keys that work here goes without saying.
            let keys = context.chain().find_map(here).map(|(_, keys)| keys.to_string());
            PickEntry { keys: keys.unwrap_or(entry.keys), ..entry }
        };
        let entries: Vec<_> = commands.into_iter().map(entry).collect();
        let place = context.place();
        let title = format!("keys {place} · type to search").replace("  ", " ");
        self.open_pick(title, entries, 0, |c, label| c.choose(label));
    }

    /// Filters the properties in the inspector, or elsewhere lists parts and fields of the scene.
    pub(super) fn find(&mut self) {
        if self.model.context() == KeyContext::Inspector {
            return self.open_filter("");
        }
        let found = self.palette().into_iter();
        let found = found.filter(|(_, choice)| !matches!(choice, Choice::Run(_)));
        let (parts, fields): (Vec<_>, Vec<_>) =
            found.partition(|(_, choice)| matches!(choice, Choice::Select(_)));
        let entries: Vec<_> = parts.into_iter().chain(fields).map(|(entry, _)| entry).collect();
        self.open_pick("find a part or a field", entries, 0, |c, name| c.choose(name));
    }

    fn palette(&self) -> Vec<(PickEntry, Choice)> {
        let watching = self.model.watch.is_some();
        let listed =
            self.model.preferences.commands.iter().filter(|command| command.is_listed(self.model));
        let mut list: Vec<_> =
            listed.map(|c| (PickEntry::of(c, watching), Choice::Run(c))).collect();
        if watching || self.model.file.unreadable {
            return list;
        }
        let scene = self.scene();
        let mut names = HashSet::new();
        for field in self.reachable_fields() {
            let last = field.property.key.rsplit('.').next();
            let also = SYNONYMS.iter().find(|(key, _)| Some(*key) == last);
            let also = also.map_or("", |(_, words)| words).to_string();
            let shown =
                [(&field.property.label, &field.property.value), (&field.label, &field.value)];
            for (label, value) in shown {
                let name = format!("{label} of {}", field.target.label(scene));
                if names.insert(name.clone()) {
                    let entry = PickEntry { also: also.clone(), ..PickEntry::new(name, value) };
                    list.push((entry, Choice::Edit(Box::new(field.clone()))));
                }
            }
        }
        for (section, target) in outline(scene) {
            let name = format!("select {}", target.title(scene));
            list.push((PickEntry::new(name, section.title()), Choice::Select(target)));
        }
        list
    }

    /// Returns the properties of the selection and its material, of the mirror, and of camera, film
    /// and integrator.
    fn reachable_fields(&self) -> Vec<FieldLine> {
        let scene = self.scene();
        let selection = &self.model.selection;
        let mirror = edit::mirror(scene, Some(selection));
        let settings = [SceneSettings::Film, SceneSettings::Integrator].map(Target::Settings);
        let targets = [Some(selection.clone()), mirror.map(Target::Material), Some(Target::Camera)];
        let lines = targets.into_iter().flatten().chain(settings);
        let lines = lines.flat_map(|target| inspector(scene, &target));
        lines
            .filter_map(|line| if let PanelLine::Entry(field) = line { Some(*field) } else { None })
            .collect()
    }

    /// Carries out the entry of the palette or of the help with this name.
    fn choose(&mut self, name: &str) {
        let mut palette = self.palette().into_iter();
        let Some((_, choice)) = palette.find(|(entry, _)| entry.name == name) else { return };
        self.model.recent.retain(|other| other != name);
        self.model.recent.insert(0, name.to_string());
        self.model.recent.truncate(RECENT);
        match choice {
            Choice::Run(command) => self.run(command),
            Choice::Select(target) => {
                self.end_mode();
                self.select(target);
                let label = self.model.selection.label(self.scene());
                self.say(label);
            }
            Choice::Edit(field) => {
                let shown = self.model.selection == field.target
                    || self.model.selection.material(self.scene()).as_ref() == Some(&field.target);
                if !shown {
                    self.select(field.target.clone());
                }
                self.set_focus(Focus::Inspector);
                self.show_row(|line| line.is_same(&field));
            }
        }
    }

    /// Carries out `text` if it is a typed command. Returns `false` if it is none.
    pub(super) fn typed_command(&mut self, text: &str) -> bool {
        let (word, rest) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
        let is_edited = self.model.is_unsaved();
        let label = match (word, rest) {
            ("w", "") => "save",
            ("wq" | "x", "") if is_edited => "save",
            ("q" | "wq" | "x", "") => "quit",
            ("e", "") => "read the file again",
            _ => "",
        };
        let edits = self.model.watch.is_none() && !self.model.file.unreadable;
        let palette = self.model.overlay.take();
        let result = match word {
            _ if !label.is_empty() => {
                self.model.quit_when_saved = label == "save" && word != "w";
                self.choose(label);
                Ok(())
            }
            "q!" => {
                self.emit(Effect::Quit);
                Ok(())
            }
            "w" if edits => self.save_to(rest.trim()),
            "e" if self.model.watch.is_none() => {
                self.open_scene_file(rest.trim());
                Ok(())
            }
            "set" if edits => self.set_typed(rest.trim()),
            _ => {
                self.model.overlay = palette;
                return false;
            }
        };
        if let Err(problem) = result {
            self.refuse(&problem);
            self.model.overlay = palette;
        }
        true
    }

    /// Sets the property that `text` names, such as `roughness 0.3` or `center.x 2`.
    fn set_typed(&mut self, text: &str) -> Result<(), String> {
        let (name, value) = text.split_once([' ', '=']).unwrap_or((text, ""));
        let value = value.trim_start_matches([' ', '=']);
        if name.is_empty() || value.is_empty() {
            return Err("A field and a value are needed: set roughness 0.3".to_string());
        }
        let fields = self.reachable_fields();
        let number = |field: &FieldLine| field.label.replace(' ', "_") == name;
        let whole = |field: &FieldLine| {
            let key = &field.property.key;
            key == name || key.rsplit('.').next() == Some(name)
        };
        let found = fields.iter().find(|field| number(field) || whole(field));
        let field = found.ok_or_else(|| format!("There is no field \"{name}\" here."))?;
        let mut field = field.clone();
        if !number(&field) {
            (field.component, field.value) = (None, field.property.value.clone());
        }
        let edit = self.set_field(&field, value)?;
        self.record(edit, Coalesce::Single);
        let label = field.target.label(self.scene());
        self.say(format!("{name} of {label}: {value}"));
        Ok(())
    }

    /// Lists the undo steps. The chosen one becomes the last that is not undone.
    pub(super) fn list_steps(&mut self) {
        let (done, undone) = self.model.history.labels();
        let count = done.len();
        let entry = |(i, label): (usize, &str)| {
            let note = ["", "now", "undone"][usize::from(i >= count) + usize::from(i > count)];
            PickEntry::new(format!("{i} {label}"), note)
        };
        let labels = std::iter::once("as opened").chain(done).chain(undone);
        let entries: Vec<_> = labels.enumerate().map(entry).collect();
        self.open_pick("undo steps", entries, count, |c, name| {
            let step = name.split(' ').next().and_then(|n| n.parse::<usize>().ok()).unwrap_or(0);
            let now = c.model.history.labels().0.len();
            let (undo, times) = (step < now, step.abs_diff(now));
            for _ in 0..times {
                if undo { c.undo() } else { c.redo() }
            }
            c.say(format!("now at step {name}"));
        });
    }
}
