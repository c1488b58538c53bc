//! `replay run --dram`: every line that leaves the last cache is read once, and nothing else of the result changes.

use parallax_tests::{program, root};
use serde_json::Value;

fn result(trace: &str, arguments: &[&str]) -> Value {
    let mut command = program("replay");
    command.arg("run").arg(root().join("traces").join(trace));
    command.args(arguments).arg("--json");
    let output = command.output().expect("replay starts");
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {messages}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    json["result"].clone()
}

fn count(value: &Value) -> u64 {
    value
        .as_u64()
        .unwrap_or_else(|| panic!("{value}: no count"))
}

#[test]
fn every_line_that_leaves_the_caches_is_read_once_in_every_mode() {
    for mode in ["--mode=functional", "--tmu=looping", "--tmu=first-miss"] {
        for (trace, order) in [("atrium.textrace", "morton"), ("jungle.textrace", "z2-sta")] {
            let machine = [mode, "--order", order];
            let place = format!("{mode}, {order}");
            let without = result(trace, &machine);
            assert!(without.get("dram").is_none(), "{place}");
            for device in ["lpddr4", "lpddr5", "ddr4", "gddr6"] {
                let arguments = [&machine[..], &["--dram", device]].concat();
                let mut with = result(trace, &arguments);
                let again = result(trace, &[&arguments[..], &["--threads", "1"]].concat());
                assert_eq!(with, again, "{place}, {device}");
                let dram = with["dram"].take();
                with.as_object_mut().expect("an object").remove("dram");
                assert_eq!(with, without, "{place}, {device}");
                let lines = count(&with["external_bytes"]) / 16;
                assert_eq!(count(&dram["requests"]), lines, "{place}, {device}");
                // A line of 16 bytes takes a burst, which is larger in every device.
                assert_eq!(count(&dram["reads"]), lines, "{place}, {device}");
                let kinds =
                    ["row_hits", "row_empty", "row_conflicts"].map(|kind| count(&dram[kind]));
                assert_eq!(kinds.iter().sum::<u64>(), lines, "{place}, {device}");
                assert!(
                    count(&dram["activates"]) >= kinds[1] + kinds[2],
                    "{place}, {device}"
                );
            }
        }
    }
}
