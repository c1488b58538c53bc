//! Tests of `tracegen page` in Chromium: pages that wait, ask, download, poll, reload or draw nothing, and what
//! they may read and write.
#![cfg(unix)]

use parallax_tests::{has_chromium, program, refuse, run_ok, said};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// A page that draws a textured quad for each half of its canvas, after a script of the test.
fn page(script: &str) -> String {
    format!(
        r#"<!doctype html><script>{script}</script>
<canvas id=c width=64 height=64></canvas><script>
const gl = document.getElementById("c").getContext("webgl2");
const shader = (kind, text) => {{ const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; }};
const p = gl.createProgram();
gl.attachShader(p, shader(gl.VERTEX_SHADER, `#version 300 es
void main() {{ vec2 q = vec2(gl_VertexID & 1, gl_VertexID >> 1); gl_Position = vec4(q * 2. - 1., .5, 1); }}`));
gl.attachShader(p, shader(gl.FRAGMENT_SHADER, `#version 300 es
precision highp float; uniform sampler2D t; out vec4 o; void main() {{ o = texture(t, gl_FragCoord.xy / 16.); }}`));
gl.linkProgram(p); gl.useProgram(p); gl.enable(gl.DEPTH_TEST);
gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 16, 16, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(1024).fill(99));
gl.generateMipmap(gl.TEXTURE_2D);
const frame = () => {{ gl.clear(16640); for (const e of [0, 1]) {{ gl.viewport(e * 32, 0, 32, 64); gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4); }} requestAnimationFrame(frame); }};
requestAnimationFrame(frame);
</script>"#
    )
}

/// `tracegen page` of a small window; the name of the page comes next.
fn command(folder: &Path, name: &str) -> Command {
    let mut command = program("tracegen");
    command
        .args([
            "page", "--frames", "2", "--eyes", "halves", "--size", "64x64",
        ])
        .args(["-o", "o.textrace"])
        .arg(name)
        .current_dir(folder);
    command
}

/// Runs the page with a script before its own drawing; returns what the command says and how long it takes.
fn drawn(script: &str) -> (String, Duration) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("page.html"), page(script)).expect("writable");
    let start = Instant::now();
    let output = run_ok(&mut command(folder.path(), "page.html"));
    assert!(folder.path().join("o.textrace").exists());
    (said(&output), start.elapsed())
}

#[test]
fn dialogs_are_dismissed_and_named() {
    if !has_chromium() {
        return;
    }
    for (script, named) in [
        ("alert('hi')", "dialog alert \"hi\""),
        (
            "requestAnimationFrame(() => confirm('sure?'))",
            "dialog confirm \"sure?\"",
        ),
        ("prompt('who?')", "dialog prompt \"who?\""),
    ] {
        let (text, time) = drawn(script);
        assert!(text.contains(named), "{script}: {text}");
        assert!(time < Duration::from_secs(60), "{script}: {time:?}");
    }
}

#[test]
fn a_page_that_polls_is_captured_and_one_that_never_loads_is_named() {
    if !has_chromium() {
        return;
    }
    let (_, time) = drawn("(function f() { fetch('x.txt').catch(() => 0).finally(f) })()");
    assert!(time < Duration::from_secs(60), "{time:?}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (script, timeout, expected) in [
        ("location.reload()", "300", "loads documents without end"),
        (
            "while (true);",
            "4",
            "given up after 4 seconds while loading",
        ),
        (
            "requestAnimationFrame(() => { while (true); })",
            "4",
            "given up after 4 seconds while",
        ),
        (
            "let n = 0; (function f() { fetch('x' + n++).finally(f) })()",
            "4",
            "given up after 4 seconds while loading",
        ),
    ] {
        fs::write(folder.path().join("page.html"), page(script)).expect("writable");
        let start = Instant::now();
        let mut command = command(folder.path(), "page.html");
        refuse(command.args(["--timeout", timeout]), &[expected]);
        let time = start.elapsed();
        assert!(time < Duration::from_secs(60), "{script}: {time:?}");
        assert!(!folder.path().join("o.textrace").exists());
    }
}

#[test]
fn a_page_writes_nothing_into_the_users_home() {
    if !has_chromium() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let home = folder.path().join("home");
    fs::create_dir(&home).expect("a folder");
    let script = "const a = document.createElement('a'); a.download = 'a.sh'; a.href = 'data:application/octet-stream,x';
        document.documentElement.append(a); a.click();
        const b = document.createElement('a'); b.download = 'b.sh'; b.href = URL.createObjectURL(new Blob(['x']));
        document.documentElement.append(b); requestAnimationFrame(() => b.click())";
    fs::write(folder.path().join("page.html"), page(script)).expect("writable");
    let mut command = command(folder.path(), "page.html");
    for variable in ["XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"] {
        command.env_remove(variable);
    }
    let text = said(&run_ok(command.env("HOME", &home)));
    let left = fs::read_dir(&home).expect("a folder").count();
    assert_eq!(left, 0, "files in the home: {text}");
}

#[test]
fn a_page_reads_regular_files_of_its_folder_and_no_others() {
    if !has_chromium() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = folder.path().join("site");
    fs::create_dir(&root).expect("a folder");
    fs::write(folder.path().join("secret"), "secret").expect("writable");
    fs::write(root.join("file"), "public").expect("writable");
    symlink("../secret", root.join("link")).expect("a link");
    symlink("file", root.join("inner")).expect("a link");
    symlink("/dev/zero", root.join("device")).expect("a link");
    run_ok(Command::new("mkfifo").arg(root.join("pipe")));
    let script = "for (const name of ['file', 'inner', 'link', 'device', 'pipe'])
        fetch(name).then((r) => r.ok ? r.text() : 'no').then((t) => { requestAnimationFrame(() => { throw `${name}: ${t}` }) })";
    fs::write(root.join("page.html"), page(script)).expect("writable");
    let text = said(&run_ok(&mut command(&root, "page.html")));
    for expected in [
        "file: public",
        "inner: public",
        "link: no",
        "device: no",
        "pipe: no",
        "/link: a link to a file outside the page's folder",
        "/pipe: expected a file, found a pipe",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}

#[test]
fn a_file_that_a_page_loads_is_not_replaced() {
    if !has_chromium() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("page.html"), page("fetch('a.png')")).expect("writable");
    fs::write(folder.path().join("a.png"), "kept").expect("writable");
    let mut command = command(folder.path(), "page.html");
    refuse(
        command.args(["--image", "a.png"]),
        &["would replace the input"],
    );
    assert_eq!(
        fs::read(folder.path().join("a.png")).expect("readable"),
        b"kept"
    );
}

#[test]
fn the_cause_of_an_empty_frame_is_named() {
    if !has_chromium() {
        return;
    }
    let lose = "let n = 0; const go = () => { if (n++ == 1) gl.getExtension('WEBGL_lose_context').loseContext(); requestAnimationFrame(go); }; requestAnimationFrame(go)";
    let in_worker = "<!doctype html><canvas id=c></canvas><script>
        const c = document.getElementById('c').transferControlToOffscreen();
        new Worker(URL.createObjectURL(new Blob(['onmessage = (e) => e.data.getContext(\"webgl2\").clear(16640)']))).postMessage(c, [c]);</script>";
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (html, expected) in [
        (page(lose), "lost its context of WebGL in frame"),
        (
            "<!doctype html><p>text".to_owned(),
            "the page has no context of WebGL",
        ),
        (in_worker.to_owned(), "1 canvases are drawn by workers"),
    ] {
        fs::write(folder.path().join("page.html"), html).expect("writable");
        refuse(&mut command(folder.path(), "page.html"), &[expected]);
    }
}

#[test]
fn plain_frames_need_no_trace() {
    if !has_chromium() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("page.html"), page("")).expect("writable");
    let mut command = program("tracegen");
    command.args([
        "page",
        "page.html",
        "--plain",
        "--frames",
        "1",
        "--size",
        "64x64",
    ]);
    run_ok(
        command
            .args(["--image", "a.png"])
            .current_dir(folder.path()),
    );
    assert!(folder.path().join("a.png").exists());
}
