//! Compares `docs/models/machines.md` with the tables. `UPDATE_DOCS=1` rewrites its tables.

use super::Preset;
use std::fmt::Write as _;
use std::path::Path;

const BEGIN: &str = "<!-- machines -->\n";
const END: &str = "<!-- end of machines -->\n";

/// A section for each machine.
fn sections() -> String {
    let mut page = String::new();
    for machine in Preset::all().filter_map(Preset::machine) {
        let _ = write!(
            page,
            "\n### `{}`\n\n{}.\n\n| key | value | range | source |\n| --- | --- | --- | --- |\n",
            machine.name, machine.help
        );
        for setting in machine.settings {
            let text = |value| setting.key.text(value);
            let range = setting
                .range
                .map(|[low, high]| format!("{} to {}", text(low), text(high)));
            let _ = writeln!(
                page,
                "| `{}` | {} | {} | {} |",
                setting.key.name(),
                text(setting.value),
                range.unwrap_or_default(),
                setting.source
            );
        }
    }
    page + "\n"
}

#[test]
fn the_page_of_machines_equals_the_tables() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/models/machines.md");
    let found = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = found.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    let page = format!("{before}{BEGIN}{}{END}{after}", sections());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    } else {
        assert!(
            found == page,
            "docs/models/machines.md differs from the tables; UPDATE_DOCS=1 rewrites it"
        );
    }
}
