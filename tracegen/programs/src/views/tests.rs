use super::*;
use parallax_layer::spool::{DepthInfo, Event, Span, TextureInfo};

const SIZE: u32 = 64;

fn target(image: u32) -> ViewInfo {
    ViewInfo {
        image,
        format: 37,
        kind: 1,
        levels: [0, 1],
        layers: [0, 1],
        min_lod_256ths: 0,
    }
}

/// Builds a session of one frame.
#[derive(Default)]
struct Build {
    session: Session,
    draws: Vec<[u32; 2]>,
    weights: Vec<u64>,
    passes: u32,
}

impl Build {
    /// Adds a render pass with a colour and a depth target.
    fn pass(&mut self, color: Option<u32>, depth: Option<u32>) -> u32 {
        self.multiview(color, depth, 0)
    }

    fn multiview(&mut self, color: Option<u32>, depth: Option<u32>, view_mask: u32) -> u32 {
        let pass = self.passes;
        self.passes += 1;
        self.session.take(Event::Pass(PassInfo {
            pass,
            colors: color.map(target).into_iter().collect(),
            depth: depth.map(target),
            area: [0, 0, SIZE as i32, SIZE as i32],
            view_mask,
            clears: true,
        }));
        pass
    }

    /// Adds a draw with a pipeline into a range of columns.
    fn draw(&mut self, pass: u32, pipeline: u32, columns: [u32; 2], weight: u64) {
        self.draw_with(pass, pipeline, columns, weight, |_| ());
    }

    fn draw_with(
        &mut self,
        pass: u32,
        pipeline: u32,
        [left, width]: [u32; 2],
        weight: u64,
        change: impl FnOnce(&mut DrawInfo),
    ) {
        let draw = self.draws.len() as u32;
        let tests = self
            .session
            .pass(pass)
            .is_some_and(|pass| pass.depth.is_some());
        let mut info = DrawInfo {
            draw,
            pipeline,
            viewport: [left as f32, 0.0, width as f32, SIZE as f32],
            color_masks: vec![15],
            depth: DepthInfo {
                tests,
                ..DepthInfo::default()
            },
            vertices: 3,
            instances: 1,
            ..DrawInfo::default()
        };
        change(&mut info);
        self.session.take(Event::Draw(info));
        self.draws.push([draw, pass]);
        self.weights.push(weight);
    }

    fn find(&mut self, wanted: &Wanted) -> Result<Views, ViewsError> {
        self.session.take(Event::Submit {
            frame: 0,
            draws: std::mem::take(&mut self.draws),
            records: Span::default(),
            lost_bytes: 0,
            occlusion: Vec::new(),
            frame_by_waits: None,
            dispatches: Vec::new(),
        });
        let frame = self.session.frames[&0].clone();
        find(&self.session, &frame, &self.weights, wanted)
    }
}

fn reads(image: u32) -> impl FnOnce(&mut DrawInfo) {
    move |draw| {
        draw.textures.push(TextureInfo {
            set: 0,
            binding: 0,
            element: 0,
            view: Some(target(image)),
            sampler: None,
        });
    }
}

#[test]
fn halves_are_eyes_even_if_draws_without_depth_cover_more() {
    let mut build = Build::default();
    let composed = build.pass(Some(9), None);
    build.draw(composed, 5, [0, 64], 9000);
    let eyes = build.pass(Some(1), Some(2));
    for left in [0, 32] {
        build.draw(eyes, 1, [left, 32], 300);
        build.draw(eyes, 2, [left, 32], 100);
    }
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(views.rule, Rule::Halves);
    let origins = views.eyes.map(|eye| eye.origin);
    assert_eq!(origins, [[0, 0], [32, 0]]);
    let other = Role::Other(Other::Elsewhere);
    assert_eq!(views.roles, [other, LEFT, LEFT, RIGHT, RIGHT]);
}

#[test]
fn the_first_of_two_targets_is_the_left_eye() {
    let mut build = Build::default();
    for color in [7, 3] {
        let pass = build.pass(Some(color), Some(2));
        build.draw(pass, 1, [0, 64], if color == 3 { 500 } else { 400 });
    }
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(
        (views.rule, &views.roles[..]),
        (Rule::Targets, &[LEFT, RIGHT][..])
    );
}

#[test]
fn multiview_eyes_are_the_bits_of_the_view_mask() {
    let mut build = Build::default();
    let pass = build.multiview(Some(1), Some(2), 0b1010);
    build.draw(pass, 1, [0, 64], 500);
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!((views.rule, views.layers), (Rule::Multiview, [1, 3]));
    assert_eq!(views.roles, [Role::Multiview]);
}

#[test]
fn eyes_in_one_target_are_identified_by_channels_or_equal_sequences() {
    let mut build = Build::default();
    for mask in [1, 6] {
        let pass = build.pass(Some(1), Some(2));
        build.draw_with(pass, 1, [0, 64], 500, |draw| draw.color_masks = vec![mask]);
    }
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(
        (views.rule, &views.roles[..]),
        (Rule::Channels, &[LEFT, RIGHT][..])
    );
    let mut build = Build::default();
    for _ in 0..2 {
        let pass = build.pass(Some(1), Some(2));
        for pipeline in 0..3 {
            build.draw(pass, pipeline, [0, 64], 500);
        }
    }
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(views.rule, Rule::Twice);
    assert_eq!(views.roles, [LEFT, LEFT, LEFT, RIGHT, RIGHT, RIGHT]);
}

#[test]
fn a_single_picture_is_accepted_only_by_the_mono_rule() {
    let mono = || {
        let mut build = Build::default();
        let pass = build.pass(Some(1), Some(2));
        build.draw(pass, 1, [0, 64], 500);
        build
    };
    assert_eq!(mono().find(&Wanted::First), Err(ViewsError::NoStereo(0)));
    let halves = mono().find(&Wanted::Rule(Rule::Halves)).unwrap_err();
    assert!(halves.to_string().contains("by the rule viewport halves"));
    let views = mono().find(&Wanted::Rule(Rule::Mono)).unwrap();
    assert_eq!(views.roles, [Role::Seen(None)]);
    let nothing = Build::default().find(&Wanted::First);
    assert_eq!(nothing, Err(ViewsError::Empty(0)));
}

#[test]
fn draws_outside_the_eyes_are_classified_by_their_readers() {
    let mut build = Build::default();
    let shadow = build.pass(None, Some(10));
    build.draw(shadow, 8, [0, 64], 700);
    let mirror = build.pass(Some(11), Some(12));
    build.draw(mirror, 7, [0, 16], 50);
    let prepass = build.pass(None, Some(2));
    build.draw(prepass, 6, [32, 32], 90);
    let eyes = build.pass(Some(1), Some(2));
    for left in [0, 32] {
        build.draw_with(eyes, 1, [left, 32], 300, reads(11));
    }
    let bloom = build.pass(Some(13), None);
    build.draw_with(bloom, 5, [0, 64], 4000, reads(1));
    let roles = build.find(&Wanted::First).unwrap().roles;
    let other = |of| Role::Other(of);
    assert_eq!(
        roles,
        [
            Role::Shadow,
            other(Other::Reflection),
            RIGHT,
            LEFT,
            RIGHT,
            other(Other::PostProcessing),
        ]
    );
}

#[test]
fn a_file_of_rules_assigns_eyes_where_no_rule_fits() {
    let build = || {
        let mut build = Build::default();
        for color in [1, 2, 3] {
            let pass = build.pass(Some(color), Some(9));
            build.draw(pass, color, [0, 32], 500);
        }
        build
    };
    let text = "
        [[rule]]
        pass = 1
        viewport = [0, 0, 32, 64]
        shows = \"right\"
        [[rule]]
        pass = 2
        shows = \"left\"
        [[rule]]
        size = [64, 64]
        shows = \"ignored\"";
    let file = RuleFile::parse("rules.toml", text).unwrap();
    let views = build().find(&Wanted::File(file)).unwrap();
    let ignored = Role::Other(Other::Ignored);
    assert_eq!(
        (views.rule, &views.roles[..]),
        (Rule::File, &[ignored, RIGHT, LEFT][..])
    );
    let other = "[[rule]]\nformat = 1\nshows = \"both\"";
    let file = RuleFile::parse("rules.toml", other).unwrap();
    let text = build().find(&Wanted::File(file)).unwrap_err().to_string();
    assert!(text.contains("by the rule file"), "{text}");
}

#[test]
fn invalid_files_of_rules_are_refused_with_name_and_place() {
    let cases = [
        ("[[rule]]\nshows = \"up\"", "line 2"),
        ("[[rule]]\nshown = \"left\"", "unknown field"),
        (
            "[[rule]]\nchannels = \"rx\"\nshows = \"left\"",
            "found \"rx\"",
        ),
        ("[[rule]]\nshows = \"shadow\"", "expected a rule that shows"),
        ("rule = 3", "rules.toml"),
    ];
    for (text, expected) in cases {
        let error = RuleFile::parse("rules.toml", text).unwrap_err().to_string();
        assert!(error.starts_with("rules.toml") || error.contains("expected a rule"));
        assert!(error.contains(expected), "{error}");
    }
}
