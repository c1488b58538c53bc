//! Compares traffic with closed forms.

use super::*;
use crate::config::Order;
use crate::order::PlanInputs;
use crate::stream::testing::{GeometryTrace as Trace, Synthetic};
use formats::textrace::geometry::{GeometryView, MeshGeometry, TileLists};
use formats::textrace::{Draw, PrimitiveRun, QuadRecord, Surfaces};

/// Two pictures of a size, drawn with one mesh. `list` gives the primitives of each tile.
fn trace(size_px: [u32; 2], mesh: MeshGeometry, list: impl Fn(u32) -> Vec<u32>) -> Trace {
    let mut memory = Synthetic::one_layer(size_px, 120).generate();
    memory.tables.draws = vec![Draw {
        first_primitive: 0,
        primitives: mesh.indices.len() as u32 / 3,
        ..memory.tables.draws[0].clone()
    }];
    for tile in memory.tiles.iter_mut().flatten() {
        tile.clear();
    }
    let view = |pass| GeometryView {
        frame: 0,
        target: ViewTarget::Pass(pass),
        size_px,
    };
    let mut lists = TileLists {
        draws: vec![0],
        starts: vec![0],
        ..TileLists::default()
    };
    for tile in 0..view(0).tile_count() as u32 {
        lists.primitives.extend(list(tile));
        lists.starts.push(lists.primitives.len() as u32);
    }
    let mut geometry = Geometry::default();
    geometry.meshes = vec![mesh];
    geometry.draw_meshes = vec![0];
    geometry.views = vec![view(0), view(1)];
    Trace {
        memory,
        geometry,
        lists: vec![lists.clone(), lists],
    }
}

/// A triangle list of a strip: triangle i has the vertices i, i + 1, i + 2.
fn strip(triangles: u32) -> MeshGeometry {
    MeshGeometry {
        vertices: triangles + 2,
        vertex_bytes: 64,
        index_bytes: 2,
        indices: (0..triangles).flat_map(|i| [i, i + 1, i + 2]).collect(),
    }
}

/// Traffic by client, and counts of vertex processing.
#[derive(Debug)]
struct WholeFrame {
    clients: Vec<ClientTraffic>,
    geometry: GeometryCounts,
}

/// Runs all frames, with items assigned round robin. Checks that the accesses add up to the traffic.
fn traffic(
    source: &dyn TileSource,
    config: &RunConfig,
    machine: &FrameConfig,
    texture_bytes: u64,
) -> Result<WholeFrame, StreamError> {
    let mut of = FrameClients::new(source, config, *machine, 1 << 20)?;
    let tables = source.tables();
    let inputs = PlanInputs::new(config, &tables.meta);
    let mut sums = [[0; 2]; Client::ALL.len()];
    for frame in [0] {
        of.start_frame(frame)?;
        let phases = crate::order::plan_frame(config.order, &inputs, &tables.passes, frame);
        for (number, item) in phases.iter().flatten().enumerate() {
            of.start_item(number % config.cores as usize, item)?;
        }
        of.end_frame();
        of.send(|access| {
            assert!(
                access.address >= 1 << 20 && access.address % 64 == 0,
                "{access:?}"
            );
            sums[access.client as usize][usize::from(access.write)] += access.bytes;
            0
        });
    }
    let (clients, geometry) = of.result(texture_bytes);
    for client in &clients {
        let [read, written] = sums[client.client as usize];
        let texture = if client.client == Client::Texture {
            texture_bytes
        } else {
            0
        };
        assert_eq!(
            [client.read_bytes, client.write_bytes],
            [read + texture, written]
        );
    }
    Ok(WholeFrame { clients, geometry })
}

fn count(trace: &Trace, machine: &FrameConfig, order: Order) -> WholeFrame {
    let config = RunConfig {
        order,
        ..RunConfig::default()
    };
    traffic(trace, &config, machine, 1000).unwrap()
}

fn of(whole: &WholeFrame, client: Client) -> [u64; 2] {
    let found = whole.clients.iter().find(|c| c.client == client);
    found.map_or([0; 2], |c| [c.read_bytes, c.write_bytes])
}

#[test]
fn a_cleared_frame_writes_only_its_colour_and_only_once() {
    // Cut tiles: 40 x 20 pixels.
    let empty = trace([40, 20], strip(0), |_| Vec::new());
    for machine in [FrameMachine::TileBased, FrameMachine::Immediate] {
        let config = FrameConfig {
            machine,
            composition: false,
            ..FrameConfig::default()
        };
        let whole = count(&empty, &config, Order::Z2_STA);
        assert_eq!(
            of(&whole, Client::Colour),
            [0, 2 * 40 * 20 * 4],
            "{machine:?}"
        );
        assert_eq!(of(&whole, Client::Texture), [1000, 0]);
        assert_eq!(whole.clients.len(), 2, "{whole:?}");
    }
    let with_buffer = FrameConfig {
        machine: FrameMachine::TileBasedGBuffer,
        ..FrameConfig::default()
    };
    let whole = count(&empty, &with_buffer, Order::MORTON);
    assert_eq!(of(&whole, Client::GBuffer), [2 * 40 * 20 * 16; 2]);
    assert_eq!(of(&whole, Client::Depth), [2 * 40 * 20 * 4; 2]);
    // The warp reads both pictures and writes the display's.
    assert_eq!(of(&whole, Client::Composition), [2 * 40 * 20 * 4; 2]);
}

#[test]
fn a_strip_shades_each_vertex_once_and_reads_its_lines_once() {
    let drawn = trace([32, 16], strip(1000), |tile| {
        if tile == 0 {
            (0..1000).collect()
        } else {
            vec![999]
        }
    });
    let mut drawn = drawn;
    for tile in drawn.memory.tiles.iter_mut().flatten() {
        for primitive in 0..1000 {
            tile.runs.push(PrimitiveRun {
                primitive,
                ..PrimitiveRun::default()
            });
        }
    }
    let whole = count(&drawn, &FrameConfig::default(), Order::SCANLINE);
    // Two eyes with 1002 vertices of one line each and 3000 two-byte indices.
    assert_eq!(of(&whole, Client::Vertex), [2 * 1002 * 64, 0]);
    assert_eq!(of(&whole, Client::Index), [2 * 94 * 64, 0]);
    assert_eq!(
        whole.geometry,
        GeometryCounts {
            triangles_submitted: 2000,
            triangles_binned: 2000,
            vertices_shaded: 2004,
            list_entries: 2002,
        }
    );
    // Lists of 4000 and 4 bytes in whole lines, written once and read once.
    assert_eq!(of(&whole, Client::PrimitiveList), [2 * (4032 + 64); 2]);
    let [read, written] = of(&whole, Client::ShadedVertex);
    let (positions, varyings) = (1002 * 16_u64, 1002 * 32_u64);
    assert_eq!(
        written,
        2 * (positions.next_multiple_of(64) + varyings.next_multiple_of(64))
    );
    // Tile 0 reads all lines once. Tile 1 belongs to the other core and reads the 3 vertices of the last triangle.
    assert_eq!(read, written + 2 * (2 + 2) * 64);
    // Hidden primitives need no varyings.
    for tile in drawn.memory.tiles.iter_mut().flatten() {
        tile.runs.retain(|run| run.primitive == 999);
    }
    let hidden = count(&drawn, &FrameConfig::default(), Order::SCANLINE);
    let positions_read = positions.next_multiple_of(64) + 2 * 64;
    assert_eq!(
        of(&hidden, Client::ShadedVertex),
        [2 * (positions_read + 2 * 2 * 64), written]
    );
    let multiview = FrameConfig {
        multiview: true,
        ..FrameConfig::default()
    };
    let both = count(&drawn, &multiview, Order::SCANLINE);
    assert_eq!(of(&both, Client::Vertex), [1002 * 64, 0]);
    assert_eq!(of(&both, Client::Index), [94 * 64, 0]);
    assert_eq!(both.geometry.vertices_shaded, 1002);
    let saved = varyings.next_multiple_of(64);
    assert_eq!(of(&both, Client::ShadedVertex)[1], written - saved);
}

#[test]
fn vertices_beyond_the_post_transform_cache_are_shaded_again() {
    // 100 fans around vertex 0 over the same rim of 40 vertices.
    let rim = |i: u32| 1 + i % 40;
    let mesh = MeshGeometry {
        vertices: 41,
        vertex_bytes: 64,
        index_bytes: 4,
        indices: (0..4000).flat_map(|i| [0, rim(i), rim(i + 1)]).collect(),
    };
    let drawn = trace([16, 16], mesh, |_| (0..4000).collect());
    let shaded = |entries| {
        let machine = FrameConfig {
            post_transform_entries: entries,
            ..FrameConfig::default()
        };
        count(&drawn, &machine, Order::MORTON)
    };
    // If all 41 fit, each is shaded once. Otherwise each rim vertex is shaded again in every fan.
    assert_eq!(shaded(41).geometry.vertices_shaded, 2 * 41);
    let first_in_first_out = {
        let (mut queue, mut shaded) = (std::collections::VecDeque::new(), 0);
        for vertex in (0..4000).flat_map(|i| [0, rim(i), rim(i + 1)]) {
            if !queue.contains(&vertex) {
                shaded += 1;
                queue.push_back(vertex);
                if queue.len() > 32 {
                    queue.pop_front();
                }
            }
        }
        shaded
    };
    assert_eq!(shaded(32).geometry.vertices_shaded, 2 * first_in_first_out);
    assert!(first_in_first_out > 4000);
    // The fetch cache of 8 KiB holds the mesh, so memory is read once.
    assert_eq!(of(&shaded(32), Client::Vertex), [2 * 41 * 64, 0]);
}

/// A grid of quads of 8 x 8 pixels with two triangles each: every tile of 16 x 16 contains 8 triangles.
#[test]
fn a_grid_of_triangles_has_lists_of_its_triangles_by_tile() {
    let cells = 16;
    let at = |x: u32, y: u32| y * (cells + 1) + x;
    let indices = (0..cells * cells).flat_map(|cell| {
        let (x, y) = (cell % cells, cell / cells);
        [
            at(x, y),
            at(x + 1, y),
            at(x, y + 1),
            at(x, y + 1),
            at(x + 1, y),
            at(x + 1, y + 1),
        ]
    });
    let mesh = MeshGeometry {
        vertices: (cells + 1) * (cells + 1),
        vertex_bytes: 32,
        index_bytes: 2,
        indices: indices.collect(),
    };
    let of_tile = |tile: u32| {
        let (x, y) = (tile % 8 * 2, tile / 8 * 2);
        let cells_of = [
            y * cells + x,
            y * cells + x + 1,
            (y + 1) * cells + x,
            (y + 1) * cells + x + 1,
        ];
        cells_of
            .into_iter()
            .flat_map(|cell| [2 * cell, 2 * cell + 1])
            .collect()
    };
    let drawn = trace([128, 128], mesh, of_tile);
    for order in Order::all() {
        let whole = count(&drawn, &FrameConfig::default(), order);
        // 64 tiles of 8 entries of 4 bytes: half a line each.
        assert_eq!(
            of(&whole, Client::PrimitiveList),
            [2 * 64 * 64; 2],
            "{}",
            order.name()
        );
        assert_eq!(whole.geometry.list_entries, 2 * 64 * 8);
        // Neighbouring triangles share vertices: each written position is read at least once. Nothing is visible.
        let [read, written] = of(&whole, Client::ShadedVertex);
        assert!(
            read >= written / 3 && read < 2 * written,
            "{}",
            order.name()
        );
    }
}

#[test]
fn an_immediate_machine_writes_what_it_draws_and_reads_what_it_blends_over() {
    // A line holds 4 x 4 pixels of 4 bytes, so a tile has 16. Draws every quad of the left picture's only
    // tile `times` times.
    let drawn = |times: u32, is_blended: bool| {
        let mut drawn = trace([16, 16], strip(times), |_| (0..times).collect());
        let quads = (0..64_u8).map(|m| {
            let even = |m: u8| m & 1 | m >> 1 & 2 | m >> 2 & 4;
            QuadRecord {
                x: even(m),
                y: even(m >> 1),
                mask: 15,
                group: 0,
                ..QuadRecord::default()
            }
        });
        let tile = &mut drawn.memory.tiles[0][0];
        for primitive in 0..times {
            tile.runs.push(PrimitiveRun {
                primitive,
                draw: 0,
                first: 64 * primitive,
                count: 64,
            });
            tile.records.extend(quads.clone());
        }
        drawn.memory.tables.meta.surfaces = Some(Surfaces {
            depth_tested: true,
            not_opaque: if is_blended { vec![[0, 1]] } else { Vec::new() },
        });
        drawn
    };
    let machine = |pixel_cache_bytes| FrameConfig {
        machine: FrameMachine::Immediate,
        composition: false,
        pixel_cache_bytes,
        ..FrameConfig::default()
    };
    let picture = 16 * 16 * 4;
    // The cache holds the tile, which is written at the end. The other picture is cleared. Its depth stays cleared.
    let whole = count(&drawn(3, false), &machine(16 << 10), Order::MORTON);
    assert_eq!(of(&whole, Client::Colour), [0, 2 * picture]);
    assert_eq!(of(&whole, Client::Depth), [0, picture]);
    // With four lines, each primitive writes the whole tile to memory and reads the depth of the primitive before.
    let whole = count(&drawn(3, false), &machine(4 * 64), Order::MORTON);
    assert_eq!(of(&whole, Client::Colour), [0, 3 * picture + picture]);
    assert_eq!(of(&whole, Client::Depth), [2 * picture, 3 * picture]);
    // Blended draws read colour and do not write depth.
    let whole = count(&drawn(3, true), &machine(4 * 64), Order::MORTON);
    assert_eq!(
        of(&whole, Client::Colour),
        [2 * picture, 3 * picture + picture]
    );
    assert_eq!(of(&whole, Client::Depth), [0, 0]);
    assert_eq!(of(&whole, Client::PrimitiveList), [0, 0]);
}

#[test]
fn a_trace_without_geometry_is_refused() {
    let memory = Synthetic::default().generate();
    let error = traffic(&memory, &RunConfig::default(), &FrameConfig::default(), 0).unwrap_err();
    assert!(error.to_string().contains("--geometry"), "{error}");
}
