//! glTF URIs: data URIs and percent-encoded relative paths (RFC 3986, RFC 2397).
//!
//! Many programs write file names without encoding them: `50% grey.png`, `a#1.png`. A `%` that begins no
//! escape stands for itself, and [`names`] lists what else a path may mean.

use crate::files::latin1;

/// Target of a URI.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Uri {
    /// Bytes inside the URI.
    Data(Vec<u8>),
    /// A relative path, decoded.
    Path(String),
}

/// Parses a URI. The error states what is wrong with it.
pub(crate) fn parse(uri: &str) -> Result<Uri, String> {
    if let Some(rest) = uri.strip_prefix("data:") {
        let (header, body) = rest
            .split_once(',')
            .ok_or_else(|| "a data URI without a comma".to_owned())?;
        let bytes = if header.ends_with(";base64") {
            base64(body.as_bytes())?
        } else {
            percent_decode(body)
        };
        return Ok(Uri::Data(bytes));
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        return Err(format!("a URI of scheme '{scheme}'"));
    }
    // A scheme without an authority.
    if let Some((scheme @ ("file" | "http" | "https" | "blob"), _)) = uri.split_once(':') {
        return Err(format!("a URI of scheme '{scheme}'"));
    }
    let path = decoded(uri);
    // glTF 2.0, section 2.8: references are relative, so that a scene's folder can be moved.
    if path.starts_with(['/', '\\']) || path.get(1..2) == Some(":") {
        return Err(format!("the absolute path '{path}'"));
    }
    Ok(Uri::Path(path))
}

/// What a path may mean, likeliest first: its decoded text, its text as written, and the decoded text
/// before a query (`?`) or a fragment (`#`), which say nothing about a file.
pub(crate) fn names(uri: &str, path: &str) -> Vec<String> {
    let mut names = vec![path.to_owned(), uri.to_owned()];
    if let Some((before, _)) = uri.split_once(['?', '#'])
        && !before.is_empty()
    {
        names.push(decoded(before));
    }
    names
}

/// The decoded text. Bytes that are not UTF-8 come from a system that wrote Latin-1.
fn decoded(uri: &str) -> String {
    String::from_utf8(percent_decode(uri)).unwrap_or_else(|e| latin1(e.as_bytes()))
}

/// Replaces every escape of two hexadecimal digits by its byte.
fn percent_decode(text: &str) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let digit = |at: usize| after.get(at).and_then(|&b| char::from(b).to_digit(16));
        match (byte, digit(0), digit(1)) {
            (b'%', Some(high), Some(low)) => {
                out.push((high * 16 + low) as u8);
                rest = &after[2..];
            }
            _ => {
                out.push(byte);
                rest = after;
            }
        }
    }
    out
}

fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for &c in text.iter().filter(|c| !c.is_ascii_whitespace()) {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            _ => return Err(format!("byte {c:#04x} in base64 data")),
        };
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_rfc_4648_vectors() {
        for (text, expected) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
        ] {
            let uri = format!("data:application/octet-stream;base64,{text}");
            assert_eq!(parse(&uri), Ok(Uri::Data(expected.into())));
        }
    }

    #[test]
    fn percent_escapes_in_a_path_are_decoded() {
        assert_eq!(
            parse("my%20textures/%C3%BC.png"),
            Ok(Uri::Path("my textures/ü.png".into()))
        );
        assert_eq!(parse("caf%E9.png"), Ok(Uri::Path("café.png".into())));
    }

    #[test]
    fn a_percent_sign_without_digits_stands_for_itself() {
        for (uri, path) in [
            ("wood 50% dark.png", "wood 50% dark.png"),
            ("100%", "100%"),
            ("a%2", "a%2"),
            ("%%20%zz", "% %zz"),
        ] {
            assert_eq!(parse(uri), Ok(Uri::Path(path.into())), "{uri}");
        }
    }

    #[test]
    fn queries_and_fragments_are_left_out_last() {
        assert_eq!(names("a.png", "a.png"), ["a.png", "a.png"]);
        let versioned = ["t .png?v=3", "t%20.png?v=3", "t .png"];
        assert_eq!(names(versioned[1], versioned[0]), versioned);
        assert_eq!(names("a#1.png", "a#1.png"), ["a#1.png", "a#1.png", "a"]);
        assert_eq!(names("#x", "#x"), ["#x", "#x"]);
    }

    #[test]
    fn unreadable_uris_are_refused_with_the_reason() {
        for (uri, part) in [
            ("http://x/y.bin", "scheme 'http'"),
            ("file:t.png", "scheme 'file'"),
            ("data:;base64", "without a comma"),
            ("data:;base64,a*b", "0x2a"),
            ("/etc/hostname", "absolute path '/etc/hostname'"),
            ("%2Fetc/hostname", "absolute path"),
            ("C:/textures/a.png", "absolute path"),
        ] {
            let error = parse(uri).unwrap_err();
            assert!(error.contains(part), "{uri}: {error}");
        }
    }
}
