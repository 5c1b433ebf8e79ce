//! Commands that move the cursor and open the entry under it, in panels and overlays.

use crate::dashboard::panel_lines::{outline_position, walked};
use crate::dashboard::search::{rank, words};
use crate::dashboard::{
    Answer, Editor, Effect, Focus, ListCursor, OutlineLine, Overlay, Pick, PickEntry, Question,
    UpdateContext,
};
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::QUALITIES;

impl UpdateContext<'_> {
    /// Moves the cursor of the open overlay, or of the focused panel, by `steps` lines.
    pub(super) fn move_cursor(&mut self, steps: isize) {
        if let Some((at, len)) = self.model.list() {
            at.walk(steps, len);
            return;
        }
        match (&self.model.overlay, self.model.focus) {
            (None, Focus::Outline) => self.move_outline_cursor(steps),
            (None | Some(Overlay::Form(_)), _) => {
                if self.apply_field() {
                    self.move_field_cursor(steps);
                }
            }
            (Some(_), _) => {}
        }
    }

    /// Moves the cursor by `pages` pages, each the number of visible rows minus 1.
    pub(super) fn page(&mut self, pages: isize) {
        let rows = self.model.list_rows().map_or(1, |rows| rows.height);
        let page = isize::from(i16::try_from(rows).unwrap_or(1)).max(2) - 1;
        self.move_cursor(pages * page);
    }

    fn move_outline_cursor(&mut self, steps: isize) {
        let lines = self.model.outline_lines();
        let position = outline_position(&lines, &self.model.selection).unwrap_or(0);
        if let Some(entry) = lines.get(walked(&lines, position, steps)).and_then(OutlineLine::entry)
        {
            self.select(entry.target.clone());
        }
    }

    /// Lists the parts of the selected compound, or else opens the inspector.
    pub(super) fn unfold(&mut self) {
        let target = self.model.selection.clone();
        let folded =
            !target.parts(self.scene()).is_empty() && !self.model.unfolded.contains(&target);
        match folded {
            true => drop(self.model.unfolded.insert(target)),
            false => self.open(),
        }
    }

    /// Hides the parts of the selected compound, or selects the compound of the selected part.
    pub(super) fn fold(&mut self) {
        let target = self.model.selection.clone();
        if !self.model.unfolded.remove(&target)
            && let Some(compound) = target.compound()
        {
            self.select(compound);
        }
    }

    /// Confirms or opens the entry under the cursor.
    pub(super) fn open(&mut self) {
        match &self.model.overlay {
            Some(Overlay::NoiseTargets(at)) => {
                let noise_levels = Some(QUALITIES[at.index]);
                self.model.overlay = None;
                self.set_stop(Stop { noise_levels, rmse_linear: None, ..self.model.stop });
            }
            Some(Overlay::Pick(pick)) => {
                let text = pick.editor.text().to_string();
                if pick.takes_commands && self.typed_command(&text) {
                    return;
                }
                let Some(Overlay::Pick(pick)) = &mut self.model.overlay else { return };
                let Some(found) = pick.found.get(pick.at.index) else {
                    pick.editor.untouched = true;
                    return;
                };
                let (name, take) = (pick.entries[*found].name.clone(), pick.take);
                self.model.overlay = None;
                take(self, &name);
            }
            Some(Overlay::Form(_)) => self.open_row(),
            Some(Overlay::Prompt(_)) => self.answer_prompt(),
            Some(Overlay::Question(question)) => self.answer(question.at.index),
            Some(Overlay::ViewerImage(_)) => {}
            None if self.model.watch.is_some() => {}
            None if self.model.focus == Focus::Inspector => self.open_row(),
            None => self.set_focus(Focus::Inspector),
        }
    }

    /// Closes the text editor of a form if one is open, otherwise closes the overlay.
    pub(super) fn close_overlay(&mut self) {
        match &mut self.model.overlay {
            Some(Overlay::Form(form)) if form.fields.editor.is_some() => form.fields.editor = None,
            Some(Overlay::Form(_)) => {
                self.model.overlay = None;
                self.show();
            }
            _ => {
                self.decline();
                self.model.overlay = None;
            }
        }
    }

    /// Opens a list with the cursor on the entry with index `index`. The name of the picked entry is
    /// passed to `take`.
    pub(super) fn open_pick(
        &mut self,
        title: impl Into<String>,
        entries: Vec<impl Into<PickEntry>>,
        index: usize,
        take: fn(&mut UpdateContext<'_>, &str),
    ) {
        let entries: Vec<_> = entries.into_iter().map(Into::into).collect();
        let (title, editor) = (title.into(), Editor::default());
        let found = (0..entries.len()).collect();
        let at = ListCursor { index, scroll: 0 };
        self.model.overlay = Some(Overlay::Pick(Pick {
            title,
            entries,
            editor,
            found,
            at,
            takes_commands: false,
            take,
        }));
    }

    /// Completes the text that is being typed, or goes to the next group of fields; `by` is 1 or, to
    /// the previous one, -1.
    pub(super) fn complete(&mut self, by: isize) {
        if let Some((text, beside_scene)) = self.typed_path().filter(|_| by > 0) {
            return self.emit(Effect::CompletePath { text, beside_scene });
        }
        match &mut self.model.overlay {
            Some(Overlay::Pick(pick)) if by > 0 => {
                if let Some(found) = pick.found.get(pick.at.index) {
                    let name = &pick.entries[*found].name;
                    let field = name.split_once(" of ").map(|(field, _)| field.replace(' ', "_"));
                    let sets = pick.takes_commands && pick.editor.text().starts_with("set ");
                    let text = field.filter(|_| sets).map(|field| format!("set {field} "));
                    pick.editor = Editor::new(text.unwrap_or_else(|| name.clone()));
                    self.search();
                }
            }
            None | Some(Overlay::Form(_)) => self.next_group(by),
            Some(_) => self.move_cursor(by),
        }
    }

    /// Returns the path that is being typed, and `true` if it is relative to the folder of the scene file.
    fn typed_path(&self) -> Option<(String, bool)> {
        let list = self.model.field_list();
        let path = |text: &str, beside| Some((text.to_string(), beside));
        match &self.model.overlay {
            Some(Overlay::Pick(pick)) if pick.takes_commands => {
                let (word, rest) = pick.editor.text().split_once(' ')?;
                path(rest, false).filter(|_| ["e", "w"].contains(&word))
            }
            Some(Overlay::Prompt(prompt)) if prompt.takes_path => path(prompt.editor.text(), false),
            None | Some(Overlay::Form(_)) => {
                let editor = list.editor.as_ref().filter(|_| list.filter.is_none())?;
                let field = self.field()?;
                path(editor.text(), true).filter(|_| field.property.key.ends_with("file"))
            }
            Some(_) => None,
        }
    }

    /// Completes the path that is being typed as far as all `paths` agree, which begin with `text`. If
    /// that is no further, shows their names.
    pub(super) fn complete_path(&mut self, text: &str, paths: &[String]) {
        if self.typed_path().is_none_or(|(typed, _)| typed != text) {
            return;
        }
        let Some(first) = paths.first() else {
            return self.say(format!("no file begins with {text}"));
        };
        let agreed = |(i, c): &(usize, char)| paths.iter().all(|path| path[*i..].starts_with(*c));
        let end = first.char_indices().take_while(agreed).map(|(i, c)| i + c.len_utf8()).last();
        let more = first[..end.unwrap_or(0)].strip_prefix(text).unwrap_or_default().to_string();
        if more.is_empty() && paths.len() > 1 {
            let start = text.rfind('/').map_or(0, |slash| slash + 1);
            self.say(paths.iter().map(|path| &path[start..]).collect::<Vec<_>>().join("  "));
        } else if let Some(editor) = self.model.editor_mut() {
            editor.untouched = false;
            editor.paste(&more);
            self.search();
        }
    }

    /// Updates the open list to the entries that match the search text, best match first.
    pub(super) fn search(&mut self) {
        if self.model.field_list().filter.is_some() {
            self.model.field_list_mut().cursor = 0;
        }
        let Some(Overlay::Pick(pick)) = &mut self.model.overlay else { return };
        let text = pick.editor.text();
        // The field is searched while its value is typed.
        let wanted = match text.strip_prefix("set ").filter(|_| pick.takes_commands) {
            Some(field) => field.split(' ').next().unwrap_or_default(),
            None => text,
        };
        let names_file = pick.takes_commands && ["e ", "w "].iter().any(|ex| text.starts_with(ex));
        let wanted = words(wanted);
        let ranked = pick.entries.iter().enumerate().filter(|_| !names_file);
        let mut ranked: Vec<_> =
            ranked.filter_map(|(i, entry)| Some((rank(&wanted, entry)?, i))).collect();
        ranked.sort_unstable();
        pick.found = ranked.into_iter().map(|(_, i)| i).collect();
        pick.at = ListCursor::default();
    }

    pub(super) fn ask(&mut self, text: String, answers: &[Answer]) {
        let question = Question { text, answers: answers.to_vec(), at: ListCursor::default() };
        let previews = self.in_form();
        self.model.overlay = Some(Overlay::Question(question));
        if previews {
            self.show();
        }
    }

    /// Closes the open question and carries out the answer with index `at`.
    pub(super) fn answer(&mut self, at: usize) {
        let Some(Overlay::Question(question)) = &self.model.overlay else { return };
        let Some((_, _, act)) = question.answers.get(at).copied() else { return };
        self.model.overlay = None;
        act(self);
    }
}
