use super::*;
use crate::accuracy::count_errors;
use crate::compose::{Reuse, compose};
use crate::reproject::reproject;
use crate::testing::{DIFFUSE, LEAF, MIRROR, Placed, Shape, View, frame, globe, wall};

/// The default rule of `replay reproject`.
const DEFAULT: &str = crate::DEFAULT_RULE;

fn decided(frame: &Frame, rule: &str) -> Vec<Decision> {
    decide(frame, &reproject(frame), &rule.parse().expect("a rule"))
}

fn room() -> Vec<Placed> {
    let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
    scene.extend(wall(1.0, [0.2, 0.3], -0.3, 2));
    scene.extend(globe([0.4, 0.0, -2.0], 0.5, 3));
    scene
}

#[test]
fn a_plane_that_fills_the_view_has_no_wrong_pixel_under_any_rule() {
    for depth in [0.5, 2.0, 7.3] {
        let frame = frame(&wall(depth, [50.0, 50.0], 0.0, 1), View::default());
        for rule in ["none", "depth", "row", "object", "triangle", DEFAULT] {
            let accuracy = count_errors(&frame, &decided(&frame, rule));
            let reused = accuracy.all_reused();
            assert_eq!(reused.wrong_object, 0);
            assert_eq!(reused.wrong_primitive, 0);
            assert_eq!(
                (reused.position_over_1px, reused.position_over_2px),
                (0, 0),
                "depth {depth}, {rule}"
            );
            // Only the strip that the left eye does not see is missing.
            let strip = (36.0 * 0.064 / depth).ceil() as u64 * 40;
            assert!(accuracy.missing.pixels <= strip);
            let share = reused.pixels as f64 / accuracy.total() as f64;
            assert!(share > 0.8, "depth {depth}, {rule}: {share}");
        }
    }
}

#[test]
fn an_exact_sphere_has_no_wrong_pixel_inside_its_silhouette() {
    let sphere = Placed {
        shape: Shape::Sphere {
            center: [0.0, 0.0, -2.0],
            radius: 0.7,
        },
        object: 1,
        material: DIFFUSE,
    };
    let frame = frame(&[sphere], View::default());
    let decisions = decided(&frame, "silhouette");
    let accuracy = count_errors(&frame, &decisions);
    assert_eq!(accuracy.all_reused().wrong_object, 0);
    // Half a pixel of distance, seen at most about ten degrees from the tangent, is less than 2 px.
    assert_eq!(accuracy.all_reused().position_over_2px, 0);
    assert!(accuracy.pct(accuracy.all_reused().pixels) > 80.0);
    let on_sphere = |d: &&Decision| d.class.is_reused() && d.primitive != SKY;
    for decision in decisions.iter().filter(on_sphere) {
        let left = frame.left().samples[decision.source as usize].position;
        let off = glam::Vec3::from(left).distance(glam::Vec3::new(0.0, 0.0, -2.0)) - 0.7;
        assert!(off.abs() < 1e-5);
    }
}

#[test]
fn a_sphere_of_triangles_has_no_wrong_pixel_under_the_default_rule() {
    let frame = frame(&globe([0.1, 0.05, -2.0], 0.8, 1), View::default());
    let accuracy = count_errors(&frame, &decided(&frame, DEFAULT));
    let reused = accuracy.all_reused();
    assert_eq!((reused.wrong_object, reused.wrong_primitive), (0, 0));
    assert_eq!((reused.position_over_1px, reused.position_over_2px), (0, 0));
    assert!(accuracy.pct(reused.pixels) > 85.0);
}

#[test]
fn classes_sum_to_the_pixels_under_every_rule() {
    let frame = frame(&room(), View::default());
    for rule in ["none", "depth=0.01", "row+object", "silhouette", DEFAULT] {
        let accuracy = count_errors(&frame, &decided(&frame, rule));
        assert_eq!(accuracy.total(), 72 * 40);
    }
}

#[test]
fn without_eye_separation_all_is_reused_without_error() {
    let view = View {
        ipd_m: 0.0,
        ..View::default()
    };
    let frame = frame(&room(), view);
    for rule in ["none", "depth", DEFAULT] {
        let decisions = decided(&frame, rule);
        let accuracy = count_errors(&frame, &decisions);
        let reused = accuracy.all_reused();
        if rule == "none" {
            assert_eq!(reused.pixels, 72 * 40);
        }
        assert_eq!(reused.wrong_object + reused.wrong_primitive, 0);
        assert!(accuracy.position_mean_px < 1e-4);
        for reuse in Reuse::ALL {
            let colors = compose(&frame, &decisions, reuse);
            for (color, truth) in colors.iter().zip(&frame.right().samples) {
                assert_eq!(*color, truth.color());
            }
        }
    }
}

#[test]
fn traced_pixels_equal_the_reference_bit_for_bit() {
    let frame = frame(&room(), View::default());
    for rule in ["none", "object", DEFAULT] {
        let decisions = decided(&frame, rule);
        for reuse in Reuse::ALL {
            let colors = compose(&frame, &decisions, reuse);
            let mut traced = 0;
            for (i, decision) in decisions.iter().enumerate() {
                if !decision.class.is_reused() {
                    traced += 1;
                    let truth = frame.right().samples[i].color();
                    assert_eq!(colors[i].map(f32::to_bits), truth.map(f32::to_bits));
                }
            }
            assert!(traced > 0);
        }
    }
}

#[test]
fn a_retested_hit_equals_the_traced_hit_unless_it_is_hidden() {
    let frame = frame(&room(), View::default());
    let decisions = decided(&frame, "triangles");
    let mut exact = 0;
    for (decision, truth) in decisions.iter().zip(&frame.right().samples) {
        if let Some(position) = decision.exact
            && decision.primitive == truth.primitive
        {
            exact += 1;
            let off = glam::Vec3::from(position).distance(truth.position.into());
            assert!(off < 1e-4, "{off}");
        }
    }
    assert!(exact > 2000, "{exact}");
}

#[test]
fn stricter_rules_reuse_less_and_make_fewer_errors() {
    let frame = frame(&room(), View::default());
    let of = |rule: &str| {
        let accuracy = count_errors(&frame, &decided(&frame, rule));
        let reused = accuracy.all_reused();
        (reused.pixels, reused.wrong_object)
    };
    let (none, loose, strict) = (of("none"), of("depth=0.5"), of("depth=0.02+silhouette"));
    assert!(none.0 >= loose.0 && loose.0 > strict.0);
    assert!(none.1 >= loose.1 && loose.1 >= strict.1);
    assert!(none.1 > 0, "the scene has occlusion to get wrong");
}

#[test]
fn a_near_surface_wider_in_the_right_eye_hides_surfaces_behind_it() {
    // A slanted rectangle in front of a wall that appears wider to the right eye.
    let mut scene = wall(9.0, [40.0, 40.0], 0.0, 1);
    let (near, far) = (-0.4, -1.6);
    let corners = [
        [-0.25, -1.0, near],
        [-0.05, -1.0, far],
        [-0.05, 1.0, far],
        [-0.25, 1.0, near],
    ];
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        scene.push(Placed {
            shape: Shape::Triangle([corners[a], corners[b], corners[c]]),
            object: 2,
            material: MIRROR,
        });
    }
    let frame = frame(&scene, View::default());
    let wrong = |rule: &str| {
        count_errors(&frame, &decided(&frame, rule))
            .all_reused()
            .wrong_object
    };
    assert!(
        wrong("row") < wrong("none"),
        "{} {}",
        wrong("row"),
        wrong("none")
    );
}

#[test]
fn mirrored_scenes_have_mirrored_reuse() {
    // Mirroring the scene and swapping the eyes must mirror the decisions.
    let scene = room();
    let mirrored: Vec<Placed> = scene
        .iter()
        .map(|placed| Placed {
            shape: match placed.shape {
                Shape::Triangle(v) => Shape::Triangle(v.map(|[x, y, z]| [-x, y, z])),
                sphere @ Shape::Sphere { .. } => sphere,
            },
            ..*placed
        })
        .collect();
    let view = View::default();
    let swapped = View {
        ipd_m: -view.ipd_m,
        ..view
    };
    let (a, b) = (frame(&scene, view), frame(&mirrored, swapped));
    let (da, db) = (decided(&a, "depth"), decided(&b, "depth"));
    let width = view.size_px[0] as usize;
    let same = (0..da.len())
        .filter(|i| {
            let j = i / width * width + width - 1 - i % width;
            da[*i].class.is_reused() == db[j].class.is_reused()
        })
        .count();
    // Hits on the line between two pixels are rounded the same way in both.
    assert!(same * 1000 >= da.len() * 985, "{same} of {}", da.len());
}

#[test]
fn a_material_with_holes_is_never_reused_under_opaque() {
    let mut scene = room();
    for placed in scene.iter_mut().filter(|p| p.object == 2) {
        placed.material = LEAF;
    }
    let frame = frame(&scene, View::default());
    let reuses_leaf = |rule: &str| {
        let reused = |d: &&Decision| d.class.is_reused();
        let decisions = decided(&frame, rule);
        let mut reused = decisions.iter().filter(reused);
        reused.any(|d| frame.left().samples[d.source as usize].material == LEAF)
    };
    assert!(reuses_leaf("none"));
    for rule in ["opaque", "opaque+triangles", DEFAULT] {
        assert!(!reuses_leaf(rule), "{rule}");
    }
}

#[test]
fn tests_against_whole_rows_find_all_candidates_of_parallel_eyes() {
    let frame = frame(&room(), View::default());
    let arrived = reproject(&frame);
    let width = frame.size_px[0] as usize;
    for (index, candidate) in arrived.candidates.iter().enumerate() {
        let row = index / width * width;
        let mut nearest: Option<(f32, usize)> = None;
        let mut arrivals = 0;
        for left in row..row + width {
            let projected = &arrived.projected[left];
            if projected.at_px[0].floor() == (index - row) as f32 {
                arrivals += 1;
                if nearest.is_none_or(|(depth, _)| projected.depth < depth) {
                    nearest = Some((projected.depth, left));
                }
            }
        }
        let source = (!candidate.is_missing()).then_some(candidate.source as usize);
        assert_eq!(
            source,
            nearest.map(|(_, left)| left),
            "right sample {index}"
        );
        assert_eq!(candidate.arrivals, arrivals, "right sample {index}");
    }
}

/// The room with a shadow over everything right of the middle.
fn half_in_shadow() -> Frame {
    let mut frame = frame(&room(), View::default());
    for eye in frame.eyes.iter_mut().map(std::sync::Arc::make_mut) {
        for (sample, work) in eye.samples.iter().zip(&mut eye.work) {
            let in_shadow = !sample.is_sky() && sample.position[0] > 0.05;
            work.shadows_blocked = u64::from(in_shadow);
        }
    }
    frame
}

#[test]
fn shadow_rays_are_traced_again_exactly_where_a_neighbours_outcome_differs() {
    let frame = half_in_shadow();
    let arrived = reproject(&frame);
    let decisions = decided(&frame, "triangles+shadow-edge");
    let outcome = |source: u32| frame.left().work[source as usize].shadow_outcomes();
    let [width, height] = frame.size_px.map(|s| s as i32);
    let mut retraced = 0;
    for (index, decision) in (0i32..).zip(&decisions) {
        if !decision.class.is_reused() {
            assert!(!decision.retraces_shadows);
            continue;
        }
        let (x, y) = (index % width, index / width);
        let expected = (-1..=1).any(|dy| {
            (-1..=1).any(|dx| {
                let (x, y) = (x + dx, y + dy);
                let inside = (0..width).contains(&x) && (0..height).contains(&y);
                let is_self = (dx, dy) == (0, 0);
                inside && !is_self && {
                    let beside = arrived.candidates[(y * width + x) as usize];
                    !beside.is_missing() && outcome(beside.source) != outcome(decision.source)
                }
            })
        });
        assert_eq!(decision.retraces_shadows, expected, "right sample {index}");
        retraced += usize::from(expected);
    }
    assert!(retraced > 0 && retraced < decisions.len() / 3, "{retraced}");
}

#[test]
fn reused_shadow_outcomes_are_wrong_only_where_they_differ() {
    let frame = half_in_shadow();
    let wrong = |rule: &str| {
        let decisions = decided(&frame, rule);
        let colors = compose(&frame, &decisions, Reuse::Shadow);
        let truth = &frame.right().samples;
        let of = |(i, color): (usize, &[f32; 3])| {
            let decision = &decisions[i];
            let is_true_hit = decision.exact.is_some() && decision.primitive == truth[i].primitive;
            if !decision.class.is_reused() || !is_true_hit {
                return false;
            }
            let left = frame.left().work[decision.source as usize].shadow_outcomes();
            let differs = left != frame.right().work[i].shadow_outcomes();
            let is_wrong = *color != truth[i].color();
            assert!(differs || !is_wrong, "right sample {i}");
            is_wrong
        };
        colors.iter().enumerate().filter(|&at| of(at)).count()
    };
    let (plain, with_edges) = (wrong("triangles"), wrong("triangles+shadow-edge"));
    assert!(with_edges < plain, "{with_edges} of {plain}");
}

#[test]
fn gap_rejects_the_arrivals_before_a_hole_and_no_others() {
    let frame = frame(&room(), View::default());
    let arrived = reproject(&frame);
    let plain = decided(&frame, "none");
    let width = frame.size_px[0] as usize;
    let mut rejected = 0;
    for (index, decision) in decided(&frame, "gap").iter().enumerate() {
        let has_next = index % width + 1 < width;
        let before_hole = has_next && arrived.candidates[index + 1].is_missing();
        let expected = match (arrived.candidates[index].is_missing(), before_hole) {
            (true, _) => PixelClass::Missing,
            (false, true) => PixelClass::Bad,
            (false, false) => plain[index].class,
        };
        assert_eq!(decision.class, expected, "pixel {index}");
        rejected += usize::from(expected == PixelClass::Bad);
    }
    assert!(rejected > 10, "{rejected}");
}

#[test]
fn no_seen_error_is_left_by_the_oracle_and_nothing_is_charged_for_it() {
    let frame = frame(&room(), View::default());
    let rule: Rule = "oracle=0".parse().expect("a rule");
    assert_eq!(
        rule.reads(),
        "none".parse::<Rule>().expect("a rule").reads()
    );
    let truth = &frame.right().samples;
    let mut bad = 0;
    for (decision, truth) in decided(&frame, "oracle=0").iter().zip(truth) {
        if decision.class.is_reused() {
            let left = &frame.left().samples[decision.source as usize];
            let is_same = left.primitive == truth.primitive;
            assert!(is_same || left.color() == truth.color());
        }
        bad += usize::from(decision.class == PixelClass::Bad);
    }
    let rejected_by_default = decided(&frame, DEFAULT);
    let rejected = rejected_by_default
        .iter()
        .filter(|d| d.class == PixelClass::Bad);
    assert!(bad > 0 && bad < rejected.count());
}
