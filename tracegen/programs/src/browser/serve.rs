//! Serves the files of a local page to the browser, in place of a web server.

use super::protocol::{Browser, BrowserError};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use formats::container::{declare_input, kind_of, open_regular};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Origin of local pages. It is secure, so that all web features are available.
pub const ORIGIN: &str = "https://page.parallax.test";

/// Longest file that is served. The protocol sends files as text in one message.
const LONGEST_BYTES: u64 = 256 << 20;

/// Answers a request that the browser has paused. Returns the reason if a file that exists is not served.
///
/// # Errors
/// The browser ended.
pub fn serve(
    browser: &mut Browser,
    root: &Path,
    request: &Value,
) -> Result<Option<String>, BrowserError> {
    let id = &request["requestId"];
    let url = request["request"]["url"].as_str().unwrap_or("");
    let path = path_of(root, url);
    let content = path.as_ref().map(|path| content(root, path));
    let (answer, refused) = match (path, content) {
        (Some(path), Some(Ok(bytes))) => {
            declare_input(&path);
            let answer = json!({
                "requestId": id,
                "responseCode": 200,
                "responseHeaders": headers(&path),
                "body": STANDARD.encode(bytes),
            });
            (answer, None)
        }
        (_, content) => {
            let answer =
                json!({ "requestId": id, "responseCode": 404, "responsePhrase": "Not Found" });
            let refused = content.and_then(Result::err).flatten();
            (answer, refused.map(|why| format!("{url}: {why}")))
        }
    };
    browser.notify("Fetch.fulfillRequest", answer)?;
    Ok(refused)
}

/// Content of a regular file whose real path is below the root. The error is the reason why a file that exists
/// is not served.
fn content(root: &Path, path: &Path) -> Result<Vec<u8>, Option<String>> {
    let real = path.canonicalize().map_err(|_| None)?;
    if !real.starts_with(root) {
        return Err(Some(
            "a link to a file outside the page's folder".to_owned(),
        ));
    }
    let found = real.metadata().map_err(|error| Some(error.to_string()))?;
    if !found.is_file() {
        return Err(Some(format!("expected a file, found {}", kind_of(&found))));
    }
    if found.len() > LONGEST_BYTES {
        let mib = LONGEST_BYTES >> 20;
        return Err(Some(format!(
            "expected at most {mib} MiB, found {} bytes",
            found.len()
        )));
    }
    let mut bytes = Vec::new();
    let read =
        open_regular(&real).and_then(|file| file.take(LONGEST_BYTES).read_to_end(&mut bytes));
    read.map_err(|error| Some(error.to_string()))?;
    Ok(bytes)
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

    #[cfg(unix)]
    #[test]
    fn only_regular_files_below_the_root_are_served() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap().join("root");
        let at = |name: &str| root.join(name);
        std::fs::create_dir_all(at("sub")).unwrap();
        std::fs::write(at("file"), "page").unwrap();
        std::fs::write(folder.path().join("secret"), "secret").unwrap();
        symlink("../secret", at("link")).unwrap();
        symlink("..", at("folder")).unwrap();
        symlink("../file", at("sub/inner")).unwrap();
        symlink("/dev/zero", at("device")).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        let made = std::process::Command::new("mkfifo")
            .arg(at("pipe"))
            .status();
        assert!(made.unwrap().success());
        for name in ["file", "sub/inner"] {
            assert_eq!(content(&root, &at(name)), Ok(b"page".to_vec()), "{name}");
        }
        for (name, expected) in [
            ("link", "outside"),
            ("folder/secret", "outside"),
            ("device", "outside"),
            ("socket", "a socket"),
            ("pipe", "a pipe"),
            ("sub", "a folder"),
        ] {
            let why = content(&root, &at(name)).unwrap_err().unwrap();
            assert!(why.contains(expected), "{name}: {why}");
        }
        assert_eq!(content(&root, &at("none")), Err(None));
    }

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
