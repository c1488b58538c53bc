//! Parts of the tests' scenes, with known coverage and alpha.

use super::*;
use scene::TextureSlot;

/// Reproducible numbers from 0 to 1.
pub(super) fn random(seed: u32) -> impl FnMut() -> f32 {
    let mut random = formats::random::Random(u64::from(seed));
    move || random.unit_f32()
}

/// An image of 4x4-texel cells, which BC1 holds exactly; `opaque` decides each cell's alpha.
pub(super) fn cells(cells: u32, opaque: impl Fn(u32, u32) -> bool) -> Image {
    let edge = cells * 4;
    let rgba: Vec<u8> = (0..edge * edge)
        .flat_map(|i| {
            let (x, y) = (i % edge / 4, i / edge / 4);
            if opaque(x, y) {
                [200, 160, 80, 255]
            } else {
                [0, 0, 0, 0]
            }
        })
        .collect();
    Image::from_texels("cells", [edge; 2], ColorSpace::Srgb, rgba)
}

/// Triangles of random size, position and slant in front of the camera, some across the near plane.
pub(super) fn triangles(count: usize, seed: u32, material: usize) -> Mesh {
    let mut next = random(seed);
    let mut mesh = Mesh {
        name: "random".into(),
        material,
        ..Mesh::default()
    };
    for _ in 0..count {
        let center = Vec3::new(next() * 8.0 - 4.0, next() * 6.0 - 3.0, -0.5 - next() * 8.0);
        let size = 0.3 + next() * next() * 6.0;
        for _ in 0..3 {
            mesh.indices.push(mesh.positions.len() as u32);
            mesh.positions
                .push(center + size * (Vec3::new(next(), next(), next()) - 0.5));
            mesh.normals.push(Vec3::Z);
            mesh.tangents.push(Vec4::new(1.0, 0.0, 0.0, 1.0));
            mesh.uv0
                .push(Vec2::new(next() * 4.0 - 2.0, next() * 4.0 - 2.0));
        }
    }
    mesh
}

pub(super) fn scene(meshes: Vec<Mesh>, materials: Vec<Material>, images: Vec<Image>) -> Scene {
    Scene {
        name: "test".into(),
        instances: (0..meshes.len())
            .map(|mesh| Instance {
                mesh,
                transform: Affine3A::IDENTITY,
            })
            .collect(),
        meshes,
        materials,
        images,
        cameras: vec![Camera {
            name: "test".into(),
            eye: Vec3::ZERO,
            target: Vec3::NEG_Z,
            up: Vec3::Y,
            vfov_deg: 60.0,
            near: 0.1,
            far: 50.0,
        }],
        ..Scene::default()
    }
}

pub(super) fn textured(alpha: AlphaMode, double_sided: bool) -> Material {
    let sampler = Sampler {
        mag: Filter::Nearest,
        min: Filter::Nearest,
        mip: MipFilter::None,
        ..Sampler::TRILINEAR_REPEAT
    };
    let texture = TextureRef {
        sampler,
        ..TextureRef::new(0)
    };
    Material {
        name: format!("{alpha:?}"),
        textures: [(TextureSlot::BaseColor, Some(texture))].into(),
        alpha,
        double_sided,
        ..Material::default()
    }
}

pub(super) fn checker() -> Image {
    cells(8, |x, y| (x * 5 + y * 3) % 7 < 4)
}

/// Triangles over one another: their number and seed, and the material of each of these alpha modes.
pub(super) fn crowd(parts: &[(usize, u32, AlphaMode)]) -> Scene {
    let meshes = parts.iter().enumerate();
    let meshes = meshes.map(|(number, (count, seed, _))| triangles(*count, *seed, number));
    let materials = parts.iter().map(|(.., alpha)| textured(*alpha, true));
    scene(meshes.collect(), materials.collect(), vec![checker()])
}

/// For scenes without alpha test.
pub(super) fn passes(_: &DrawCall, _: DVec2) -> bool {
    true
}

/// The alpha test on [`checker`] with nearest filtering.
pub(super) fn checker_passes(_: &DrawCall, uv: DVec2) -> bool {
    let cell = uv.rem_euclid(DVec2::ONE) * 8.0;
    (cell.x as u32 * 5 + cell.y as u32 * 3) % 7 < 4
}

/// Small meshes side by side over the view, each placed eight times in a row.
pub(super) fn many_instances(alpha: AlphaMode) -> Scene {
    let meshes = (0..12).map(|mesh| triangles(3, 70 + mesh, 0)).collect();
    let mut scene = scene(meshes, vec![textured(alpha, true)], vec![checker()]);
    scene.instances = (0..96)
        .map(|i| {
            let place = Vec3::new((i % 12) as f32 - 5.5, (i / 12) as f32 - 3.5, -5.5) * 1.6;
            let transform =
                Affine3A::from_translation(place) * Affine3A::from_scale(Vec3::splat(0.4));
            Instance {
                mesh: i / 8,
                transform,
            }
        })
        .collect();
    scene
}
