//! Agreement between the shown picture, exports and `zerkalo render`.

use super::*;
use std::io::Cursor;
use zerkalo::dashboard::layout::Layout;
use zerkalo::dashboard::model::Model;
use zerkalo_scene::{History, Scene};
use zerkalo_terminal::cells::Oklab;

const SIZE: [u16; 2] = [120, 36];
const FILM: [u32; 2] = [640, 480];

/// Picture file in 8-bit sRGB.
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

    /// Divides the picture into boxes of equal size, in `cells` columns and rows. `index` is column
    /// and row of a box. Returns the mean colour of this box, averaged in linear light, as 8-bit
    /// sRGB.
    fn averaged(&self, cells: [usize; 2], index: [usize; 2]) -> [u8; 3] {
        let edge = |i: usize, n: usize| (n * self.size[i]) as f64 / cells[i] as f64;
        let overlap = |i: usize, pixel: usize| {
            let (from, to) = (edge(i, index[i]), edge(i, index[i] + 1));
            (to.min((pixel + 1) as f64) - from.max(pixel as f64)).max(0.0)
        };
        let range = |i: usize| {
            edge(i, index[i]) as usize..(edge(i, index[i] + 1).ceil() as usize).min(self.size[i])
        };
        let (mut sum, mut area) = ([0.0; 3], 0.0);
        for y in range(1) {
            for x in range(0) {
                let weight = overlap(0, x) * overlap(1, y);
                area += weight;
                let pixel = 3 * (y * self.size[0] + x);
                for (sum, level) in sum.iter_mut().zip(&self.rgb[pixel..]) {
                    *sum += weight * linear(f64::from(*level) / 255.0);
                }
            }
        }
        sum.map(|s| (255.0 * encoded(s / area)).round() as u8)
    }
}

fn linear(level: f64) -> f64 {
    if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Returns the colours of the upper and the lower half of a cell. Returns `None` if the cell shows
/// no picture.
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

/// Returns the mean OKLab distance between the cells that show the picture and a picture file.
/// Returns `None` if one of these cells shows no picture.
fn distance(screen: &vt100::Screen, layout: &Layout, picture: &Picture) -> Option<f64> {
    let [columns, rows] = layout.raster;
    let mut sum = 0.0;
    for row in 0..rows {
        for column in 0..columns {
            let place = [layout.image.y + (row / 2) as u16, layout.image.x + column as u16];
            let shown = halves(screen.cell(place[0], place[1])?)?[row % 2];
            let expected = picture.averaged(layout.raster, [column, row]);
            sum += f64::from(Oklab::of(shown).distance(Oklab::of(expected)));
        }
    }
    Some(sum / (rows * columns) as f64)
}

fn room_layout() -> Layout {
    let mut scene = Scene::default();
    scene.film.size = FILM;
    let history = History::new(Arc::new(scene));
    Model { screen: SIZE, history, ..Model::default() }.layout().unwrap()
}

#[test]
fn shown_picture_matches_render() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    restart_rendering(&mut terminal, 32);
    // The dashboard allocates samples by the displayed picture.
    let args = ["room.toml", "--spp", "32", "--noise", "1e-9"];
    let written = Picture::of_png(&fixture.rendered(&args, "room.png"));
    let error = terminal.wait_for("the picture of 32 samples", |screen| {
        distance(screen, &room_layout(), &written).filter(|d| *d <= 0.01)
    });
    // A black picture, by contrast, has a large distance from the screen.
    let mut black = written;
    black.rgb.fill(0);
    let far_error = terminal.screen(|screen| distance(screen, &room_layout(), &black)).unwrap();
    assert!(far_error > 0.1, "{error} {far_error}");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn export_matches_render() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    restart_rendering(&mut terminal, 32);
    terminal.send("p");
    terminal.wait_for_text("room-1.png");
    terminal.send("P");
    terminal.wait_for_text("room-1.exr");
    terminal.send("p");
    terminal.wait_for_text("room-2.png");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    // The dashboard distributes samples by the error of the displayed picture, also for linear
    // (EXR) files.
    let args = ["room.toml", "--spp", "32", "--noise", "1e-9"];
    for (exported, rendered) in [("room-1.png", "render.png"), ("room-1.exr", "render.exr")] {
        let expected = fixture.rendered(&args, rendered);
        assert!(fs::read(fixture.path(exported)).unwrap() == expected, "{exported} differs");
    }
    let [first, second] = ["room-1.png", "room-2.png"].map(|f| fs::read(fixture.path(f)).unwrap());
    assert!(first == second);
}

#[test]
fn pending_export_is_written_before_the_end() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], SIZE);
    wait_for_picture(&terminal);
    terminal.send("pq");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
    Picture::of_png(&fs::read(fixture.path("room-1.png")).unwrap());
}

/// Restarts the render, to stop at `spp` samples per pixel, and waits until it stops. The render
/// starts anew, so `spp` may be lower than the number of samples that it already has.
fn restart_rendering(terminal: &mut Terminal, spp: u32) {
    let condition = format!("spp {spp}");
    terminal.send("T");
    terminal.wait_for_text("stop at");
    // Ctrl-u clears the proposed text.
    terminal.send("\x15");
    terminal.send(&condition);
    terminal.wait_for_text(&condition);
    terminal.send("\r");
    terminal.wait_until_gone("stop at");
    terminal.send("R");
    let done = format!("{spp} of {spp} spp");
    terminal.wait_for(&done, |screen| {
        let text = screen.contents();
        (text.contains("✓ samples reached") && text.contains(&done)).then_some(())
    });
}
