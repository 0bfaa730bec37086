//! The tags of an XML document, one after the other, without keeping the document.

use std::io::{BufRead, Read};

use crate::error::{Error, Result};
use crate::input::Input;
use crate::source::Format;

/// Most bytes of a tag before a file is taken for broken.
const MAX_TAG_BYTES: usize = 1 << 16;

/// A tag such as `<name key="value">`.
#[derive(Debug, PartialEq)]
pub(super) struct Tag {
    /// With a leading slash at the end of an element.
    pub(super) name: String,
    attributes: Vec<(String, String)>,
}

impl Tag {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Parses what stands between `<` and `>`.
    fn parse(text: &str) -> Option<Self> {
        let text = text.trim_end().strip_suffix('/').unwrap_or(text).trim_end();
        let end = text.find(|c: char| c.is_ascii_whitespace()).unwrap_or(text.len());
        let (name, mut rest) = text.split_at_checked(end)?;
        let mut attributes = Vec::new();
        loop {
            rest = rest.trim_start();
            if rest.is_empty() {
                break;
            }
            let (key, value) = rest.split_once('=')?;
            let key = key.trim_end();
            if key.is_empty() || key.contains(|c: char| c.is_ascii_whitespace()) {
                return None;
            }
            let value = value.trim_start();
            let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, after) = value.get(1..)?.split_once(quote)?;
            attributes.push((key.into(), unescape(value)));
            rest = after;
        }
        (!name.is_empty()).then(|| Self { name: name.into(), attributes })
    }
}

fn unescape(text: &str) -> String {
    let plain = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
    plain.replace("&apos;", "'").replace("&amp;", "&")
}

/// The next tag; none at the end of the file.
pub(super) fn next_tag(input: &mut Input<'_>) -> Result<Option<Tag>> {
    loop {
        if !skip_past(input, b'<')? {
            return Ok(None);
        }
        let text = markup(input)?;
        if text.starts_with(['?', '!']) {
            continue;
        }
        return Tag::parse(&text).map(Some).ok_or_else(|| invalid(&text));
    }
}

fn invalid(text: &str) -> Error {
    let found: String = text.chars().take(100).collect();
    Error::header(Format::Vti, "tag", "<name key=\"value\" ..>", format!("{found:?}"))
}

/// Skips up to the next `byte` and it; false at the end of the file.
fn skip_past(input: &mut Input<'_>, byte: u8) -> Result<bool> {
    loop {
        let (used, found) = match input.fill_buf() {
            Ok([]) => return Ok(false),
            Ok(buffer) => match buffer.iter().position(|&b| b == byte) {
                Some(at) => (at + 1, true),
                None => (buffer.len(), false),
            },
            Err(source) => return Err(input.error(source)),
        };
        input.consume(used);
        if found {
            return Ok(true);
        }
    }
}

/// Reads up to the `>` that ends a tag, comment or declaration.
fn markup(input: &mut Input<'_>) -> Result<String> {
    let mut text: Vec<u8> = Vec::new();
    let mut quote = None;
    loop {
        let mut byte = [0];
        let count = input.read(&mut byte).map_err(|source| input.error(source))?;
        let [byte] = byte;
        if count == 0 {
            let found = input.position;
            return Err(Error::TooShort { expected: found + 1, found });
        }
        if text.starts_with(b"!--") {
            // Comments may be long: only their end counts.
            let end = text.len() > 4 && text.ends_with(b"--") && byte == b'>';
            if end {
                return Ok("!--".into());
            }
            if text.len() > 64 {
                text.drain(3..text.len() - 2);
            }
        } else if quote == Some(byte) {
            quote = None;
        } else if quote.is_none() && matches!(byte, b'"' | b'\'') && !text.starts_with(b"!") {
            quote = Some(byte);
        } else if quote.is_none() && byte == b'>' {
            return Ok(String::from_utf8_lossy(&text).into());
        }
        text.push(byte);
        if text.len() > MAX_TAG_BYTES {
            let expected = format!("at most {MAX_TAG_BYTES} bytes");
            return Err(Error::header(Format::Vti, "tag", expected, "more"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags(text: &str) -> Vec<Tag> {
        let mut input = Input::from_bytes("x", text.as_bytes());
        std::iter::from_fn(|| next_tag(&mut input).unwrap()).collect()
    }

    #[test]
    fn tags_are_found_with_their_attributes() {
        let found = tags(
            "<?xml version=\"1.0\"?>\n<!-- <no> - -- \"' --><!DOCTYPE x>\n\
             <a b='1 > 0' c = \"&lt;&amp;\"> text <d/></a >",
        );
        let names: Vec<&str> = found.iter().map(|tag| tag.name.as_str()).collect();
        assert_eq!(names, ["a", "d", "/a"]);
        assert_eq!(found[0].attribute("b"), Some("1 > 0"));
        assert_eq!(found[0].attribute("c"), Some("<&"));
        assert_eq!(found[0].attribute("d"), None);
    }

    #[test]
    fn broken_tags_are_refused() {
        for text in
            ["<a b>", "<a b=1>", "<a b='1>", "<a b c='1'>", "<a ='1'>", "<>", "<a", "<!-- ", "< a>"]
        {
            let error = next_tag(&mut Input::from_bytes("x", text.as_bytes())).unwrap_err();
            let expected = matches!(error, Error::InvalidHeader { .. } | Error::TooShort { .. });
            assert!(expected, "{text}: {error}");
        }
        let long = format!("<a{}>", " ".repeat(MAX_TAG_BYTES));
        assert!(next_tag(&mut Input::from_bytes("x", long.as_bytes())).is_err());
    }
}
