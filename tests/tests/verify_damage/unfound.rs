//! Damages that neither `replay validate` nor `tracegen verify` finds.

use super::damages::{Damage, by_texels, damage, of_bytes, of_tables};
use super::trace::Records;

/// Each with the reason.
pub fn all() -> Vec<(Damage, &'static str)> {
    let steps = |field: &str, whose: Records| {
        by_texels(field, "every record", move |trace, steps| {
            trace.each(whose, |r| r.uv[0] += steps);
        })
    };
    vec![
        (
            of_tables("META: tool, command_line", "another", |t| {
                t.meta.tool += "?";
                t.meta.command_line.push("?".into());
            }),
            "free text, which does not change what is sampled",
        ),
        (
            of_tables("META: scene, camera", "another", |t| {
                t.meta.scene += "?";
                t.meta.camera += "?";
            }),
            "names as given: a file may lie anywhere, and an eye needs no camera",
        ),
        (
            of_tables("META: backend, driver", "another", |t| {
                t.meta.backend += "?";
                t.meta.driver += "?";
            }),
            "free text that the driver chooses; `--lod` follows from it",
        ),
        (
            of_tables("META: hmd.name, hmd.source", "another", |t| {
                t.meta.hmd.name += "?";
                t.meta.hmd.source += "?";
            }),
            "free text: the figures are held against the matrices",
        ),
        (
            of_tables("META: surfaces", "absent", |t| t.meta.surfaces = None),
            "older traces lack it; it then means what it says here",
        ),
        (
            of_bytes("META", "a key that is not known", |parts| {
                parts.edit(b"META", |meta| meta["more"] = 1.into());
            }),
            "readers ignore it",
        ),
        (
            steps("record: uv, u", Records::Material),
            "within the error of single precision",
        ),
        (
            steps("record of a look-up: uv, u", Records::Shadow),
            "within 1/64 texel of the shadow map",
        ),
        (
            damage(
                "view: draws of a picture",
                "one more, none of whose primitives enters a tile",
                |t| {
                    let pass = t.geometry.views.len() - 1;
                    let draws = &mut t.lists[pass].draws;
                    let absent =
                        (0..t.tables.draws.len() as u32).find(|draw| !draws.contains(draw));
                    draws.push(absent.expect("a culled draw"));
                    draws.sort_unstable();
                },
            ),
            "which draws are culled is the renderer's choice",
        ),
        (
            damage(
                "list of a picture",
                "a hidden draw and its primitives less",
                |t| {
                    let pass = t.geometry.views.len() - 1;
                    let recorded = |draw: u32| {
                        let mut runs = t.tiles[1].iter().flat_map(|tile| &tile.runs);
                        runs.any(|run| run.draw == draw)
                    };
                    let draws = &t.lists[pass].draws;
                    let hidden = draws.iter().copied().find(|draw| !recorded(*draw));
                    t.leave_out(pass, hidden.expect("a hidden draw"));
                },
            ),
            "a renderer may find that the draw is hidden",
        ),
    ]
}
