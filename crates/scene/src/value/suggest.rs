//! Suggestions for mistyped words ("Did you mean"): the nearest known word.

use crate::value::truncated;
use std::path::Path;

/// Returns the word most similar to `given`, if typing errors may explain the difference.
pub fn nearest<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // A text of this length is far longer than any key, and is no typing error.
    if given.len() > 100 {
        return None;
    }
    let (distance, word) =
        words.into_iter().map(|w| (distance(given, w), w)).min_by_key(|(d, _)| *d)?;
    let length = word.chars().count().max(given.chars().count());
    (distance <= 1 + length / 4 && distance < length).then_some(word)
}

/// Returns ` Did you mean "word"?` with the [`nearest`] word, or an empty string.
pub fn did_you_mean<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> String {
    let word = nearest(given, words).map(truncated);
    word.map_or(String::new(), |word| format!(" Did you mean \"{word}\"?"))
}

/// Returns the path of the file in the folder of `path` whose name is [`nearest`] to that of `path`.
pub(crate) fn nearest_file(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    let near = nearest(&path.file_name()?.to_string_lossy(), names.iter().map(String::as_str))?;
    Some(path.with_file_name(near).display().to_string())
}

/// Words of other programs, each group with what it is in a scene file.
const FOREIGN: &[(&[&str], &str)] = &[
    (&["fov", "field_of_view", "angle"], "view_angle = { vertical = 40.0 } of the camera"),
    (&["look_at", "lookat", "center_of_interest"], "target"),
    (&["position", "origin", "location", "from"], "eye of a camera, position of a light"),
    (&["albedo", "base_color", "diffuse_color", "kd", "rgb"], "color"),
    (&["ks", "specular_color"], "specular, the weight of highlights"),
    (&["metallic", "metalness"], "metal = \"gold\", or reflection with f0 for any colour"),
    (&["index_of_refraction", "refraction", "eta"], "ior, with transmission = 1.0"),
    (&["emissive", "emit", "radiance", "le"], "emission, a number, and emission_color"),
    (&["opacity", "transparency", "transmissive"], "transmission; 0 is opaque"),
    (&["glossiness", "gloss", "shininess"], "roughness of reflections, exponent of highlights"),
    (&["strength", "power", "energy"], "intensity, and unit = \"power\" for watts"),
    (&["translate", "translation", "rotation", "rotate"], "a step of transform"),
    (&["width", "height", "resolution"], "size = [640, 480] of [film]"),
    (&["samples", "spp"], "the option --spp of `zerkalo render`"),
    (&["exposure", "gamma"], "the option --exposure of `zerkalo render`"),
    (&["depth", "bounces", "max_bounces"], "max_depth and max_diffuse_depth of [trace]"),
];

/// Returns a sentence with the meaning of `given`, a word of other programs; empty if it is none.
pub(crate) fn translated(given: &str) -> String {
    let given = given.to_lowercase();
    let found = FOREIGN.iter().find(|(words, _)| words.contains(&&*given));
    found.map_or(String::new(), |(_, here)| format!(" Here it is {here}."))
}

/// Returns the optimal string alignment distance, ignoring case: insertions, deletions,
/// replacements and transpositions of adjacent characters.
fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::{distance, nearest};

    #[test]
    fn edit_distances() {
        for (a, b, expected) in [
            ("", "", 0),
            ("", "abc", 3),
            ("raduis", "radius", 1),
            ("colour", "color", 1),
            ("Radius", "radius", 0),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!(distance(a, b), expected, "{a} {b}");
            assert_eq!(distance(b, a), expected, "{b} {a}");
        }
    }

    #[test]
    fn suggestions_are_near_words() {
        let words = ["ebony", "ivory", "board"];
        assert_eq!(nearest("ivroy", words), Some("ivory"));
        assert_eq!(nearest("xylophone", words), None);
        assert_eq!(nearest("", words), None);
        assert_eq!(nearest(&"i".repeat(1 << 20), words), None);
        assert_eq!(nearest("x", [] as [&str; 0]), None);
    }
}
