//! The temple ruin of the jungle: a stepped platform, a gate, broken columns and stone idols.

use crate::atrium::parts::{Column, cornice, lion_medallion, moulding};
use crate::mesh_builder::MeshBuilder;
use crate::noise::Rng;
use crate::scene_builder::SceneBuilder;
use glam::{Affine3A, Quat, Vec3, vec3};
use std::f32::consts::FRAC_PI_2;

/// Builds the ruin around `center`; its stair faces -x.
pub fn build(scene: &mut SceneBuilder, center: Vec3) {
    let mut rng = Rng::new(5);
    let mut tiers = MeshBuilder::new();
    let mut bands = MeshBuilder::new();
    // Four receding tiers, with courses of single blocks along each rim.
    for tier in 0..4 {
        let half = 6.4 - 1.25 * tier as f32;
        let (low, high) = (tier as f32 * 0.9 - 0.4, (tier + 1) as f32 * 0.9);
        tiers.block(vec3(-half, low, -half), vec3(half, high - 0.28, half), 0.04);
        for side in 0..4 {
            let place = Affine3A::from_quat(Quat::from_rotation_y(side as f32 * FRAC_PI_2));
            let mut x = -half;
            while x < half - 0.3 {
                let w = rng.range(0.5, 1.1).min(half - x);
                let gone = tier > 0 && rng.unit() < 0.10;
                if !gone {
                    let sink = rng.range(0.0, 0.03);
                    tiers.merge_block(
                        vec3(x + 0.008, high - 0.28, half - 0.9),
                        vec3(x + w - 0.008, high - sink, half + 0.05 - sink),
                        0.03,
                        place,
                    );
                }
                x += w;
            }
            let shift = Affine3A::from_translation(vec3(-half, 0.0, half));
            bands.merge(
                &moulding(&cornice(0.14, 0.3, 2), 2.0 * half, high - 0.62),
                place * shift,
            );
        }
        tiers.block(
            vec3(-half + 0.5, high - 0.3, -half + 0.5),
            vec3(half - 0.5, high - 0.05, half - 0.5),
            0.03,
        );
    }
    let place = Affine3A::from_translation(center);
    scene.put("temple-tiers", tiers, "temple-blocks", place);

    let mut stairs = MeshBuilder::new();
    for i in 0..18 {
        let y = i as f32 * 0.2;
        let x = -8.4 + i as f32 * 0.30;
        stairs.block(
            vec3(x, y - 0.5, -1.5),
            vec3(x + 1.2, y + 0.2 - rng.range(0.0, 0.02), 1.5),
            0.025,
        );
    }
    for side in [-1.0f32, 1.0] {
        for i in 0..6 {
            let x = -8.5 + i as f32 * 0.9;
            let y = 0.25 + i as f32 * 0.6;
            let (z0, z1) = (side * 1.5, side * 2.0);
            stairs.block(vec3(x, y - 1.4, z0), vec3(x + 1.0, y + 0.35, z1), 0.04);
        }
    }
    scene.put("temple-stairs", stairs, "temple-steps", place);

    shrine(scene, center + Vec3::Y * 3.6, &mut bands);
    scene.put("temple-bands", bands, "temple-frieze", place);
    columns(scene, center, &mut rng);
}

/// The gate house on top, with a face over its door.
fn shrine(scene: &mut SceneBuilder, base: Vec3, bands: &mut MeshBuilder) {
    let mut walls = MeshBuilder::new();
    let (half, wall) = (1.9, 0.5);
    for side in [-1.0f32, 1.0] {
        let (z0, z1) = (side * 0.7, side * half);
        walls.block(vec3(-half, 0.0, z0), vec3(-half + wall, 2.3, z1), 0.03);
        let (z0, z1) = (side * (half - wall), side * half);
        walls.block(vec3(-half + wall, 0.0, z0), vec3(half, 2.3, z1), 0.03);
    }
    walls.block(
        vec3(half - wall, 0.0, -half + wall),
        vec3(half, 2.3, half - wall),
        0.02,
    );
    walls.block(
        vec3(-half - 0.1, 1.75, -0.9),
        vec3(-half + wall, 2.3, 0.9),
        0.03,
    );
    walls.block(
        vec3(-half - 0.25, 2.3, -half - 0.25),
        vec3(half + 0.25, 2.65, half + 0.25),
        0.04,
    );
    walls.block(
        vec3(-half + 0.3, 2.65, -half + 0.3),
        vec3(half - 0.3, 3.25, half - 0.3),
        0.04,
    );
    walls.block(vec3(-0.5, 3.25, -1.5), vec3(-0.1, 4.6, 1.5), 0.05);
    let mesh = scene.mesh("shrine", walls, "temple-blocks");
    scene.place(mesh, Affine3A::from_translation(base));
    for turn in 0..4 {
        let rotation = Affine3A::from_quat(Quat::from_rotation_y(turn as f32 * FRAC_PI_2));
        let shift = Affine3A::from_translation(vec3(-half, 3.6, half));
        bands.merge(
            &moulding(&cornice(0.2, 0.3, 2), 2.0 * half, 1.98),
            rotation * shift,
        );
    }
    let idol = scene.mesh("idol", lion_medallion(28, 0.6), "idol");
    let facing = |position: Vec3, scale: f32| {
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(scale),
            Quat::from_rotation_y(-FRAC_PI_2),
            position,
        )
    };
    scene.place(idol, facing(base + vec3(-0.5, 3.9, 0.0), 0.66));
    scene.place(idol, facing(base + vec3(-half - 0.26, 2.32, 0.0), 0.4));
    for side in [-1.0, 1.0] {
        scene.place(idol, facing(vec3(base.x - 6.46, 0.42, side * 3.4), 0.36));
        scene.place(idol, facing(vec3(base.x - 5.21, 1.32, side * 3.0), 0.36));
    }
}

fn columns(scene: &mut SceneBuilder, center: Vec3, rng: &mut Rng) {
    let whole = Column {
        radius: 0.34,
        height: 3.6,
        segments: 20,
        rows: 8,
        flutes: 8,
        steps: 2,
    };
    let shaft = scene.mesh("ruin-column", whole.shaft(), "temple-steps");
    let capital = scene.mesh("ruin-capital", whole.capital(), "idol");
    let mut drum = MeshBuilder::new();
    use crate::mesh_builder::profile;
    drum.lathe(
        &profile("0,0! 0.31,0! 0.34,0.03! 0.34,0.57! 0.31,0.6! 0,0.6!"),
        20,
    );
    let drum = scene.mesh("drum", drum, "temple-steps");
    for (i, z) in [-5.2f32, -3.2, 3.2, 5.2].into_iter().enumerate() {
        let foot = center + vec3(-8.6, 0.0, z);
        if i != 1 {
            scene.place(shaft, Affine3A::from_translation(foot));
        }
        if i != 1 && i != 3 {
            scene.place(capital, Affine3A::from_translation(foot));
        }
        if i == 1 {
            for k in 0..3 {
                let lean = Quat::from_rotation_z(0.03 * k as f32);
                scene.place(
                    drum,
                    Affine3A::from_rotation_translation(lean, foot + Vec3::Y * (0.6 * k as f32)),
                );
            }
        }
    }
    // Fallen drums.
    for _ in 0..7 {
        let lying = Quat::from_rotation_y(rng.range(0.0, 6.3)) * Quat::from_rotation_x(FRAC_PI_2);
        let at = center
            + vec3(
                -9.3 + rng.jitter(1.1),
                0.3,
                rng.jitter(1.0).signum() * rng.range(2.4, 5.6),
            );
        scene.place(drum, Affine3A::from_rotation_translation(lying, at));
    }
}
