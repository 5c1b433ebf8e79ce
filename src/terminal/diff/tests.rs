use crate::terminal::diff::*;
use crate::terminal::flow::FrameBudget;
use ratatui::style::{Color, Style};
use std::num::NonZeroU16;

const AREA: Rect = Rect { x: 0, y: 0, width: 40, height: 12 };
const PICTURE: Rect = Rect { x: 2, y: 1, width: 30, height: 8 };
const THRESHOLD: f32 = 0.02;
const EVERYTHING: FrameBudget =
    FrameBudget { bytes: usize::MAX, picture: true, refinement: usize::MAX };

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn within(bytes: usize) -> FrameBudget {
    FrameBudget { bytes, picture: true, refinement: bytes / 2 }
}

/// A screen with a picture, a terminal, and what goes between.
struct Desk {
    pacing: FrameDiff,
    cells: Buffer,
    uncovered: Vec<bool>,
    cursor: Option<Position>,
    subject: u64,
    version: u64,
    samples: f64,
    settled: bool,
    parser: vt100::Parser,
}

impl Desk {
    fn new() -> Self {
        let [rows, columns] = [AREA.height, AREA.width].map(|n| NonZeroU16::new(n).unwrap());
        let mut desk = Self {
            pacing: FrameDiff::new(),
            cells: Buffer::empty(AREA),
            uncovered: vec![true; 240],
            cursor: None,
            subject: 1,
            version: 0,
            samples: 1.0,
            settled: false,
            parser: vt100::Parser::new(rows, columns, 0),
        };
        desk.paint(|x, y| [8 * x as u8, 20 * y as u8, 100]);
        desk
    }

    /// Both halves of every cell have that colour, but the lower one a little more red.
    fn paint(&mut self, color: impl Fn(u16, u16) -> [u8; 3]) {
        for at in PICTURE.positions() {
            let [r, g, b] = color(at.x - PICTURE.x, at.y - PICTURE.y);
            let lower = Color::Rgb(r.saturating_add(9), g, b);
            let style = Style::new().fg(Color::Rgb(r, g, b)).bg(lower);
            self.cells[at].set_symbol("▀").set_style(style);
        }
        self.version += 1;
    }

    fn say(&mut self, row: u16, text: &str) {
        self.cells.set_string(0, row, text, Style::new());
    }

    fn frame(&mut self, now: u64, allowance: FrameBudget) -> (Frame, Vec<u8>) {
        let wanted = TargetFrame {
            cells: &self.cells,
            cursor: self.cursor,
            picture: PICTURE,
            uncovered: &self.uncovered,
            subject: self.subject,
            version: self.version,
            samples: self.samples,
            settled: self.settled,
        };
        let mut bytes = Vec::new();
        let frame = self.pacing.frame(&wanted, ms(now), allowance, THRESHOLD, &mut bytes);
        self.parser.process(&bytes);
        (frame, bytes)
    }

    /// Cells of the picture that the terminal shows as they ought to be.
    fn exact(&self) -> usize {
        PICTURE.positions().filter(|at| self.is_exact(at.x, at.y)).count()
    }

    /// Sends whatever is left.
    fn finish(&mut self) {
        self.settled = true;
        for i in 0..100 {
            self.frame(100_000 + i, within(20_000));
        }
        assert_eq!((self.exact(), self.pacing.rest()), (240, Pending::default()));
    }

    fn is_exact(&self, x: u16, y: u16) -> bool {
        let (wanted, cell) = (&self.cells[(x, y)], self.parser.screen().cell(y, x).unwrap());
        let same = |color, wanted| match (color, wanted) {
            (vt100::Color::Rgb(r, g, b), Color::Rgb(x, y, z)) => [r, g, b] == [x, y, z],
            _ => false,
        };
        let [fg, bg] = [cell.fgcolor(), cell.bgcolor()];
        match cell.contents() {
            "▀" => same(fg, wanted.fg) && same(bg, wanted.bg),
            "▄" => same(bg, wanted.fg) && same(fg, wanted.bg),
            " " | "" => same(bg, wanted.fg) && same(bg, wanted.bg),
            _ => false,
        }
    }
}

#[test]
fn a_terminal_that_is_here_is_shown_everything_at_once() {
    let mut desk = Desk::new();
    desk.say(10, "words");
    let (frame, bytes) = desk.frame(0, EVERYTHING);
    assert!(frame.picture && bytes.starts_with(b"\x1b[m\x1b[2J"));
    assert_eq!(desk.exact(), 240);
    assert!(desk.parser.screen().contents().contains("words"));
    assert_eq!(desk.pacing.rest(), Pending::default());
    assert_eq!(desk.frame(1, EVERYTHING).1, b"");
    // The least change goes out, and only that.
    desk.cells[(5, 5)].set_bg(Color::Rgb(1, 2, 3));
    assert!(desk.frame(2, EVERYTHING).1.len() < 50);
    assert_eq!(desk.exact(), 240);
    // Another size: everything anew.
    desk.cells = Buffer::empty(Rect { width: 39, ..AREA });
    assert!(desk.frame(3, EVERYTHING).1.starts_with(b"\x1b[m\x1b[2J"));
}

#[test]
fn text_goes_before_the_picture_and_frames_stay_within_their_budget() {
    let mut desk = Desk::new();
    (9..12).for_each(|row| desk.say(row, "a line of text of some length"));
    let (frame, bytes) = desk.frame(0, within(400));
    assert!(bytes.len() <= 400, "{}", bytes.len());
    assert!(frame.picture);
    let text = desk.parser.screen().contents();
    assert_eq!(text.matches("a line of text of some length").count(), 3);
    assert!(desk.pacing.rest().visible && !desk.pacing.rest().text);
    let mut frames = 1;
    while desk.pacing.rest().visible {
        assert!(desk.frame(100 * frames, within(400)).1.len() <= 400);
        frames += 1;
        assert!(frames < 100);
    }
    assert!(frames > 5);
    assert!(desk.exact() > 200);
    desk.finish();
}

#[test]
fn beside_other_frames_only_text_goes() {
    let mut desk = Desk::new();
    desk.say(10, "words");
    let beside = FrameBudget { bytes: 1500, picture: false, refinement: 0 };
    let (frame, _) = desk.frame(0, beside);
    assert_eq!((frame, desk.exact()), (Frame::default(), 0));
    assert!(desk.parser.screen().contents().contains("words"));
    assert!(desk.pacing.rest().visible);
    assert_eq!(desk.frame(1, beside).1, b"");
    // Text that is too much comes row by row.
    let long: String = ('a'..='z').chain('0'..='9').collect();
    (9..12).for_each(|row| desk.say(row, &long));
    let narrow = FrameBudget { bytes: 120, ..beside };
    for rows in 1..=3 {
        let (_, bytes) = desk.frame(2, narrow);
        assert!(bytes.len() <= 120, "{}", bytes.len());
        assert_eq!(desk.parser.screen().contents().matches(&long).count(), rows);
        assert_eq!(desk.pacing.rest().text, rows < 3);
    }
}

#[test]
fn the_worst_cells_come_first() {
    let mut desk = Desk::new();
    desk.frame(0, EVERYTHING);
    // Now over a line: first everything is known, then three cells change.
    desk.samples = 2.0;
    desk.frame(50, within(20_000));
    for (at, color) in [((3, 3), [24, 90, 90]), ((9, 6), [250, 250, 250]), ((20, 2), [150, 20, 60])]
    {
        let [r, g, b] = color;
        desk.cells[at].set_bg(Color::Rgb(r, g, b)).set_fg(Color::Rgb(r, g, b));
    }
    desk.version += 1;
    desk.samples = 4.0;
    let differing = |desk: &Desk| 240 - desk.exact();
    let before = differing(&desk);
    assert_eq!(before, 3);
    desk.frame(100, within(BESIDE_CELLS + 45));
    assert_eq!(differing(&desk), before - 1);
    let parser = &desk.parser;
    let cell = parser.screen().cell(6, 9).unwrap();
    assert!([cell.fgcolor(), cell.bgcolor()].contains(&vt100::Color::Rgb(250, 250, 250)));
}

#[test]
fn differences_that_nobody_sees_wait_for_rest() {
    let mut desk = Desk::new();
    desk.frame(0, within(20_000));
    assert_eq!(desk.exact(), 240);
    desk.paint(|x, y| [8 * x as u8, 20 * y as u8, 101]);
    desk.samples = 2.0;
    assert_eq!(desk.frame(100, within(20_000)).1, b"");
    let Pending { visible, hidden, .. } = desk.pacing.rest();
    assert_eq!((visible, hidden), (false, Some(ms(100) + IDLE)));
    // After a while without anything new they go, in slices.
    let (frame, bytes) = desk.frame(2200, within(4000));
    assert!(frame.flushed > 500 && frame.flushed <= 2000 && bytes.len() <= 2000, "{frame:?}");
    // When the picture is done they go at once; but not before the line has time for them.
    desk.settled = true;
    assert_eq!(desk.frame(2300, FrameBudget { refinement: 0, ..within(4000) }).1, b"");
    while desk.pacing.rest().hidden.is_some() {
        assert!(desk.frame(2400, within(4000)).0.flushed > 0);
    }
    assert_eq!(desk.exact(), 240);
}

#[test]
fn more_samples_count_when_they_are_many_more() {
    let mut desk = Desk::new();
    desk.samples = 16.0;
    desk.frame(0, within(20_000));
    // Five percent more samples and clearly another colour: it can wait.
    desk.samples = 17.0;
    desk.paint(|x, y| [8 * x as u8, 20 * y as u8, 150]);
    assert_eq!(desk.frame(50, within(20_000)).1, b"");
    assert!(!desk.pacing.rest().visible);
    desk.samples = 20.0;
    desk.frame(100, within(20_000));
    assert_eq!(desk.exact(), 240);
    // Another picture cannot wait.
    desk.subject += 1;
    desk.samples = 1.0;
    desk.paint(|x, y| [8 * x as u8, 20 * y as u8, 250]);
    desk.frame(150, within(20_000));
    assert_eq!(desk.exact(), 240);
}

#[test]
fn another_picture_appears_in_one_frame_coarse_at_first() {
    let mut desk = Desk::new();
    desk.frame(0, within(20_000));
    desk.subject += 1;
    desk.paint(|x, y| [255 - 8 * x as u8, 200 - 20 * y as u8, 20]);
    let (_, bytes) = desk.frame(50, within(1200));
    assert!(bytes.len() <= 1200, "{}", bytes.len());
    // Every cell has come much nearer.
    for at in PICTURE.positions() {
        let cell = desk.parser.screen().cell(at.y, at.x).unwrap();
        let vt100::Color::Rgb(r, ..) = cell.bgcolor() else { panic!("{at} has no colour") };
        let wanted = 255 - 8 * (at.x - PICTURE.x) as i32;
        assert!((i32::from(r) - wanted).abs() < 90, "{at}: {r} for {wanted}");
    }
    assert!(desk.pacing.rest().visible);
    desk.finish();
}

#[test]
fn what_lay_over_the_picture_comes_back() {
    let mut desk = Desk::new();
    desk.frame(0, within(20_000));
    let before = desk.cells.clone();
    for (row, range) in [(3, 35..50), (4, 65..80)] {
        desk.say(row, "       overlay      ");
        range.for_each(|at| desk.uncovered[at] = false);
    }
    // Those cells of the text that lie beside the picture's are its own as well.
    let wide: Vec<_> = (0..240).map(|at| !(2..4).contains(&(at / 30)) || at % 30 >= 18).collect();
    desk.uncovered = wide;
    desk.frame(50, within(20_000));
    assert!(desk.parser.screen().contents().contains("overlay"));
    desk.cells = before;
    desk.uncovered = vec![true; 240];
    desk.frame(100, within(20_000));
    assert!(!desk.parser.screen().contents().contains("overlay"));
    assert_eq!(desk.exact(), 240);
}

#[test]
fn the_cursor_is_hidden_while_a_frame_is_written() {
    let mut desk = Desk::new();
    desk.cursor = Some(Position { x: 7, y: 10 });
    let (_, bytes) = desk.frame(0, EVERYTHING);
    assert!(bytes.ends_with(b"\x1b[?25h"));
    assert_eq!(desk.parser.screen().cursor_position(), (10, 7));
    assert_eq!(desk.frame(1, EVERYTHING).1, b"", "nothing has changed");
    desk.say(10, "typed");
    let (_, bytes) = desk.frame(2, within(500));
    assert!(bytes.starts_with(b"\x1b[?25l") && bytes.ends_with(b"\x1b[?25h"));
    desk.cursor = None;
    assert_eq!(desk.frame(3, EVERYTHING).1, b"\x1b[?25l");
    assert_eq!(desk.frame(4, EVERYTHING).1, b"");
}

#[test]
fn wide_characters_are_whole() {
    let mut desk = Desk::new();
    for (now, text) in ["漢字 and more", "a漢", "漢a", "plain"].into_iter().enumerate() {
        desk.cells.set_string(0, 10, " ".repeat(40), Style::new());
        desk.say(10, text);
        desk.frame(100 * now as u64, within(20_000));
        let screen = desk.parser.screen();
        assert_eq!(screen.contents_between(10, 0, 10, 40).trim_end(), text);
    }
}
