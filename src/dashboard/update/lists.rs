//! Commands that move the cursor and open the entry under it, in panels and overlays.

use crate::dashboard::hints::help;
use crate::dashboard::panel_lines::{outline, outline_position, scrolled};
use crate::dashboard::update::commands::{COMMANDS, Command};
use crate::dashboard::{
    Answer, CommandPalette, Editor, Effect, Focus, OutlineLine, Overlay, Question, UpdateContext,
};
use nucleo_matcher::pattern::{CaseMatching, Normalization, Pattern};
use nucleo_matcher::{Config, Matcher, Utf32Str};
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::QUALITIES;

/// Returns `cursor` moved within a list of `len` entries.
fn moved(cursor: usize, steps: isize, len: usize) -> usize {
    cursor.saturating_add_signed(steps).min(len.saturating_sub(1))
}

impl UpdateContext<'_> {
    /// Moves the cursor of the open overlay, or of the focused panel, by `steps` lines. Scrolls an
    /// overlay without cursor.
    pub(super) fn move_cursor(&mut self, steps: isize) {
        let list = self.model.overlay_layout().map(|layout| layout.list);
        let (width, rows) = list.map_or((1, 1), |list| (list.width, usize::from(list.height)));
        let [help, inventory] = [help(self.model).len(), self.model.inventory(width).len()];
        match &mut self.model.overlay {
            Some(Overlay::Help { scroll }) => {
                *scroll = moved(*scroll, steps, help.saturating_sub(rows) + 1);
            }
            Some(Overlay::Inventory { scroll }) => {
                *scroll = moved(*scroll, steps, inventory.saturating_sub(rows) + 1);
            }
            Some(Overlay::Form(_)) => {
                if self.apply_field() {
                    self.move_field_cursor(steps);
                }
            }
            Some(overlay) => {
                if let Some((cursor, scroll, len)) = overlay.list() {
                    *cursor = moved(*cursor, steps, len);
                    if let Some(scroll) = scroll {
                        *scroll = scrolled(*scroll, *cursor, len, rows);
                    }
                }
            }
            None if self.model.watch.is_some() => self.move_watch_cursor(steps),
            None if self.model.focus == Focus::Outline => self.move_outline_cursor(steps),
            None => self.move_field_cursor(steps),
        }
    }

    /// Moves the cursor by `pages` pages, each the number of visible rows minus 1.
    pub(super) fn page(&mut self, pages: isize) {
        let rows = match (self.model.overlay_layout(), self.model.focus) {
            (Some(layout), _) => layout.list.height,
            (None, _) if self.model.watch.is_some() => {
                self.model.watch_rows().map_or(1, |(rows, _)| rows.height)
            }
            (None, Focus::Outline) => self.model.outline_rows().map_or(1, |rows| rows.height),
            (None, _) => self.model.inspector_rows().map_or(1, |(rows, _)| rows.height),
        };
        let page = isize::from(i16::try_from(rows).unwrap_or(1)).max(2) - 1;
        self.move_cursor(pages * page);
    }

    fn move_outline_cursor(&mut self, steps: isize) {
        let lines = outline(self.scene());
        let before = outline_position(&lines, &self.model.selection).unwrap_or(0);
        let position = lines[..before].iter().filter_map(OutlineLine::entry).count();
        let entries: Vec<_> = lines.iter().filter_map(OutlineLine::entry).collect();
        if let Some(entry) = entries.get(moved(position, steps, entries.len())) {
            self.select(entry.subject.clone());
        }
    }

    /// Confirms or opens the entry under the cursor.
    pub(super) fn open(&mut self) {
        match &self.model.overlay {
            Some(Overlay::Help { .. } | Overlay::Inventory { .. }) => self.model.overlay = None,
            Some(Overlay::NoiseTargets { cursor }) => {
                let noise_levels = Some(QUALITIES[*cursor]);
                self.model.overlay = None;
                self.set_stop(Stop { noise_levels, rmse_linear: None, ..self.model.stop });
            }
            Some(Overlay::CommandPalette(palette)) => {
                if let Some(found) = palette.found.get(palette.cursor) {
                    let command = &COMMANDS[*found];
                    self.model.overlay = None;
                    self.run(command);
                }
            }
            Some(Overlay::Pick(pick)) => {
                let Some((name, _)) = pick.entries.get(pick.cursor).cloned() else { return };
                let take = pick.take;
                self.model.overlay = None;
                take(self, &name);
            }
            Some(Overlay::Form(form)) => {
                if form.fields.editor.is_none() {
                    self.confirm_form();
                } else if self.apply_field() {
                    self.move_field_cursor(1);
                }
            }
            Some(Overlay::Prompt(_)) => self.answer_prompt(),
            Some(Overlay::Question(question)) => self.answer(question.cursor),
            Some(Overlay::ViewerImage(_)) => {}
            None if self.model.watch.is_some() => {}
            None if self.model.focus == Focus::Inspector => {
                if self.model.inspector.editor.is_some() {
                    self.apply_field();
                } else {
                    self.open_field(self.typed);
                }
            }
            None => self.set_focus(Focus::Inspector),
        }
    }

    /// Closes the text editor of a form if one is open, otherwise closes the overlay.
    pub(super) fn close_overlay(&mut self) {
        match &mut self.model.overlay {
            Some(Overlay::Form(form)) if form.fields.editor.is_some() => form.fields.editor = None,
            Some(Overlay::Form(_)) => self.cancel_form(),
            _ => {
                self.model.quit_when_saved = false;
                self.model.overlay = None;
            }
        }
    }

    pub(super) fn open_command_palette(&mut self) {
        self.model.overlay = Some(Overlay::CommandPalette(CommandPalette {
            editor: Editor::default(),
            found: self.offered().into_iter().map(|(i, _)| i).collect(),
            cursor: 0,
            scroll: 0,
        }));
    }

    /// Returns the commands of the command palette, each with its index in the table.
    fn offered(&self) -> Vec<(usize, &'static Command)> {
        COMMANDS.iter().enumerate().filter(|(_, command)| command.is_listed(self.model)).collect()
    }

    /// Updates the command palette to the commands that match the search text, best match first.
    pub(super) fn search(&mut self) {
        let offered = self.offered();
        let Some(Overlay::CommandPalette(palette)) = &mut self.model.overlay else { return };
        let text = palette.editor.text();
        let pattern = Pattern::parse(text, CaseMatching::Ignore, Normalization::Smart);
        let mut matcher = Matcher::new(Config::DEFAULT);
        let mut buffer = Vec::new();
        let mut found: Vec<(u32, usize)> = offered
            .into_iter()
            .filter_map(|(i, row)| {
                let line = format!("{} {}", row.label, row.chapter);
                let score = pattern.score(Utf32Str::new(&line, &mut buffer), &mut matcher)?;
                Some((score, i))
            })
            .collect();
        found.sort_by_key(|(score, i)| (std::cmp::Reverse(*score), *i));
        palette.found = found.into_iter().map(|(_, i)| i).collect();
        palette.cursor = 0;
        palette.scroll = 0;
    }

    /// Moves the cursor to the next entry that starts with `c`, from the first one again after the
    /// last.
    pub(super) fn jump_to(&mut self, c: char) {
        let Some(Overlay::Pick(pick)) = &self.model.overlay else { return };
        let begins = |i: &usize| {
            let first = pick.entries[*i].0.chars().next();
            first.is_some_and(|first| first.eq_ignore_ascii_case(&c))
        };
        let after = (pick.cursor + 1..pick.entries.len()).find(begins);
        if let Some(to) = after.or_else(|| (0..pick.entries.len()).find(begins)) {
            self.move_cursor(to as isize - pick.cursor as isize);
        }
    }

    /// Opens a question. `answers` holds the letter, text and effect of each answer.
    pub(super) fn ask(&mut self, text: String, answers: &[(char, &'static str, Answer)]) {
        let question = Question { text, answers: answers.to_vec(), cursor: 0 };
        self.model.overlay = Some(Overlay::Question(question));
    }

    /// Closes the open question and carries out the answer with index `at`.
    pub(super) fn answer(&mut self, at: usize) {
        let Some(Overlay::Question(question)) = &self.model.overlay else { return };
        let Some((_, _, answer)) = question.answers.get(at).cloned() else { return };
        self.model.overlay = None;
        match answer {
            Answer::Nothing => self.model.quit_when_saved = false,
            Answer::SaveAndQuit => {
                self.model.quit_when_saved = true;
                self.save();
            }
            Answer::Quit => self.emit(Effect::Quit),
            Answer::Load => self.emit(Effect::Load),
            Answer::Overwrite(path) => self.write(path, true),
            Answer::SaveAs => self.ask_path(),
            Answer::Recover => self.recover(),
            Answer::Discard => self.discard_orphaned_edits(),
        }
    }
}
