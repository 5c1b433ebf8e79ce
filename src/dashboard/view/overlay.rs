//! Drawing of overlays: help, lists, forms, prompts, questions.

use crate::dashboard::hints::{HelpLine, help};
use crate::dashboard::model::Model;
use crate::dashboard::noise_targets::{ABOUT, Cost, LOOKS, cost};
use crate::dashboard::overlay::{CommandPalette, Form, Overlay, Pick, Prompt, Question};
use crate::dashboard::overlay_layout::OverlayLayout;
use crate::dashboard::update::commands::COMMANDS;
use crate::dashboard::view::fields::{Fields, heading, typed};
use crate::dashboard::view::frame::{overlay, window};
use crate::dashboard::view::text::{Row, columns, cut, duration, durations, paragraphs};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use ratatui::layout::Position;
use ratatui::style::Style;
use zerkalo_render::session::QUALITIES;

/// Draws the open overlay. Returns the position of the text cursor, or `None` if the cursor is
/// hidden.
pub fn draw(model: &Model, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
    let mut painter = Painter { place: model.overlay_layout()?, theme, buffer };
    match model.overlay.as_ref()? {
        Overlay::Help { scroll } => painter.help(model.watch.is_some(), *scroll),
        Overlay::Inventory { scroll } => painter.inventory(model, *scroll),
        Overlay::NoiseTargets { cursor } => painter.noise_targets(model, *cursor),
        Overlay::CommandPalette(palette) => return painter.palette(palette),
        Overlay::Pick(pick) => painter.pick(pick),
        Overlay::Form(form) => return painter.form(model, form),
        Overlay::Prompt(prompt) => return painter.prompt(prompt),
        // The image viewer has the whole screen and is drawn by `View::draw`.
        Overlay::ViewerImage(_) => {}
        Overlay::Question(question) => painter.question(question),
    }
    None
}

/// Areas, theme and target buffer of the overlay that is drawn.
struct Painter<'a> {
    place: OverlayLayout,
    theme: &'a Theme,
    buffer: &'a mut Buffer,
}

impl Painter<'_> {
    fn frame(&mut self, title: &str) {
        overlay(self.place.frame, title, self.theme, self.buffer);
    }

    /// Draws the scroll bar of the overlay's list. `len` is the number of its lines, and `scroll`
    /// the index of the first visible one. Returns two values for each visible line: its row in the
    /// area of the list and its index.
    fn window(&mut self, scroll: usize, len: usize) -> impl Iterator<Item = (u16, usize)> + use<> {
        window(self.place.list, scroll, len, self.theme.border(true), self.buffer)
    }

    /// Draws `text` in the overlay's area for help.
    fn say(&mut self, text: &str, style: Style) {
        paragraphs(self.place.help, &[(text.to_string(), style)], self.buffer);
    }

    /// Starts row `row` of the overlay's list. `is_chosen` is `true` for the row under the cursor.
    /// Returns a writer of the row and three styles: for names, for other text and for keys.
    fn choice(&mut self, row: u16, is_chosen: bool) -> (Row<'_>, [Style; 3]) {
        let theme = self.theme;
        let mut to = Row::new(self.buffer, self.place.list, row);
        let styles = match is_chosen {
            true => [theme.selected(true); 3],
            false => [theme.text(), theme.dim(), theme.accent()],
        };
        if is_chosen {
            to.fill(styles[0]);
        }
        to.put(if is_chosen { " ▸ " } else { "   " }, styles[0]);
        (to, styles)
    }

    fn help(&mut self, watching: bool, scroll: usize) {
        self.frame("keys");
        let (lines, theme) = (help(watching), self.theme);
        for (row, i) in self.window(scroll, lines.len()) {
            let mut to = Row::new(self.buffer, self.place.list, row);
            match &lines[i] {
                HelpLine::Heading(title) => heading(to, title, theme),
                HelpLine::Keys(keys, label) => {
                    // A long list of keys is truncated so that it does not shorten the label.
                    let room = to.left().saturating_sub(3 + columns(label) + 2 + 1);
                    to.put_right(" ", 0, theme.text());
                    to.put_right(&cut(keys, room), 0, theme.accent());
                    to.skip(3).put(label, theme.text());
                }
            }
        }
    }

    fn inventory(&mut self, model: &Model, scroll: usize) {
        self.frame("inventory");
        let lines = model.inventory(self.place.list.width);
        for (row, i) in self.window(scroll, lines.len()) {
            Row::new(self.buffer, self.place.list, row).put(&lines[i], self.theme.text());
        }
    }

    fn noise_targets(&mut self, model: &Model, cursor: usize) {
        self.frame("noise targets in 8-bit levels");
        let good = self.theme.good();
        let report = model.snapshot.as_ref().map(|snapshot| &snapshot.report);
        let cost_of = |i| report.map_or(Cost::Unknown, |r| cost(r, &model.convergence, i));
        for (row, (i, noise_levels)) in (0..self.place.list.height).zip((0..).zip(QUALITIES)) {
            let (mut to, [name, remainder, _]) = self.choice(row, i == cursor);
            let cost = match cost_of(i) {
                Cost::Reached(Some(seconds)) => format!("reached after {}", duration(seconds)),
                Cost::Reached(None) => "reached".to_string(),
                Cost::Left(from, to) => format!("{} more", durations(from, to)),
                Cost::Unknown => "not known yet".to_string(),
            };
            let mark = if model.stop.noise_levels == Some(noise_levels) { "→ " } else { "  " };
            to.put_right("  ", 0, remainder).put_right(&cost, 8, name);
            to.put_right("  ", 0, remainder).put(mark, good);
            to.put_wide(&noise_levels.to_string(), 5, name);
            to.skip(2).put(LOOKS[i], remainder);
        }
        self.say(ABOUT, self.theme.dim());
    }

    fn palette(&mut self, palette: &CommandPalette) -> Option<Position> {
        self.frame("all actions");
        let mut input = Row::new(self.buffer, self.place.input, 0);
        input.put(" : ", self.theme.accent());
        let cursor = typed(&palette.editor, &mut input, self.theme);
        if palette.found.is_empty() {
            let none = "no matching action";
            Row::new(self.buffer, self.place.list, 0).skip(3).put(none, self.theme.dim());
        }
        for (row, i) in self.window(palette.scroll, palette.found.len()) {
            let command = &COMMANDS[palette.found[i]];
            let (mut to, [name, remainder, key]) = self.choice(row, i == palette.cursor);
            let keys = command.all_keys(str::to_string);
            to.put_right(" ", 0, key).put_right(&keys, columns(command.label) + 2, key);
            to.put(command.label, name);
            to.put_right("  ", 1, remainder).put_right(command.chapter, 1, remainder);
        }
        cursor
    }

    fn pick(&mut self, pick: &Pick) {
        self.frame(&pick.title);
        let names = pick.entries.iter().map(|(name, _)| columns(name)).max().unwrap_or(0);
        for (row, i) in self.window(pick.scroll, pick.entries.len()) {
            let (name, doc) = &pick.entries[i];
            let (mut to, [style, remainder, _]) = self.choice(row, i == pick.cursor);
            to.put_wide(name, names, style).skip(2).put(doc, remainder);
        }
    }

    fn form(&mut self, model: &Model, form: &Form) -> Option<Position> {
        self.frame(&form.title);
        let fields = Fields {
            lines: &model.field_lines(),
            list: self.place.list,
            help: self.place.help,
            state: &form.fields,
            problem: form.problem.as_deref(),
            active: true,
        };
        fields.draw(self.theme, self.buffer)
    }

    fn prompt(&mut self, prompt: &Prompt) -> Option<Position> {
        self.frame(&prompt.title);
        match &prompt.editor.problem {
            Some(problem) => self.say(problem, self.theme.bad()),
            None => self.say(&prompt.help, self.theme.dim()),
        }
        typed(&prompt.editor, &mut Row::new(self.buffer, self.place.input, 0), self.theme)
    }

    fn question(&mut self, question: &Question) {
        self.frame("");
        self.say(&question.text, self.theme.text());
        for (row, (i, (letter, words, _))) in (0..).zip(question.answers.iter().enumerate()) {
            let (mut to, [name, _, key]) = self.choice(row, i == question.cursor);
            to.put(&letter.to_string(), key).skip(2).put(words, name);
        }
    }
}
