//! glTF URIs: data URIs and percent-encoded relative paths (RFC 3986, RFC 2397).

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
            percent_decode(body)?
        };
        return Ok(Uri::Data(bytes));
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        return Err(format!("a URI of scheme '{scheme}'"));
    }
    let bytes = percent_decode(uri)?;
    let path = String::from_utf8(bytes).map_err(|_| "a path that is not UTF-8".to_owned())?;
    // glTF 2.0, section 2.8: references are relative, so that a scene's folder can be moved.
    if path.starts_with(['/', '\\']) || path.get(1..2) == Some(":") {
        return Err(format!("the absolute path '{path}'"));
    }
    Ok(Uri::Path(path))
}

fn percent_decode(text: &str) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        if byte != b'%' {
            out.push(byte);
            continue;
        }
        let mut digit = || bytes.next().and_then(|b| char::from(b).to_digit(16));
        match (digit(), digit()) {
            (Some(high), Some(low)) => out.push((high * 16 + low) as u8),
            _ => return Err(format!("a bad percent escape in '{text}'")),
        }
    }
    Ok(out)
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
    }

    #[test]
    fn unreadable_uris_are_refused_with_the_reason() {
        for (uri, part) in [
            ("http://x/y.bin", "scheme 'http'"),
            ("a%2", "percent escape"),
            ("data:;base64", "without a comma"),
            ("data:;base64,a*b", "0x2a"),
            ("%FF", "not UTF-8"),
            ("/etc/hostname", "absolute path '/etc/hostname'"),
            ("%2Fetc/hostname", "absolute path"),
            ("C:/textures/a.png", "absolute path"),
        ] {
            let error = parse(uri).unwrap_err();
            assert!(error.contains(part), "{uri}: {error}");
        }
    }
}
