//! The built program itself: version, built-in scenes and exit codes.

use std::process::{Command, Output};

fn tracegen(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tracegen"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn version_names_the_program_and_the_trace_formats() {
    let output = tracegen(&["--version"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0));
    assert!(
        text.starts_with("tracegen ") && text.contains("textrace"),
        "{text}"
    );
}

#[test]
fn wrong_usage_exits_with_code_2_and_empty_stdout() {
    for arguments in [
        &["no-such-command"][..],
        &["raster"],
        &["raster", "atrium", "--hmd", "none"],
    ] {
        let output = tracegen(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!output.stderr.is_empty(), "{arguments:?}");
    }
}
