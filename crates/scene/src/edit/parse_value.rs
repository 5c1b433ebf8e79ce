//! Parsing and formatting of property values as users type and read them.

use crate::edit::EditError;
use crate::format::emit::color;
use crate::format::suggest::did_you_mean;
use crate::value::{Color, Field, NumberRange, ValueType, number, sanitized, truncated};
use toml::Value;

/// Parses `text` as a value of `field`. A whole number must be in its range. The ranges of other
/// numbers are checked later, by the validation of the edited scene.
pub(super) fn parse(field: &Field, text: &str) -> Result<Value, EditError> {
    let text = text.trim();
    let wrong = || {
        let found = format!("{} cannot be \"{}\"", field.name, truncated(text));
        EditError::new(&found, &format!("Expected {}.", field.takes))
    };
    let list = |n: usize| match numbers(text) {
        Some(list) if list.len() == n => Ok(list),
        Some(list) => {
            let found = format!("{} needs {n} numbers, not {}", field.name, list.len());
            Err(EditError::new(&found, &format!("Expected {}.", field.takes)))
        }
        None => Err(wrong()),
    };
    let floats = |list: Vec<f64>| Value::Array(list.into_iter().map(Value::Float).collect());
    let whole = |x: f64, range: NumberRange| {
        let fits = x.fract() == 0.0 && range.holds(x);
        if fits { Ok(Value::Integer(x as i64)) } else { Err(wrong()) }
    };
    match field.takes {
        ValueType::Text => name(field.name, unquoted(text)).map(Value::String),
        ValueType::Switch => {
            let words = ["true", "on", "yes", "1", "false", "off", "no", "0"];
            let index = choose(text, &words).ok_or_else(wrong)?;
            Ok(Value::Boolean(index < 4))
        }
        ValueType::Choice(choices) => {
            let word = word(field, unquoted(text), choices.iter().map(|c| c.name));
            word.map(Value::from)
        }
        ValueType::Whole(range) => list(1).and_then(|list| whole(list[0], range)),
        ValueType::Wholes(n, range) => {
            let wholes = list(n)?.into_iter().map(|x| whole(x, range));
            wholes.collect::<Result<_, _>>().map(Value::Array)
        }
        ValueType::Number(_) => list(1).map(|list| Value::Float(list[0])),
        ValueType::Numbers(n, _) => list(n).map(floats),
        ValueType::Direction => list(3).map(floats),
        ValueType::Factor => match numbers(text).as_deref() {
            Some([factor]) => Ok(Value::Float(*factor)),
            Some(list @ [_, _, _]) => Ok(floats(list.to_vec())),
            _ => Err(wrong()),
        },
        ValueType::Color(_) => match Color::from_hex(unquoted(text)) {
            Some(color) => Ok(floats(color.0.to_vec())),
            None if text.contains('#') => Err(wrong()),
            None => list(3).map(floats),
        },
        ValueType::Table(_)
        | ValueType::OneOf(_)
        | ValueType::ListOf(_)
        | ValueType::Tables(_)
        | ValueType::Named(_) => Err(wrong()),
    }
}

/// Returns the index in `words` of the word that equals `text`, or else of the only word that
/// starts with `text`. Case is ignored. Returns `None` if no word or more than one word starts with
/// `text`.
pub(super) fn choose(text: &str, words: &[&str]) -> Option<usize> {
    let text = text.to_lowercase();
    if let Some(at) = words.iter().position(|word| word.to_lowercase() == text) {
        return Some(at);
    }
    let starts = |word: &&str| !text.is_empty() && word.to_lowercase().starts_with(&text);
    let mut begun = words.iter().enumerate().filter(|(_, word)| starts(word));
    match (begun.next(), begun.next()) {
        (Some((at, _)), None) => Some(at),
        _ => None,
    }
}

/// Returns the word that [`choose`] finds, or an error that lists the accepted words.
pub(super) fn word<'a>(
    field: &Field,
    text: &str,
    words: impl IntoIterator<Item = &'a str>,
) -> Result<&'a str, EditError> {
    let words: Vec<_> = words.into_iter().collect();
    choose(text, &words).map(|index| words[index]).ok_or_else(|| {
        let quote = |word: &&str| format!("\"{}\"", truncated(word));
        let quoted: Vec<_> = words.iter().take(20).map(quote).collect();
        let more = if quoted.len() < words.len() { ", …" } else { "" };
        let meant = did_you_mean(text, words.iter().copied());
        let help = format!("Expected one of {}{more}.{meant}", quoted.join(", "));
        EditError::new(&format!("{} cannot be \"{}\"", field.name, truncated(text)), &help)
    })
}

/// Validates `text` as a name, which must be printable. `what` is the key in the error.
pub(super) fn name(what: &str, text: &str) -> Result<String, EditError> {
    let text = text.trim();
    let help = "Expected at most 60 characters, none of them a control character.";
    if text.chars().count() > 60 || sanitized(text) != text {
        return Err(EditError::new(&format!("{what} cannot be \"{}\"", truncated(text)), help));
    }
    Ok(text.to_string())
}

fn unquoted(text: &str) -> &str {
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text)
}

/// Parses numbers that are separated by commas, semicolons or spaces (or the `x` of `640x480` and
/// `640 x 480`), with or without brackets. Returns `None` if one of them is not a number.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let inner = match text.strip_prefix('[') {
        Some(rest) => rest.strip_suffix(']')?,
        None => text,
    };
    let words: Vec<_> =
        inner.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty()).collect();
    let is_number = |at: usize| words.get(at).is_some_and(|word| digits(word));
    let between = |at: usize| {
        ["x", "×"].contains(&words[at]) && at > 0 && is_number(at - 1) && is_number(at + 1)
    };
    let parts = (0..words.len()).filter(|at| !between(*at));
    let parts = parts.flat_map(|at| words[at].split(['x', '×']));
    parts.map(|part| digits(part).then(|| part.parse().ok())?).collect()
}

/// Returns `true` if `part` has at least one digit, and apart from digits only signs, points, `e`
/// and `E`. The words `inf` and `nan` are excluded, because no field accepts them.
fn digits(part: &str) -> bool {
    part.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b))
        && part.bytes().any(|b| b.is_ascii_digit())
}

/// Formats a value of the type `takes`: numbers with the shortest digits, lists without brackets. A
/// colour is formatted as `#rrggbb` if that is exact, and shorter than its three numbers.
pub(super) fn show(takes: ValueType, value: &Value) -> String {
    if let (ValueType::Color(_), Some(color)) = (takes, color(value)) {
        let channels = join(&color.0.map(number));
        return color.to_hex().filter(|hex| hex.len() < channels.len()).unwrap_or(channels);
    }
    match value {
        Value::Array(list) => {
            join(&list.iter().map(|v| show(ValueType::Text, v)).collect::<Vec<_>>())
        }
        Value::Float(x) => number(*x),
        Value::Integer(i) => i.to_string(),
        Value::Boolean(yes) => yes.to_string(),
        Value::String(text) => sanitized(text),
        other => other.to_string(),
    }
}

fn join(parts: &[String]) -> String {
    parts.join(", ")
}

/// Returns the numbers of a value: one number, or those of a list. Returns `None` for any other
/// value.
pub(super) fn floats(value: &Value) -> Option<Vec<f64>> {
    let one = |value: &Value| match value {
        Value::Float(x) => Some(*x),
        Value::Integer(i) => Some(*i as f64),
        _ => None,
    };
    match value {
        Value::Array(list) => list.iter().map(one).collect(),
        other => one(other).map(|x| vec![x]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Choice, NumberRange};

    fn field(takes: ValueType) -> Field {
        Field::required("it", takes, "", "")
    }

    #[test]
    fn typed_numbers_are_parsed() {
        let one = field(ValueType::Number(NumberRange::FINITE));
        for (text, expected) in
            [("0.5", 0.5), (".5", 0.5), (" 5. ", 5.0), ("1e-3", 1e-3), ("+2", 2.0), ("[3]", 3.0)]
        {
            assert_eq!(parse(&one, text), Ok(Value::Float(expected)), "{text}");
        }
        for text in [
            "", "x", "inf", "nan", "1 2", "0,5", "--1", "1e", "[1", "e", "0x10", "1x", "x1", "1 x",
            "×2",
        ] {
            assert!(parse(&one, text).is_err(), "{text}");
        }
        let three = field(ValueType::Numbers(3, NumberRange::FINITE));
        for text in ["1, 2, 3", "1 2 3", "[1,2,3]", "1;2 ;3", " [ 1 2 3 ] "] {
            assert_eq!(floats(&parse(&three, text).unwrap()), Some(vec![1.0, 2.0, 3.0]), "{text}");
        }
        let refusal = parse(&three, "1 2").unwrap_err();
        assert_eq!(refusal.found, "it needs 3 numbers, not 2");
        let size = field(ValueType::Wholes(2, NumberRange::closed(1.0, 100.0)));
        for text in ["64x48", "64 x 48", "64×48", "64 48"] {
            assert_eq!(floats(&parse(&size, text).unwrap()), Some(vec![64.0, 48.0]), "{text}");
        }
        for text in
            ["64x", "x64", "64 48x", "64xx48", "64 x x 48", "64 x", "64 0", "64 4.5", "64 1e9"]
        {
            assert!(parse(&size, text).is_err(), "{text}");
        }
        let factor = field(ValueType::Factor);
        assert!(parse(&factor, "2").is_ok() && parse(&factor, "1 2 3").is_ok());
        assert!(parse(&factor, "1 2").is_err());
    }

    #[test]
    fn typed_colours_and_choices_are_parsed() {
        let color = field(ValueType::Color(NumberRange::SHARE));
        assert_eq!(floats(&parse(&color, "#ff0000").unwrap()), Some(vec![1.0, 0.0, 0.0]));
        assert_eq!(floats(&parse(&color, ".5 0 1").unwrap()), Some(vec![0.5, 0.0, 1.0]));
        assert!(parse(&color, "#ff00").is_err() && parse(&color, "red").is_err());
        let switch = field(ValueType::Switch);
        for (text, expected) in
            [("true", true), ("ON", true), ("y", true), ("of", false), ("n", false), ("f", false)]
        {
            assert_eq!(parse(&switch, text), Ok(Value::Boolean(expected)), "{text}");
        }
        assert!(parse(&switch, "o").is_err(), "on or off");
        let lobes: &[Choice] =
            &[Choice { name: "mirror", doc: "" }, Choice { name: "monkey", doc: "" }];
        let lobe = field(ValueType::Choice(lobes));
        assert_eq!(parse(&lobe, "mi"), Ok(Value::String("mirror".into())));
        let refusal = parse(&lobe, "miror").unwrap_err().to_string();
        assert!(refusal.ends_with("Did you mean \"mirror\"?"), "{refusal}");
        assert!(parse(&lobe, "m").is_err() && parse(&lobe, "").is_err());
    }

    #[test]
    fn printed_values_are_short() {
        let list = |list: &[f64]| Value::Array(list.iter().map(|x| Value::Float(*x)).collect());
        let color = ValueType::Color(NumberRange::LIGHT);
        assert_eq!(show(ValueType::Direction, &list(&[0.1, -3.0, 1e9])), "0.1, -3, 1e9");
        assert_eq!(show(color, &list(&[1.0, 0.0, 0.5])), "1, 0, 0.5");
        assert_eq!(show(color, &list(&Color::from_hex("#80ff01").unwrap().0)), "#80ff01");
        assert_eq!(show(ValueType::Switch, &Value::Boolean(true)), "true");
    }

    #[test]
    fn names_with_control_characters_are_refused() {
        assert_eq!(name("name", " café 2 "), Ok("café 2".into()));
        for bad in ["a\nb", "\u{1b}[31m", "a\u{202e}b", &"x".repeat(61)] {
            assert!(name("name", bad).is_err(), "{bad:?}");
        }
    }
}
