//! Drawing of overlays.

use crate::dashboard::noise_targets::{ABOUT, APPEARANCES, cost};
use crate::dashboard::overlay_layout::OverlayLayout;
use crate::dashboard::text::{columns, cut};
use crate::dashboard::view::fields::{self, typed};
use crate::dashboard::view::painter::{ListRow, Painter, VisibleLine};
use crate::dashboard::view::theme::Theme;
use crate::dashboard::{Model, Overlay, Pick, Prompt, Question};
use ratatui::layout::Position;
use ratatui::style::Style;
use zerkalo_render::session::QUALITIES;

/// Draws the open overlay. Returns the position of the text cursor.
pub fn draw(model: &Model, painter: &mut Painter) -> Option<Position> {
    let (overlay, place) = (model.overlay.as_ref()?, model.overlay_layout()?);
    let title = match overlay {
        Overlay::NoiseTargets(_) => "noise targets in 8-bit levels",
        Overlay::Pick(pick) => &pick.title,
        Overlay::Form(form) => &form.title,
        Overlay::Prompt(prompt) => &prompt.title,
        Overlay::Question(_) => "",
        // `View::draw` draws it on the whole screen.
        Overlay::ViewerImage(_) => return None,
    };
    painter.overlay(place.frame, title);
    let mut painter = OverlayPainter { place, theme: painter.theme, painter };
    match overlay {
        Overlay::NoiseTargets(at) => painter.noise_targets(model, at.index),
        Overlay::Pick(pick) => return painter.pick(pick),
        Overlay::Form(_) => {
            return fields::draw(model, place.list, place.help, true, painter.painter);
        }
        Overlay::Prompt(prompt) => return painter.prompt(prompt),
        Overlay::Question(question) => painter.question(question),
        Overlay::ViewerImage(_) => {}
    }
    None
}

struct OverlayPainter<'a, 'b> {
    place: OverlayLayout,
    theme: Theme,
    painter: &'a mut Painter<'b>,
}

impl OverlayPainter<'_, '_> {
    fn say(&mut self, text: &str, style: Style) {
        self.painter.paragraphs(self.place.help, &[(text.to_string(), style)]);
    }

    /// Starts a row of the list. `is_chosen` is `true` for the row under the cursor.
    fn choice(&mut self, row: u16, is_chosen: bool) -> ListRow<'_> {
        let mut choice = self.painter.list_row(self.place.list, row, is_chosen.then_some(true));
        choice.to.put(if is_chosen { " ▸ " } else { "   " }, choice.name);
        choice
    }

    fn noise_targets(&mut self, model: &Model, cursor: usize) {
        let good = self.theme.good();
        let report = model.snapshot.as_ref().map(|snapshot| &snapshot.report);
        for (row, (i, noise_levels)) in (0..self.place.list.height).zip((0..).zip(QUALITIES)) {
            let ListRow { mut to, name, note: text, .. } = self.choice(row, i == cursor);
            let cost = cost(report, &model.convergence, i);
            let mark = if model.stop.noise_levels == Some(noise_levels) { "→ " } else { "  " };
            to.put_right("  ", 0, text).put_right(&cost, 8, name);
            to.put_right("  ", 0, text).put(mark, good);
            to.put_wide(&noise_levels.to_string(), 5, name);
            to.skip(2).put(APPEARANCES[i], text);
        }
        self.say(ABOUT, self.theme.dim());
    }

    fn pick(&mut self, pick: &Pick) -> Option<Position> {
        let mut input = self.painter.row(self.place.input, 0);
        input.put(" : ", self.theme.accent());
        let cursor = typed(&pick.editor, &mut input);
        if pick.found.is_empty() {
            let style = self.theme.dim();
            let text = match pick.editor.text().starts_with(['e', 'w']) && pick.takes_commands {
                true => "Tab completes the path",
                false => "no match · Enter: type anew",
            };
            self.painter.row(self.place.list, 0).skip(3).put(text, style);
        }
        let names = pick.entries.iter().map(|entry| columns(&entry.name)).max().unwrap_or(0);
        let (list, border) = (self.place.list, self.theme.border(true));
        let window = self.painter.window(list, pick.at.scroll, pick.found.len(), border);
        for VisibleLine { row, index } in window {
            let entry = &pick.entries[pick.found[index]];
            let ListRow { mut to, name, note, key } = self.choice(row, index == pick.at.index);
            // A long list of keys must not shorten the name.
            let room = to.left().saturating_sub(columns(&entry.name) + 3);
            to.put_right(" ", 0, key).put_right(&cut(&entry.keys, room), 0, key);
            to.put_wide(&entry.name, names, name).skip(2);
            // A description may be truncated. A chapter beside long keys is omitted instead.
            if entry.keys.is_empty() || columns(&entry.note) < to.left() {
                to.put(&entry.note, note);
            }
        }
        cursor
    }

    fn prompt(&mut self, prompt: &Prompt) -> Option<Position> {
        match &prompt.editor.problem {
            Some(problem) => self.say(problem, self.theme.bad()),
            None => self.say(&prompt.help, self.theme.dim()),
        }
        typed(&prompt.editor, &mut self.painter.row(self.place.input, 0))
    }

    fn question(&mut self, question: &Question) {
        self.say(&question.text, self.theme.text());
        for (row, (i, (letter, words, _))) in (0..).zip(question.answers.iter().enumerate()) {
            let ListRow { mut to, name, key, .. } = self.choice(row, i == question.at.index);
            to.put(&letter.to_string(), key).skip(2).put(words, name);
        }
    }
}
