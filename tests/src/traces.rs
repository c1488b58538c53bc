//! Small generated traces of both kinds that use every feature of the format.

use formats::container::Kind;
pub use formats::random::Random;
use formats::raytrace::camera::sample_position_px;
use formats::raytrace::{
    BvhSummary, EyeCamera, Hit, NO_PARENT, Outcome, PixelRecord, RayKind, RayLight, RayMaterial,
    RayRecord, RayTile, RayTriangle, RaytraceMeta, RaytraceTables, RaytraceWriter, TraversalKind,
    Visit, encode_ray_tile, half,
};
use formats::textrace::geometry::{Geometry, GeometryView, MeshGeometry, TileLists, ViewTarget};
use formats::textrace::{
    Draw, Encoding, LeftOut, LodRule, NO_GROUP, Pass, PassKind, ProgramCapture, QuadRecord, Sample,
    SampleLevel, Tables, TextraceWriter, Tile, TraceMeta, UnrecordedReads, UvGroup, VertexDraw,
    VertexRead, VertexReadCounts, VertexSite, encode_tile_as, quad_morton,
};
use formats::texture::{
    ColorSpace, Filter, LodRange, MipFilter, Part, Sampler, TexelFormat, Texture, Wrap,
};
use formats::view::{Eye, FovTangents, FrameViews, Hmd};

/// Width and height of an eye's image; neither is a multiple of the tile size.
const EYE_SIZE_PX: [u32; 2] = [39, 21];

fn fov() -> FovTangents {
    FovTangents::new(1.2, 0.9, 1.1, 1.0)
}

fn meta(frames: u32) -> TraceMeta {
    TraceMeta {
        tool: "made up 1".to_owned(),
        command_line: vec!["a \"quoted\" word".to_owned(), "\u{e9}\u{1f332}".to_owned()],
        scene: "made up".to_owned(),
        scene_triangles: 3000,
        camera: "default".to_owned(),
        backend: "none".to_owned(),
        driver: "none".to_owned(),
        seed: u64::MAX,
        hmd: Hmd {
            name: "custom".to_owned(),
            source: "unverified".to_owned(),
            eye_size_px: EYE_SIZE_PX,
            fov: [fov(); 2],
            ipd_m: 0.064,
            cant_deg: -3.5,
        },
        frames: (0..frames)
            .map(|frame| FrameViews {
                frame: 2 * frame,
                ..FrameViews::default()
            })
            .collect(),
        surfaces: None,
        origin_m: [0.0; 3],
        techniques: None,
        program: None,
        ..TraceMeta::default()
    }
}

/// Tables of a texture trace: several groups, an untextured draw, two frames and a shadow map.
pub fn texture_tables() -> Tables {
    let texture = |name: &str, size, levels, format| Texture {
        name: name.to_owned(),
        size,
        levels,
        layers: 2,
        format,
        color_space: ColorSpace::Srgb,
        part: None,
    };
    let sample = |texture, sampler| Sample {
        texture,
        sampler,
        layer: 1,
        offset: [-1, 3],
        level: Default::default(),
    };
    let group = |extent, samples| UvGroup { extent, samples };
    let draw = |material: &str, first_primitive, groups| Draw {
        material: material.to_owned(),
        first_primitive,
        primitives: 1000,
        groups,
    };
    let pass = |frame, kind, eye, size_px: [u32; 2]| Pass {
        frame,
        kind,
        eye,
        layer: 0,
        size_px,
        tiles: size_px.map(|size| size.div_ceil(16)),
    };
    let layer = |layer, eye, size_px| Pass {
        layer,
        ..pass(2, PassKind::Layer, eye, size_px)
    };
    Tables {
        meta: meta(2),
        textures: vec![
            texture("a.png", [1024, 256], 11, TexelFormat::Bc1),
            texture("", [300, 65536], 17, TexelFormat::Astc6x6),
            texture("\u{e9}.png", [1, 1], 1, TexelFormat::R32f),
        ],
        samplers: vec![
            Sampler::TRILINEAR_REPEAT,
            Sampler {
                wrap: [Wrap::MirroredRepeat, Wrap::ClampToEdge],
                mag: Filter::Nearest,
                min: Filter::Linear,
                mip: MipFilter::Nearest,
                ..Sampler::SHADOW
            },
        ],
        draws: vec![
            draw(
                "brick",
                0,
                vec![
                    group([1024, 256], vec![sample(0, 0), sample(2, 1)]),
                    group([300, 65536], vec![sample(1, 0)]),
                    group([7, 9], vec![]),
                ],
            ),
            draw("plain", 1000, vec![]),
            draw("leaf", 2000, vec![group([1, 1], vec![sample(2, 0)])]),
        ],
        passes: vec![
            pass(0, PassKind::Main, Some(Eye::Left), EYE_SIZE_PX),
            pass(0, PassKind::Main, Some(Eye::Right), EYE_SIZE_PX),
            pass(2, PassKind::Shadow, None, [17, 16]),
            layer(0, None, [35, 9]),
            layer(0, Some(Eye::Left), [16, 16]),
            layer(65535, Some(Eye::Left), [20, 33]),
            layer(65535, Some(Eye::Right), [20, 33]),
            layer(1, Some(Eye::Right), [1, 1]),
        ],
    }
}

/// Tables of a trace of a program: the same, with features that scenes do not have.
pub fn program_tables() -> Tables {
    let mut tables = texture_tables();
    tables.meta.program = Some(ProgramCapture {
        cameras_known: false,
        frames_by: "present".to_owned(),
        views_by: "viewport halves".to_owned(),
        left_out: vec![LeftOut {
            what: "texel buffers".to_owned(),
            draws: 1,
            fragments: 7,
        }],
        unrecorded_reads: vec![UnrecordedReads {
            stage: "vertex".to_owned(),
            what: "two-dimensional textures".to_owned(),
            commands: 2,
            indirect: 1,
            invocations: 6,
            reads: 12,
        }],
        vertex_reads: None,
    });
    tables.textures[0].format = TexelFormat::Bc6h;
    tables.textures[0].layers = 6;
    tables.textures[2].format = TexelFormat::D16;
    tables.samplers.push(Sampler {
        wrap: [Wrap::ClampToBorder, Wrap::MirrorClampToEdge],
        lod: LodRange {
            bias_256ths: -128,
            min_256ths: 0,
            max_256ths: 1000,
        },
        ..Sampler::TRILINEAR_REPEAT
    });
    let level = |rule, lod_256ths, operands| SampleLevel {
        rule,
        lod_256ths,
        operands,
    };
    let samples = |draw: &mut Draw, group: usize, level| {
        for sample in &mut draw.groups[group].samples {
            (sample.sampler, sample.level) = (2, level);
        }
    };
    let operands = UvGroup {
        extent: [1, 1],
        samples: Vec::new(),
    };
    let draws = &mut tables.draws;
    samples(&mut draws[0], 0, level(LodRule::Bias, -300, false));
    samples(&mut draws[0], 1, level(LodRule::Derivatives, 0, true));
    draws[0].groups.insert(1, operands.clone());
    samples(&mut draws[2], 0, level(LodRule::Explicit, 256, true));
    draws[2].groups.insert(0, operands);
    tables
}

/// Tables of a trace of a program with an anisotropic sampler, and with a texture that is a part of another one.
pub fn shared_tables() -> Tables {
    let mut tables = program_tables();
    tables.samplers[1].max_anisotropy_256ths = 2560;
    tables.samplers[2].max_anisotropy_256ths = 300;
    let (whole, level) = (&tables.textures[0], 2);
    let part = Texture {
        name: "a.png from level 2".to_owned(),
        size: whole.level_size(level),
        levels: 7,
        layers: 2,
        part: Some(Part {
            of: 0,
            level,
            layer: 4,
        }),
        ..whole.clone()
    };
    tables.textures.push(part);
    tables.draws[0].groups[2].samples[0].texture = 3;
    tables
}

/// A tile with a few primitives of every draw.
fn texture_tile(tables: &Tables, random: &mut Random) -> Tile {
    let mut tile = Tile::default();
    for primitive in 0..3000 {
        if random.below(400) != 0 {
            continue;
        }
        let draw = primitive / 1000;
        let groups = tables.draws[draw as usize].groups.len() as u32;
        // Mostly small numbers, as in captures, and sometimes any number.
        let wild = random.below(4) == 0;
        let mut number = |range: u32| match wild {
            true => random.bits() as i32,
            false => random.below(range) as i32 - (range / 2) as i32,
        };
        let mut records: Vec<QuadRecord> = (0..1 + primitive % 9)
            .map(|_| QuadRecord {
                uv: [number(1 << 24), number(1 << 24)],
                dx: [number(5000), number(50)],
                dy: [number(50), number(5000)],
                cross: [number(5), number(5)],
                ..QuadRecord::default()
            })
            .collect();
        for record in &mut records {
            (record.x, record.y) = (random.below(8) as u8, random.below(8) as u8);
            record.mask = 1 + random.below(15) as u8;
            record.group = match random.below(groups + 1) {
                none if none == groups => NO_GROUP,
                group => group as u8,
            };
        }
        records.sort_by_key(|record| (quad_morton(record.x, record.y), record.group));
        let of_draw = &tables.draws[draw as usize];
        if of_draw.groups.iter().any(UvGroup::has_operands) {
            records = paired(of_draw, &records);
        }
        tile.push_run(primitive, draw, records);
    }
    tile
}

/// Keeps each record of operands that directly precedes its record, and removes all other records of
/// operands.
fn paired(draw: &Draw, records: &[QuadRecord]) -> Vec<QuadRecord> {
    let mut pairs = Vec::new();
    for record in records {
        let record = match draw.is_operands(record.group) {
            true => QuadRecord {
                group: record.group + 1,
                ..*record
            },
            false => *record,
        };
        let group = draw.groups.get(usize::from(record.group));
        if group.is_some_and(UvGroup::has_operands) {
            pairs.push(QuadRecord {
                group: record.group - 1,
                uv: [record.uv[0] % 20_000, record.uv[1] % 20_000],
                ..record
            });
        }
        pairs.push(record);
    }
    pairs
}

/// A texture trace; about a tile in three is untouched.
pub fn texture_trace(encoding: Encoding, seed: u64) -> Vec<u8> {
    texture_trace_of(&texture_tables(), encoding, seed)
}

/// A texture trace with these tables.
pub fn texture_trace_of(tables: &Tables, encoding: Encoding, seed: u64) -> Vec<u8> {
    let writer = TextraceWriter::in_memory(tables).expect("sound tables");
    with_tiles(writer, tables, encoding, &random_tiles(tables, seed))
}

/// A texture trace with the geometry of its draws, its passes and a shadow map.
pub fn geometry_trace(seed: u64) -> Vec<u8> {
    let tables = &texture_tables();
    let mut random = Random(seed);
    let mut geometry = Geometry::default();
    for (mesh, draw) in (0..).zip(&tables.draws) {
        geometry.meshes.push(MeshGeometry {
            vertices: 500,
            vertex_bytes: 20 + 12 * mesh as u16,
            index_bytes: 2 + 2 * (mesh as u16 % 2),
            indices: (0..3 * draw.primitives)
                .map(|_| random.below(500))
                .collect(),
        });
        geometry.draw_meshes.push(mesh);
    }
    let writer = TextraceWriter::in_memory(tables).expect("sound tables");
    let mut writer = writer.with_geometry(geometry).expect("sound geometry");
    let tiles = random_tiles(tables, seed);
    let mut append = |view: GeometryView, tiles: Option<&[Tile]>| {
        let mut lists = TileLists {
            draws: vec![0, 1, 2],
            starts: vec![0],
            primitives: Vec::new(),
        };
        for tile in 0..view.tile_count() {
            let runs = tiles.map_or(&[][..], |tiles| &tiles[tile].runs);
            let mut recorded = runs.iter().map(|run| run.primitive).peekable();
            let of_tile = (0..3000_u32).filter(|primitive| {
                let has_records = recorded.next_if_eq(primitive).is_some();
                random.below(40) == 0 || has_records
            });
            lists.primitives.extend(of_tile);
            lists.starts.push(lists.primitives.len() as u32);
        }
        writer.append_view(view, &lists).expect("sound lists");
    };
    let shadow_map = GeometryView {
        frame: 0,
        target: ViewTarget::ShadowMap(3),
        size_px: [33, 40],
    };
    append(shadow_map, None);
    for (pass, (number, tiles)) in tables.passes.iter().zip((0..).zip(&tiles)) {
        let view = GeometryView {
            frame: pass.frame,
            target: ViewTarget::Pass(number),
            size_px: pass.size_px,
        };
        append(view, Some(tiles));
    }
    with_tiles(writer, tables, Encoding::Delta, &tiles)
}

/// Tiles of each pass; about one in three is untouched.
fn random_tiles(tables: &Tables, seed: u64) -> Vec<Vec<Tile>> {
    let mut random = Random(seed);
    let mut tile = |_| match random.below(3) {
        0 => Tile::default(),
        _ => texture_tile(tables, &mut random),
    };
    let passes = tables.passes.iter();
    passes
        .map(|pass| (0..pass.tile_count()).map(&mut tile).collect())
        .collect()
}

fn with_tiles(
    mut writer: TextraceWriter<std::io::Cursor<Vec<u8>>>,
    tables: &Tables,
    encoding: Encoding,
    tiles: &[Vec<Tile>],
) -> Vec<u8> {
    for (pass, tiles) in tiles.iter().enumerate() {
        for (index, tile) in tiles.iter().enumerate() {
            let encoded = encode_tile_as(encoding, tables, tile).expect("a sound tile");
            writer.append(pass, index, encoded).expect("in order");
        }
    }
    writer.into_bytes().expect("in memory")
}

/// Tables of a ray trace with triangles, materials and lights of every kind.
pub fn ray_tables(samples_per_px: u32, has_visits: bool) -> RaytraceTables {
    let eye = |x: f32| EyeCamera {
        position: [x, 0.1, 0.0],
        right: [0.8, 0.0, 0.6],
        up: [0.0, 1.0, 0.0],
        forward: [0.6, 0.0, -0.8],
        fov: fov(),
        size_px: EYE_SIZE_PX,
    };
    let material = |name: &str, mirror: bool| RayMaterial {
        name: name.to_owned(),
        diffuse: !mirror,
        mirror,
        ..ray_material()
    };
    RaytraceTables {
        meta: RaytraceMeta {
            trace: meta(1),
            origin: [0.1, 1e6 + 1.0 / 3.0, -7.0],
            eyes: [eye(-0.032), eye(0.032)],
            max_depth: 3,
            samples_per_px,
            has_visits,
            sky: [[0.3, 0.4, 0.5], [0.1; 3]],
            lighting: None,
        },
        bvh: BvhSummary {
            builder: "none".to_owned(),
            settings: vec![("leaf".to_owned(), "4".to_owned())],
            traversal: TraversalKind::Bvh2,
            triangles: 1 << 31,
            nodes: (1 << 32) - 1,
            leaves: 18,
            depth: 6,
            sah_cost: 61.623_411_2,
            bytes_per_node: 64,
            bytes_per_triangle: 40,
            instances: None,
            update: None,
        },
        materials: vec![material("clay", false), material("chrome", true)],
        lights: vec![
            RayLight::Directional {
                direction: [0.0, -1.0, 0.0],
                color: [3.0; 3],
            },
            RayLight::Point {
                position: [0.1, 0.2, 0.3],
                color: [1.0; 3],
            },
        ],
        triangles: (0..20u32)
            .map(|i| RayTriangle {
                primitive: if i == 19 { u32::MAX } else { 2 * i },
                object: i / 7,
                material: i % 2,
                vertices: [
                    [i as f32, 0.0, -5.0],
                    [i as f32 + 0.7, 0.1, -5.5],
                    // One triangle has no area.
                    [i as f32, 0.9 * (i % 5) as f32, -5.25],
                ],
            })
            .collect(),
    }
}

/// A material without effects.
fn ray_material() -> RayMaterial {
    RayMaterial {
        name: String::new(),
        diffuse: false,
        mirror: false,
        glass: false,
        glossy: true,
        alpha_masked: false,
    }
}

pub(crate) fn ray_tile(
    tables: &RaytraceTables,
    eye: Eye,
    number: u32,
    random: &mut Random,
) -> RayTile {
    let mut tile = RayTile::default();
    (tile.origin_px, tile.size_px) = tables.tile_rect(number);
    let camera = tables.camera(eye);
    let samples = tables.meta.samples_per_px;
    for i in 0..tile.size_px[0] * tile.size_px[1] * samples {
        let (at, sample) = (i / samples, i % samples);
        let x = tile.origin_px[0] + at % tile.size_px[0];
        let y = tile.origin_px[1] + at / tile.size_px[0];
        let direction = camera.direction(sample_position_px(x, y, sample, samples));
        let hit = (random.below(4) > 0).then(|| {
            let triangle = &tables.triangles[random.below(20) as usize];
            let code = [0; 2].map(|_| (random.below(65535) - 32767) as i16);
            let uv = match random.below(16) {
                0 => [f32::NAN, f32::NEG_INFINITY],
                _ => [random.below(1000) as f32 / 7.0, -1.5],
            };
            let t = random.below(9000) as f32 / 900.0;
            Hit::new(camera, direction, t, triangle, code, uv)
        });
        let mut color = || [0; 3].map(|_| random.below(9000) as f32 / 300.0 - 1.0);
        let (seen, dependent) = (color(), color());
        tile.pixels.push(PixelRecord {
            hit,
            view_independent: half::round3(hit.map_or([0.0; 3], |_| seen)),
            view_dependent: half::round3(dependent),
            first_ray: tile.rays.len() as u32,
            ray_count: 1 + random.below(5),
        });
        push_rays(&mut tile, random);
    }
    if tables.meta.has_visits {
        let visits: u64 = tile.rays.iter().map(RayRecord::visit_count).sum();
        tile.visits = (0..visits)
            .map(|_| match random.below(8) {
                0 => Visit::Node(random.below(u32::MAX)),
                1..4 => Visit::Node(random.below(100)),
                4 => Visit::Triangle(random.below(1 << 31)),
                _ => Visit::Triangle(random.below(100)),
            })
            .collect();
    }
    tile
}

/// Adds the rays of the last pixel.
fn push_rays(tile: &mut RayTile, random: &mut Random) {
    let Some(pixel) = tile.pixels.last() else {
        return;
    };
    for own in 0..pixel.ray_count {
        let parent = if own == 0 {
            NO_PARENT
        } else {
            random.below(own)
        };
        let above = tile.rays.get((pixel.first_ray + parent.min(own)) as usize);
        let depth = above.map_or(0, |ray| ray.depth + 1);
        let kind = match random.below(3) {
            _ if own == 0 => RayKind::Primary,
            0 => RayKind::Shadow,
            1 => RayKind::Reflection,
            _ => RayKind::Refraction,
        };
        tile.rays.push(RayRecord {
            kind,
            outcome: [Outcome::Miss, Outcome::Hit, Outcome::Occluded][random.below(3) as usize],
            depth,
            parent,
            steps: random.below(12),
            triangle_tests: random.below(5),
            alpha_tests: random.below(2) * random.below(300),
        });
    }
}

/// A ray trace.
pub fn ray_trace(samples_per_px: u32, has_visits: bool, seed: u64) -> Vec<u8> {
    ray_trace_of(&ray_tables(samples_per_px, has_visits), seed)
}

/// A ray trace with these tables.
pub fn ray_trace_of(tables: &RaytraceTables, seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    for eye in [Eye::Left, Eye::Right] {
        for number in 0..tables.tile_count() {
            let tile = ray_tile(tables, eye, number, &mut random);
            let encoded = encode_ray_tile(&tile, tables.meta.has_visits).expect("a sound tile");
            writer.tile(&encoded).expect("in memory");
        }
    }
    writer.into_bytes(tables).expect("sound tables")
}

/// A trace of a program with reads of vertex shaders, a number of each of two draws.
pub fn vertex_trace(reads: u32, seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let mut tables = program_tables();
    let draws = [None, Some(Eye::Right)].map(|eye| VertexDraw {
        frame: 2,
        eye,
        draw: 7,
        sites: (0..3)
            .map(|texture| VertexSite {
                texture,
                sampler: texture as u16,
                fetches: texture == 1,
                offset: [-8, texture as i8],
            })
            .collect(),
        reads: (0..reads)
            .map(|vertex| VertexRead {
                instance: vertex / 20,
                vertex: vertex % 20,
                site: random.below(3),
                at: [
                    random.below(u32::MAX),
                    (random.below(999) as f32 / 7.0).to_bits(),
                ],
                layer: random.below(3),
                level: (random.below(900) as f32 / 100.0 - 1.0).to_bits(),
            })
            .collect(),
    });
    if let Some(program) = &mut tables.meta.program {
        program.vertex_reads = VertexReadCounts::of(&draws);
    }
    let mut writer = TextraceWriter::in_memory(&tables).expect("sound tables");
    writer
        .set_vertex_reads(draws.to_vec())
        .expect("its tables come last");
    with_tiles(
        writer,
        &tables,
        Encoding::Delta,
        &random_tiles(&tables, seed),
    )
}

/// Traces of both kinds, with every encoding, with and without visits and optional columns, and with one or
/// more samples per pixel.
pub fn all() -> Vec<(String, Kind, Vec<u8>)> {
    let textures = Encoding::ALL.map(|encoding| {
        let name = format!("{encoding:?}").to_lowercase();
        (name, Kind::Textrace, texture_trace(encoding, 5))
    });
    let rays = [(1, true), (1, false), (3, true)].map(|(samples, visits)| {
        let name = format!("{samples}-samples-visits-{visits}");
        (name, Kind::Raytrace, ray_trace(samples, visits, 7))
    });
    let geometry = ("geometry".to_owned(), Kind::Textrace, geometry_trace(5));
    let program = texture_trace_of(&program_tables(), Encoding::Delta, 5);
    let program = ("program".to_owned(), Kind::Textrace, program);
    let shared = texture_trace_of(&shared_tables(), Encoding::Planes, 5);
    let shared = ("shared".to_owned(), Kind::Textrace, shared);
    let read = (
        "vertex-reads".to_owned(),
        Kind::Textrace,
        vertex_trace(60, 5),
    );
    let textures = textures
        .into_iter()
        .chain([geometry, program, shared, read]);
    let columns = TraversalKind::ALL.map(|tree| {
        let name = format!("columns-{tree:?}").to_lowercase();
        (name, Kind::Raytrace, crate::columns::column_trace(tree, 7))
    });
    textures.chain(rays).chain(columns).collect()
}
