//! The tracer on a small scene with every kind of material.

mod columns;
#[allow(dead_code)]
mod instances;
mod lighting;
// The benches include these files, and use more of them than the tests do.
#[allow(dead_code)]
mod reference_tree;
#[allow(dead_code)]
mod reference_walk;
#[allow(dead_code)]
mod robustness;

use super::bvh::TreeOptions;
use super::frame::{RayFrame, trace_frame};
use super::material::Materials;
use super::scene::TraceScene;
use super::soup::Soup;
use super::tracer::{TraceSettings, Tracer};
use formats::raytrace::{
    EyeCamera, Outcome, RayKind, RayTile, Raytrace, RaytraceMeta, RaytraceTables, RaytraceWriter,
    TraversalKind,
};
use formats::textrace::TraceMeta;
use formats::view::Eye;
use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
use lab::traversal::reference::TestMesh;
use scene::{AlphaMode, Camera, Instance, Light, Material, Mesh, Scene, cameras, hmd};

fn material(name: &str) -> Material {
    Material {
        name: name.to_owned(),
        base_color: Vec4::new(0.6, 0.5, 0.4, 1.0),
        ..Material::default()
    }
}

fn sphere(material: usize, levels: u32) -> Mesh {
    let mesh = TestMesh::sphere(levels);
    Mesh {
        name: "sphere".to_owned(),
        positions: mesh
            .vertices
            .iter()
            .map(|v| (*v / 10.0).as_vec3())
            .collect(),
        normals: mesh
            .vertices
            .iter()
            .map(|v| v.normalize().as_vec3())
            .collect(),
        uv0: vec![Vec2::ZERO; mesh.vertices.len()],
        indices: mesh.triangles.as_flattened().to_vec(),
        material,
        ..Mesh::default()
    }
}

fn floor(material: usize) -> Mesh {
    Mesh {
        name: "floor".to_owned(),
        positions: [[-9.0, 9.0], [9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]]
            .map(|[x, z]| Vec3::new(x, 0.0, z))
            .to_vec(),
        normals: vec![Vec3::Y; 4],
        uv0: vec![Vec2::ZERO; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    }
}

/// A floor with four balls: diffuse, mirror, glass and nearly transparent.
fn scene() -> Scene {
    let at = |mesh, x: f32, z: f32| Instance {
        mesh,
        transform: Affine3A::from_translation(Vec3::new(x, 1.0, z)),
    };
    Scene {
        name: "balls".to_owned(),
        meshes: vec![
            floor(0),
            sphere(1, 3),
            sphere(2, 3),
            sphere(3, 3),
            sphere(4, 3),
        ],
        instances: vec![
            Instance {
                mesh: 0,
                transform: Affine3A::IDENTITY,
            },
            at(1, -3.3, 0.0),
            at(2, -1.1, 0.0),
            at(3, 1.1, 0.5),
            at(4, 3.3, 0.0),
        ],
        materials: vec![
            material("floor"),
            material("clay"),
            Material {
                mirror: 0.9,
                roughness: 0.1,
                ..material("chrome")
            },
            Material {
                transmission: 0.95,
                roughness: 0.0,
                ..material("glass")
            },
            Material {
                base_color: Vec4::new(0.9, 0.2, 0.2, 0.5),
                alpha: AlphaMode::Blend,
                ..material("veil")
            },
        ],
        lights: vec![
            Light::Directional {
                direction: Vec3::new(0.3, -1.0, -0.4).normalize(),
                color: Vec3::splat(3.0),
            },
            Light::Point {
                position: Vec3::new(0.0, 4.0, 2.0),
                color: Vec3::splat(10.0),
            },
        ],
        sky: Vec3::new(0.4, 0.5, 0.6),
        ..Scene::default()
    }
}

fn settings(traversal: TraversalKind) -> TraceSettings {
    TraceSettings {
        max_depth: 3,
        samples_per_px: 1,
        visits: true,
        geometry: true,
        traversal,
        lighting: None,
        seed: 0,
    }
}

fn tables(scene: &TraceScene, settings: TraceSettings, size_px: [u32; 2]) -> RaytraceTables {
    let camera = Camera {
        eye: Vec3::new(0.0, 2.0, 6.0),
        target: Vec3::new(0.0, 0.8, 0.0),
        ..cameras::default_camera(&scene.scene)
    };
    let mut display = hmd::preset("symmetric-100").expect("a preset");
    display.eye_size_px = size_px;
    display.fov = [hmd::symmetric(90.0, size_px); 2];
    let frames = cameras::still_frame(&camera, &display).expect("views");
    let origin = scene.soup.origin.to_array();
    let eyes = std::array::from_fn(|e| {
        EyeCamera::new(&frames[0].eyes[e], display.fov[e], size_px, origin)
    });
    RaytraceTables {
        meta: RaytraceMeta {
            trace: TraceMeta {
                tool: "test".to_owned(),
                command_line: Vec::new(),
                scene: "balls".to_owned(),
                scene_triangles: scene.scene.triangle_count(),
                camera: "test".to_owned(),
                backend: "rays".to_owned(),
                driver: "bvh2".to_owned(),
                seed: 0,
                hmd: display,
                frames,
                surfaces: None,
                origin_m: [0.0; 3],
                techniques: None,
                program: None,
                ..TraceMeta::default()
            },
            origin,
            eyes,
            max_depth: settings.max_depth,
            samples_per_px: settings.samples_per_px,
            has_visits: settings.visits,
            sky: [scene.sky.sky.to_array(), scene.sky.ground.to_array()],
            lighting: settings.lighting,
        },
        bvh: scene.bvh.summary(settings.traversal),
        materials: scene.materials.table(),
        lights: scene.lights.clone(),
        triangles: Vec::new(),
    }
}

fn trace(scene: &TraceScene, settings: TraceSettings, size_px: [u32; 2]) -> (RayFrame, Vec<u8>) {
    let mut tables = tables(scene, settings, size_px);
    let mut writer = RaytraceWriter::in_memory().expect("in memory");
    if tables.bvh.instances.is_none() {
        writer = writer.with_hierarchy(scene.bvh.contents(settings.traversal));
    }
    let mut frame = trace_frame(scene, settings, &tables, &mut writer, |_| ()).expect("traces");
    tables.triangles = std::mem::take(&mut frame.triangles);
    let bytes = writer.into_bytes(&tables).expect("writes");
    (frame, bytes)
}

const SIZE_PX: [u32; 2] = [72, 56];

#[test]
fn a_trace_that_is_read_back_equals_the_traced_frame() {
    let scene = TraceScene::new(scene()).expect("small");
    for samples_per_px in [1, 3] {
        let settings = TraceSettings {
            samples_per_px,
            ..settings(TraversalKind::Bvh2)
        };
        let (_, bytes) = trace(&scene, settings, SIZE_PX);
        let file = Raytrace::from_bytes(bytes).expect("opens");
        let (mut traced, mut read) = (RayTile::default(), RayTile::default());
        for eye in [Eye::Left, Eye::Right] {
            for tile in 0..file.tables().tile_count() {
                traced.clear();
                (traced.origin_px, traced.size_px) = file.tables().tile_rect(tile);
                Tracer::new(&scene, settings).tile(file.tables().camera(eye), &mut traced);
                file.decode_tile_with_geometry(eye, tile, &mut read)
                    .expect("decodes");
                assert_eq!(read, traced, "{eye:?} tile {tile}");
            }
        }
    }
}

#[test]
fn the_bytes_do_not_depend_on_threads_or_run() {
    let scene = TraceScene::new(scene()).expect("small");
    let traced = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let run = || trace(&scene, settings(TraversalKind::Bvh2), SIZE_PX).1;
        pool.expect("threads").install(run)
    };
    let one = traced(1);
    assert_eq!(one, traced(2));
    assert_eq!(one, traced(5));
    let again = TraceScene::new(self::scene()).expect("small");
    assert_eq!(one, trace(&again, settings(TraversalKind::Bvh2), SIZE_PX).1);
}

#[test]
fn all_trees_give_the_same_picture_and_the_same_rays() {
    let traced = |kind: TraversalKind, instances| {
        let mut scene = scene();
        for i in 1..5 {
            // Mirrored and uneven copies of chrome and glass.
            let size = Vec3::new(-0.5, 0.3, 0.1 * i as f32);
            let turn = Quat::from_rotation_x(i as f32);
            let place = Vec3::new(i as f32 - 2.5, 2.0, 1.5);
            scene.instances.push(Instance {
                mesh: 2 + i % 2,
                transform: Affine3A::from_scale_rotation_translation(size, turn, place),
            });
        }
        let options = TreeOptions {
            instances,
            ..kind.into()
        };
        let scene = TraceScene::with_tree(scene, options).expect("small");
        let (frame, bytes) = trace(&scene, settings(kind), SIZE_PX);
        let file = Raytrace::from_bytes(bytes).expect("opens");
        let version = if instances { 5 } else { 3 };
        assert!(file.container().version().1 >= version);
        let counted = file.tables().bvh.instances.map(|of| of.count);
        // Three of chrome, three of glass, and the rest.
        assert_eq!(counted, instances.then_some(7));
        (frame, file)
    };
    let (frame, binary) = traced(TraversalKind::Bvh2, false);
    for (tree, instances) in [
        (TraversalKind::Bvh4, false),
        (TraversalKind::Bvh8, false),
        (TraversalKind::Cwbvh8, false),
        (TraversalKind::Bvh2, true),
        (TraversalKind::Bvh4, true),
        (TraversalKind::Cwbvh8, true),
    ] {
        let (other_frame, other) = traced(tree, instances);
        assert_eq!(frame.images[0].pixels, other_frame.images[0].pixels);
        assert_eq!(frame.images[1].pixels, other_frame.images[1].pixels);
        let (mut a, mut b) = (RayTile::default(), RayTile::default());
        for tile in 0..binary.tables().tile_count() {
            binary
                .decode_tile(Eye::Left, tile, &mut a)
                .expect("decodes");
            other.decode_tile(Eye::Left, tile, &mut b).expect("decodes");
            assert_eq!(a.pixels, b.pixels);
            for (x, y) in a.rays.iter().zip(&b.rays) {
                assert_eq!((x.kind, x.outcome, x.parent), (y.kind, y.outcome, y.parent));
            }
        }
    }
}

#[test]
fn each_material_spawns_its_kind_of_ray() {
    let scene = TraceScene::new(scene()).expect("small");
    let (_, bytes) = trace(&scene, settings(TraversalKind::Bvh2), [160, 120]);
    let file = Raytrace::from_bytes(bytes).expect("opens");
    let mut tile = RayTile::default();
    let mut seen = [[0u32; 6]; 5];
    for number in 0..file.tables().tile_count() {
        file.decode_tile(Eye::Left, number, &mut tile)
            .expect("decodes");
        for pixel in &tile.pixels {
            let rays = tile.rays_of(pixel);
            assert_eq!(rays[0].kind, RayKind::Primary);
            assert_eq!(pixel.hit.is_some(), rays[0].outcome == Outcome::Hit);
            let Some(hit) = pixel.hit else {
                assert_eq!(rays.len(), 1);
                continue;
            };
            for ray in rays.iter().filter(|r| r.depth == 1) {
                seen[hit.material as usize][ray.kind as usize] += 1;
            }
        }
    }
    let [floor, clay, chrome, glass, veil] = seen;
    let (shadow, mirror, through) = (1, 2, 3);
    for diffuse in [floor, clay] {
        assert!(diffuse[shadow] > 100 && diffuse[mirror] == 0 && diffuse[through] == 0);
    }
    assert!(chrome[mirror] > 100 && chrome[through] == 0, "{chrome:?}");
    assert!(glass[mirror] > 100 && glass[through] > 100, "{glass:?}");
    assert!(veil[through] > 100 && veil[mirror] == 0, "{veil:?}");
}

#[test]
fn primary_hits_on_the_floor_match_the_computed_intersections() {
    let scene = TraceScene::new(scene()).expect("small");
    let settings = settings(TraversalKind::Bvh2);
    let (_, bytes) = trace(&scene, settings, [160, 120]);
    let file = Raytrace::from_bytes(bytes).expect("opens");
    let mut tile = RayTile::default();
    let mut checked = 0;
    for number in 0..file.tables().tile_count() {
        file.decode_tile(Eye::Right, number, &mut tile)
            .expect("decodes");
        let eye = file.tables().camera(Eye::Right);
        let floor = -scene.soup.origin.y as f32;
        for hit in tile.pixels.iter().filter_map(|p| p.hit) {
            if hit.object != 0 {
                continue;
            }
            assert!((hit.position[1] - floor).abs() < 2e-6, "{hit:?}");
            assert_eq!(hit.geometric_normal, [0.0, 1.0, 0.0]);
            let along = Vec3::from(hit.position) - Vec3::from(eye.position);
            assert!((along.length() - hit.t).abs() < 2e-6 * hit.t);
            checked += 1;
        }
    }
    assert!(checked > 1000, "{checked}");
}

#[test]
fn a_white_room_without_lights_is_as_bright_as_its_sky() {
    // With albedo 1 and a uniform sky and ground, every pixel must show exactly that radiance.
    let mut scene = scene();
    scene.lights.clear();
    scene.sky = Vec3::ONE;
    for material in &mut scene.materials {
        *material = Material {
            roughness: 1.0,
            specular: Vec3::ZERO,
            ..Material::default()
        };
    }
    let mut scene = TraceScene::new(scene).expect("small");
    scene.sky.ground = Vec3::ONE;
    let (frame, _) = trace(&scene, settings(TraversalKind::Bvh2), SIZE_PX);
    for pixel in frame.images[0].pixels.iter().skip(72 * 40) {
        assert!((*pixel - Vec3::ONE).abs().max_element() < 2e-3, "{pixel}");
    }
}

#[test]
fn vertex_colours_multiply_the_base_colour_at_the_hit() {
    let mut mesh = floor(0);
    let (red, clear) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 0.0));
    mesh.colors = vec![red, Vec4::ONE, clear, Vec4::ONE];
    let plain = floor(0);
    let veil = Material {
        base_color: Vec4::new(0.5, 1.0, 0.5, 1.0),
        alpha: AlphaMode::Blend,
        ..material("veil")
    };
    let scene = Scene {
        meshes: vec![mesh, plain],
        instances: [0, 1]
            .map(|mesh| Instance {
                mesh,
                transform: Affine3A::IDENTITY,
            })
            .to_vec(),
        materials: vec![veil],
        ..Scene::default()
    };
    let (soup, materials) = (Soup::new(&scene), Materials::new(&scene).unwrap());
    let albedo = |primitive, bary| {
        let at = soup.attributes(&scene, primitive, bary);
        let surface = materials.surface(0, &at, 0.0);
        surface.albedo.extend(surface.alpha)
    };
    // Corners of the first triangle: red, white, blue and clear.
    assert_eq!(albedo(0, [0.0, 0.0]), Vec4::new(0.5, 0.0, 0.0, 1.0));
    assert_eq!(albedo(0, [0.0, 1.0]), Vec4::new(0.0, 0.0, 0.5, 0.0));
    assert_eq!(albedo(0, [0.0, 0.5]), Vec4::new(0.25, 0.0, 0.25, 0.5));
    assert_eq!(albedo(2, [0.0, 0.5]), Vec4::new(0.5, 1.0, 0.5, 1.0));
    let stops = |primitive, bary| materials.stops(&scene, &soup, primitive, bary);
    assert!(stops(0, [0.0, 0.0]) && !stops(0, [0.0, 1.0]) && stops(2, [0.0, 1.0]));
}
