//! Errors for broken files.

use super::*;

#[test]
fn a_missing_file_is_named() {
    let files = Files::new(&base());
    std::fs::remove_file(files.path("mesh.bin")).unwrap();
    files.fails_with(&["mesh.bin", "buffers[0]", "cannot read"]);
}

#[test]
fn a_cut_buffer_is_refused_with_both_lengths() {
    let files = Files::new(&base());
    files.write("mesh.bin", &[0; 40]);
    files.fails_with(&["buffers[0]", "42 bytes", "40 bytes"]);
}

#[test]
fn truncated_json_and_json_that_is_not_gltf_are_refused() {
    let files = Files::new(&base());
    let text = base().to_string();
    for cut in [0, 1, text.len() / 2, text.len() - 1] {
        files.write("scene.gltf", &text.as_bytes()[..cut]);
        files.fails_with(&["JSON"]);
    }
    for glb in [
        &b"glTF"[..],
        b"glTF\x02\0\0\0\x05\0\0\0",
        b"glTF\x02\0\0\0\xff\0\0\0abcd",
    ] {
        files.write("scene.gltf", glb);
        files.fails_with(&["GLB"]);
    }
}

#[test]
fn ranges_outside_their_buffer_are_refused() {
    for (pointer, value, place) in [
        ("/accessors/0/count", json!(4), "accessors[0]"),
        ("/accessors/0/byteOffset", json!(1), "accessors[0]"),
        ("/bufferViews/0/byteLength", json!(1000), "bufferViews[0]"),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            "bufferViews[0]",
        ),
        ("/bufferViews/0/byteStride", json!(252), "accessors[0]"),
    ] {
        Files::new(&with(base(), pointer, value)).fails_with(&[place, "range inside"]);
    }
}

#[test]
fn indices_outside_their_table_are_refused() {
    for (pointer, value) in [
        ("/nodes/0/mesh", json!(7)),
        ("/meshes/0/primitives/0/material", json!(3)),
        ("/meshes/0/primitives/0/indices", json!(9)),
        ("/accessors/0/bufferView", json!(2)),
        ("/bufferViews/1/buffer", json!(1)),
        ("/scene", json!(4)),
    ] {
        Files::new(&with(base(), pointer, value)).fails_with(&["index inside its table"]);
    }
}

#[test]
fn a_vertex_index_past_the_vertices_is_refused() {
    let files = Files::new(&base());
    files.write("mesh.bin", &triangle_bytes(CORNERS, [0, 1, 3]));
    files.fails_with(&[
        "'tri'",
        "accessors[1], index 2",
        "vertex below 3",
        "found 3",
    ]);
}

#[test]
fn a_position_that_is_not_finite_names_mesh_accessor_and_vertex() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut corners = CORNERS;
        corners[1][2] = bad;
        let files = Files::new(&base());
        files.write("mesh.bin", &triangle_bytes(corners, [0, 1, 2]));
        files.fails_with(&[
            "meshes[0] 'tri'",
            "accessors[0], vertex 1",
            "finite position",
        ]);
    }
}

#[test]
fn accessors_of_the_wrong_type_are_refused() {
    for (pointer, value) in [
        ("/accessors/0/type", json!("VEC2")),
        ("/accessors/0/componentType", json!(5125)),
        ("/accessors/1/componentType", json!(5126)),
        ("/accessors/1/type", json!("MAT4")),
    ] {
        Files::new(&with(base(), pointer, value)).fails_with(&["accessors["]);
    }
}

#[test]
fn cycles_and_nodes_with_two_parents_are_refused() {
    let cycle = json!([{"children": [1]}, {"mesh": 0, "children": [0]}]);
    Files::new(&with(base(), "/nodes", cycle)).fails_with(&["nodes[0]", "cycle"]);
    let own_child = json!([{"mesh": 0, "children": [0]}]);
    Files::new(&with(base(), "/nodes", own_child)).fails_with(&["nodes[0]", "cycle"]);
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_does_not_overflow_the_stack() {
    let n = 100_000;
    let mut nodes: Vec<Value> = (1..n).map(|i| json!({"children": [i]})).collect();
    nodes.push(json!({"mesh": 0}));
    assert!(
        Files::new(&with(base(), "/nodes", json!(nodes)))
            .load()
            .is_ok()
    );
}

#[test]
fn elements_beyond_the_files_budget_are_refused_before_allocation() {
    let sparse = json!({"count": 1,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 0}});
    for count in [1_000_000_000_000u64, u64::MAX] {
        let accessor = json!({"componentType": 5126, "count": count,
                              "type": "VEC3", "sparse": sparse});
        Files::new(&with(base(), "/accessors/0", accessor)).fails_with(&[
            "accessors[0]",
            "in a file of this size",
            &count.to_string(),
        ]);
        Files::new(&with(base(), "/accessors/1/count", json!(count))).fails_with(&[
            "accessors[1]",
            "in a file of this size",
            &count.to_string(),
        ]);
    }
}

#[test]
fn a_mesh_of_many_primitives_placed_many_times_is_refused_before_allocation() {
    let primitive = json!({"attributes": {"POSITION": 0}});
    let json = with(
        base(),
        "/meshes/0/primitives",
        json!(vec![primitive; 10_000]),
    );
    let json = with(json, "/nodes", json!(vec![json!({"mesh": 0}); 10_000]));
    let nodes: Vec<u32> = (0..10_000).collect();
    let json = with(json, "/scenes/0/nodes", json!(nodes));
    Files::new(&json).fails_with(&["instances of meshes[0]", "in a file of this size"]);
}

#[test]
fn a_stride_below_the_elements_size_is_refused() {
    for stride in [4, 8] {
        let json = with(base(), "/bufferViews/0/byteStride", json!(stride));
        Files::new(&json).fails_with(&[
            "bufferViews[0].byteStride",
            "at least 12 bytes",
            &format!("found {stride}"),
        ]);
    }
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused_as_buffers_and_images() {
    for (json, place) in [
        (with(base(), "/buffers/0/uri", json!("zero")), "buffers[0]"),
        (
            with(textured(), "/images/0/uri", json!("zero")),
            "images[0]",
        ),
    ] {
        let files = Files::new(&json);
        std::os::unix::fs::symlink("/dev/zero", files.path("zero")).unwrap();
        files.fails_with(&["zero", place, "a regular file", "a device"]);
    }
    let files = Files::new(&base());
    std::fs::remove_file(files.path("mesh.bin")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(files.path("mesh.bin"))
        .status();
    assert!(made.unwrap().success());
    files.fails_with(&["mesh.bin", "buffers[0]", "a regular file", "a pipe"]);
}

#[test]
fn names_and_paths_with_terminal_escapes_are_shown_escaped() {
    let json = with(base(), "/buffers/0/uri", json!("no\u{1b}]0;x\u{7}.bin"));
    Files::new(&json).fails_with(&["no\\u{1b}]0;x\\u{7}.bin", "cannot read"]);
    let json = with(base(), "/meshes/0/name", json!("a\u{1b}[2Jb\u{9b}"));
    let files = Files::new(&json);
    let scene = files.load().unwrap().scene;
    assert_eq!(scene.meshes[0].name, "a\\u{1b}[2Jb\\u{9b}");
    files.write("mesh.bin", &triangle_bytes(CORNERS, [0, 1, 3]));
    files.fails_with(&["'a\\u{1b}[2Jb\\u{9b}'"]);
}

#[test]
fn missing_corrupt_and_empty_images_are_refused() {
    let files = Files::new(&textured());
    files.fails_with(&["my image.png", "images[0], used by materials[0] 'paint'"]);
    let good = png([4, 4], [1, 2, 3, 255]);
    for bytes in [&b""[..], b"not an image", &good[..good.len() / 2]] {
        files.write("my image.png", bytes);
        files.fails_with(&["my image.png", "PNG, JPEG"]);
    }
    // The width in the header of a PNG, which has a checksum: 0x4.
    let mut empty = good.clone();
    empty[16..20].fill(0);
    files.write("my image.png", &empty);
    files.fails_with(&["my image.png"]);
    files.write("my image.png", &good);
    assert!(files.load().is_ok());
}

#[test]
fn a_huge_image_is_refused_before_it_is_decoded() {
    // 0xffff x 0xffff in the frame header of an otherwise empty JPEG.
    let jpeg = [
        0xff, 0xd8, 0xff, 0xc0, 0, 11, 8, 0xff, 0xff, 0xff, 0xff, 1, 1, 0x11, 0,
    ];
    let files = Files::new(&textured());
    files.write("my image.png", &jpeg);
    files.fails_with(&["my image.png"]);
}

#[test]
fn unsupported_required_extensions_are_reported_before_other_errors() {
    // Accessors that only the extension fills, as in real files.
    let mut draco = base();
    draco["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("bufferView");
    for (name, json) in [
        ("EXT_mesh_features", draco.clone()),
        ("FOO_geometry_compression", draco),
    ] {
        let required = json!(["KHR_texture_transform", name, name]);
        let files = Files::new(&with(json, "/extensionsRequired", required));
        files.fails_with(&["extensionsRequired", &format!("found {name}, unsupported")]);
    }
}

#[test]
fn a_huge_image_in_a_small_file_is_refused_before_it_is_decoded() {
    let files = Files::new(&textured());
    let mut huge = png([1, 1], [0; 4]);
    // Width and height of the header, with a corrected checksum.
    huge[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let checksum = crc(&huge[12..29]);
    huge[29..33].copy_from_slice(&checksum.to_be_bytes());
    files.write("my image.png", &huge);
    files.fails_with(&["my image.png", "16384x16384", "bytes of texels"]);
}

#[test]
fn many_small_images_are_refused_before_one_is_decoded() {
    // 1024x1024 in 1-bit grey, with only the header present: 4 MiB of texels each.
    let mut image = png([1, 1], [0; 4]);
    image[16..24].copy_from_slice(&[0, 0, 4, 0, 0, 0, 4, 0]);
    image[24..26].copy_from_slice(&[1, 0]);
    let checksum = crc(&image[12..29]);
    image[29..33].copy_from_slice(&checksum.to_be_bytes());
    let scene = |count: usize| {
        let images: Vec<Value> = (0..count)
            .map(|i| json!({"uri": format!("{i}.png")}))
            .collect();
        let numbers: Vec<Value> = (0..count).map(|i| json!({"source": i})).collect();
        let materials: Vec<Value> = (0..count)
            .map(|i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}}))
            .collect();
        let primitives: Vec<Value> = (0..count)
            .map(|i| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": i}))
            .collect();
        let json = with(base(), "/images", json!(images));
        let json = with(json, "/textures", json!(numbers));
        let json = with(json, "/materials", json!(materials));
        let files = Files::new(&with(json, "/meshes/0/primitives", json!(primitives)));
        for i in 0..count {
            files.write(&format!("{i}.png"), &image);
        }
        files
    };
    assert!(scene(128).load().is_ok());
    scene(129).fails_with(&[
        "128.png",
        "images[128], used by materials[128]",
        "at most 536870912 bytes of texels in all images",
        "541065216 bytes with this image of 1024x1024, number 129 of 129",
    ]);
}

/// CRC-32 as PNG defines it.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

#[test]
fn a_scene_without_triangles_is_an_error() {
    let files = Files::new(&with(base(), "/meshes/0/primitives/0/mode", json!(0)));
    files.fails_with(&[
        "scene: expected at least one triangle, found none (meshes[0] 'tri'.primitives[0] holds points",
    ]);
}

#[test]
fn no_single_changed_byte_of_the_json_panics() {
    let text = textured().to_string().into_bytes();
    let files = Files::new(&textured());
    files.write("my image.png", &png([4, 4], [1, 2, 3, 255]));
    for at in 0..text.len() {
        let mut changed = text.clone();
        changed[at] = if changed[at].is_ascii_digit() {
            b'9'
        } else {
            b'1'
        };
        files.write("scene.gltf", &changed);
        // Success and failure are both fine. Only a panic fails the test.
        let _ = files.load();
    }
}

#[test]
fn versions_other_than_two_are_refused() {
    for (asset, place) in [
        (json!({"version": "9.9"}), "asset.version"),
        (json!({"version": "1.0"}), "asset.version"),
        (json!({"version": "two"}), "asset.version"),
        (json!({"version": 1}), "asset.version"),
        (json!({"version": 0.8}), "asset.version"),
        (
            json!({"version": "2.1", "minVersion": "2.1"}),
            "asset.minVersion",
        ),
    ] {
        Files::new(&with(base(), "/asset", asset)).fails_with(&[place, "expected 2.0"]);
    }
    // glTF 1.0 holds objects where 2.0 holds lists.
    let first = with(base(), "/asset", json!({"version": "1.0"}));
    let first = with(first, "/textures", json!({"paint": {"source": "image"}}));
    Files::new(&first).fails_with(&["asset.version: expected 2.0, found '1.0'"]);
    let files = Files::new(&base());
    files.write("scene.gltf", b"glTF\x01\0\0\0\xff\0\0\0");
    files.fails_with(&["GLB header, byte 4: expected version 2, found 1"]);
    let later = json!({"version": "2.1", "minVersion": "2.0"});
    Files::new(&with(base(), "/asset", later)).load().unwrap();
}

#[test]
fn a_texture_only_in_an_unsupported_format_is_refused_with_its_number_and_extension() {
    for extension in ["EXT_texture_avif", "VENDOR_texture_new"] {
        let texture = json!({"extensions": {extension: {"source": 0}}});
        let json = with(textured(), "/textures", json!([texture]));
        for list in ["/extensionsUsed", "/extensionsRequired"] {
            let json = with(json.clone(), list, json!([extension]));
            let place = if list.ends_with("Used") {
                "textures[0]"
            } else {
                extension
            };
            Files::new(&json).fails_with(&[place, extension]);
        }
        // With a fallback the file is read.
        let texture = json!({"source": 0, "extensions": {extension: {"source": 0}}});
        let json = with(textured(), "/textures", json!([texture]));
        let files = Files::new(&with(json, "/extensionsUsed", json!([extension])));
        files.write("my image.png", &png([4, 4], [1, 2, 3, 255]));
        files.load().unwrap();
    }
}

#[test]
fn invalid_glb_lengths_are_refused_and_trailing_bytes_are_ignored_with_a_warning() {
    let glb = |length: i32, json_length: i32, kind: &[u8; 4]| {
        let mut json = base();
        json["buffers"] = json!([{"byteLength": 42}]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = triangle_bytes(CORNERS, [0, 1, 2]);
        bin.resize(44, 0);
        let plus = |a: usize, b: i32| (a as i32 + b).to_le_bytes();
        let whole = 12 + 8 + text.len() + 8 + bin.len();
        let head = [
            b"glTF".as_slice(),
            &2_u32.to_le_bytes(),
            &plus(whole, length),
        ]
        .concat();
        let json_chunk = [&plus(text.len(), json_length), kind.as_slice(), &text].concat();
        let bin_chunk = [&plus(bin.len(), 0), b"BIN\0".as_slice(), &bin].concat();
        [head, json_chunk, bin_chunk].concat()
    };
    let load = |bytes: &[u8]| {
        let files = Files::new(&base());
        files.write("scene.glb", bytes);
        load_file(&files.path("scene.glb"), &LoadOptions::ALL)
    };
    load(&glb(0, 0, b"JSON")).unwrap();
    for (bytes, place) in [
        (glb(4, 0, b"JSON"), "byte 8"),
        (glb(0, 1 << 20, b"JSON"), "GLB chunk 0, byte 12"),
        (glb(0, 4, b"JSON"), "GLB chunk 1"),
        (glb(-4, 0, b"JSON"), "GLB chunk 1"),
        (glb(0, 0, b"json"), "GLB chunk 0"),
    ] {
        let error = load(&bytes).unwrap_err().to_string();
        assert!(error.contains(place), "{error}");
    }
    let mut longer = glb(0, 0, b"JSON");
    longer.extend([0; 100]);
    let warnings = load(&longer).unwrap().warnings.join("\n");
    assert!(warnings.contains("100 bytes after"), "{warnings}");
}
