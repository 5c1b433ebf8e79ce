//! Plan files: text with one setting or tile per line, in a fixed order, and a checksum at the end.
//!
//! The line of a tile has four fields: samples per pixel and replicate in the base, samples per
//! pixel and replicate in the merged picture, the expected number of rays per sample, and `g` for a
//! glossy tile, otherwise `-`. Up to two earlier estimates follow, each as samples, allocation and
//! validation estimate. The lines before the tiles are the head of the plan, which parts contain.

use crate::file_error::{self, FileError, begins_with};
use crate::film::Display;
use crate::plan::{MAX_SHARDS, Plan, PlanHead, PlanSettings, PlannedTile, tiles_of};
use crate::schedule::{MAX_SAMPLES, RoundEstimate};
use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;
use std::str::FromStr;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_scene::Tone;
use zerkalo_scene::value::{fnv1a64, sanitized, truncated};
use zerkalo_world::Precision;

/// First line of a plan file.
const TITLE: &str = "zerkalo plan 2";
/// Largest length of a plan file in bytes. The plan of 16384 x 16384 pixels has about 70 MB.
const MAX_BYTES: u64 = 1 << 27;
/// Largest width and height of the picture in pixels.
const MAX_SIDE: u32 = 1 << 14;
/// Bytes of the shortest line of a tile.
const MIN_TILE_BYTES: usize = 8;

/// Beginning of the first line of a plan file, in every version of the format.
const START: &[u8; 13] = b"zerkalo plan ";

pub fn is_plan_file(path: &Path) -> bool {
    begins_with(path, START)
}

impl Plan {
    pub fn text(&self) -> String {
        let mut text = self.body();
        let checksum = fnv1a64(text.as_bytes());
        let _ = writeln!(text, "checksum {checksum:016x}");
        text
    }

    /// Returns the hash of the lines before the checksum. Plans with equal hashes count as equal.
    pub fn checksum(&self) -> u64 {
        fnv1a64(self.body().as_bytes())
    }

    /// Formats all lines before the checksum.
    fn body(&self) -> String {
        let mut text = head_text(&self.settings, self.predicted_levels, self.slopes);
        let _ = writeln!(text, "tiles {}", self.tiles.len());
        for tile in &self.tiles {
            let PlannedTile { base, end, rays_per_sample, glossy, earlier } = tile;
            let glossy = if *glossy { 'g' } else { '-' };
            let _ = write!(text, "{base} {end} {rays_per_sample} {glossy}");
            for RoundEstimate { samples, allocation, reported } in earlier {
                if *samples > 0 {
                    let _ = write!(text, " {samples} {allocation} {reported}");
                }
            }
            text.push('\n');
        }
        text
    }

    /// Reads a plan file. Fails if it cannot be read or is no valid plan.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (file, length) = file_error::open(path)?;
        if length > MAX_BYTES {
            let what = format!("it has {length} bytes; a plan has at most {MAX_BYTES}");
            return Err(FileError::new(path, what, NOT_A_PLAN));
        }
        let mut bytes = Vec::new();
        let read = file.take(MAX_BYTES).read_to_end(&mut bytes);
        read.map_err(|e| FileError::new(path, e.to_string(), "check the disk"))?;
        Self::parse(path, &bytes)
    }

    /// Parses the text of a plan file. `path` is its name in error messages.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, FileError> {
        let mut lines = Lines { path, line: 0, rest: "" };
        if !bytes.starts_with(START) {
            return Err(FileError::new(path, "it is not a plan file", NOT_A_PLAN));
        }
        let Ok(text) = std::str::from_utf8(bytes) else {
            return Err(FileError::new(path, "it is damaged: it is not UTF-8", DAMAGED));
        };
        lines.rest = text;
        let title = lines.next_line();
        if title != Some(TITLE) {
            let found = truncated(title.unwrap_or_default());
            let what = format!("found `{found}`, expected `{TITLE}`");
            let remedy = "use the version of zerkalo that wrote it, or plan again".to_string();
            return Err(FileError { remedy, ..lines.error(what) });
        }
        let body = text.trim_end_matches('\n').rfind('\n').map_or("", |end| &text[..=end]);
        let last = &text[body.len()..];
        if last != format!("checksum {:016x}\n", fnv1a64(body.as_bytes())) {
            let what = "it is damaged, altered or incomplete: the checksum at its end is wrong";
            return Err(FileError::new(path, what, DAMAGED));
        }
        lines.rest = &body[TITLE.len() + 1..];
        Self::parse_body(&mut lines)
    }

    /// Parses the lines between the title and the checksum.
    fn parse_body(lines: &mut Lines) -> Result<Self, FileError> {
        let (settings, predicted_levels, slopes) = parse_head(lines)?;
        let count = tiles_of(settings.size);
        lines.setting("tiles", &format!("{count}, the number of tiles of the size"), |text| {
            number(text).filter(|n: &usize| *n == count)
        })?;
        // The file may state more tiles than it has lines.
        let mut tiles = Vec::with_capacity(count.min(lines.rest.len() / MIN_TILE_BYTES));
        for _ in 0..count {
            tiles.push(lines.tile()?);
        }
        if let Some(line) = lines.next_line() {
            let what = format!("found `{}`, expected the checksum", truncated(line));
            return Err(lines.error(what));
        }
        Ok(Self { settings, predicted_levels, slopes, tiles })
    }
}

impl PlanHead {
    /// Formats the head with the number of samples and the checksum of the plan.
    pub(super) fn text(&self) -> String {
        let head = head_text(&self.settings, self.predicted_levels, self.slopes);
        format!("{head}samples {}\nchecksum {:016x}\n", self.samples, self.checksum)
    }

    /// Parses the head in the part at `path`.
    pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Self, FileError> {
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        let mut lines = Lines { path, line: 0, rest: text };
        if lines.next_line() != Some(TITLE) {
            return Err(lines.error(format!("its plan does not begin with `{TITLE}`")));
        }
        let (settings, predicted_levels, slopes) = parse_head(&mut lines)?;
        let samples = lines.setting("samples", "an integer from 0", number)?;
        let checksum = lines.setting("checksum", "16 hexadecimal digits", checksum)?;
        Ok(Self { settings, predicted_levels, slopes, samples, checksum })
    }
}

/// Formats the lines before the tiles.
fn head_text(s: &PlanSettings, predicted_levels: f64, slopes: [f64; 2]) -> String {
    let base = s.base_plan.map_or("none".to_string(), |plan| format!("{plan:016x}"));
    format!(
        "{TITLE}\nscene {}\nscene_hash {}\nsize {}x{}\nseed {}\nsampler {}\nprecision {}\n\
         exposure {}\ntone {}\nrays_per_pixel {}\nnoise {}\npredicted_noise {predicted_levels}\n\
         slopes {} {}\nshards {}\nround {}\nbase {base}\nbase_rays {}\ntotal_rays {}\n",
        sanitized(&s.source),
        s.scene_hash,
        s.size[0],
        s.size[1],
        s.seed,
        s.sampler.name(),
        s.precision.name(),
        s.display.exposure_ev,
        s.display.tone.name(),
        s.rays_per_pixel,
        s.noise_levels,
        slopes[0],
        slopes[1],
        s.shards,
        s.round,
        s.base_rays,
        s.total_rays,
    )
}

/// Parses a checksum of 16 hexadecimal digits.
fn checksum(text: &str) -> Option<u64> {
    u64::from_str_radix(text, 16).ok().filter(|_| text.len() == 16)
}

/// Parses the lines that [`head_text`] has formatted, except the title.
fn parse_head(lines: &mut Lines) -> Result<(PlanSettings, f64, [f64; 2]), FileError> {
    let positive = |text: &str| number(text).filter(|n: &f64| n.is_finite() && *n > 0.0);
    // The fields are read in the order of the file. The last ones are set below, after other
    // lines.
    let mut settings = PlanSettings {
        source: lines.setting("scene", "a file name", |text| Some(sanitized(text).to_string()))?,
        scene_hash: lines.setting("scene_hash", "a hash", |text| Some(text.to_string()))?,
        size: lines.setting("size", "WIDTHxHEIGHT, 1 to 16384 pixels each", |text| {
            let (width, height) = text.split_once('x')?;
            let size = [number(width)?, number(height)?];
            size.iter().all(|n| (1..=MAX_SIDE).contains(n)).then_some(size)
        })?,
        seed: lines.setting("seed", "an integer from 0", number)?,
        sampler: lines.setting("sampler", "sobol or random", SamplerKind::from_name)?,
        precision: lines.setting("precision", "single or double", Precision::from_name)?,
        display: Display {
            exposure_ev: lines.setting("exposure", "a number from -64 to 64", |text| {
                number(text).filter(|ev: &f64| ev.abs() <= 64.0)
            })?,
            tone: lines.setting("tone", "clip or neutral", Tone::from_name)?,
        },
        rays_per_pixel: lines.setting("rays_per_pixel", "an integer from 0", number)?,
        noise_levels: lines.setting("noise", "a number above 0", positive)?,
        shards: 0,
        round: 1,
        base_plan: None,
        base_rays: 0,
        total_rays: 0.0,
    };
    let predicted_levels = lines.setting("predicted_noise", "a number from 0", |text| {
        number(text).filter(|n: &f64| n.is_finite() && *n >= 0.0)
    })?;
    let slopes = lines.setting("slopes", "two numbers from 0.1 to 2", |text| {
        let (plain, glossy) = text.split_once(' ')?;
        let slopes = [number(plain)?, number(glossy)?];
        slopes.iter().all(|s| (0.1..=2.0).contains(s)).then_some(slopes)
    })?;
    settings.shards = lines.setting("shards", "an integer from 1 to 65536", |text| {
        number(text).filter(|n| (1..=MAX_SHARDS).contains(n))
    })?;
    settings.round =
        lines.setting("round", "an integer from 1", |text| number(text).filter(|n| *n > 0))?;
    settings.base_plan = lines.setting("base", "none or a checksum", |text| match text {
        "none" => Some(None),
        _ => checksum(text).map(Some),
    })?;
    settings.base_rays = lines.setting("base_rays", "an integer from 0", number)?;
    settings.total_rays = lines.setting("total_rays", "a number from 0", |text| {
        number(text).filter(|n: &f64| n.is_finite() && *n >= 0.0)
    })?;
    Ok((settings, predicted_levels, slopes))
}

const DAMAGED: &str = "copy it again or plan again";
const NOT_A_PLAN: &str = "name a file that `zerkalo plan` has written";

/// Remaining lines of a plan file.
struct Lines<'a> {
    path: &'a Path,
    /// Number of the latest line, counted from 1.
    line: usize,
    rest: &'a str,
}

impl<'a> Lines<'a> {
    fn error(&self, what: String) -> FileError {
        FileError { line: self.line, ..FileError::new(self.path, what, DAMAGED) }
    }

    fn next_line(&mut self) -> Option<&'a str> {
        self.line += 1;
        let (line, rest) = self.rest.split_once('\n')?;
        self.rest = rest;
        Some(line)
    }

    /// Reads the next line, which must be `key` and its value. `expected` describes valid values in
    /// error messages.
    fn setting<T>(
        &mut self,
        key: &str,
        expected: &str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, FileError> {
        let line = self.next_line().unwrap_or_default();
        let value = line.strip_prefix(key).and_then(|value| value.strip_prefix(' '));
        value.and_then(parse).ok_or_else(|| {
            self.error(format!("found `{}`, expected `{key}` and {expected}", truncated(line)))
        })
    }

    /// Reads the next line, which must be that of a tile.
    fn tile(&mut self) -> Result<PlannedTile, FileError> {
        let line = self.next_line().unwrap_or_default();
        let parse = || {
            let mut fields = line.split(' ');
            let mut tile = PlannedTile {
                base: number(fields.next()?)?,
                end: number(fields.next()?)?,
                rays_per_sample: number(fields.next()?)?,
                glossy: match fields.next()? {
                    "g" => true,
                    "-" => false,
                    _ => return None,
                },
                earlier: Default::default(),
            };
            for earlier in &mut tile.earlier {
                let Some(samples) = fields.next() else { break };
                earlier.samples = number(samples).filter(|n| (1..=MAX_SAMPLES).contains(n))?;
                let mut error =
                    || number(fields.next()?).filter(|mse: &f32| mse.is_finite() && *mse >= 0.0);
                (earlier.allocation, earlier.reported) = (error()?, error()?);
            }
            let is_valid = tile.base <= tile.end
                && tile.end <= MAX_SAMPLES
                && (0.0..=1e9).contains(&tile.rays_per_sample)
                && fields.next().is_none();
            is_valid.then_some(tile)
        };
        parse().ok_or_else(|| {
            self.error(format!(
                "found `{}`, expected a tile: its samples in base and picture, rays per sample, \
                 `g` or `-`",
                truncated(line)
            ))
        })
    }
}

/// Parses a number that begins with a digit or a minus sign.
fn number<T: FromStr>(text: &str) -> Option<T> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    digits.starts_with(|c: char| c.is_ascii_digit()).then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::testing::plan;

    fn parsed(text: &str) -> Result<Plan, String> {
        Plan::parse(Path::new("job.plan"), text.as_bytes()).map_err(|e| e.to_string())
    }

    /// Returns the text of a plan file with `from` replaced by `to` and a correct checksum.
    fn altered(from: &str, to: &str) -> String {
        let text = plan(8, &[[4, 16], [8, 8], [16, 480]]).body();
        assert_eq!(text.matches(from).count(), 1, "{from} in {text}");
        let mut text = text.replace(from, to);
        let checksum = fnv1a64(text.as_bytes());
        let _ = writeln!(text, "checksum {checksum:016x}");
        text
    }

    #[test]
    fn plan_survives_its_text() {
        let mut plan = plan(8, &[[4, 16], [8, 8], [16, 480]]);
        plan.settings.base_plan = Some(0x12);
        plan.settings.display = Display { exposure_ev: -1.1, tone: Tone::Neutral };
        plan.predicted_levels = 1.0 / 3.0;
        plan.tiles[1].earlier[0] = RoundEstimate { samples: 4, allocation: 0.1, reported: 2e-9 };
        assert_eq!(parsed(&plan.text()).unwrap(), plan);
        assert!(plan.text().ends_with(&format!("checksum {:016x}\n", plan.checksum())));
    }

    #[test]
    fn source_with_line_breaks_stays_in_its_line() {
        let mut plan = plan(1, &[[4, 16]]);
        plan.settings.source = "a\nshards 5".into();
        assert_eq!(parsed(&plan.text()).unwrap().settings.source, "a\\nshards 5");
    }

    #[test]
    fn faults_are_located_even_under_a_correct_checksum() {
        for (from, to, message) in [
            ("size 48x16", "size 0x16", "job.plan:4: found `size 0x16`, expected `size` and WIDTH"),
            (
                "size 48x16",
                "size 16384x16384",
                ":19: found `tiles 3`, expected `tiles` and 1048576",
            ),
            ("seed 7", "seed -7", "job.plan:5: "),
            ("sampler sobol", "sampler halton", "expected `sampler` and sobol or random"),
            ("exposure 0", "exposure nan", "job.plan:8: "),
            ("noise 0.25\n", "noise 0\n", "job.plan:11: "),
            ("shards 8", "shards 65537", "an integer from 1 to 65536"),
            ("base none", "base 12", "none or a checksum"),
            ("tiles 3", "tiles 4", "expected `tiles` and 3"),
            ("4 16 2.25 g", "17 16 2.25 g", "job.plan:20: found `17 16 2.25 g`, expected a tile"),
            ("4 16 2.25 g", "4 4294967295 2.25 g", "job.plan:20: "),
            ("4 16 2.25 g", "4 16 inf g", "job.plan:20: "),
            ("4 16 2.25 g\n", "", "job.plan:22: found ``, expected a tile"),
            ("4 16 2.25 g", "4 16 2.25 g\n4 16 2.25 g", "job.plan:23: found `16 480 2.25 g`"),
        ] {
            let error = parsed(&altered(from, to)).unwrap_err();
            assert!(error.contains(message), "{to}: {error}");
        }
        let other = parsed("zerkalo plan 1\n").unwrap_err();
        assert!(other.contains("job.plan:1: found `zerkalo plan 1`"), "{other}");
        assert!(parsed("[film]\nsize = [1, 1]\n").unwrap_err().contains("it is not a plan file"));
    }

    #[test]
    fn altered_text_is_refused_by_its_checksum() {
        let text = plan(8, &[[4, 16], [8, 8]]).text();
        for end in 14..text.len() {
            assert!(parsed(&text[..end]).is_err(), "cut at {end}");
        }
        let error = parsed(&text.replace("4 16", "4 32")).unwrap_err();
        assert!(error.contains("the checksum at its end is wrong"), "{error}");
    }

    #[test]
    fn unreadable_files_are_refused() {
        let message = |path: &str| Plan::read(Path::new(path)).unwrap_err().to_string();
        assert!(message("no-such-file").contains("there is no such file"));
        assert!(message(".").contains("not a regular file; name a file"));
    }
}
