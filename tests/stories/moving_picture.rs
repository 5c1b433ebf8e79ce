//! Moving picture of README: keys pressed in the simulated dashboard, while a session renders a given number of
//! samples per second of the simulated clock.
//! `cargo test --release --test program moving_picture -- --ignored` writes `docs/images/moving.png`, the same bytes
//! each time. `ZERKALO_FONT` names a monospaced font, by default DejaVu Sans Mono.

use super::*;
use ab_glyph::{Font, FontVec, PxScale, point};
use png::{BitDepth, BlendOp, ColorType, Compression, Encoder, Filter};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::{Color as CellColor, Modifier};
use zerkalo::dashboard::view::View as DashboardView;
use zerkalo_render::session::{Report, Snapshot, View};

const SCREEN: [u16; 2] = [128, 37];
/// Width and height of a cell in pixels.
const CELL: [usize; 2] = [8, 16];
/// Rows of cells of the picture: the screen, and two for the caption.
const ROWS: usize = SCREEN[1] as usize + 2;
const SIZE: [usize; 2] = [SCREEN[0] as usize * CELL[0], ROWS * CELL[1]];
const FRAMES_PER_SECOND: u32 = 8;
/// Even, as both replicates get as many samples.
const SAMPLES_PER_FRAME: u32 = 2;

/// Largest change in levels of a pixel that is not written.
const UNSEEN: u8 = 3;

/// Parts of the picture: the number of frames, a key, how often it is pressed in every second frame, and the caption.
const SCRIPT: [(u32, &str, u32, &str); 9] = [
    (
        24,
        "",
        0,
        "A lamp before a frosted mirror. The loupe shows the grain of the mirror dissolve.",
    ),
    (44, "[", 15, "[  a smoother mirror"),
    (20, "]", 5, "]  a rougher one"),
    (8, "l", 1, "l  the lamp"),
    (14, ";", 6, ";  dimmed: the samples stay, only the mix of lights changes"),
    (10, "L", 1, "L  switched off: the window and the sky alone"),
    (8, "L", 1, "L  and on"),
    (10, "'", 4, "'  brighter"),
    (12, "", 0, "The picture converges; at the noise target it rests."),
];

type Pixels = Vec<[u8; 3]>;

fn rgb(color: CellColor, default: [u8; 3]) -> [u8; 3] {
    match color {
        CellColor::Rgb(r, g, b) => [r, g, b],
        CellColor::Reset => default,
        other => panic!("no colour of 24 bits: {other:?}"),
    }
}

/// Draws a cell whose upper left pixel is (`left`, `top`).
fn draw_cell(font: &FontVec, cell: &Cell, [left, top]: [usize; 2], pixels: &mut Pixels) {
    let [mut front, mut ground] = [rgb(cell.fg, [230; 3]), rgb(cell.bg, [23, 24, 30])];
    if cell.modifier.contains(Modifier::REVERSED) {
        std::mem::swap(&mut front, &mut ground);
    }
    if cell.modifier.contains(Modifier::DIM) {
        front = std::array::from_fn(|c| front[c] / 3 * 2 + ground[c] / 3);
    }
    let upper_half =
        |is_upper: bool| move |_, y: usize| f32::from(u8::from((y < CELL[1] / 2) == is_upper));
    let mut put = |coverage: &dyn Fn(usize, usize) -> f32| {
        for (y, x) in (0..CELL[1]).flat_map(|y| (0..CELL[0]).map(move |x| (y, x))) {
            let c = coverage(x, y).clamp(0.0, 1.0);
            let mixed =
                |i| (f32::from(front[i]) * c + f32::from(ground[i]) * (1.0 - c)).round() as u8;
            pixels[(top + y) * SIZE[0] + left + x] = std::array::from_fn(mixed);
        }
    };
    match cell.symbol() {
        "▀" => put(&upper_half(true)),
        "▄" => put(&upper_half(false)),
        "█" => put(&|_, _| 1.0),
        // Braille: two columns of four dots, the lowest ones in the upper two bits.
        dots if ("\u{2800}".."\u{2900}").contains(&dots) => {
            let bits = u32::from(dots.chars().next().unwrap()) - 0x2800;
            put(&|x, y| {
                let [column, row] = [2 * x / CELL[0], 4 * y / CELL[1]];
                let bit = if row == 3 { 6 + column } else { 3 * column + row };
                let is_dot = 2 * x % CELL[0] >= 4 && 4 * y % CELL[1] >= 8;
                (bits >> bit & u32::from(is_dot)) as f32
            });
        }
        symbol => {
            let mut covered = vec![0.0; CELL[0] * CELL[1]];
            for id in symbol.chars().filter(|c| *c != ' ').map(|c| font.glyph_id(c)) {
                // Advance and height of the font are those of a cell.
                let em = font.height_unscaled() / font.h_advance_unscaled(id).max(1.0);
                let scale = PxScale { x: em * CELL[0] as f32, y: CELL[1] as f32 };
                let ascent = font.ascent_unscaled() / font.height_unscaled() * scale.y;
                let glyph = id.with_scale_and_position(scale, point(0.0, ascent.round()));
                let Some(outline) = font.outline_glyph(glyph) else { continue };
                let at = outline.px_bounds().min;
                outline.draw(|x, y, coverage| {
                    let [x, y] = [x as i32 + at.x as i32, y as i32 + at.y as i32];
                    if (0..CELL[0] as i32).contains(&x) && (0..CELL[1] as i32).contains(&y) {
                        covered[y as usize * CELL[0] + x as usize] += coverage;
                    }
                });
            }
            put(&|x, y| covered[y * CELL[0] + x]);
        }
    }
}

/// Draws the screen of the dashboard, and the caption below it.
fn draw(font: &FontVec, desk: &Desk, view: &mut DashboardView, caption: &str) -> Pixels {
    let [width, height] = SCREEN;
    let mut screen = Buffer::empty(Rect { x: 0, y: 0, width, height });
    view.draw(&desk.model, &mut screen);
    let mut below = Buffer::empty(Rect { x: 0, y: height, width, height: 2 });
    let key = caption.split("  ").next().filter(|key| key.len() == 1).map_or(0, str::len);
    let style = |c: [u8; 3]| ratatui::style::Style::new().fg(CellColor::Rgb(c[0], c[1], c[2]));
    below.set_string(2, height + 1, caption, style([230; 3]));
    below.set_string(2, height + 1, &caption[..key], style([255, 190, 90]));
    let mut pixels = vec![[0; 3]; SIZE[0] * SIZE[1]];
    for buffer in [&screen, &below] {
        for (i, cell) in buffer.content().iter().enumerate() {
            let (x, y) = buffer.pos_of(i);
            draw_cell(
                font,
                cell,
                [usize::from(x) * CELL[0], usize::from(y) * CELL[1]],
                &mut pixels,
            );
        }
    }
    pixels
}

/// Dashboard with a session that renders its scene.
struct Recording {
    desk: Desk,
    session: Session,
    /// Scene that the session has.
    scene: Arc<Scene>,
    generation: u64,
    /// Frames since the picture was begun.
    age: u32,
}

impl Recording {
    fn new() -> Self {
        let text = shipped("lamp-and-mirror.toml").to_text();
        let mut desk = Desk::new(&text.replace("roughness = 0.035", "roughness = 0.4"));
        desk.model.file.name = "lamp-and-mirror.toml".to_string();
        desk.send(Message::Resize(SCREEN));
        let mut session = new_session(2, 1, spp_stop(SAMPLES_PER_FRAME), false);
        let scene = Arc::clone(desk.model.seen());
        let generation = session.set_scene(Arc::clone(&scene));
        Self { desk, session, scene, generation, age: 0 }
    }

    /// Presses the key, and shows the picture with the samples of one more frame.
    fn frame(&mut self, key: Option<&str>) {
        self.desk.now += Duration::from_secs(1) / FRAMES_PER_SECOND;
        if let Some(key) = key {
            self.desk.send(Message::Key(key.parse().unwrap()));
        }
        self.desk.send(Message::Tick);
        self.age += 1;
        let scene = Arc::clone(self.desk.model.seen());
        let snapshot = self.desk.model.snapshot.as_ref();
        if snapshot.is_some_and(|snapshot| snapshot.weights_for(&scene).is_none()) {
            self.age = 1;
        }
        // Before the scene, whose render would otherwise have the old stop.
        self.session.set_stop(spp_stop(self.age * SAMPLES_PER_FRAME));
        if !Arc::ptr_eq(&scene, &self.scene) {
            self.generation = self.session.set_scene(Arc::clone(&scene));
            self.scene = scene;
        }
        loop {
            let wanted = self.desk.model.requested;
            self.session.set_view(wanted);
            let snapshot = self.snapshot(wanted);
            self.desk.send(Message::Snapshot(Box::new(snapshot)));
            if self.desk.model.requested == wanted {
                return;
            }
        }
    }

    /// Waits for the picture with all samples that are due. The times in its report are simulated; the
    /// noise is that of the film, as the session's estimate may come later.
    fn snapshot(&self, view: View) -> Snapshot {
        loop {
            let mut snapshot =
                self.session.wait(Duration::from_secs(60)).expect("a snapshot in time");
            let report = &snapshot.report;
            let spp = self.age * SAMPLES_PER_FRAME;
            let is_shown = snapshot.picture.as_ref().map(|p| [p.cols, p.rows]) == view.raster
                && snapshot.detail.as_ref().map(|detail| detail.window)
                    == view.detail.map(|(w, _)| w);
            let is_done = report.generation == self.generation
                && matches!(report.state, State::Finished(_))
                && report.spp.min == spp;
            if is_done && is_shown {
                let noise = self
                    .session
                    .with(|state, _| state.film.noise(&state.weights, &state.display()));
                let seconds = f64::from(self.age) / f64::from(FRAMES_PER_SECOND);
                snapshot.report = Report {
                    state: State::Tracing,
                    seconds,
                    noise: noise.flatten(),
                    recent_samples_per_second: report.samples as f64 / seconds,
                    eta_seconds: None,
                    error: None,
                    progress: None,
                    ..snapshot.report
                };
                return snapshot;
            }
        }
    }
}

/// Returns the smallest rectangle with the pixels that differ: its upper left pixel and its size, at least one pixel.
fn changed(before: &Pixels, after: &Pixels) -> ([usize; 2], [usize; 2]) {
    let [mut low, mut high] = [SIZE, [1; 2]];
    for i in (0..after.len()).filter(|i| before[*i] != after[*i]) {
        for (axis, at) in [i % SIZE[0], i / SIZE[0]].into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(at), high[axis].max(at + 1));
        }
    }
    let low = [0, 1].map(|axis| low[axis].min(high[axis] - 1));
    (low, [high[0] - low[0], high[1] - low[1]])
}

/// Writes an animated PNG file; pixels that stay are transparent in later frames.
fn write(path: &Path, frames: &[Pixels]) {
    let mut encoder = Encoder::new(fs::File::create(path).unwrap(), SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_filter(Filter::NoFilter);
    encoder.set_animated(frames.len() as u32, 0).unwrap();
    let mut writer = encoder.write_header().unwrap();
    let mut shown = vec![[0; 3]; SIZE[0] * SIZE[1]];
    for (i, frame) in frames.iter().enumerate() {
        let is_seen = |(a, b): (&u8, &u8)| a.abs_diff(*b) > UNSEEN;
        let next: Pixels = (shown.iter().zip(frame))
            .map(|(old, new)| if i == 0 || old.iter().zip(new).any(is_seen) { *new } else { *old })
            .collect();
        let (origin, size) = if i == 0 { ([0; 2], SIZE) } else { changed(&shown, &next) };
        let delay = if i + 1 == frames.len() { 2 * FRAMES_PER_SECOND } else { 1 };
        writer.set_frame_delay(delay as u16, FRAMES_PER_SECOND as u16).unwrap();
        writer.set_blend_op(if i == 0 { BlendOp::Source } else { BlendOp::Over }).unwrap();
        writer.reset_frame_position().unwrap();
        writer.set_frame_dimension(size[0] as u32, size[1] as u32).unwrap();
        writer.set_frame_position(origin[0] as u32, origin[1] as u32).unwrap();
        let indices = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (origin[1] + y) * SIZE[0] + origin[0] + x));
        let rgba = |at: usize| match next[at] {
            same if i > 0 && same == shown[at] => [0; 4],
            [r, g, b] => [r, g, b, 255],
        };
        writer.write_image_data(indices.map(rgba).collect::<Vec<_>>().as_flattened()).unwrap();
        shown = next;
    }
    writer.finish().unwrap();
}

#[test]
#[ignore = "writes the moving picture of README"]
fn moving_picture() {
    let font = std::env::var("ZERKALO_FONT");
    let font = font.unwrap_or("/usr/share/fonts/truetype/dejavu/DejaVuSansMono.ttf".to_string());
    let font = FontVec::try_from_vec(fs::read(font).unwrap()).unwrap();
    let (mut recording, mut view) = (Recording::new(), DashboardView::default());
    let mut frames = Vec::new();
    for (count, key, presses, caption) in SCRIPT {
        for frame in 0..count {
            recording.frame((frame % 2 == 0 && frame / 2 < presses).then_some(key));
            frames.push(draw(&font, &recording.desk, &mut view, caption));
        }
    }
    write(&Path::new(env!("ZERKALO_ROOT")).join("docs/images/moving.png"), &frames);
}
