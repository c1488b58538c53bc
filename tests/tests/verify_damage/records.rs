//! Damages of tiles: records and runs.

use super::damages::{Damage, by_texels, damage};
use super::trace::{Records, Trace};
use formats::textrace::{NO_GROUP, QuadRecord, Tile};

/// A pair of a record, by name.
fn pair<'a>(record: &'a mut QuadRecord, name: &str) -> &'a mut [i32; 2] {
    match name {
        "uv" => &mut record.uv,
        "dx" => &mut record.dx,
        "dy" => &mut record.dy,
        _ => &mut record.cross,
    }
}

/// Damages of coordinates.
fn of_pairs(whose: Records, called: &str) -> Vec<Damage> {
    let mut all = Vec::new();
    for name in ["uv", "dx", "dy", "cross"] {
        for (axis, letter) in ["u", "v"].into_iter().enumerate() {
            let field = format!("{called}: {name}, {letter}");
            all.push(by_texels(&field, "every record", move |trace, steps| {
                trace.each(whose, |r| pair(r, name)[axis] += steps);
            }));
            all.push(by_texels(&field, "one record", move |trace, steps| {
                trace.one(whose, |r| pair(r, name)[axis] += steps);
            }));
        }
    }
    all
}

/// A record that samples nothing in the place of another.
fn without_group(record: &QuadRecord) -> QuadRecord {
    QuadRecord {
        x: record.x,
        y: record.y,
        mask: record.mask,
        group: NO_GROUP,
        ..QuadRecord::default()
    }
}

pub fn of_records() -> Vec<Damage> {
    use Records::{Material, Shadow};
    let mut all = of_pairs(Material, "record");
    all.extend(of_pairs(Shadow, "record of a look-up"));
    for (whose, called) in [(Material, "record"), (Shadow, "record of a look-up")] {
        let field = |name: &str| format!("{called}: {name}");
        all.push(damage(
            &field("mask"),
            "one lane of one record less",
            move |t| {
                t.one(whose, |r| r.mask = 7);
            },
        ));
        all.push(damage(
            &field("group"),
            "one record without its group",
            move |t| {
                t.one(whose, |r| *r = without_group(r));
            },
        ));
    }
    all.push(damage(
        "record of a look-up: group",
        "the next cascade",
        |t| {
            t.one(Shadow, |r| {
                r.group = if r.group % 2 == 0 {
                    r.group + 1
                } else {
                    r.group - 1
                }
            });
        },
    ));
    all.push(damage("record: mask", "a lane more", |t| {
        // A lane that the primitive does not cover.
        let tiles = t.tiles[0].iter_mut().skip(30);
        let record = tiles
            .flat_map(|tile| &mut tile.records)
            .find(|r| r.mask == 7);
        record.expect("a partly covered quad").mask = 15;
    }));
    all.push(damage("record: x", "one quad a quad to the right", |t| {
        t.move_quad([1, 0])
    }));
    all.push(damage("record: y", "one quad a quad down", |t| {
        t.move_quad([0, 1])
    }));
    all
}

pub fn of_tiles() -> Vec<Damage> {
    let rows = |field: &str, what: &str, change: fn(&mut Trace)| damage(field, what, change);
    vec![
        rows("tile", "the first record less", |t| {
            Trace::remove_record(t.tile(), 0)
        }),
        rows("tile", "the last record less", |t| {
            let tile = t.tile();
            let last = tile.records.len() - 1;
            Trace::remove_record(tile, last);
        }),
        rows("tile", "the first record twice", |t| {
            let tile = t.tile();
            tile.records.insert(0, tile.records[0]);
            tile.runs[0].count += 1;
            tile.runs[1..].iter_mut().for_each(|run| run.first += 1);
        }),
        rows("tile", "its first run less", |t| {
            let tile = t.tile();
            for _ in 0..tile.runs[0].count {
                Trace::remove_record(tile, 0);
            }
        }),
        rows("tile", "its last run less", |t| {
            let tile = t.tile();
            let count = tile.runs.last().expect("a run").count;
            for _ in 0..count {
                let last = tile.records.len() - 1;
                Trace::remove_record(tile, last);
            }
        }),
        rows("tile", "nothing in it", |t| *t.tile() = Tile::default()),
        rows("tile", "that of the other eye", |t| {
            t.tiles[0][40] = t.tiles[1][40].clone();
        }),
        rows("tiles", "two exchanged", |t| t.tiles[0].swap(40, 41)),
        rows("tiles", "those of both eyes exchanged", |t| {
            t.tiles.swap(0, 1)
        }),
        rows("tiles", "none of the right eye", |t| {
            t.tiles[1].iter_mut().for_each(Tile::clear);
        }),
        rows("run: primitive", "one run's + 1", Trace::next_primitive),
        rows(
            "run: records",
            "the first one's last record in the second run",
            |t| {
                let mut tiles = t.tiles[0].iter_mut();
                let tile = tiles.find(|tile| {
                    let of = |run: usize| {
                        let run = tile.runs.get(run)?;
                        Some(tile.records[run.first as usize..][..run.count as usize].to_vec())
                    };
                    let place = |r: &QuadRecord| formats::textrace::quad_morton(r.x, r.y);
                    match (of(0), of(1)) {
                        (Some(a), Some(b)) => {
                            a.len() > 1
                                && tile.runs[0].draw == tile.runs[1].draw
                                && place(&a[a.len() - 1]) <= place(&b[0])
                        }
                        _ => false,
                    }
                });
                let runs = &mut tile.expect("two runs of a draw").runs;
                runs[0].count -= 1;
                runs[1].first -= 1;
                runs[1].count += 1;
            },
        ),
    ]
}
