//! Parts of a scene file: whole `[[object]]` sections, or everything else. Only one part is parsed
//! at a time, because a parsed document takes about a hundred times the memory of its text.

use std::borrow::Cow;
use std::ops::Range;

/// Length in bytes from which a part is full: the next `[[object]]` begins a new part.
pub(crate) const PART_BYTES: usize = 256 << 10;

/// Part of a scene file that is parsed as a TOML document of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Ranges of the file's bytes that make up this part of the scene file, in ascending order.
    ranges: Vec<Range<usize>>,
    /// Number of objects in the file before this part of it.
    pub first_object: usize,
}

/// Header with which a section of a TOML document begins.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Header {
    /// Header of an object: `[[object]]`.
    Object,
    /// Header of a table inside the previous object, such as `[object.shape]`.
    InObject,
    Other,
}

impl Part {
    /// Creates a part that consists of the whole `text` of a scene file.
    pub fn whole(text: &str) -> Self {
        let everything = 0..text.len();
        Self { ranges: vec![everything], first_object: 0 }
    }

    /// Returns the text of this part; `text` is the text of the whole file.
    pub fn text<'a>(&self, text: &'a str) -> Cow<'a, str> {
        match self.ranges.as_slice() {
            [range] => Cow::Borrowed(&text[range.clone()]),
            ranges => ranges.iter().map(|range| &text[range.clone()]).collect(),
        }
    }

    /// Returns the index in the whole file of this part's first entry in the list at `path`.
    pub fn first_index(&self, path: &[String]) -> usize {
        match path {
            [list] if list == "object" => self.first_object,
            _ => 0,
        }
    }

    /// Converts the byte offset `at` in the text of this part to a byte offset in the file.
    pub fn in_file(&self, mut at: usize) -> usize {
        for range in &self.ranges {
            if at < range.len() {
                return range.start + at;
            }
            at -= range.len();
        }
        self.ranges.last().map_or(0, |range| range.end)
    }
}

/// Divides a file into parts. The first has everything except the objects. Each of the others has
/// consecutive objects, up to the one with which it reaches `part_bytes` bytes. A file has a single
/// part if it is short, if it has no objects, if a table of an object follows a section of another
/// kind, or if a line that looks like a header may be part of a string or a list.
pub(crate) fn split(text: &str, part_bytes: usize) -> Vec<Part> {
    let sections = sections(text).unwrap_or_default();
    let objects = sections.iter().filter(|(_, header)| *header == Header::Object).count();
    if text.len() <= part_bytes || objects == 0 {
        return vec![Part::whole(text)];
    }
    let mut others: Vec<Range<usize>> = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    let (mut object, mut before) = (0, Header::Other);
    for (i, (start, header)) in sections.iter().enumerate() {
        let range = *start..sections.get(i + 1).map_or(text.len(), |(next, _)| *next);
        let extends = |ranges: &[Range<usize>]| ranges.last().is_some_and(|r| r.end == *start);
        match header {
            Header::InObject if before == Header::Other => return vec![Part::whole(text)],
            Header::Other => match others.last_mut().filter(|last| last.end == *start) {
                Some(last) => last.end = range.end,
                None => others.push(range),
            },
            _ => {
                let is_full = |part: &Part| part.ranges[0].len() >= part_bytes;
                match parts.last_mut().filter(|part| extends(&part.ranges)) {
                    Some(part) if *header == Header::InObject || !is_full(part) => {
                        part.ranges[0].end = range.end;
                    }
                    _ => parts.push(Part { ranges: vec![range], first_object: object }),
                }
                object += usize::from(*header == Header::Object);
            }
        }
        before = *header;
    }
    parts.insert(0, Part { ranges: others, first_object: 0 });
    parts
}

/// Returns the first byte and the kind of header of each section of a TOML document. `None` if a
/// line that begins with a bracket may be part of a string or a list.
fn sections(text: &str) -> Option<Vec<(usize, Header)>> {
    if text.contains("\"\"\"") || text.contains("'''") {
        return None;
    }
    let mut sections = vec![(0, Header::Other)];
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        if line.trim_start().starts_with('[') {
            sections.push((start, header(line)?));
        }
        start += line.len();
    }
    if sections.get(1).is_some_and(|(start, _)| *start == 0) {
        sections.remove(0);
    }
    Some(sections)
}

/// Returns the kind of header in `line`; `None` if it is not certainly a header.
fn header(line: &str) -> Option<Header> {
    let line = line.split('#').next().unwrap_or(line).trim();
    let list = line.strip_prefix("[[").and_then(|line| line.strip_suffix("]]"));
    let table = || line.strip_prefix('[')?.strip_suffix(']');
    let name = list.or_else(table)?.trim();
    if name.contains(['[', ']', '{', '}', ',', '=']) {
        return None;
    }
    let inner = name.strip_prefix("object").map(str::trim_start);
    Some(match inner {
        Some("") if list.is_some() => Header::Object,
        Some(inner) if inner.starts_with('.') => Header::InObject,
        _ => Header::Other,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r##"# [[object]] in a comment
film.size = [
8, 8] # [[object]]
s = "\"[[object]]" # "
[materials."b"] # [[object]]
[[object]]
name = "a"
[object.shape]
x = 1
 [[ object ]] # b
[objects]
y = 1
[[object]]
name = '[[object]]'
[[object.transform]]
"##;

    #[test]
    fn parts_begin_with_headers_of_objects() {
        let parts = split(TEXT, 1);
        let texts: Vec<_> = parts.iter().map(|part| part.text(TEXT)).collect();
        let at = |text: &str| TEXT.find(text).unwrap();
        let first = at("[[object]]\nname = \"a\"");
        assert_eq!(texts[0], format!("{}[objects]\ny = 1\n", &TEXT[..first]));
        assert_eq!(texts[1], TEXT[first..at(" [[ object ]]")]);
        assert_eq!(texts[2], " [[ object ]] # b\n");
        assert_eq!(texts[3], TEXT[at("[[object]]\nname = '")..]);
        let objects: Vec<_> = parts.iter().map(|part| part.first_object).collect();
        assert_eq!(objects, [0, 0, 1, 2]);
        assert_eq!(parts[0].in_file(first), at("[objects]"));
        assert_eq!(parts[0].in_file(first + 12), at("[objects]") + 12);
        assert_eq!(parts[3].in_file(3), at("[[object]]\nname = '") + 3);
        assert_eq!(parts[0].in_file(TEXT.len()), at("[[object]]\nname = '"));
    }

    #[test]
    fn parts_have_at_least_the_given_length() {
        let text = "a = 1\n".to_string() + &"[[object]]\n".repeat(10);
        let lengths =
            |bytes| split(&text, bytes).iter().map(|p| p.text(&text).len()).collect::<Vec<_>>();
        assert_eq!(lengths(33), [6, 33, 33, 33, 11]);
        assert_eq!(lengths(20), [6, 22, 22, 22, 22, 22]);
        assert_eq!(lengths(text.len()), [text.len()]);
    }

    #[test]
    fn files_that_cannot_be_split_have_one_part() {
        for text in [
            "",
            "a = 1\n",
            "[[object]]\n[b]\n[object.shape]\n",
            "[object.shape]\n[[object]]\n",
            "x = \"\"\"\n[[object]]\n",
            "x = '''\n[[object]]\n'''\n[[object]]\n",
            "[[object]]\nx = [\n[1, 2],\n]\n",
            "[[object]]\nx = [\n[[1, 2]]\n]\n",
            "[materials.\"a, b\"]\n[[object]]\n",
        ] {
            assert_eq!(split(text, 0), [Part::whole(text)], "{text}");
        }
    }
}
