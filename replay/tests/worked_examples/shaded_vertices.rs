//! `shaded-vertices tile-based lists=... drawn=...`: traffic of shaded vertices of one view, a row of tiles. Triangle i of
//! the mesh has the vertices 3i to 3i + 2. `lists` has the triangles of each tile as `0.1`, `drawn` those with
//! fragments.

use super::{Settings, one_picture};
use formats::textrace::geometry::{Geometry, GeometryView, MeshGeometry, TileLists, ViewTarget};
use formats::textrace::{Draw, PrimitiveRun, QuadRecord, Tile};
use replay::config::RunConfig;
use replay::engine::replay;
use replay::memory::Client;
use replay::stream::testing::GeometryTrace;

/// Triangles of each tile, as `0.1,2`; a dash for none.
fn triangles(settings: &Settings, key: &str) -> Vec<Vec<u32>> {
    let of_tile = |text: &String| match text.as_str() {
        "-" => Vec::new(),
        _ => text.split('.').map(|n| n.parse().unwrap()).collect(),
    };
    settings.list(key).iter().map(of_tile).collect()
}

pub fn output(settings: &Settings) -> Vec<String> {
    let (listed, drawn) = (triangles(settings, "lists"), triangles(settings, "drawn"));
    let size_px = [16 * listed.len() as u32, 16];
    let count = listed.iter().flatten().max().map_or(0, |last| last + 1);
    let mut memory = one_picture(size_px);
    memory.tables.draws = vec![Draw {
        first_primitive: 0,
        primitives: count,
        ..memory.tables.draws[0].clone()
    }];
    let tile = |drawn: &Vec<u32>| {
        let runs = (0..).zip(drawn).map(|(first, &primitive)| PrimitiveRun {
            primitive,
            draw: 0,
            first,
            count: 1,
        });
        let records = (0..drawn.len()).map(|x| QuadRecord {
            x: x as u8,
            mask: 15,
            uv: [1024; 2],
            ..QuadRecord::default()
        });
        Tile {
            runs: runs.collect(),
            records: records.collect(),
        }
    };
    memory.tiles = vec![drawn.iter().map(tile).collect()];
    let mut lists = TileLists {
        draws: vec![0],
        starts: vec![0],
        ..TileLists::default()
    };
    for tile in listed {
        lists.primitives.extend(tile);
        lists.starts.push(lists.primitives.len() as u32);
    }
    let mut geometry = Geometry::default();
    geometry.meshes = vec![MeshGeometry {
        vertices: 3 * count,
        vertex_bytes: 64,
        index_bytes: 2,
        indices: (0..3 * count).collect(),
    }];
    geometry.draw_meshes = vec![0];
    geometry.views = vec![GeometryView {
        frame: 0,
        target: ViewTarget::Pass(0),
        size_px,
    }];
    let trace = GeometryTrace {
        memory,
        geometry,
        lists: vec![lists],
    };
    let text = format!(
        "mode = \"functional\"\ncores = 1\n[frame]\nmachine = \"{}\"\ncomposition = false\n",
        settings.subject
    );
    let config: RunConfig = toml::from_str(&text).unwrap();
    let result = replay(&trace, &config).unwrap();
    let of = |client: Client| {
        let found = result.clients.iter().find(|of| of.client == client);
        found.map_or([0; 2], |of| [of.read_bytes, of.write_bytes])
    };
    [
        ("shaded vertices", Client::ShadedVertex),
        ("primitive lists", Client::PrimitiveList),
    ]
    .map(|(name, client)| {
        let [read, written] = of(client);
        format!("{name}: {written} bytes written, {read} bytes read")
    })
    .into()
}
