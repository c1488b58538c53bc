//! Light beyond Whitted's model against closed forms.

use super::{SIZE_PX, floor, material, scene, settings, sphere, trace};
use crate::bvh::TreeOptions;
use crate::scene::TraceScene;
use formats::raytrace::{
    Outcome, PixelRecord, RayKind, RayLighting, RayRecord, RayTile, Raytrace, RaytraceWriter,
    TraversalKind,
};
use formats::texture::ColorSpace;
use formats::view::Eye;
use glam::{Affine3A, Vec2, Vec3, Vec4};
use scene::{Image, Instance, Light, Material, Scene, TextureRef, TextureSlot};

/// A floor and another mesh, lit by nothing.
fn room(other: scene::Mesh, at: Vec3, materials: [Material; 2]) -> Scene {
    let instance = |mesh, at| Instance {
        mesh,
        transform: Affine3A::from_translation(at),
    };
    Scene {
        meshes: vec![floor(0), other],
        instances: vec![instance(0, Vec3::ZERO), instance(1, at)],
        materials: materials.into(),
        ..Scene::default()
    }
}

/// Samples of the left eye that hit the floor, with their places in the world and their rays.
fn on_floor(
    scene: Scene,
    lighting: RayLighting,
    samples_per_px: u32,
) -> Vec<(Vec3, PixelRecord, Vec<RayRecord>)> {
    let scene = TraceScene::new(scene).expect("small");
    let settings = super::TraceSettings {
        lighting: Some(lighting),
        samples_per_px,
        ..settings(TraversalKind::Bvh2)
    };
    let (_, bytes) = trace(&scene, settings, SIZE_PX);
    let file = Raytrace::from_bytes(bytes).expect("opens");
    let (mut out, mut tile) = (Vec::new(), RayTile::default());
    for number in 0..file.tables().tile_count() {
        file.decode_tile(Eye::Left, number, &mut tile)
            .expect("decodes");
        for pixel in &tile.pixels {
            if let Some(hit) = pixel.hit.filter(|hit| hit.object == 0) {
                let place = Vec3::from(hit.position) + scene.soup.origin.as_vec3();
                out.push((place, *pixel, tile.rays_of(pixel).to_vec()));
            }
        }
    }
    assert!(out.len() > 500, "{}", out.len());
    out
}

#[test]
fn a_furnace_is_as_bright_as_its_geometric_series() {
    let (albedo, emitted) = (0.5f32, 0.25f32);
    let furnace = |name: &str| Material {
        base_color: Vec4::new(albedo, albedo, albedo, 1.0),
        emissive: Vec3::splat(emitted),
        roughness: 1.0,
        ..material(name)
    };
    for bounces in [1, 2, 5] {
        let mut scene = room(
            sphere(1, 3),
            Vec3::ZERO,
            [furnace("floor"), furnace("wall")],
        );
        scene.instances[1].transform = Affine3A::from_scale(Vec3::splat(40.0));
        let lighting = RayLighting {
            bounces,
            ..RayLighting::default()
        };
        let expected: f32 = (0..=bounces).map(|k| emitted * albedo.powi(k as i32)).sum();
        for (_, pixel, rays) in on_floor(scene, lighting, 1) {
            for channel in pixel.view_independent {
                assert!(
                    (channel - expected).abs() < 2e-3 * expected,
                    "{channel} {expected}"
                );
            }
            let diffuse = rays.iter().filter(|ray| ray.kind == RayKind::Diffuse);
            assert_eq!(diffuse.count(), bounces as usize);
        }
    }
}

#[test]
fn a_ceiling_occludes_the_directions_that_reach_it() {
    let (height, reach) = (3.0f32, 4.0f32);
    let plain = |lighting| {
        let mut scene = room(
            floor(1),
            Vec3::new(0.0, height, 0.0),
            [material("floor"), material("ceiling")],
        );
        scene.sky = Vec3::ONE;
        on_floor(scene, lighting, 1)
    };
    let lighting = RayLighting {
        occlusion_rays: 256,
        occlusion_m: reach,
        ..RayLighting::default()
    };
    // Rays with a cosine above height / reach are blocked: 1 - (height / reach)^2 of them.
    let expected = (height / reach).powi(2);
    let (mut sum, mut count) = (0.0, 0.0);
    for ((place, open, rays), (_, whole, _)) in plain(lighting)
        .into_iter()
        .zip(plain(RayLighting::default()))
    {
        // The ceiling ends at 9 m.
        if place.x.abs().max(place.z.abs()) > 6.0 {
            continue;
        }
        let share = open.view_independent[1] / whole.view_independent[1];
        assert!((share - expected).abs() < 0.02, "{share} at {place}");
        let kinds = rays
            .iter()
            .filter(|ray| ray.kind == RayKind::AmbientOcclusion);
        let blocked = kinds.filter(|ray| ray.outcome == Outcome::Occluded).count();
        assert!((1.0 - blocked as f32 / 256.0 - share).abs() < 2e-3);
        (sum, count) = (sum + share, count + 1.0);
    }
    assert!(
        count > 300.0 && (sum / count - expected).abs() < 1e-3,
        "{}",
        sum / count
    );
}

#[test]
fn a_sun_with_a_size_casts_the_penumbra_of_its_disk() {
    let (height, radius_deg) = (3.0f64, 5.0f32);
    // The roof covers everything at x < 0.
    let mut scene = room(
        floor(1),
        Vec3::new(-9.0, height as f32, 0.0),
        [material("floor"), material("roof")],
    );
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Y,
        color: Vec3::ONE,
    }];
    let lighting = RayLighting {
        sun_radius_deg: radius_deg,
        ..RayLighting::default()
    };
    let width = height * f64::from(radius_deg).to_radians().tan();
    // Observed and expected light by tenths of the penumbra.
    let mut bins = [[0.0; 3]; 10];
    for (place, _, rays) in on_floor(scene, lighting, 64) {
        let at = f64::from(place.x) / width;
        let shadow = rays.iter().find(|ray| ray.kind == RayKind::Shadow);
        let seen = shadow.expect("the sun is above").outcome == Outcome::Miss;
        // The roof ends at 9 m.
        if place.z.abs() > 8.0 {
            continue;
        }
        if at.abs() > 1.0 {
            assert_eq!(seen, at > 0.0, "{place}");
            continue;
        }
        // Part of a unit disk on one side of a chord.
        let expected = ((-at).acos() + at * (1.0 - at * at).sqrt()) / std::f64::consts::PI;
        let bin = &mut bins[((at + 1.0) * 4.999) as usize];
        *bin = [
            bin[0] + f64::from(u8::from(seen)),
            bin[1] + expected,
            bin[2] + 1.0,
        ];
    }
    for [seen, expected, count] in bins {
        assert!(count > 100.0, "{count}");
        let error = (seen - expected) / count;
        assert!(error.abs() < 0.03, "{error} of {count} samples");
    }
}

#[test]
fn glass_colours_the_light_of_shadow_rays() {
    let glass = Material {
        base_color: Vec4::new(0.9, 0.5, 0.1, 1.0),
        transmission: 0.75,
        ..material("glass")
    };
    let lit = |coloured_shadows| {
        let mut scene = room(
            floor(1),
            Vec3::new(0.0, 3.0, 0.0),
            [material("floor"), glass.clone()],
        );
        scene.lights = vec![Light::Directional {
            direction: Vec3::NEG_Y,
            color: Vec3::splat(2.0),
        }];
        let lighting = RayLighting {
            coloured_shadows,
            ..RayLighting::default()
        };
        on_floor(scene, lighting, 1)
    };
    let tint = glass.base_color.truncate() * glass.transmission;
    for ((_, white, _), (_, coloured, _)) in lit(false).into_iter().zip(lit(true)) {
        let [white, coloured] = [white, coloured].map(|p| Vec3::from(p.view_independent));
        let error = (coloured - tint * white).abs().max_element();
        assert!(error < 2e-3 * white.max_element(), "{coloured} {white}");
    }
}

#[test]
fn a_normal_map_bends_the_shading_normal_and_not_the_surface() {
    let mut mapped = material("floor");
    mapped.textures[TextureSlot::Normal] = Some(TextureRef::new(0));
    let mut scene = room(sphere(1, 1), Vec3::splat(50.0), [mapped, material("ball")]);
    let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from);
    scene.meshes[0].uv0 = uv.to_vec();
    scene.meshes[0].tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    // (0.6, 0, 0.8) in tangent space.
    let texel = [204, 128, 230, 255];
    let texels = texel.repeat(16);
    scene.images = vec![Image::from_texels(
        "bent",
        [4, 4],
        ColorSpace::Linear,
        texels,
    )];
    let with = |normal_maps| {
        let lighting = RayLighting {
            normal_maps,
            sun_radius_deg: 1.0,
            ..RayLighting::default()
        };
        on_floor(scene.clone(), lighting, 1)
    };
    for (normal_maps, expected) in [(true, Vec3::new(0.6, 0.8, 0.0)), (false, Vec3::Y)] {
        for (_, pixel, _) in with(normal_maps) {
            let hit = pixel.hit.expect("on the floor");
            let normal = Vec3::from(hit.shading_normal);
            assert!(normal.distance(expected) < 0.01, "{normal}");
            assert_eq!(hit.geometric_normal, [0.0, 1.0, 0.0]);
        }
    }
}

/// With an eye distance of zero, both pictures differ by their noise only.
#[test]
fn eyes_at_one_position_have_their_own_noise() {
    let scene = TraceScene::new(scene()).expect("small");
    let traced = |lighting| {
        let settings = super::TraceSettings {
            lighting,
            ..settings(TraversalKind::Bvh2)
        };
        let mut tables = super::tables(&scene, settings, SIZE_PX);
        let [left, right] = &mut tables.meta.eyes;
        right.clone_from(left);
        let mut writer = RaytraceWriter::in_memory().expect("in memory");
        let frame = super::trace_frame(&scene, settings, &tables, &mut writer, |_| ());
        frame.expect("traces").images
    };
    let [left, right] = traced(None);
    assert_eq!(left.pixels, right.pixels);
    let [left, right] = traced(Some(RayLighting {
        light_radius_m: 0.5,
        bounces: 1,
        ..RayLighting::default()
    }));
    let same = left
        .pixels
        .iter()
        .zip(&right.pixels)
        .filter(|(a, b)| a == b);
    assert!(same.count() < left.pixels.len() / 2);
}

#[test]
fn lighting_depends_on_the_seed_and_not_on_the_tree_or_the_threads() {
    let traced = |kind: TraversalKind, seed, threads| {
        let tree = TreeOptions::from(kind);
        let scene = TraceScene::with_tree(scene(), tree).expect("small");
        let settings = super::TraceSettings {
            lighting: Some(RayLighting {
                light_radius_m: 0.5,
                sun_radius_deg: 3.0,
                bounces: 3,
                coloured_shadows: true,
                ..RayLighting::default()
            }),
            samples_per_px: 2,
            seed,
            ..settings(kind)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("a pool");
        pool.install(|| trace(&scene, settings, SIZE_PX))
    };
    let (frame, bytes) = traced(TraversalKind::Bvh2, 1, 1);
    assert_eq!(bytes, traced(TraversalKind::Bvh2, 1, 5).1);
    for kind in TraversalKind::ALL {
        let (other, _) = traced(kind, 1, 2);
        assert_eq!(frame.images[0].pixels, other.images[0].pixels, "{kind:?}");
    }
    let (other, _) = traced(TraversalKind::Bvh2, 2, 2);
    assert_ne!(frame.images[0].pixels, other.images[0].pixels);
    // Both eyes have rays of all kinds but ambient occlusion.
    for (kind, least) in [(RayKind::Diffuse, 1000), (RayKind::Shadow, 1000)] {
        assert!(frame.stats.rays_of(kind) > least, "{kind}");
    }
}
