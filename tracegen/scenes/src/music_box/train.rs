//! The music box's gear train, fan, springs and bells.

use super::{CYLINDER, CYLINDER_HALF, MODULE};
use crate::gears::{Gear, placed};
use crate::mesh_builder::{MeshBuilder, lathed, profile, rounded};
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Spring barrel, great wheel and intermediate wheels.
pub(super) fn train(scene: &mut SceneBuilder) {
    // Gears are in planes of constant x: their z axis points to +x.
    let facing = Quat::from_rotation_y(FRAC_PI_2);
    let wheel = |teeth: u32, thickness: f32, spokes: u32| Gear {
        teeth,
        module: MODULE,
        thickness,
        bore: 0.0014,
        spokes,
    };
    let great = wheel(36, 0.0030, 5);
    let pinion = wheel(12, 0.0062, 0);
    let second = wheel(32, 0.0022, 5);
    let third = wheel(22, 0.0020, 4);
    let meshes: Vec<usize> = [great, pinion, second, third]
        .iter()
        .zip(["brass", "steel", "brass", "brass"])
        .map(|(gear, material)| scene.mesh("gear", gear.build(), material))
        .collect();
    // In the wheel's plane, angles run from -z upwards.
    let offset = |angle: f32, distance: f32| {
        facing * vec3(angle.cos() * distance, angle.sin() * distance, 0.0)
    };
    for (plane, sign) in [
        (CYLINDER.x - CYLINDER_HALF - 0.0075, -1.0f32),
        (CYLINDER.x + CYLINDER_HALF + 0.0075, 1.0),
    ] {
        let center = vec3(plane, CYLINDER.y, CYLINDER.z);
        scene.place(meshes[0], placed(center, facing, 0.0));
        let direction = if sign < 0.0 { 2.9 } else { 0.25 };
        let c1 = center + offset(direction, great.pitch_radius() + pinion.pitch_radius());
        let t1 = pinion.mesh_turn(&great, 0.0, direction);
        scene.place(meshes[1], placed(c1, facing, t1));
        // The second wheel shares the pinion's arbor, further out.
        let plane2 = Vec3::X * (sign * 0.0045);
        scene.place(meshes[2], placed(c1 + plane2, facing, t1));
        let direction2 = if sign < 0.0 { 1.2 } else { 1.9 };
        let c2 = c1 + plane2 + offset(direction2, second.pitch_radius() + pinion.pitch_radius());
        let t2 = pinion.mesh_turn(&second, t1, direction2);
        scene.place(meshes[1], placed(c2, facing, t2));
        scene.place(meshes[3], placed(c2 + plane2, facing, t2));
        let mut arbors = MeshBuilder::new();
        for c in [center, c1, c2] {
            let shaft = profile(
                "0,-0.011! 0.0007,-0.011! 0.0013,-0.009! 0.0013,0.009! 0.0007,0.011! 0,0.011!",
            );
            let rod = lathed(&shaft, 20);
            arbors.merge(
                &rod,
                Affine3A::from_rotation_translation(
                    Quat::from_rotation_z(-FRAC_PI_2),
                    vec3(plane + sign * 0.003, c.y, c.z),
                ),
            );
        }
        scene.add("arbors", arbors, "steel");
        // Cock: a plate outside the train, with jewelled holes.
        let mut plate = MeshBuilder::new();
        let x = plane + sign * 0.0135;
        plate.block(
            vec3(x - 0.001, 0.0085, CYLINDER.z - 0.027),
            vec3(x + 0.001, 0.048, CYLINDER.z + 0.021),
            0.0004,
        );
        scene.add("plate", plate, "polished-brass");
        let mut jewels = MeshBuilder::new();
        for c in [center, c1, c2] {
            let jewel = rounded("0.0017,0! 0.0016,0.0006 0,0.0011", 4, 24);
            let out = Quat::from_rotation_z(-sign * FRAC_PI_2);
            jewels.merge(
                &jewel,
                Affine3A::from_rotation_translation(out, vec3(x + sign * 0.001, c.y, c.z)),
            );
        }
        scene.add("jewels", jewels, "ruby");
    }
}

/// The two vanes of the governor.
pub(super) fn fan(fan: &mut MeshBuilder) {
    for s in [-1.0f32, 1.0] {
        fan.surface(10, 6, |u, v| {
            let x = s * (0.0012 + 0.0095 * u);
            let curl = 0.0018 * u * u * s;
            (vec3(x, 0.010 * v, curl), vec2(x, v * 0.01))
        });
        fan.surface(10, 6, |u, v| {
            let x = s * (0.0012 + 0.0095 * (1.0 - u));
            let curl = 0.0018 * (1.0 - u) * (1.0 - u) * s - 0.00035;
            (vec3(x, 0.010 * v, curl), vec2(x, v * 0.01))
        });
    }
}

/// The bells, each with its hammer.
pub(super) fn bells(scene: &mut SceneBuilder) {
    let [bell, hammer] = ["bell", "hammer"].map(|name| scene.numbers(name)[0]);
    let (y, z) = (0.0425, -0.036);
    for i in 0..6 {
        let size = 0.0088 - 0.0007 * i as f32;
        let x = -0.034 + 0.0155 * i as f32;
        scene.place(
            bell,
            Affine3A::from_scale_rotation_translation(
                Vec3::splat(size),
                Quat::IDENTITY,
                vec3(x, y - size, z),
            ),
        );
        scene.place(
            hammer,
            Affine3A::from_translation(vec3(x, y - 0.8 * size, z + size + 0.0022)),
        );
    }
}

/// The spring of a barrel.
pub(super) fn mainspring(spring: &mut MeshBuilder) {
    let r = 0.0085;
    let coil = |s: f32| {
        let a = 7.0 * TAU * s;
        let radius = 0.0016 + (0.86 * r - 0.0016) * s;
        vec2(radius * a.cos(), -radius * a.sin())
    };
    for (shift, outside) in [(0.0002f32, true), (-0.0002, false)] {
        let mut band = MeshBuilder::new();
        band.surface(300, 1, |s, t| {
            let p = coil(s);
            let q = p + p.normalize_or_zero() * shift;
            (vec3(q.x, 0.0035 + 0.0075 * t, q.y), vec2(s * 0.2, t * 0.01))
        });
        band.orient(|p| {
            if outside {
                vec3(p.x, 0.0, p.z)
            } else {
                vec3(-p.x, 0.0, -p.z)
            }
        });
        spring.merge(&band, Affine3A::IDENTITY);
    }
    spring.surface(300, 1, |s, t| {
        let p = coil(s);
        let q = p + p.normalize_or_zero() * (0.0002 - 0.0004 * t);
        (vec3(q.x, 0.011, q.y), vec2(s * 0.2, t * 0.001))
    });
}
