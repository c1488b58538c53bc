//! Serves the files of a local page to the browser, in place of a web server.

use super::protocol::{Browser, BrowserError, Event};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::path::{Component, Path, PathBuf};

/// Origin of local pages. It is secure, so that all web features are available.
pub const ORIGIN: &str = "https://page.parallax.test";

/// Answers a request that the browser has paused; returns false for other events.
///
/// # Errors
/// The browser ended.
pub fn serve(browser: &mut Browser, root: &Path, event: &Event) -> Result<bool, BrowserError> {
    if event.method != "Fetch.requestPaused" {
        return Ok(false);
    }
    let id = &event.params["requestId"];
    let url = event.params["request"]["url"].as_str().unwrap_or("");
    let content = path_of(root, url).and_then(|path| Some((std::fs::read(&path).ok()?, path)));
    let answer = match content {
        Some((bytes, path)) => json!({
            "requestId": id,
            "responseCode": 200,
            "responseHeaders": headers(&path),
            "body": STANDARD.encode(bytes),
        }),
        None => json!({ "requestId": id, "responseCode": 404, "responsePhrase": "Not Found" }),
    };
    browser.notify("Fetch.fulfillRequest", answer)?;
    Ok(true)
}

/// The file below `root` at an address.
fn path_of(root: &Path, url: &str) -> Option<PathBuf> {
    let rest = url.strip_prefix(ORIGIN)?;
    let path = rest.split(['?', '#']).next()?;
    let path = decoded(path.trim_start_matches('/'))?;
    let mut found = root.to_owned();
    for part in Path::new(&path).components() {
        match part {
            Component::Normal(part) => found.push(part),
            Component::CurDir => {}
            // Files outside the root are not served.
            _ => return None,
        }
    }
    Some(if found.is_dir() {
        found.join("index.html")
    } else {
        found
    })
}

/// Decodes the percent signs in an address.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Address of a file below the root.
#[must_use]
pub fn address(file: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"/-_.~".contains(&b);
    let mut url = format!("{ORIGIN}/");
    for byte in file.bytes() {
        if plain(byte) {
            url.push(byte.into());
        } else {
            url += &format!("%{byte:02X}");
        }
    }
    url
}

fn headers(path: &Path) -> Value {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_lowercase();
    let kind = match extension.as_str() {
        "html" | "htm" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "gltf" => "model/gltf+json",
        "glb" => "model/gltf-binary",
        "wasm" => "application/wasm",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "svg" => "image/svg+xml",
        "ktx2" => "image/ktx2",
        _ => "application/octet-stream",
    };
    json!([
        { "name": "content-type", "value": kind },
        { "name": "access-control-allow-origin", "value": "*" },
        // Required for memory that threads share.
        { "name": "cross-origin-opener-policy", "value": "same-origin" },
        { "name": "cross-origin-embedder-policy", "value": "credentialless" },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_name_files_below_the_root_and_no_others() {
        let root = Path::new("/none");
        let of = |url: &str| path_of(root, &format!("{ORIGIN}{url}"));
        assert_eq!(of("/a/b.png?x=1"), Some("/none/a/b.png".into()));
        assert_eq!(of("/a%20b.js"), Some("/none/a b.js".into()));
        for outside in ["/../etc/passwd", "/%2e%2e/x", "/%2fetc", "/%zz"] {
            let found = of(outside);
            assert!(found.is_none_or(|path| path.starts_with(root) && !path.ends_with("..")));
        }
        assert_eq!(path_of(root, "https://elsewhere.test/a"), None);
        let file = "folder/a page?.html";
        assert_eq!(path_of(root, &address(file)), Some(root.join(file)));
    }
}
