//! The reports of `tracegen verify` on captures with a single error, for each column of a record and each
//! field of the tables. `results/verify-damage.csv` has the results of this test; `UPDATE_GOLDEN=1`
//! rewrites it, and `make figures` then updates the table in docs/results/verify.md. For damages of graded
//! size, the smallest reported one is searched. The test checks that size, and that damages two steps below
//! are not reported (drivers differ by a step).

use formats::textrace::{NO_GROUP, QuadRecord, SUBTEXELS, Tables, Textrace, TextraceWriter, Tile};
use formats::texture::{ColorSpace, Filter, MipFilter, TexelFormat, Wrap};
use formats::view::Eye;
use parallax_tests::{program, root, run_ok};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const SCENE: &str = "atrium-shadows";

/// The parts of a trace.
#[derive(Clone)]
struct Trace {
    tables: Tables,
    tiles: Vec<Vec<Tile>>,
}

impl Trace {
    fn read(path: &Path) -> Self {
        let trace = Textrace::open(path).expect("a trace");
        let tables = trace.tables().clone();
        let tile = |pass, number| {
            let mut tile = Tile::default();
            trace.decode_tile(pass, number, &mut tile).expect("a tile");
            tile
        };
        let passes = tables.passes.iter().enumerate();
        let tiles = passes
            .map(|(pass, info)| {
                (0..info.tile_count() as usize)
                    .map(|n| tile(pass, n))
                    .collect()
            })
            .collect();
        Self { tables, tiles }
    }

    fn write(&self, path: &Path) {
        let mut writer = TextraceWriter::create(path, &self.tables).expect("sound tables");
        for (pass, tiles) in self.tiles.iter().enumerate() {
            for (number, tile) in tiles.iter().enumerate() {
                writer.write_tile(pass, number, tile).expect("a sound tile");
            }
        }
        writer.finish().expect("a file");
    }

    /// Changes every record of a group of a material.
    fn each(&mut self, change: impl Fn(&mut QuadRecord)) {
        let groups = |draw: u32, tables: &Tables| tables.draws[draw as usize].groups.len() - 4;
        for tile in self.tiles.iter_mut().flatten() {
            for run in &tile.runs {
                let of_material = groups(run.draw, &self.tables);
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let records = records.iter_mut();
                records
                    .filter(|r| usize::from(r.group) < of_material)
                    .for_each(&change);
            }
        }
    }

    /// Changes one fully covered record of a material's group, in the middle of a picture, alone in its
    /// run.
    fn one(&mut self, change: impl FnOnce(&mut QuadRecord)) {
        let tables = &self.tables;
        for tile in self.tiles[0].iter_mut().skip(30) {
            for run in &tile.runs {
                let of_material = tables.draws[run.draw as usize].groups.len() - 4;
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let found = records.iter_mut().find(|r| {
                    r.mask == 15 && of_material > 0 && r.group == 0 && r.dx[0].abs() > 0 && r.x < 7
                });
                if let Some(record) = found {
                    change(record);
                    return;
                }
            }
        }
        panic!("no whole record");
    }

    /// Moves the last quad of a run, if fully covered.
    fn move_quad(&mut self, by: [u8; 2]) {
        for tile in self.tiles.iter_mut().flatten() {
            for run in &tile.runs {
                let records = &mut tile.records[run.first as usize..][..run.count as usize];
                let Some(&QuadRecord { x, y, .. }) = records.last() else {
                    continue;
                };
                let same = |r: &&mut QuadRecord| (r.x, r.y) == (x, y);
                let mut of_quad: Vec<_> = records.iter_mut().filter(same).collect();
                if x % 2 == 0 && y % 2 == 0 && of_quad.iter().all(|r| r.mask == 15) {
                    for record in &mut of_quad {
                        [record.x, record.y] = [x + by[0], y + by[1]];
                    }
                    return;
                }
            }
        }
        panic!("no quad that may move");
    }

    /// Gives the next primitive's number to a run with a fully covered quad.
    fn next_primitive(&mut self) {
        let draws = &self.tables.draws;
        for tile in self.tiles.iter_mut().flatten() {
            for position in 0..tile.runs.len() {
                let run = tile.runs[position];
                let draw = &draws[run.draw as usize];
                let following = tile.runs.get(position + 1).map(|next| next.primitive);
                let is_free = following != Some(run.primitive + 1)
                    && run.primitive + 1 < draw.first_primitive + draw.primitives;
                let records = &tile.records[run.first as usize..][..run.count as usize];
                if is_free && records.iter().any(|r| r.mask == 15) {
                    tile.runs[position].primitive += 1;
                    return;
                }
            }
        }
        panic!("no run that may have another primitive");
    }
}

type Change = Box<dyn Fn(&mut Trace)>;

/// A field and its damage: one change, or the same change in ascending sizes.
struct Damage {
    field: String,
    sizes: Vec<(String, Change)>,
}

fn damage(field: &str, what: &str, change: impl Fn(&mut Trace) + 'static) -> Damage {
    Damage {
        field: field.into(),
        sizes: vec![(what.into(), Box::new(change))],
    }
}

/// Changes by 1, 2, 4 ... 1024 steps of 1/2048 texel.
fn by_texels(
    field: &str,
    whose: &str,
    change: impl Fn(&mut Trace, i32) + Clone + 'static,
) -> Damage {
    let sizes = (0..=10).map(|power| {
        let (steps, change) = (1 << power, change.clone());
        let change: Change = Box::new(move |trace| change(trace, steps));
        (format!("{whose} + {steps}/{SUBTEXELS} texel"), change)
    });
    Damage {
        field: field.into(),
        sizes: sizes.collect(),
    }
}

/// Changes by 1e-8, 1e-7 ... 1 of a unit.
fn by_tenths(
    field: &str,
    unit: &str,
    change: impl Fn(&mut Tables, f32) + Clone + 'static,
) -> Damage {
    let sizes = (-8..=0).map(|power| {
        let change = change.clone();
        let apply: Change = Box::new(move |trace| change(&mut trace.tables, 10.0_f32.powi(power)));
        (format!("+ 1e{power}{unit}"), apply)
    });
    Damage {
        field: field.into(),
        sizes: sizes.collect(),
    }
}

fn of_tables(field: &str, what: &str, change: impl Fn(&mut Tables) + 'static) -> Damage {
    damage(field, what, move |trace| change(&mut trace.tables))
}

/// A pair of a record, by name.
fn pair<'a>(record: &'a mut QuadRecord, name: &str) -> &'a mut [i32; 2] {
    match name {
        "uv" => &mut record.uv,
        "dx" => &mut record.dx,
        "dy" => &mut record.dy,
        _ => &mut record.cross,
    }
}

fn of_records() -> Vec<Damage> {
    let mut all = Vec::new();
    for name in ["uv", "dx", "dy", "cross"] {
        for (axis, letter) in ["u", "v"].into_iter().enumerate() {
            let field = format!("record: {name}, {letter}");
            all.push(by_texels(&field, "every record", move |trace, steps| {
                trace.each(|r| pair(r, name)[axis] += steps);
            }));
            all.push(by_texels(&field, "one record", move |trace, steps| {
                trace.one(|r| pair(r, name)[axis] += steps);
            }));
        }
    }
    all.push(damage(
        "record: mask",
        "one lane of one record less",
        |trace| {
            trace.one(|r| r.mask = 7);
        },
    ));
    all.push(damage(
        "record: group",
        "one record without its group",
        |trace| {
            trace.one(|r| {
                *r = QuadRecord {
                    x: r.x,
                    y: r.y,
                    mask: r.mask,
                    group: NO_GROUP,
                    ..QuadRecord::default()
                };
            });
        },
    ));
    let rows: [Damage; 3] = [
        damage("record: x", "one quad a quad to the right", |t| {
            t.move_quad([1, 0])
        }),
        damage("record: y", "one quad a quad down", |t| t.move_quad([0, 1])),
        damage("run: primitive", "one run's + 1", Trace::next_primitive),
    ];
    all.extend(rows);
    all
}

fn of_textures() -> Vec<Damage> {
    vec![
        of_tables("texture: name", "the next one's", |t| {
            t.textures[0].name = t.textures[1].name.clone();
        }),
        of_tables("texture: width", "+ 1 texel", |t| {
            t.textures[0].size[0] += 1
        }),
        of_tables("texture: height", "+ 1 texel", |t| {
            t.textures[0].size[1] += 1
        }),
        of_tables("texture: mip levels", "- 1", |t| t.textures[0].levels -= 1),
        of_tables("texture: layers", "+ 1", |t| t.textures[0].layers += 1),
        of_tables("texture: layers of the shadow maps", "+ 1", |t| {
            t.textures.last_mut().expect("shadow maps").layers += 1;
        }),
        of_tables("texture: format", "BC3 for BC1", |t| {
            t.textures[0].format = TexelFormat::Bc3;
        }),
        of_tables("texture: colour space", "linear for sRGB", |t| {
            t.textures[0].color_space = ColorSpace::Linear;
        }),
        of_tables("texture table", "one more", |t| {
            let next = t.textures[0].clone();
            t.textures.push(next);
        }),
    ]
}

fn of_samplers() -> Vec<Damage> {
    vec![
        of_tables("sampler: wrap in u", "clamp for repeat", |t| {
            t.samplers[0].wrap[0] = Wrap::ClampToEdge;
        }),
        of_tables("sampler: wrap in v", "mirrored for repeat", |t| {
            t.samplers[0].wrap[1] = Wrap::MirroredRepeat;
        }),
        of_tables("sampler: magnification", "nearest for linear", |t| {
            t.samplers[0].mag = Filter::Nearest;
        }),
        of_tables("sampler: minification", "nearest for linear", |t| {
            t.samplers[0].min = Filter::Nearest;
        }),
        of_tables("sampler: mip filter", "nearest for linear", |t| {
            t.samplers[0].mip = MipFilter::Nearest;
        }),
    ]
}

/// A draw with a texture.
fn textured(tables: &mut Tables) -> &mut formats::textrace::Draw {
    let draw = tables.draws.iter_mut().find(|draw| draw.groups.len() > 4);
    draw.expect("a draw with a texture")
}

fn of_draws() -> Vec<Damage> {
    vec![
        of_tables("draw: material", "another name", |t| {
            t.draws[0].material += "?"
        }),
        of_tables("draw: primitives", "the last one's - 1", |t| {
            t.draws.last_mut().expect("a draw").primitives -= 1;
        }),
        of_tables("draw table", "one more", |t| {
            let mut next = t.draws.last().expect("a draw").clone();
            next.first_primitive += next.primitives;
            t.draws.push(next);
        }),
        of_tables("uv group: extent in u", "+ 1", |t| {
            textured(t).groups[0].extent[0] += 1
        }),
        of_tables("uv group: extent in v", "+ 1", |t| {
            textured(t).groups[0].extent[1] += 1
        }),
        of_tables("uv group: samples", "one more", |t| {
            let group = &mut textured(t).groups[0];
            let next = group.samples[0];
            group.samples.push(next);
        }),
        of_tables("sample: texture", "the next one", |t| {
            textured(t).groups[0].samples[0].texture += 1;
        }),
        of_tables("sample: sampler", "the next one", |t| {
            textured(t).groups[0].samples[0].sampler += 1;
        }),
        of_tables("sample: layer of a shadow map", "the next one", |t| {
            let group = textured(t).groups.len() - 4;
            textured(t).groups[group].samples[0].layer += 1;
        }),
        of_tables("sample: offset in u", "+ 1", |t| {
            textured(t).groups[0].samples[0].offset[0] += 1;
        }),
        of_tables("sample: offset in v", "+ 1", |t| {
            textured(t).groups[0].samples[0].offset[1] += 1;
        }),
    ]
}

fn of_description() -> Vec<Damage> {
    let rows = |field: &str, what: &str, change: fn(&mut Tables)| of_tables(field, what, change);
    vec![
        rows("META: scene_triangles", "+ 1", |t| {
            t.meta.scene_triangles += 1
        }),
        rows("META: seed", "+ 1", |t| t.meta.seed += 1),
        by_tenths("META: origin_m", " m", |t, by| {
            t.meta.origin_m[0] += f64::from(by)
        }),
        by_tenths("META: hmd.fov", "", |t, by| t.meta.hmd.fov[0].left += by),
        by_tenths("META: hmd.ipd_m", " m", |t, by| t.meta.hmd.ipd_m += by),
        by_tenths("META: hmd.cant_deg", " degrees", |t, by| {
            t.meta.hmd.cant_deg += by;
        }),
        by_tenths("META: world_to_eye", " in one element", |t, by| {
            t.meta.frames[0].eyes[0].world_to_eye[0][0] += by;
        }),
        by_tenths(
            "META: world_to_eye",
            " m to the side, both eyes and positions",
            |t, by| {
                for eye in &mut t.meta.frames[0].eyes {
                    let side = [0, 1, 2].map(|axis| eye.world_to_eye[axis][0]);
                    eye.world_to_eye[3][0] -= by;
                    for (at, side) in eye.position.iter_mut().zip(side) {
                        *at += by * side;
                    }
                }
            },
        ),
        by_tenths("META: eye_to_clip", " in one element", |t, by| {
            t.meta.frames[0].eyes[1].eye_to_clip[1][1] += by;
        }),
        by_tenths("META: position", " m", |t, by| {
            t.meta.frames[0].eyes[0].position[1] += by;
        }),
        rows("META: surfaces.depth_tested", "false for true", |t| {
            t.meta.surfaces.as_mut().expect("surfaces").depth_tested = false;
        }),
        rows("META: surfaces.not_opaque", "draw 0 as well", |t| {
            let surfaces = t.meta.surfaces.as_mut().expect("surfaces");
            match surfaces.not_opaque.first_mut() {
                Some([0, count]) => *count -= 1,
                _ => surfaces.not_opaque.insert(0, [0, 1]),
            }
        }),
        rows("pass: eye", "both left", |t| {
            t.passes[1].eye = Some(Eye::Left)
        }),
    ]
}

/// Fields that are not checked against the scene.
const FREE: [(&str, &str); 6] = [
    (
        "META: tool, command_line",
        "free text: they do not change what is sampled",
    ),
    (
        "META: scene, camera",
        "names as given: a file may lie anywhere, and an eye needs no camera",
    ),
    (
        "META: backend, driver",
        "free text that the driver chooses; `--lod` follows from it",
    ),
    (
        "META: hmd.name, hmd.source",
        "free text: the figures are held against the matrices",
    ),
    (
        "pass, frame, tile and index numbers",
        "a reader refuses what contradicts the other tables or a checksum",
    ),
    (
        "records of shadow maps, later frames",
        "not verified (see above)",
    ),
];

/// Verifies a trace; the runs of this test share the prepared textures of the scene.
fn verify(trace: &Path, cache: &Path) -> (Option<i32>, String) {
    let mut command = program("tracegen");
    command.env("PARALLAX_CACHE_SIZE", "1GiB");
    command.env("PARALLAX_CACHE_DIR", cache);
    command
        .args(["verify", SCENE, "--quiet", "--trace"])
        .arg(trace);
    let output = command.output().expect("the program starts");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), errors)
}

/// The first error, without parts that differ between machines.
fn first_error(errors: &str) -> String {
    let line = errors.lines().find(|line| line.contains("error"));
    let line = line.unwrap_or_default();
    let text = line.split_once("error: ").map_or(line, |(_, text)| text);
    // Measured figures differ between drivers, so only the kind of report is compared.
    let mut kind = String::new();
    for part in text.split_inclusive(": ").take(2) {
        kind += part;
    }
    let kind = kind.trim_end_matches(": ");
    if let Some((what, _)) = kind.split_once(" over ") {
        return what.to_owned();
    }
    match kind.split_once(": ") {
        Some((what, count)) if count.ends_with(" unexplained") => format!("{what}: unexplained"),
        _ => kind.to_owned(),
    }
}

#[test]
fn each_damage_is_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    let file = path("sound.textrace");
    let mut capture = program("tracegen");
    capture.args(["raster", SCENE, "--no-plain", "--size", "96x112", "-o"]);
    run_ok(capture.arg(&file));
    let cache = path("cache");
    let sound = Trace::read(&file);
    let (code, errors) = verify(&file, &cache);
    assert_eq!(code, Some(0), "{errors}");
    let mut csv = String::from(
        "# command: UPDATE_GOLDEN=1 cargo test --release --workspace --test verify_damage\nfield,damage,exit code,reported as\n",
    );
    let mut missed = Vec::new();
    let damages = [
        of_records(),
        of_textures(),
        of_samplers(),
        of_draws(),
        of_description(),
    ];
    let attempt = |field: &str, what: &str, change: &Change| {
        let mut trace = sound.clone();
        change(&mut trace);
        let damaged = path("damaged.textrace");
        trace.write(&damaged);
        let (code, errors) = verify(&damaged, &cache);
        assert!(!errors.contains("panicked"), "{field}: {what}: {errors}");
        let reported = first_error(&errors).replace(&*damaged.to_string_lossy(), "FILE");
        (code.unwrap_or(-1), reported, errors)
    };
    let committed = root().join("results/verify-damage.csv");
    let before = std::fs::read_to_string(&committed).unwrap_or_default();
    let searches = std::env::var_os("UPDATE_GOLDEN").is_some();
    for Damage { field, sizes } in damages.into_iter().flatten() {
        let known = |what: &str| {
            let row = [&*field, what].map(quoted).join(",") + ",";
            before.lines().any(|line| line.starts_with(&row))
        };
        let at = sizes.iter().position(|(what, _)| known(what));
        let first = if searches { 0 } else { at.unwrap_or(0) };
        let found = (sizes[first..].iter())
            .map(|(what, change)| (what, attempt(&field, what, change)))
            .find(|(_, (code, ..))| !searches || matches!(code, 1 | 2));
        let Some((what, (code, reported, errors))) = found else {
            missed.push(format!("{field}: no size"));
            continue;
        };
        if !matches!(code, 1 | 2) {
            missed.push(format!("{field}: {what}: {errors}"));
        }
        if let Some((below, change)) = first.checked_sub(2).map(|below| &sizes[below]) {
            let (code, reported, _) = attempt(&field, below, change);
            assert_eq!(code, 0, "{field}: {below} is reported as well: {reported}");
        }
        let row = [&*field, what, &code.to_string(), &reported].map(quoted);
        writeln!(csv, "{}", row.join(",")).expect("a string");
    }
    assert!(missed.is_empty(), "not reported:\n{}", missed.join("\n"));
    for (field, why) in FREE {
        let row = [field, "any", "-", &format!("not verified: {why}")].map(quoted);
        writeln!(csv, "{}", row.join(",")).expect("a string");
    }
    compare_or_update(&committed, &csv);
}

/// Quotes a field of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Compares a file with its expected content, or writes it.
fn compare_or_update(file: &Path, whole: &str) {
    let found = std::fs::read_to_string(file).unwrap_or_default();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        let folder = file.parent().expect("a folder");
        std::fs::create_dir_all(folder).expect("a folder");
        std::fs::write(file, whole).expect("a file");
        return;
    }
    let name = file.display();
    assert!(
        found == whole,
        "{name}: expected (UPDATE_GOLDEN=1 writes it)\n{whole}"
    );
}
