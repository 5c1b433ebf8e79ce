//! Prompts for names, paths, stop criteria and sizes.

use crate::dashboard::model::RunningExport;
use crate::dashboard::update::Coalesce;
use crate::dashboard::{Answer, Editor, Effect, Format, Overlay, Prompt, UpdateContext};
use std::path::PathBuf;
use std::sync::Arc;
use zerkalo_render::schedule::Stop;
use zerkalo_render::{ErrorTarget, ROUNDING_TO_8_BITS};
use zerkalo_scene::edit::{self, SceneSettings, Target};
use zerkalo_scene::value::{number, truncated};

/// Largest number of copies that one array adds.
const MOST_COPIES: u32 = 50;

impl UpdateContext<'_> {
    /// Opens a prompt with `text` in its editor. The edited text is passed to `apply`.
    fn prompt(
        &mut self,
        title: &str,
        help: &str,
        text: impl Into<String>,
        apply: fn(&mut UpdateContext<'_>, &str) -> Result<(), String>,
    ) {
        let (title, help) = (title.to_string(), help.to_string());
        let editor = Editor::replacing(text);
        let takes_path = title == "save as";
        self.model.overlay =
            Some(Overlay::Prompt(Prompt { title, help, editor, takes_path, apply }));
    }

    pub(super) fn ask_path(&mut self) {
        let path = match &self.model.file.path {
            Some(path) => path.display().to_string(),
            None => self.model.file.name.clone(),
        };
        let help = "A path. An existing file is overwritten only after confirmation.";
        self.prompt("save as", help, path, |c, path| c.save_to(path));
    }

    pub(super) fn ask_name(&mut self) {
        let (scene, target) = (self.scene(), &self.model.selection);
        let label = target.label(scene);
        let name = match target {
            Target::Light(i) => scene.lights.get(*i).map(|light| light.name.clone()),
            Target::Object(i) => scene.objects.get(*i).map(|object| object.name.clone()),
            Target::Material(name) | Target::View(name) | Target::Group(name) => Some(name.clone()),
            Target::Part(..) => Some(label.clone()),
            Target::Camera | Target::Settings(_) => None,
        };
        match name {
            Some(name) => {
                let help = "A name that is unique among its kind.";
                self.prompt(&format!("rename {label}"), help, name, |c, name| c.rename(name));
            }
            None => self.refuse(&format!("{label} has no name to change")),
        }
    }

    /// Asks for a distance, which the typed axis or digit begins.
    pub(super) fn ask_move(&mut self) {
        let text = match self.typed {
            Some(c @ 'x'..='z') => format!("{c} "),
            typed => typed.map(String::from).unwrap_or_default(),
        };
        let help = "An axis and a distance in scene units, such as x .5, or all three: .5 0 -1.";
        self.prompt("move by", help, "", |c, text| c.move_typed(text));
        self.continue_prompt(text);
    }

    pub(super) fn ask_angle(&mut self) {
        let text = self.typed.map(String::from).unwrap_or_default();
        let help = "Degrees about the vertical axis, counter-clockwise seen from above.";
        self.prompt("rotate by", help, "", |c, text| {
            let degrees = text.parse().map_err(|_| "Type an angle, such as 30.".to_string())?;
            c.rotate_selection(degrees);
            c.end_mode();
            Ok(())
        });
        self.continue_prompt(text);
    }

    pub(super) fn ask_scale(&mut self) {
        let help = "A factor, such as 1.5 or .8. The underside stays where it is.";
        self.prompt("scale by", help, "1", |c, text| {
            let factor = text.parse().map_err(|_| "Type a factor, such as 1.5.".to_string())?;
            c.scale_selection(factor)
        });
    }

    pub(super) fn ask_array(&mut self) {
        let help = "Copies, then axis and distance from each to the next, such as 4 x .5.";
        self.prompt("array", help, "3 x 1", |c, text| {
            let (count, by) = text.split_once(' ').unwrap_or((text, ""));
            let count = count.parse().ok().filter(|n| (1..=MOST_COPIES).contains(n));
            let wrong =
                || format!("Type up to {MOST_COPIES} copies and a distance, such as 4 x .5.");
            let (count, by) = count.zip(distances(by)).ok_or_else(wrong)?;
            c.array(count, by.into())
        });
    }

    /// Puts `text` into the prompt, so that typing goes on after it.
    fn continue_prompt(&mut self, text: String) {
        if let Some(Overlay::Prompt(prompt)) = &mut self.model.overlay {
            prompt.editor = Editor::new(text);
        }
    }

    fn move_typed(&mut self, text: &str) -> Result<(), String> {
        let by = distances(text).ok_or("Type an axis and a distance, such as x .5.")?;
        self.move_by(by.into());
        self.end_mode();
        Ok(())
    }

    pub(super) fn ask_view_name(&mut self) {
        let count = self.scene().cameras.len();
        let free = (count + 1..).map(|n| format!("view {n}"));
        let name = free.into_iter().find(|name| !self.scene().cameras.contains_key(name));
        let help = "A name for this viewpoint; keys 1 to 9 recall it.";
        let name = name.unwrap_or_default();
        self.prompt("store this viewpoint", help, name, |c, name| c.store_view(name));
    }

    pub(super) fn ask_stop(&mut self) {
        let help = "noise 0.5 (8-bit levels), rmse 0.001 (linear), spp 1000, time 60 (seconds): one or \
                    more, whichever comes first; or none";
        let now = stop_text(&self.model.stop);
        self.prompt("stop at", help, now, |c, text| parse_stop(text).map(|stop| c.set_stop(stop)));
    }

    pub(super) fn ask_export_size(&mut self) {
        if let Some(export) = &self.model.export {
            let [width, height] = export.size;
            let percent = 100.0 * export.progress;
            let text = format!("{width}x{height} is being rendered: {percent:.0} %.");
            let finish: Answer = ('n', "write it now", |c| c.finish_export());
            let cancel: Answer = ('x', "cancel it", |c| c.cancel_export());
            return self.ask(text, &[finish, cancel, ('l', "let it go on", |c| c.decline())]);
        }
        let [width, height] = self.scene().film.size;
        let text = format!("{}x{} png", 2 * width, 2 * height);
        let help = "Width x height in pixels, then png, exr, or exr rgb (no layers). Rendered to the same target.";
        self.prompt("render at another size", help, text, |c, text| c.export_sized(text));
    }

    /// Applies the text of the prompt and closes it, or shows why the text is not valid.
    pub(super) fn answer_prompt(&mut self) {
        let Some(Overlay::Prompt(prompt)) = &self.model.overlay else { return };
        let (apply, text) = (prompt.apply, prompt.editor.text().trim().to_string());
        match (apply(self, &text), &mut self.model.overlay) {
            (Err(problem), Some(Overlay::Prompt(prompt))) => prompt.editor.problem = Some(problem),
            // The answer may have replaced the prompt by another overlay.
            (Ok(()), overlay @ Some(Overlay::Prompt(_))) => *overlay = None,
            _ => {}
        }
    }

    pub(super) fn save_to(&mut self, text: &str) -> Result<(), String> {
        if text.is_empty() || text.ends_with('/') {
            return Err("A file needs a name.".to_string());
        }
        let mut path = PathBuf::from(text);
        if path.extension().is_none() {
            path.set_extension("toml");
        }
        // A save to the scene's own file checks for changes by other programs.
        let is_own_file = self.model.file.path.as_ref() == Some(&path);
        self.write((!is_own_file).then_some(path), false);
        Ok(())
    }

    fn rename(&mut self, text: &str) -> Result<(), String> {
        let edit = edit::rename(self.scene(), &self.model.selection, text)?;
        self.commit_and_select(Ok(edit));
        Ok(())
    }

    fn store_view(&mut self, text: &str) -> Result<(), String> {
        let edit = self.edit_seen(|seen| edit::store_view(seen, Some(text)))?;
        self.record(edit, Coalesce::Single);
        let number =
            self.scene().cameras.keys().position(|name| name == text).map_or(0, |index| index + 1);
        let key = if number <= 9 { format!(" · key {number}") } else { String::new() };
        self.say(format!("viewpoint {} is stored{key}", truncated(text)));
        Ok(())
    }

    /// Starts the export that the text describes, such as `1920x1080 png`.
    fn export_sized(&mut self, text: &str) -> Result<(), String> {
        let mut words = text.split_whitespace();
        let size = words.next().ok_or("A size is needed, such as 1920x1080.")?;
        let format = match (words.next(), words.clone().next()) {
            (Some("exr"), Some("rgb")) => {
                words.next();
                Format::PlainExr
            }
            (None | Some("png"), _) => Format::Png,
            (Some("exr"), _) => Format::Exr,
            (Some(other), _) => {
                return Err(format!("\"{}\" is neither png nor exr.", truncated(other)));
            }
        };
        if let Some(more) = words.next() {
            return Err(format!("Unexpected \"{}\".", truncated(more)));
        }
        let film = edit::set(self.seen(), &Target::Settings(SceneSettings::Film), "size", size);
        let scene = film?.scene;
        let size = scene.film.size;
        let left = self.expected_seconds(&scene);
        self.model.export = Some(RunningExport { size, progress: 0.0, left });
        let (display, stop) = (self.model.display, self.model.stop);
        self.emit(Effect::ExportSized { scene: Arc::new(scene), format, display, stop });
        self.say(format!(
            "rendering {}x{} beside this picture · Ctrl-e n writes it now",
            size[0], size[1]
        ));
        Ok(())
    }
}

/// Parses axes with distances, such as `x .5 z -1`, or three distances.
fn distances(text: &str) -> Option<[f64; 3]> {
    let apart = |c: char| match c {
        'x' | 'y' | 'z' => format!(" {c} "),
        ',' => " ".to_string(),
        c => c.to_string(),
    };
    let spaced: String = text.chars().map(apart).collect();
    let mut by = [0.0; 3];
    let words: Vec<_> = spaced.split_whitespace().collect();
    let finite = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite());
    if let [x, y, z] = words[..]
        && finite(x).is_some()
    {
        return Some([finite(x)?, finite(y)?, finite(z)?]);
    }
    for pair in words.chunks(2) {
        let [axis, distance] = pair else { return None };
        by["xyz".find(axis)?] += finite(distance)?;
    }
    (!words.is_empty()).then_some(by)
}

/// Formats stop criteria, such as `noise 0.5 time 60`, or `none`.
pub(super) fn stop_text(stop: &Stop) -> String {
    let targets = [
        ("noise", stop.noise_levels),
        ("rmse", stop.rmse_linear),
        ("error", stop.error.map(|error| error.levels)),
        ("spp", stop.spp.map(f64::from)),
        ("time", stop.seconds),
    ];
    let given = targets.iter().filter_map(|(word, x)| Some(format!("{word} {}", number((*x)?))));
    let text = given.collect::<Vec<_>>().join(" ");
    if text.is_empty() { "none".to_string() } else { text }
}

/// Parses the format of [`stop_text`]. Words are separated by spaces, commas or equals signs.
fn parse_stop(text: &str) -> Result<Stop, String> {
    let mut stop = Stop::default();
    let mut words = text.split([' ', ',', '=']).filter(|word| !word.is_empty()).peekable();
    if words.peek().is_none() {
        return Err("Type one, or none for no limit.".to_string());
    }
    while let Some(word) = words.next() {
        if word.eq_ignore_ascii_case("none") {
            continue;
        }
        let Some(value) = words.next() else {
            return Err(format!("\"{}\" needs a number, such as noise 0.5.", truncated(word)));
        };
        let positive = value.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
        let wrong =
            |expected: &str| format!("{word} cannot be \"{}\": {expected}.", truncated(value));
        let number = || positive.ok_or_else(|| wrong("expected a number greater than 0"));
        match word.to_ascii_lowercase().as_str() {
            "noise" => stop.noise_levels = Some(number()?),
            "rmse" => stop.rmse_linear = Some(number()?),
            "error" => {
                let quantization = ROUNDING_TO_8_BITS;
                stop.error = Some(ErrorTarget { levels: number()?, quantization });
            }
            "time" => stop.seconds = Some(number()?),
            "spp" => {
                let whole = value.parse().ok().filter(|n: &u32| *n > 0);
                stop.spp =
                    Some(whole.ok_or_else(|| wrong("expected a whole number of at least 1"))?);
            }
            _ => {
                let word = truncated(word);
                return Err(format!(
                    "\"{word}\" is not known: noise, rmse, error, spp, time or none."
                ));
            }
        }
    }
    Ok(stop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_have_axes() {
        assert_eq!(distances("x .5"), Some([0.5, 0.0, 0.0]));
        assert_eq!(distances("y-1 x2"), Some([2.0, -1.0, 0.0]));
        assert_eq!(distances(".5, 0 -1"), Some([0.5, 0.0, -1.0]));
        for text in ["", "x", "1", "1 2", "a 1", "x inf", "x 1 2"] {
            assert_eq!(distances(text), None, "{text}");
        }
    }

    #[test]
    fn stop_criteria_round_trip_through_text() {
        let all = Stop {
            spp: Some(1000),
            noise_levels: Some(0.5),
            rmse_linear: Some(0.001),
            error: Some(ErrorTarget { levels: 0.6, quantization: ROUNDING_TO_8_BITS }),
            seconds: Some(60.0),
        };
        for stop in [all, Stop::default(), Stop { seconds: Some(1.5), ..Stop::default() }] {
            assert_eq!(parse_stop(&stop_text(&stop)), Ok(stop));
        }
        assert_eq!(parse_stop("NOISE=0.5, spp 1000 rmse 0.001,time 60 error .6"), Ok(all));
        for wrong in
            ["", "noise", "noise -1", "spp 0", "spp 1.5", "time nan", "0.5", "x 1", "time inf"]
        {
            assert!(parse_stop(wrong).is_err(), "{wrong}");
        }
    }
}
