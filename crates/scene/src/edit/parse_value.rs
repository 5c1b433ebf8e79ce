//! Parsing and formatting of property values as users type and read them.

use crate::edit::EditError;
use crate::value::{
    Color, Field, KeyValue, NumberRange, ValueType, did_you_mean, number, sanitized, truncated,
};

/// Parses `text` as a value of `field`. The ranges of numbers that are not whole are checked later.
pub(super) fn parse(field: &Field, text: &str) -> Result<KeyValue, EditError> {
    let text = text.trim();
    let wrong = || {
        let found = format!("{} cannot be \"{}\"", field.name, truncated(text));
        EditError::new(found, format!("Expected {}.", field.takes))
    };
    let list = |n: usize| match numbers(text) {
        Some(list) if list.len() == n => Ok(list),
        Some(list) => {
            let found = format!("{} needs {n} numbers, not {}", field.name, list.len());
            Err(EditError::new(found, format!("Expected {}.", field.takes)))
        }
        None => Err(wrong()),
    };
    let wholes = |n: usize, range: NumberRange| {
        let list = list(n)?;
        let fits = list.iter().all(|x| x.fract() == 0.0 && range.holds(*x));
        if fits { Ok(KeyValue::Numbers(list)) } else { Err(wrong()) }
    };
    match field.takes {
        ValueType::Text => name(field.name, unquoted(text)).map(KeyValue::Text),
        ValueType::Switch => {
            let words = ["true", "on", "yes", "1", "false", "off", "no", "0"];
            let index = choose(text, &words).ok_or_else(wrong)?;
            Ok(KeyValue::Switch(index < 4))
        }
        ValueType::Choice(choices) => {
            let word = word(field, unquoted(text), choices.iter().map(|c| c.name));
            word.map(|word| KeyValue::Text(word.to_string()))
        }
        ValueType::Whole(range) => wholes(1, range),
        ValueType::Wholes(n, range) => wholes(n, range),
        ValueType::Number(_) => list(1).map(KeyValue::Numbers),
        ValueType::Numbers(n, _) => list(n).map(KeyValue::Numbers),
        ValueType::Direction => list(3).map(KeyValue::Numbers),
        ValueType::Factor => match numbers(text) {
            Some(list) if [1, 3].contains(&list.len()) => Ok(KeyValue::Numbers(list)),
            _ => Err(wrong()),
        },
        ValueType::Color(_) => match Color::typed(unquoted(text)) {
            Some(color) => Ok(KeyValue::Numbers(color.0.to_vec())),
            None if text.contains('#') => Err(wrong()),
            None => list(3).map(KeyValue::Numbers),
        },
        ValueType::Table(_)
        | ValueType::OneOf(_)
        | ValueType::ListOf(_)
        | ValueType::Tables(_)
        | ValueType::Named(_) => Err(wrong()),
    }
}

/// Returns the index of the word that equals `text`, or else of the only word that starts with it;
/// `None` if there is no such word. Case is ignored.
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
        EditError::new(format!("{} cannot be \"{}\"", field.name, truncated(text)), help)
    })
}

/// Returns the name `text`; an error about the key `what` if it is too long or not printable.
pub(super) fn name(what: &str, text: &str) -> Result<String, EditError> {
    let text = text.trim();
    let help = "Expected at most 60 characters, none of them a control character.";
    if text.chars().count() > 60 || sanitized(text) != text {
        return Err(EditError::new(format!("{what} cannot be \"{}\"", truncated(text)), help));
    }
    Ok(text.to_string())
}

fn unquoted(text: &str) -> &str {
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text)
}

/// Parses numbers that are separated by commas, semicolons, spaces or the `x` of `640x480`, with or
/// without brackets.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let inner = match text.strip_prefix('[') {
        Some(rest) => rest.strip_suffix(']')?,
        None => text,
    };
    let joined = inner.replace('×', "x").replace(" x ", "x");
    let words = joined.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty());
    let parts = words.flat_map(|word| word.split('x'));
    parts.map(|part| digits(part).then(|| part.parse().ok())?).collect()
}

/// Returns `true` if `part` may be a number; no field accepts `inf` and `nan`.
fn digits(part: &str) -> bool {
    part.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b))
        && part.bytes().any(|b| b.is_ascii_digit())
}

/// Formats numbers with the shortest digits, lists without brackets, and a colour as `#rrggbb` if
/// that is exact and shorter.
pub(super) fn show(takes: ValueType, value: &KeyValue) -> String {
    let list = match value {
        KeyValue::Switch(on) => return on.to_string(),
        KeyValue::Text(text) => return sanitized(text),
        KeyValue::Numbers(list) => list,
    };
    if let ValueType::Whole(_) | ValueType::Wholes(..) = takes {
        return list.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    }
    let text = list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ");
    let color = color(takes, value).and_then(Color::to_hex);
    color.filter(|hex| hex.len() < text.len()).unwrap_or(text)
}

/// Returns the colour `value`; `None` if `takes` is not the type of colours.
pub(super) fn color(takes: ValueType, value: &KeyValue) -> Option<Color> {
    match (takes, value) {
        (ValueType::Color(_), KeyValue::Numbers(list)) => list[..].try_into().ok().map(Color),
        _ => None,
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
            assert_eq!(parse(&one, text), Ok(KeyValue::Numbers(vec![expected])), "{text}");
        }
        for text in [
            "", "x", "inf", "nan", "1 2", "0,5", "--1", "1e", "[1", "e", "0x10", "1x", "x1", "1 x",
            "×2",
        ] {
            assert!(parse(&one, text).is_err(), "{text}");
        }
        let three = field(ValueType::Numbers(3, NumberRange::FINITE));
        for text in ["1, 2, 3", "1 2 3", "[1,2,3]", "1;2 ;3", " [ 1 2 3 ] "] {
            assert_eq!(parse(&three, text), Ok(KeyValue::Numbers(vec![1.0, 2.0, 3.0])), "{text}");
        }
        let refusal = parse(&three, "1 2").unwrap_err();
        assert_eq!(refusal.found, "it needs 3 numbers, not 2");
        let size = field(ValueType::Wholes(2, NumberRange::closed(1.0, 100.0)));
        for text in ["64x48", "64 x 48", "64×48", "64 48"] {
            assert_eq!(parse(&size, text), Ok(KeyValue::Numbers(vec![64.0, 48.0])), "{text}");
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
        assert_eq!(parse(&color, "#ff0000"), Ok(KeyValue::Numbers(vec![1.0, 0.0, 0.0])));
        assert_eq!(parse(&color, ".5 0 1"), Ok(KeyValue::Numbers(vec![0.5, 0.0, 1.0])));
        assert!(parse(&color, "#ff00").is_err() && parse(&color, "redd").is_err());
        let switch = field(ValueType::Switch);
        for (text, expected) in
            [("true", true), ("ON", true), ("y", true), ("of", false), ("n", false), ("f", false)]
        {
            assert_eq!(parse(&switch, text), Ok(KeyValue::Switch(expected)), "{text}");
        }
        assert!(parse(&switch, "o").is_err(), "on or off");
        let lobes: &[Choice] =
            &[Choice { name: "mirror", doc: "" }, Choice { name: "monkey", doc: "" }];
        let lobe = field(ValueType::Choice(lobes));
        assert_eq!(parse(&lobe, "mi"), Ok(KeyValue::Text("mirror".into())));
        let refusal = parse(&lobe, "miror").unwrap_err().to_string();
        assert!(refusal.ends_with("Did you mean \"mirror\"?"), "{refusal}");
        assert!(parse(&lobe, "m").is_err() && parse(&lobe, "").is_err());
    }

    #[test]
    fn printed_values_are_short() {
        let list = |list: &[f64]| KeyValue::Numbers(list.to_vec());
        let color = ValueType::Color(NumberRange::LIGHT);
        assert_eq!(show(ValueType::Direction, &list(&[0.1, -3.0, 1e9])), "0.1, -3, 1e9");
        assert_eq!(show(color, &list(&[1.0, 0.0, 0.5])), "1, 0, 0.5");
        assert_eq!(show(color, &list(&Color::from_hex("#80ff01").unwrap().0)), "#80ff01");
        assert_eq!(show(ValueType::Switch, &KeyValue::Switch(true)), "true");
    }

    #[test]
    fn names_with_control_characters_are_refused() {
        assert_eq!(name("name", " café 2 "), Ok("café 2".into()));
        for bad in ["a\nb", "\u{1b}[31m", "a\u{202e}b", &"x".repeat(61)] {
            assert!(name("name", bad).is_err(), "{bad:?}");
        }
    }
}
