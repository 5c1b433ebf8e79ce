//! Values of options: the words of a choice, and parsers of numbers, sizes and file names.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::PathBuf;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::image_file::Depth;
use zerkalo_terminal::cells::{Blocks, Colors};
use zerkalo_terminal::image::GraphicsMode;
use zerkalo_world::Precision;

/// Possible value of an option: its name, its help text and the parsed value.
pub(super) type Choice<T> = (&'static str, Option<&'static str>, T);

pub(super) fn choice<T, const N: usize>(choices: [Choice<T>; N]) -> impl TypedValueParser<Value = T>
where
    T: Clone + Send + Sync + 'static,
{
    let names = choices.clone().map(|(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(names).map(move |given| {
        let chosen = choices.iter().find(|(name, ..)| *name == given);
        chosen.expect("only these names are parsed").2.clone()
    })
}

/// Parses a size such as `640x480`. The validation of the scene checks its range.
pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, such as 640x480".to_string())
}

fn number(text: &str, is_valid: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| is_valid(*x));
    number.ok_or_else(|| format!("expected {expected}"))
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, |x| x.is_finite() && x > 0.0, "a number greater than 0")
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |x| x.is_finite() && x >= 0.0, "a number of at least 0")
}

pub(super) fn bandwidth(text: &str) -> Result<f64, String> {
    number(text, |x| (1.0..=1e6).contains(&x), "a number from 1 to 1000000")
}

pub(super) fn exposure(text: &str) -> Result<f64, String> {
    number(text, |x| x.abs() <= 64.0, "a number from -64 to 64")
}

/// Units of memory sizes: name and number of bytes.
const MEMORY_UNITS: [(&str, f64); 6] = [
    ("KB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
    ("KiB", 1024.0),
    ("MiB", 1_048_576.0),
    ("GiB", 1_073_741_824.0),
];

/// Parses a memory size such as `4GB`, `1.5GiB` or `800 MB` into bytes.
pub(super) fn memory(text: &str) -> Result<u64, String> {
    let of_unit = |(unit, bytes): &(&str, f64)| {
        let end = text.len().checked_sub(unit.len())?;
        let (number, ending) = text.split_at_checked(end)?;
        let number: f64 =
            number.trim_end().parse().ok().filter(|_| ending.eq_ignore_ascii_case(unit))?;
        (number > 0.0 && number * bytes < 1e18).then(|| (number * bytes) as u64)
    };
    let bytes = MEMORY_UNITS.iter().find_map(of_unit);
    bytes.ok_or_else(|| "expected a size with KB, MB, GB, KiB, MiB or GiB, such as 4GB".to_string())
}

pub(super) fn file_of(name: &str, format: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(name);
    let fits = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(format));
    if fits { Ok(path) } else { Err(format!("expected a name that ends in .{format}")) }
}

pub(super) const PRECISIONS: [Choice<Precision>; 3] = [
    ("single", Some("32-bit floats"), Precision::Single),
    ("double", Some("64-bit floats"), Precision::Double),
    ("auto", Some("32-bit or 64-bit floats, chosen by the scene's proportions"), Precision::Auto),
];

/// Colours of `--color`; `None` is `auto`. The alias hides the `Option` from clap, for which it
/// means an argument that may be absent.
pub(super) type ColorChoice = Option<Colors>;

pub(super) const COLORS: [Choice<ColorChoice>; 5] = [
    ("auto", Some("Chosen by the environment and the terminal's replies"), None),
    ("true", Some("24-bit colours"), Some(Colors::True)),
    ("256", Some("The 256 colours of xterm"), Some(Colors::Indexed)),
    ("16", Some("The 16 colours of every terminal"), Some(Colors::Sixteen)),
    ("none", Some("No colours"), Some(Colors::Mono)),
];

pub(super) const GRAPHICS: [Choice<GraphicsMode>; 7] = [
    ("auto", None, GraphicsMode::Automatic),
    ("kitty", Some("Kitty's graphics protocol"), GraphicsMode::Kitty),
    ("sixel", Some("Sixel"), GraphicsMode::Sixel),
    ("cells", Some("Half blocks in cells of the terminal"), GraphicsMode::Cells(Blocks::Halves)),
    ("quadrants", Some("2 x 2 pixels in a cell"), GraphicsMode::Cells(Blocks::Quadrants)),
    (
        "sextants",
        Some("2 x 3 pixels; `doctor` tests the font"),
        GraphicsMode::Cells(Blocks::Sextants),
    ),
    (
        "octants",
        Some("2 x 4 pixels; `doctor` tests the font"),
        GraphicsMode::Cells(Blocks::Octants),
    ),
];

pub(super) const DEPTHS: [Choice<Depth>; 2] =
    [("8", None, Depth::Eight), ("16", None, Depth::Sixteen)];

pub(super) const SAMPLERS: [Choice<SamplerKind>; 2] = [
    ("sobol", Some("Owen-scrambled Sobol points"), SamplerKind::Sobol),
    ("random", Some("Independent random numbers"), SamplerKind::Random),
];
