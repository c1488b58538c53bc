use super::*;
use crate::Mask;
use crate::gaze::Gaze;
use crate::hidden_mesh::HiddenMesh;
use crate::layer::Layer;
use crate::plan::{Filter, PicturePart};
use crate::settings::{FarField, Foveation, FoveationKind, Rates, Reprojection, Split, Variant};
use crate::shading_reuse::ShadingReuse;
use formats::textrace::PassKind;
use formats::view::{EyeView, FovTangents};

const BOTH: &[Eye] = &[Eye::Left, Eye::Right];

/// Off-axis eyes whose picture has odd tiles and coarse pixels at its edges.
fn hmd(size_px: [u32; 2]) -> Hmd {
    let fov = |left, right| FovTangents::new(left, right, 1.1, 1.0);
    Hmd {
        eye_size_px: size_px,
        fov: [fov(1.3, 1.0), fov(1.0, 1.3)],
        ..Hmd::default()
    }
}

fn foveated(kind: FoveationKind, gaze: [f32; 2], hidden_area_mask: bool) -> Settings {
    Settings {
        hidden_area_mask,
        foveation: Some(Foveation {
            kind,
            gaze: Gaze::Fixed(gaze),
            rates: Rates::default(),
        }),
        ..Settings::default()
    }
}

fn plan(settings: &Settings, hmd: &Hmd) -> FramePlan {
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    let planner = Planner::new(settings, hmd, lenses, BOTH, 72.0).unwrap();
    planner
        .plan(&FrameViews::default(), false, Vec::new)
        .unwrap()
}

/// All settings that result in layers, each with a gaze straight ahead and one in a corner.
fn all() -> Vec<Settings> {
    let mut all = vec![
        Settings::default(),
        Settings {
            hidden_area_mask: true,
            ..Settings::default()
        },
    ];
    for kind in [
        FoveationKind::Rings,
        FoveationKind::MultiResolution,
        FoveationKind::RadialDensity,
        FoveationKind::LensMatched,
    ] {
        for gaze in [[0.0, 0.0], [-40.0, 30.0]] {
            for masked in [false, true] {
                all.push(foveated(kind, gaze, masked));
            }
        }
    }
    all
}

/// Pixels of the layer that are read for a pixel of the picture.
fn taps(part: &PicturePart, layer: &Layer, pixel: [u32; 2]) -> Vec<[u32; 2]> {
    let own = [0, 1].map(|axis: usize| pixel[axis] - part.origin_px[axis]);
    match part.filter {
        Filter::Projective => {
            let [x, y] = pixel.map(|px| f64::from(px) + 0.5);
            let at = part.layer_from_px.unwrap() * glam::DVec3::new(x, y, 1.0);
            let axis = |axis: usize| {
                let first = ([at.x, at.y][axis] / at.z - 0.5).floor();
                let last = f64::from(layer.size_px[axis] - 1);
                [first, first + 1.0].map(|tap| tap.clamp(0.0, last) as u32)
            };
            let ([x0, x1], [y0, y1]) = (axis(0), axis(1));
            vec![[x0, y0], [x1, y0], [x0, y1], [x1, y1]]
        }
        Filter::Copy => vec![own],
        Filter::FillQuads if layer.mask.as_ref().is_some_and(|m| m.get(own[0], own[1])) => {
            vec![own]
        }
        Filter::FillQuads => {
            let [x, y] = own;
            let [a, b] = [x / 2 * 2, y / 2 * 2];
            vec![
                [a.wrapping_sub(1), y],
                [a + 2, y],
                [x, b.wrapping_sub(1)],
                [x, b + 2],
            ]
        }
        Filter::Bilinear => {
            let axis = |axis: usize| {
                let n = f64::from(part.coarseness[axis]);
                let at = (f64::from(own[axis]) + 0.5) / n - 0.5;
                let last = f64::from(layer.size_px[axis] - 1);
                // A tap with weight zero is not read.
                let next = if at.fract() == 0.0 {
                    at
                } else {
                    at.floor() + 1.0
                };
                [
                    at.floor().clamp(0.0, last) as u32,
                    next.clamp(0.0, last) as u32,
                ]
            };
            let ([x0, x1], [y0, y1]) = (axis(0), axis(1));
            vec![[x0, y0], [x1, y0], [x0, y1], [x1, y1]]
        }
    }
}

#[test]
fn each_visible_pixel_has_one_part_and_reads_only_drawn_pixels() {
    for size_px in [[120, 104], [131, 97]] {
        let hmd = hmd(size_px);
        for settings in all() {
            let plan = plan(&settings, &hmd);
            for (eye, picture) in plan.pictures.iter().enumerate() {
                let whole = match picture {
                    PictureSource::Layer(layer) => vec![PicturePart {
                        layer: *layer,
                        origin_px: [0, 0],
                        coarseness: [1, 1],
                        tiles: None,
                        filter: Filter::Copy,
                        layer_from_px: None,
                    }],
                    PictureSource::Composed { parts, .. } => parts.clone(),
                };
                let lens = Lens::of(&hmd.fov[eye]);
                for pixel in (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| [x, y])) {
                    if settings.hidden_area_mask
                        && !lens.pixel_visible(&hmd.fov[eye], size_px, pixel)
                    {
                        continue;
                    }
                    let fills = |part: &&PicturePart| {
                        let tile = pixel.map(|px| px / 16);
                        part.tiles
                            .as_ref()
                            .is_none_or(|tiles| tiles.get(tile[0], tile[1]))
                    };
                    let filling: Vec<&PicturePart> = whole.iter().filter(fills).collect();
                    assert_eq!(filling.len(), 1, "{settings:?} {pixel:?}");
                    let part = filling[0];
                    let layer = &plan.layers[part.layer];
                    assert_eq!(layer.eye, Some(BOTH[eye]));
                    let drawn = |[x, y]: &[u32; 2]| {
                        *x < layer.size_px[0]
                            && *y < layer.size_px[1]
                            && layer.mask.as_ref().is_none_or(|mask| mask.get(*x, *y))
                    };
                    let taps = taps(part, layer, pixel);
                    let ok = match part.filter {
                        Filter::FillQuads => taps.iter().any(drawn),
                        _ => taps.iter().all(drawn),
                    };
                    assert!(ok, "{settings:?} eye {eye} {pixel:?}: {taps:?}");
                }
            }
        }
    }
}

#[test]
fn pixels_of_a_layer_have_the_directions_of_the_pictures_pixels() {
    let hmd = hmd([131, 97]);
    let eye_to_clip = glam::camera::rh::proj::directx::perspective(1.4, 1.2, 90.0, 0.1);
    let view = EyeView {
        eye_to_clip: eye_to_clip.to_cols_array_2d(),
        ..EyeView::default()
    };
    let views = FrameViews {
        frame: 0,
        eyes: [view; 2],
    };
    for settings in all() {
        let lenses = hmd.fov.map(|fov| Lens::of(&fov));
        let plan = Planner::new(&settings, &hmd, lenses, BOTH, 72.0)
            .unwrap()
            .plan(&views, false, Vec::new)
            .unwrap();
        for picture in &plan.pictures {
            let PictureSource::Composed { parts, .. } = picture else {
                continue;
            };
            for part in parts {
                let layer = &plan.layers[part.layer];
                for corner in [[0, 0], layer.size_px] {
                    // A point in pixels of the picture, and the same point in pixels of the layer.
                    let px = match &part.layer_from_px {
                        None => [0, 1].map(|axis: usize| {
                            f64::from(part.origin_px[axis] + corner[axis] * part.coarseness[axis])
                        }),
                        Some(map) => {
                            let [x, y] = corner.map(f64::from);
                            let at = map.inverse() * glam::DVec3::new(x, y, 1.0);
                            [at.x / at.z, at.y / at.z]
                        }
                    };
                    let ndc = |px: [f64; 2], size: [u32; 2]| {
                        let [x, y] = [px[0] / f64::from(size[0]), px[1] / f64::from(size[1])];
                        glam::Vec2::new((2.0 * x - 1.0) as f32, (1.0 - 2.0 * y) as f32)
                    };
                    let of_picture = ndc(px, hmd.eye_size_px);
                    let of_layer = ndc(corner.map(f64::from), layer.size_px);
                    let point = eye_to_clip.inverse().project_point3(of_picture.extend(0.5));
                    let found = layer.clip_from_world().project_point3(point).truncate();
                    assert!(
                        found.distance(of_layer) < 1e-4,
                        "{settings:?} {found} {of_layer}"
                    );
                }
            }
        }
    }
}

#[test]
fn shaded_shares_match_the_rates_and_borders_are_small() {
    let hmd = hmd([960, 1080]);
    let shares = |settings: &Settings| {
        let predicted = plan(settings, &hmd).predicted;
        (
            predicted.rate_share.unwrap(),
            predicted.shaded_share.unwrap(),
        )
    };
    // The viewports end at tiles, so the share is not exactly 49 %.
    let (rate, shaded) = shares(&foveated(FoveationKind::MultiResolution, [0.0, 0.0], false));
    assert!(
        (rate - 0.49).abs() < 0.02 && shaded > rate && shaded < rate + 0.01,
        "{rate} {shaded}"
    );
    let (rate, shaded) = shares(&foveated(FoveationKind::RadialDensity, [0.0, 0.0], false));
    assert!(rate == shaded && (0.5..0.6).contains(&rate), "{rate}");
    let (rate, shaded) = shares(&foveated(FoveationKind::Rings, [0.0, 0.0], false));
    assert!(shaded > rate && shaded < rate + 0.05, "{rate} {shaded}");
    let masked = Settings {
        hidden_area_mask: true,
        ..Settings::default()
    };
    // The share of a circle that touches the left and right edges, for this vertical span of tangents.
    let (rate, shaded) = shares(&masked);
    let expected = std::f32::consts::PI * 1.15 * 1.15 / (2.3 * 2.1);
    assert!(
        rate == shaded && rate < 1.0 && shaded > expected * 0.9,
        "{rate} {expected}"
    );
}

#[test]
fn rings_around_the_gaze_have_the_share_of_a_circle() {
    // One rate beyond 20 degrees: a disc of tan(20) in a square picture with a tangent of 1.15.
    let mut hmd = hmd([1600, 1600]);
    hmd.fov = [FovTangents::new(1.15, 1.15, 1.15, 1.15); 2];
    let mut settings = foveated(FoveationKind::Rings, [0.0, 0.0], false);
    if let Some(foveation) = &mut settings.foveation {
        foveation.rates.edges_deg = [20.0; 4];
    }
    let share = plan(&settings, &hmd).predicted.rate_share.unwrap();
    let disc = std::f32::consts::PI * 20.0_f32.to_radians().tan().powi(2) / 2.3_f32.powi(2);
    let expected = disc + (1.0 - disc) / 16.0;
    // Tiles that touch the disc belong to it, which adds a ring of at most half a tile.
    assert!(
        share > expected && share < expected + 0.02,
        "{share} {expected}"
    );
}

#[test]
fn left_and_right_layers_with_the_same_number_are_consecutive() {
    for settings in all() {
        let plan = plan(&settings, &hmd([131, 97]));
        let keys: Vec<_> = plan
            .layers
            .iter()
            .map(|l| (l.number, l.eye.map(|e| e as u8)))
            .collect();
        assert!(keys.is_sorted_by(|a, b| a < b), "{keys:?}");
    }
}

#[test]
fn a_rate_without_tiles_has_no_layer() {
    let hmd = hmd([320, 320]);
    let mut settings = foveated(FoveationKind::Rings, [0.0; 2], true);
    // The second ring has no width, and the last one starts beyond the display's corners.
    let rates = Rates {
        edges_deg: [10.0, 10.0, 20.0, 120.0],
    };
    settings.foveation.as_mut().unwrap().rates = rates;
    let plan = plan(&settings, &hmd);
    let mut numbers: Vec<u16> = plan.layers.iter().map(|layer| layer.number).collect();
    numbers.dedup();
    assert_eq!(numbers, [0, 2, 3]);
    assert!(plan.layers.iter().all(|layer| layer.drawn_px() > 0));
}

#[test]
fn eyes_without_a_possible_far_field_are_an_error_of_the_plan() {
    let hmd = hmd([64, 64]);
    let settings = Settings {
        far_field: Some(FarField {
            split: Split::Metres(7.0),
            variant: Variant::Plain,
        }),
        ..Settings::default()
    };
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    let planner = Planner::new(&settings, &hmd, lenses, BOTH, 72.0).unwrap();
    let view = |turn_deg: f32| EyeView {
        world_to_eye: glam::Mat4::from_rotation_y(turn_deg.to_radians()).to_cols_array_2d(),
        eye_to_clip: glam::camera::rh::proj::directx::perspective(1.5, 1.0, 100.0, 0.1)
            .to_cols_array_2d(),
        ..EyeView::default()
    };
    // The directions of these eyes diverge: no picture of less than 180 degrees contains both views.
    let views = FrameViews {
        frame: 3,
        eyes: [view(-80.0), view(80.0)],
    };
    planner.plan(&views, false, Vec::new).unwrap_err();
}

#[test]
fn layers_are_reused_while_the_gaze_is_unchanged() {
    let hmd = hmd([131, 97]);
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    let settings = foveated(FoveationKind::Rings, [3.0, 4.0], true);
    let planner = Planner::new(&settings, &hmd, lenses, BOTH, 72.0).unwrap();
    let masks = |frame| {
        let plan = planner.plan(
            &FrameViews {
                frame,
                ..FrameViews::default()
            },
            false,
            Vec::new,
        );
        plan.unwrap()
            .layers
            .into_iter()
            .map(|layer| layer.mask)
            .collect::<Vec<_>>()
    };
    for (a, b) in masks(0).iter().zip(masks(9)) {
        assert!(
            a.as_ref()
                .zip(b.as_ref())
                .is_some_and(|(a, b)| Arc::ptr_eq(a, b))
        );
    }
}

#[test]
fn a_hidden_area_mesh_replaces_the_mask_of_the_lens() {
    let hmd = hmd([128, 96]);
    // The left half of the left eye's picture, and the lower half of the right eye's.
    let rectangle = |x: f32, y: f32| {
        let [a, b, c, d] = [[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]];
        vec![[a, b, c], [a, c, d]]
    };
    let settings = Settings {
        hidden_area_mesh: Some(HiddenMesh {
            left: rectangle(0.5, 1.0),
            right: rectangle(1.0, 0.5),
        }),
        ..Settings::default()
    };
    let made = plan(&settings, &hmd);
    assert_eq!(
        made.pictures,
        [PictureSource::Layer(0), PictureSource::Layer(1)]
    );
    for (layer, shown) in made.layers.iter().zip([
        (|x, _| x >= 64) as fn(u32, u32) -> bool,
        // Rows of pixels are numbered downwards; the mesh's coordinates point upwards.
        |_, y| y < 48,
    ]) {
        let expected = Mask::new([128, 96], shown);
        assert_eq!(layer.mask.as_deref(), Some(&expected));
    }
    assert_eq!(made.predicted.shaded_share, Some(0.5));
    // Rings leave out the same tiles.
    let rings = Settings {
        foveation: foveated(FoveationKind::Rings, [0.0; 2], false).foveation,
        ..settings
    };
    let drawn = |settings: &Settings| plan(settings, &hmd).predicted.rate_share.unwrap();
    let unmasked = foveated(FoveationKind::Rings, [0.0; 2], false);
    assert!(drawn(&rings) < 0.6 * drawn(&unmasked));
}

#[test]
fn the_right_eye_starts_with_what_the_left_one_shaded() {
    let hmd = hmd([64, 64]);
    let settings = Settings {
        shading_reuse: Some(ShadingReuse::default()),
        ..Settings::default()
    };
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    let planner = Planner::new(&settings, &hmd, lenses, BOTH, 72.0).unwrap();
    let layers = |blends| {
        let plan = planner.plan(&FrameViews::default(), blends, Vec::new);
        let passes = plan.unwrap().passes(0).into_iter();
        let kinds = passes.map(|pass| (pass.kind, pass.eye.unwrap(), pass.layer));
        kinds.collect::<Vec<_>>()
    };
    let eyes = [
        (PassKind::Main, Eye::Left, 0),
        (PassKind::Main, Eye::Right, 0),
    ];
    assert_eq!(layers(false), eyes);
    // What is blended goes over the left eye's picture after the right eye took colours of it.
    assert_eq!(layers(true)[..2], eyes);
    assert_eq!(layers(true)[2..], [(PassKind::Layer, Eye::Left, 1)]);

    let refused = |settings: Settings, eyes: &[Eye]| {
        let planner = Planner::new(&settings, &hmd, lenses, eyes, 72.0);
        planner.unwrap_err().to_string()
    };
    assert!(refused(settings.clone(), &[Eye::Right]).contains("both eyes"));
    let multiview = Settings {
        multiview: true,
        ..settings
    };
    assert!(refused(multiview, BOTH).contains("one after the other"));
    for contrast in [-0.1, 1.1, f32::NAN] {
        let shading_reuse = Some(ShadingReuse { contrast });
        let settings = Settings {
            shading_reuse,
            ..Settings::default()
        };
        assert!(refused(settings, BOTH).contains("0 to 1"), "{contrast}");
    }
}

#[test]
fn at_half_rate_every_other_frame_has_no_layers() {
    let hmd = hmd([64, 64]);
    let settings = Settings {
        half_rate: Some(Reprojection::Rotation),
        ..Settings::default()
    };
    let lenses = hmd.fov.map(|fov| Lens::of(&fov));
    let planner = Planner::new(&settings, &hmd, lenses, BOTH, 72.0).unwrap();
    let layers = |frame| {
        let views = FrameViews {
            frame,
            ..FrameViews::default()
        };
        planner.plan(&views, false, Vec::new).unwrap().layers.len()
    };
    assert_eq!([0, 1, 2, 3].map(layers), [2, 0, 2, 0]);
}

#[test]
fn views_at_once_have_separate_depth_buffers_and_consecutive_passes_share_one() {
    let hmd = hmd([100, 80]);
    let view = 4 * 100 * 80;
    let baseline = plan(&Settings::default(), &hmd);
    let bytes = |plan: &FramePlan, at_once| {
        let bytes = plan.target_bytes(at_once);
        (bytes.color, bytes.depth)
    };
    assert_eq!(bytes(&baseline, false), (2 * view, view));
    assert_eq!(bytes(&baseline, true), (2 * view, 2 * view));
    // Composed pictures are additional targets, and the layers share a depth buffer of the largest layer's
    // size.
    let rings = plan(&foveated(FoveationKind::Rings, [0.0; 2], false), &hmd);
    let layers: u64 = (rings.layers.iter())
        .map(|layer| 4 * u64::from(layer.size_px[0]) * u64::from(layer.size_px[1]))
        .sum();
    assert_eq!(bytes(&rings, false), (layers + 2 * view, view));
    assert_eq!(FramePlan::default().target_bytes(true), Default::default());
}
