//! Data that FORMAT.md forbids is refused despite valid checksums, by every command in the same way.

use formats::Trace;
use formats::textrace::Encoding;
use parallax_tests::repair::{Parts, repair_header, validate};
use parallax_tests::{program, refuse, root, traces};
use serde_json::json;
use std::fs;

fn texture_parts() -> Parts {
    Parts::of(&traces::texture_trace(Encoding::Delta, 5))
}

fn ray_parts() -> Parts {
    Parts::of(&traces::ray_trace(1, true, 7))
}

fn outcome(bytes: Vec<u8>) -> Result<(), String> {
    Trace::from_bytes(bytes)
        .and_then(|trace| validate(&trace))
        .map_err(|error| error.to_string())
}

fn assert_refused(bytes: Vec<u8>, expected: &str) {
    match outcome(bytes) {
        Ok(()) => panic!("accepted; expected {expected:?}"),
        Err(text) => assert!(text.contains(expected), "no {expected:?} in: {text}"),
    }
}

fn refuse_texture(expected: &str, change: impl FnOnce(&mut Parts)) {
    let mut parts = texture_parts();
    change(&mut parts);
    assert_refused(parts.sealed(), expected);
}

fn refuse_ray(expected: &str, change: impl FnOnce(&mut Parts)) {
    let mut parts = ray_parts();
    change(&mut parts);
    assert_refused(parts.sealed(), expected);
}

#[test]
fn traces_that_are_split_and_reassembled_are_accepted() {
    for (name, _, bytes) in traces::all() {
        let mut parts = Parts::of(&bytes);
        assert!(parts.sealed() == bytes, "{name}");
        let tiles = parts.tiles();
        parts.set_tiles(&tiles);
        parts.repair_tiles();
        assert!(parts.sealed() == bytes, "{name}");
        assert_eq!(outcome(bytes), Ok(()), "{name}");
    }
}

#[test]
fn reserved_fields_of_the_header_must_be_zero() {
    for at in [14, 15, 40, 43] {
        let mut bytes = texture_parts().sealed();
        bytes[at] = 1;
        repair_header(&mut bytes);
        assert_refused(bytes, "zero in reserved bytes");
    }
}

#[test]
fn chunks_of_a_texture_trace_must_be_in_order_and_those_of_rays_may_be_in_any() {
    refuse_texture("chunk SMPS behind chunk TEXS", |parts| {
        parts.chunks.swap(1, 2)
    });
    let mut parts = ray_parts();
    parts.chunks.reverse();
    assert_eq!(outcome(parts.sealed()), Ok(()));
}

#[test]
fn an_unknown_chunk_is_skipped_but_its_damage_is_detected() {
    let mut parts = texture_parts();
    parts.chunks.insert(3, (*b"XTRA", vec![7; 99]));
    let mut bytes = parts.sealed();
    assert_eq!(outcome(bytes.clone()), Ok(()));
    let at = bytes
        .windows(99)
        .position(|w| w == [7; 99])
        .expect("it is there");
    bytes[at] = 8;
    assert_refused(bytes, "chunk XTRA");
}

#[test]
fn the_encoding_of_an_untouched_tile_has_no_effect() {
    let mut parts = texture_parts();
    let untouched = parts.tiles().iter().position(Vec::is_empty).expect("one");
    for encoding in [0, 1, 3] {
        parts.put(b"TIDX", untouched * 32 + 24, &[encoding]);
        assert_eq!(outcome(parts.sealed()), Ok(()));
    }
    parts.put(b"TIDX", untouched * 32 + 24, &[2]);
    assert_refused(parts.sealed(), "an encoding of 0, 1 or 3");
    parts.put(b"TIDX", untouched * 32 + 24, &[0]);
    parts.put(b"TIDX", untouched * 32 + 20, &[1]);
    assert_refused(parts.sealed(), "an untouched tile's entry");
}

#[test]
fn numbers_must_be_encoded_in_the_fewest_bytes() {
    let mut parts = texture_parts();
    let mut tiles = parts.tiles();
    let tile = tiles.iter_mut().find(|t| !t.is_empty()).expect("one");
    let short = tile.iter().position(|byte| *byte < 0x80).expect("an end");
    let whole = tile.clone();
    tile[short] |= 0x80;
    tile.insert(short + 1, 0);
    parts.set_tiles(&tiles);
    assert_refused(parts.sealed(), "in as few bytes as it needs");
    for too_large in [&[0xff, 0xff, 0xff, 0xff, 0x7f][..], &[0xff; 11]] {
        let tile = tiles.iter_mut().find(|t| !t.is_empty()).expect("one");
        *tile = [too_large, &whole[short + 1..]].concat();
        parts.set_tiles(&tiles);
        assert_refused(parts.sealed(), "below 2^33");
    }
}

#[test]
fn numbers_of_rays_must_be_encoded_in_the_fewest_bytes() {
    let mut parts = ray_parts();
    let mut tiles = parts.tiles();
    // The first tile has 256 samples, so 32 bytes of hit bits come before the first number.
    let end = 32
        + tiles[0][32..]
            .iter()
            .position(|b| *b < 0x80)
            .expect("an end");
    tiles[0][end] |= 0x80;
    tiles[0].insert(end + 1, 0);
    parts.set_tiles(&tiles);
    assert_refused(parts.sealed(), "in as few bytes as it needs");
}

#[test]
fn bits_after_the_last_record_must_be_zero() {
    let mut parts = texture_parts();
    let tiles = parts.tiles();
    let refused = (0..tiles.len()).filter(|index| {
        let mut tiles = tiles.clone();
        let Some(at) = tiles[*index].len().checked_sub(9) else {
            return false;
        };
        tiles[*index][at] |= 0x80;
        parts.set_tiles(&tiles);
        outcome(parts.sealed()).is_err_and(|text| text.contains("zero bits after the last"))
    });
    assert!(refused.count() > 0);
}

#[test]
fn hit_bits_after_the_last_sample_must_be_zero() {
    refuse_ray("zero bits behind the last sample's", |parts| {
        let mut tiles = parts.tiles();
        // The last tile has 7 x 5 samples: five bytes with five unused bits.
        let last = tiles.last_mut().expect("tiles");
        last[4] |= 0x80;
        parts.set_tiles(&tiles);
    });
}

#[test]
fn a_description_must_have_frames() {
    let expected = "frames: at least one, numbers ascending";
    refuse_texture(expected, |parts| {
        parts.edit(b"META", |meta| meta["frames"] = json!([]));
    });
    refuse_ray(expected, |parts| {
        parts.edit(b"META", |meta| meta["trace"]["frames"] = json!([]));
    });
    refuse_texture(expected, |parts| {
        parts.edit(b"META", |meta| meta["frames"][1]["frame"] = json!(0));
    });
    refuse_texture("pass 2: a frame of the description", |parts| {
        parts.edit(b"META", |meta| meta["frames"][1]["frame"] = json!(3));
    });
}

#[test]
fn the_eye_distance_may_be_zero_but_not_negative() {
    let with = |ipd: serde_json::Value| {
        let mut parts = texture_parts();
        parts.edit(b"META", |meta| meta["hmd"]["ipd_m"] = ipd);
        parts.sealed()
    };
    assert_eq!(outcome(with(json!(0.0))), Ok(()));
    for ipd in [-0.001, 1.5e6, 1e30] {
        assert_refused(
            with(json!(ipd)),
            "distance between the eyes: 0 to 1000000 m",
        );
    }
}

#[test]
fn tangents_without_a_frustum_are_refused_by_every_command() {
    let bad = [
        ("left", -0.9),
        ("up", -1.0),
        ("right", 1e30),
        ("down", -1e9),
    ];
    for (side, tangent) in bad {
        refuse_texture("field-of-view tangents", |parts| {
            parts.edit(b"META", |meta| meta["hmd"]["fov"][0][side] = json!(tangent));
        });
        refuse_ray("field-of-view tangents", |parts| {
            parts.edit(b"META", |meta| {
                meta["eyes"][1]["fov"][side] = json!(tangent)
            });
        });
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let zero = json!({ "left": 0.0, "right": 0.0, "up": 0.0, "down": 0.0 });
    let mut texture = texture_parts();
    texture.edit(b"META", |meta| meta["hmd"]["fov"][0] = zero.clone());
    let mut ray = ray_parts();
    ray.edit(b"META", |meta| meta["eyes"][0]["fov"] = zero.clone());
    ray.edit(b"META", |meta| meta["eyes"][1]["fov"] = zero);
    let commands: [&[&str]; 6] = [
        &["validate"],
        &["info"],
        &["dump"],
        &["run"],
        &["convert", "--to", "din"],
        &["reproject"],
    ];
    for (name, parts) in [("a.textrace", texture), ("a.raytrace", ray)] {
        let path = folder.path().join(name);
        fs::write(&path, parts.sealed()).expect("temporary file");
        for command in commands {
            let output = program("replay").args(command).arg(&path).output();
            let output = output.expect("replay starts");
            let message = String::from_utf8_lossy(&output.stderr);
            let code = if command == ["validate"] { 1 } else { 2 };
            assert_eq!(
                output.status.code(),
                Some(code),
                "{command:?} {name}: {message}"
            );
            let other_kind = message.contains("expected a textrace, found a raytrace")
                || message.contains("expected a raytrace, found a textrace");
            assert!(
                other_kind || message.contains("field-of-view tangents"),
                "{command:?} {name}: {message}"
            );
        }
    }
}

#[test]
fn pictures_must_have_the_size_of_the_displays_eyes() {
    refuse_texture("pass 0: the size of an eye's image", |parts| {
        parts.edit(b"META", |meta| meta["hmd"]["eye_size_px"][1] = json!(22));
    });
    refuse_ray("eyes: the display's eye size", |parts| {
        parts.edit(b"META", |meta| meta["eyes"][0]["size_px"][0] = json!(38));
    });
    refuse_texture("1 to 16384 pixels each way", |parts| {
        parts.edit(b"META", |meta| meta["hmd"]["eye_size_px"][0] = json!(16385));
    });
}

#[test]
fn layers_must_be_numbered_and_need_a_version() {
    // Passes: two pictures, a shadow map, a layer of both eyes, two of the left eye.
    let number = |pass: usize| 4 + 24 * pass + 6;
    refuse_texture(
        "pass 1: layer 0 of a pass that is no layer, found 7",
        |parts| {
            parts.put(b"PASS", number(1), &[7, 0]);
        },
    );
    refuse_texture("pass 5: a layer number that no other layer", |parts| {
        parts.put(b"PASS", number(5), &[0, 0]);
    });
    refuse_texture(
        "version 1.1 for passes that are layers, found 1.0",
        |parts| {
            parts.minor = 0;
        },
    );
    let mut parts = texture_parts();
    parts.put(b"PASS", number(5), &[3, 0]);
    parts.minor = 2;
    assert_eq!(outcome(parts.sealed()), Ok(()));
}

#[test]
fn a_key_must_be_unique_in_its_object() {
    for twice in [
        "\"seed\":1,\"seed\":",
        "\"unknown\":1,\"unknown\":[],\"seed\":",
    ] {
        refuse_texture(" twice", |parts| parts.replace(b"META", "\"seed\":", twice));
    }
    refuse_ray(" twice", |parts| {
        parts.replace(b"RLIT", "\"color\":", "\"kind\":\"point\",\"color\":");
    });
    let mut parts = texture_parts();
    parts.edit(b"META", |meta| {
        meta["unknown"] = json!({ "a": [1, null, true] })
    });
    assert_eq!(outcome(parts.sealed()), Ok(()));
}

#[test]
fn numbers_in_json_must_be_finite_as_floats() {
    for number in ["1e39", "-4e38", "1e308"] {
        refuse_texture("a number of at most 3.4e38", |parts| {
            parts.replace(
                b"META",
                "\"position\":[0.0",
                &format!("\"position\":[{number}"),
            );
        });
    }
}

#[test]
fn vertices_and_eyes_must_be_in_the_specified_range() {
    for coordinate in [1e19f32, -2e18, f32::INFINITY, f32::NAN] {
        refuse_ray("triangle 2: vertices within 1e18 m", |parts| {
            parts.put(b"RTRI", 4 + 2 * 48 + 12 + 8, &coordinate.to_le_bytes());
        });
    }
    refuse_ray("eyes: positions within 1e18 m", |parts| {
        parts.edit(b"META", |meta| meta["eyes"][1]["position"][0] = json!(1e30));
    });
    refuse_ray("eyes: unit axes at right angles", |parts| {
        parts.edit(b"META", |meta| {
            meta["eyes"][1]["up"] = json!([0.0, 0.0, 0.0])
        });
    });
}

#[test]
fn sizes_of_a_hierarchy_must_be_in_the_specified_range() {
    for (key, value) in [
        ("bytes_per_triangle", json!(1u32 << 31)),
        ("bytes_per_triangle", json!(0)),
        ("bytes_per_node", json!(4097)),
        ("nodes", json!(1u64 << 32)),
        ("triangles", json!(u64::MAX)),
        ("sah_cost", json!(-1.0)),
    ] {
        refuse_ray("hierarchy: ", |parts| {
            parts.edit(b"RBVH", |bvh| bvh[key] = value)
        });
    }
    refuse_ray("a node or triangle slot below 1", |parts| {
        parts.edit(b"RBVH", |bvh| bvh["nodes"] = json!(1));
    });
}

#[test]
fn distances_must_be_finite_and_not_negative() {
    for distance in [f32::NAN, f32::INFINITY, -1.0] {
        let mut parts = ray_parts();
        let mut tiles = parts.tiles();
        let tile = &mut tiles[0];
        let hits: u32 = tile[..32].iter().map(|byte| byte.count_ones()).sum();
        let mut at = 32;
        for _ in 0..hits {
            at += 1 + tile[at..].iter().position(|b| *b < 0x80).expect("an end");
        }
        let end = at + 1 + tile[at..].iter().position(|b| *b < 0x80).expect("an end");
        let bits = distance.to_bits().cast_signed();
        let mut number = u64::from((bits << 1 ^ bits >> 31).cast_unsigned());
        let mut encoded = Vec::new();
        while number >= 0x80 {
            encoded.push(number as u8 | 0x80);
            number >>= 7;
        }
        encoded.push(number as u8);
        tile.splice(at..end, encoded);
        parts.set_tiles(&tiles);
        assert_refused(parts.sealed(), "a distance of 0 or more");
    }
}

#[test]
fn the_size_of_a_tile_is_checked_before_any_allocation() {
    refuse_ray(
        "256 samples: as many rays, in 1824 bytes or more",
        |parts| {
            let mut tiles = parts.tiles();
            tiles[0].truncate(1823);
            parts.set_tiles(&tiles);
        },
    );
    refuse_ray("256 samples: as many rays", |parts| {
        parts.put(b"RTIX", 16, &255u32.to_le_bytes());
    });
    refuse_ray("samples: as many rays", |parts| {
        parts.edit(b"META", |meta| meta["samples_per_px"] = json!(1024));
    });
}

#[test]
fn every_mip_level_of_the_largest_texture_is_counted() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.textrace");
    fs::write(&path, texture_parts().sealed()).expect("temporary file");
    let output = program("replay")
        .args(["run", "--json"])
        .arg(&path)
        .output();
    let output = output.expect("replay starts");
    let text = String::from_utf8(output.stdout).expect("JSON is text");
    let report: serde_json::Value = serde_json::from_str(&text).expect("one JSON object");
    let levels = report["result"]["by_level"].as_array().expect("levels");
    assert_eq!(levels.len(), 17);
}

#[test]
fn validate_refuses_textures_that_run_cannot_address() {
    let golden = root().join("traces/atrium.textrace");
    let mut trace = Parts::of(&fs::read(golden).expect("a trace"));
    let table = trace.chunk(b"TEXS");
    let mut at = 4;
    while at < table.len() {
        // Array layers, then the length of the name after the entry.
        table[at + 12..at + 16].copy_from_slice(&65_536u32.to_le_bytes());
        let name = u16::from_le_bytes([table[at + 20], table[at + 21]]);
        at += 22 + usize::from(name);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("layers.textrace");
    fs::write(&path, trace.sealed()).expect("temporary file");
    let why = "expected fewer than 2^32";
    refuse(program("replay").arg("run").arg(&path), &[why]);
    let output = program("replay").arg("validate").arg(&path).output();
    let output = output.expect("replay starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    let file = path.display().to_string();
    assert!(
        message.contains(&file) && message.contains("chunk TEXS") && message.contains(why),
        "{message}"
    );
}

#[cfg(unix)]
#[test]
fn settings_from_an_endless_device_are_refused() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let endless = "/dev/zero";
    let expected = [endless, "at most 4 MiB of TOML"];
    let mut reproject = program("replay");
    refuse(
        reproject
            .args(["reproject", "--config", endless])
            .arg(golden),
        &expected,
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut sweep = program("tracegen");
    sweep.args(["sweep", endless, "-o"]).arg(folder.path());
    refuse(&mut sweep, &expected);
}

#[test]
fn numbers_and_files_of_a_page_are_checked_before_the_browser_starts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    for (name, text) in [
        ("a.html", "<p>"),
        ("i.js", "1"),
        ("empty.js", ""),
        ("r.toml", "[[rule]]\nshows = 1\n"),
    ] {
        fs::write(at(name), text).expect("writable");
    }
    for (options, expected) in [
        ("--iwer i.js --ipd nan", "0 to 1000 mm"),
        ("--iwer i.js --ipd inf", "0 to 1000 mm"),
        ("--iwer i.js --ipd -5", "0 to 1000 mm"),
        ("--iwer i.js --ipd 1e9", "0 to 1000 mm"),
        ("--iwer i.js --fov nan", "1 to 179 degrees"),
        ("--iwer i.js --fov 0", "1 to 179 degrees"),
        ("--iwer i.js --fov 180", "1 to 179 degrees"),
        ("--iwer i.js --fov -90", "1 to 179 degrees"),
        ("--iwer i.js --head nan,0,0", "found 'nan'"),
        ("--iwer i.js --head 0,inf,0", "found 'inf'"),
        ("--iwer i.js --head 0,0", "expected X,Y,Z"),
        ("--iwer none.js", "none.js"),
        ("--iwer empty.js", "expected a script"),
        ("--iwer .", "expected a regular file"),
        ("--rules none.toml", "none.toml"),
        ("--rules r.toml", "r.toml"),
        ("--rate nan", "0.001 to 1000 Hz"),
        ("--rate 0", "0.001 to 1000 Hz"),
        ("--settle nan", "0 to 60 s"),
        ("--timeout 0", "expected seconds"),
        ("--timeout 18446744073709551615", "expected seconds"),
        ("--size 0x64", "each from 1"),
        ("--chromium ./none", "expected a program"),
    ] {
        let mut command = program("tracegen");
        command
            .args(["page", "a.html", "-o", "o.textrace"])
            .args(options.split(' '));
        let output = refuse(command.current_dir(folder.path()), &[expected]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(!text.contains("starting"), "{options}: {text}");
    }
    for camera in [
        "--ipd nan",
        "--ipd inf",
        "--ipd -1",
        "--hfov nan",
        "--hfov 180",
        "--vfov 0",
        "--size 0x1",
        "--cant inf",
    ] {
        for name in ["raster", "rays"] {
            let mut command = program("tracegen");
            command
                .args([name, "teapot", "-o", "o"])
                .args(camera.split(' '));
            refuse(command.current_dir(folder.path()), &[]);
        }
    }
}
