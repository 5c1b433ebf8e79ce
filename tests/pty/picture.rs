//! What the terminal shows is what `render` writes.

use super::*;
use std::io::Cursor;
use zerkalo::dashboard::layout::{Focus, Layout, Request, layout};
use zerkalo::terminal::cells::Oklab;

const SIZE: [u16; 2] = [120, 36];
const FILM: [u32; 2] = [640, 480];

/// A picture of 8-bit codes.
pub struct Picture {
    pub size: [usize; 2],
    pub rgb: Vec<u8>,
}

impl Picture {
    pub fn of_png(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
        rgb.truncate(info.buffer_size());
        Self { size: [info.width as usize, info.height as usize], rgb }
    }

    /// The mean in linear light over one of `cells` equal boxes, as sRGB codes.
    fn averaged(&self, cells: [usize; 2], at: [usize; 2]) -> [u8; 3] {
        let edge = |i: usize, n: usize| (n * self.size[i]) as f64 / cells[i] as f64;
        let part = |i: usize, pixel: usize| {
            let (from, to) = (edge(i, at[i]), edge(i, at[i] + 1));
            (to.min((pixel + 1) as f64) - from.max(pixel as f64)).max(0.0)
        };
        let range = |i: usize| {
            edge(i, at[i]) as usize..(edge(i, at[i] + 1).ceil() as usize).min(self.size[i])
        };
        let (mut sum, mut area) = ([0.0; 3], 0.0);
        for y in range(1) {
            for x in range(0) {
                let weight = part(0, x) * part(1, y);
                area += weight;
                let pixel = 3 * (y * self.size[0] + x);
                for (sum, code) in sum.iter_mut().zip(&self.rgb[pixel..]) {
                    *sum += weight * linear(f64::from(*code) / 255.0);
                }
            }
        }
        sum.map(|s| (255.0 * encoded(s / area)).round() as u8)
    }
}

fn linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The upper and the lower half of a cell.
fn halves(cell: &vt100::Cell) -> Option<[[u8; 3]; 2]> {
    let rgb = |color| match color {
        vt100::Color::Rgb(r, g, b) => Some([r, g, b]),
        _ => None,
    };
    match cell.contents() {
        "▀" => Some([rgb(cell.fgcolor())?, rgb(cell.bgcolor())?]),
        "▄" => Some([rgb(cell.bgcolor())?, rgb(cell.fgcolor())?]),
        " " | "" => Some([rgb(cell.bgcolor())?; 2]),
        _ => None,
    }
}

/// Mean distance in OKLab between the cells of the picture and a picture file.
fn distance(screen: &vt100::Screen, layout: &Layout, picture: &Picture) -> Option<f64> {
    let [columns, rows] = layout.raster;
    let mut sum = 0.0;
    for row in 0..rows {
        for column in 0..columns {
            let place = [layout.image.y + (row / 2) as u16, layout.image.x + column as u16];
            let shown = halves(screen.cell(place[0], place[1])?)?[row % 2];
            let wanted = picture.averaged(layout.raster, [column, row]);
            sum += f64::from(Oklab::of(shown).distance(Oklab::of(wanted)));
        }
    }
    Some(sum / (rows * columns) as f64)
}

fn room_layout() -> Layout {
    let request = Request { screen: SIZE, film: FILM, focus: Focus::Picture, fullscreen: false };
    layout(&request).unwrap()
}

#[test]
fn the_cells_show_the_picture_that_render_writes() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    rendered_anew(&mut terminal, 256);
    let written = Picture::of_png(&desk.rendered(&["room.toml", "--spp", "256"], "room.png"));
    let found = terminal.wait_for("the picture of 256 samples", |screen| {
        distance(screen, &room_layout(), &written).filter(|d| *d <= 0.01)
    });
    // Not because every picture is near to every other one.
    let mut black = written;
    black.rgb.fill(0);
    let far = terminal.screen(|screen| distance(screen, &room_layout(), &black)).unwrap();
    assert!(far > 0.1, "{found} {far}");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn an_export_is_the_file_that_render_writes() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    rendered_anew(&mut terminal, 64);
    terminal.send("p");
    terminal.wait_for_text("room-1.png");
    terminal.send("P");
    terminal.wait_for_text("room-1.exr");
    terminal.send("p");
    terminal.wait_for_text("room-2.png");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    // As in the dashboard, samples go where the displayed picture needs them, for linear files too.
    let args = ["room.toml", "--spp", "64", "--noise", "1e-9"];
    for (exported, rendered) in [("room-1.png", "render.png"), ("room-1.exr", "render.exr")] {
        let expected = desk.rendered(&args, rendered);
        assert!(fs::read(desk.path(exported)).unwrap() == expected, "{exported} differs");
    }
    let [first, second] = ["room-1.png", "room-2.png"].map(|f| fs::read(desk.path(f)).unwrap());
    assert!(first == second);
}

#[test]
fn a_picture_that_was_asked_for_is_written_before_the_end() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    terminal.send("pq");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
    Picture::of_png(&fs::read(desk.path("room-1.png")).unwrap());
}

/// Begins the picture anew and waits until it has so many samples per pixel. What was traced before
/// may have been more already.
fn rendered_anew(terminal: &mut Terminal, spp: u32) {
    let when = format!("spp {spp}");
    terminal.send("T");
    terminal.wait_for_text("stop at");
    // Whatever is proposed is replaced.
    terminal.send("\x15");
    terminal.send(&when);
    terminal.wait_for_text(&when);
    terminal.send("\r");
    terminal.wait_until_gone("stop at");
    terminal.send("R");
    let done = format!("{spp} of {spp} spp");
    terminal.wait_for(&done, |screen| {
        let text = screen.contents();
        (text.contains("resting") && text.contains(&done)).then_some(())
    });
}
