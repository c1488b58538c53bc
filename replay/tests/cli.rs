//! The built program itself: version, help and exit codes.

use std::process::{Command, Output};

fn replay(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_replay"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn version_names_the_program() {
    let output = replay(&["--version"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("replay "));
}

#[test]
fn wrong_use_exits_with_two_and_prints_nothing_on_stdout() {
    for arguments in [
        &["no-such-command"][..],
        &["run"],
        &["run", "--no-such-flag"],
    ] {
        let output = replay(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!output.stderr.is_empty(), "{arguments:?}");
    }
}
