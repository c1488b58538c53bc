use super::*;
use spool::openxr::ShownEye;
use spool::{DepthInfo, Event, Span, TextureInfo};

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
        let draw = self.weights.len() as u32;
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
                writes: tests,
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

    /// Submits the draws so far as a frame.
    fn submit(&mut self, frame: u32) {
        self.session.take(Event::Submit {
            frame,
            draws: std::mem::take(&mut self.draws),
            records: Span::default(),
            lost_bytes: 0,
            occlusion: Vec::new(),
            frame_by_waits: None,
            dispatches: Vec::new(),
        });
    }

    /// Copies between layers of images.
    fn copy_layers(&mut self, layers: &[[u32; 4]]) {
        self.session.take(Event::Copies {
            frame: 0,
            pairs: Vec::new(),
            layers: layers.to_vec(),
            probed: Vec::new(),
        });
    }

    /// Notes what an OpenXR program shows: image, layer, left edge and width of each eye.
    fn show(&mut self, eyes: [[u32; 4]; 2]) {
        let eyes = eyes.map(|[image, layer, left, width]| ShownEye {
            image,
            layer,
            rect: [left as i32, 0, width as i32, SIZE as i32],
            orientation: [0.0, 0.0, 0.0, 1.0],
            position_m: [0.0; 3],
            angles: [0.0; 4],
            planes_m: None,
        });
        self.session.take(Event::Shown { frame: 0, eyes });
    }

    fn copy(&mut self, pairs: &[[u32; 2]], probed: &[u32]) {
        self.session.take(Event::Copies {
            frame: 0,
            pairs: pairs.to_vec(),
            layers: Vec::new(),
            probed: probed.to_vec(),
        });
    }

    /// Identifies the eyes of frame 0.
    fn find(&mut self, wanted: &Wanted) -> Result<Views, ViewsError> {
        if !self.draws.is_empty() || self.session.frames.is_empty() {
            self.submit(0);
        }
        let frame = self.session.frames.get(&0).cloned().unwrap_or_default();
        find(&self.session, &frame, &self.weights, wanted)
    }

    fn roles(&mut self) -> Vec<Role> {
        self.find(&Wanted::First).unwrap().roles
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
    build.draw_with(mirror, 7, [0, 16], 50, reads(10));
    let prepass = build.pass(None, Some(2));
    build.draw(prepass, 6, [32, 32], 90);
    let eyes = build.pass(Some(1), Some(2));
    for left in [0, 32] {
        build.draw_with(eyes, 1, [left, 32], 300, reads(11));
    }
    let bloom = build.pass(Some(13), None);
    build.draw_with(bloom, 5, [0, 64], 4000, reads(1));
    let other = |of| Role::Other(of);
    assert_eq!(
        build.roles(),
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

/// A mask: a draw that writes only stencil.
fn stencil(draw: &mut DrawInfo) {
    draw.color_masks = vec![0];
    draw.depth = DepthInfo {
        stencil: true,
        ..DepthInfo::default()
    };
}

/// The proxy of an occlusion query: a draw that tests depth and writes nothing.
fn proxy(draw: &mut DrawInfo) {
    draw.color_masks = vec![0];
    draw.depth.writes = false;
}

/// Eyes in the halves of image 1 with depth 2.
fn eyes(build: &mut Build, change: impl Fn(&mut DrawInfo)) {
    let pass = build.pass(Some(1), Some(2));
    for left in [0, 32] {
        build.draw_with(pass, 1, [left, 32], 300, &change);
    }
}

#[test]
fn masks_and_occlusion_proxies_are_no_shadow_maps() {
    let mask = Role::Other(Other::Mask);
    for change in [stencil, proxy] {
        let mut build = Build::default();
        // Into a target that nobody reads, and into one whose colours the eyes read.
        for color in [20, 22] {
            let target = build.pass(Some(color), Some(21));
            build.draw_with(target, 9, [0, 64], 700, change);
        }
        // Over both eyes at once, and for each eye.
        let pass = build.pass(Some(1), Some(2));
        for columns in [[0, 64], [0, 32], [32, 32]] {
            build.draw_with(pass, 9, columns, 700, change);
        }
        eyes(&mut build, |draw| reads(22)(draw));
        let expected = [mask, mask, mask, mask, mask, LEFT, RIGHT];
        assert_eq!(build.roles(), expected);
    }
    // A mask that discards samples textures for the eye in whose viewport it is.
    let mut build = Build::default();
    let pass = build.pass(Some(1), Some(2));
    for columns in [[0, 64], [32, 32]] {
        build.draw_with(pass, 9, columns, 700, |draw| {
            stencil(draw);
            draw.twice = true;
        });
    }
    eyes(&mut build, |_| ());
    assert_eq!(build.roles(), [mask, RIGHT, LEFT, RIGHT]);
}

#[test]
fn a_portal_draws_the_world_behind_its_mask_into_the_eyes() {
    let mut build = Build::default();
    let pass = build.pass(Some(1), Some(2));
    for left in [0, 32] {
        build.draw(pass, 1, [left, 32], 300);
        build.draw_with(pass, 2, [left, 32], 100, stencil);
        build.draw_with(pass, 3, [left, 32], 90, |draw| draw.depth.stencil = true);
    }
    let mask = Role::Other(Other::Mask);
    assert_eq!(build.roles(), [LEFT, mask, LEFT, RIGHT, mask, RIGHT]);
}

#[test]
fn depth_is_a_shadow_map_only_if_it_is_read_for_an_eye() {
    let mut build = Build::default();
    // Depth that no draw reads, and depth that only processes the finished eyes.
    for depth in [30, 31] {
        let pass = build.pass(None, Some(depth));
        build.draw(pass, 8, [0, 64], 700);
    }
    // A shadow map beside a colour target that is not read, and a mirror whose depth is read as well.
    let beside = build.pass(Some(32), Some(33));
    build.draw(beside, 8, [0, 16], 7);
    let mirror = build.pass(Some(34), Some(35));
    build.draw(mirror, 8, [0, 16], 7);
    // A shadow map that is read through a copy.
    let copied = build.pass(None, Some(36));
    build.draw(copied, 8, [0, 16], 7);
    build.copy(&[[36, 37]], &[]);
    eyes(&mut build, |draw| {
        for image in [33, 34, 35, 37] {
            reads(image)(draw);
        }
    });
    // A shadow map that the eyes of the next frame read is in the same image.
    let after = build.pass(None, Some(37));
    build.draw(after, 8, [0, 16], 7);
    let bloom = build.pass(Some(13), None);
    build.draw_with(bloom, 5, [0, 64], 40, |draw| {
        reads(1)(draw);
        reads(31)(draw);
    });
    let unread = Role::Other(Other::Depth);
    assert_eq!(
        build.roles(),
        [
            unread,
            unread,
            Role::Shadow,
            Role::Other(Other::Reflection),
            Role::Shadow,
            LEFT,
            RIGHT,
            Role::Shadow,
            Role::Other(Other::PostProcessing),
        ]
    );
}

#[test]
fn a_shadow_map_may_be_read_in_the_next_frame() {
    let mut build = Build::default();
    for (frame, [drawn, read]) in [[40, 41], [41, 40]].into_iter().enumerate() {
        eyes(&mut build, |draw| reads(read)(draw));
        let shadow = build.pass(None, Some(drawn));
        build.draw(shadow, 8, [0, 64], 700);
        build.submit(frame as u32);
    }
    assert_eq!(build.roles(), [LEFT, RIGHT, Role::Shadow]);
}

#[test]
fn a_depth_pre_pass_belongs_to_the_eye_that_follows() {
    let mut build = Build::default();
    for _ in 0..2 {
        let prepass = build.pass(None, Some(2));
        build.draw(prepass, 6, [0, 64], 90);
        let pass = build.pass(Some(1), Some(2));
        for pipeline in 0..3 {
            build.draw(pass, pipeline, [0, 64], 500);
        }
    }
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(views.rule, Rule::Twice);
    let eye = |eye| [eye; 4];
    assert_eq!(views.roles, [eye(LEFT), eye(RIGHT)].concat());
}

/// A browser with a page that draws its eyes without depth into canvas 1 of 64 pixels.
fn page() -> Build {
    let mut build = Build::default();
    build.session.is_page = true;
    // Chromium draws two tiles of its window, with stencil.
    for tile in [50, 51] {
        let pass = build.pass(Some(tile), Some(52));
        build.draw_with(pass, 20, [0, 64], 600, stencil);
        build.draw_with(pass, 21, [0, 64], 5000, |draw| draw.depth.tests = false);
    }
    build
}

#[test]
fn the_browsers_draws_are_identified_by_images_and_affect_no_eye() {
    let mut build = page();
    let canvas = build.pass(Some(1), None);
    for left in [0, 32] {
        build.draw(canvas, 1, [left, 32], 300);
    }
    // The window shows the canvas and the tiles.
    let window = build.pass(Some(60), None);
    for image in [1, 50, 51] {
        build.draw_with(window, 22, [0, 64], 9000, reads(image));
    }
    build.copy(&[], &[1]);
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(views.rule, Rule::Halves);
    let browser = [Role::Other(Other::Browser); 4];
    let expected = [&browser[..], &[LEFT, RIGHT], &browser[..3]].concat();
    assert_eq!(views.roles, expected);
}

#[test]
fn eyes_of_a_page_may_be_in_an_image_that_its_canvas_shows() {
    let mut build = page();
    // With several samples per pixel, and with a pass that processes the picture.
    let scene = build.pass(Some(2), Some(3));
    for left in [0, 32] {
        build.draw(scene, 1, [left, 32], 300);
    }
    let canvas = build.pass(Some(5), None);
    build.draw_with(canvas, 2, [0, 64], 900, reads(4));
    let window = build.pass(Some(60), None);
    build.draw_with(window, 22, [0, 64], 9000, reads(1));
    build.copy(&[[2, 4], [5, 1]], &[1]);
    let browser = Role::Other(Other::Browser);
    let post = Role::Other(Other::PostProcessing);
    let expected = [&[browser; 4][..], &[LEFT, RIGHT, post, browser]].concat();
    assert_eq!(build.roles(), expected);
}

#[test]
fn a_page_without_draws_into_its_canvas_has_drawn_nothing() {
    let mut build = page();
    build.copy(&[], &[1]);
    let error = build.find(&Wanted::First).unwrap_err();
    assert_eq!(error, ViewsError::EmptyPage(0));
}

#[test]
fn a_pass_that_combines_two_targets_is_no_reason_against_them() {
    let mut build = Build::default();
    for color in [1, 2] {
        let pass = build.pass(Some(color), Some(3));
        build.draw(pass, 1, [0, 64], 100);
    }
    let combined = build.pass(Some(4), Some(5));
    build.draw_with(combined, 2, [0, 64], 4000, |draw| {
        reads(1)(draw);
        reads(2)(draw);
    });
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(views.rule, Rule::Targets);
    assert_eq!(
        views.roles,
        [LEFT, RIGHT, Role::Other(Other::PostProcessing)]
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

#[test]
fn shown_images_are_followed_back_over_full_screen_passes_and_copies() {
    // Each eye is drawn into the same target, which a pass without depth test reads into the shown image.
    let mut build = Build::default();
    for image in [8, 9] {
        let scene = build.pass(Some(1), Some(2));
        build.draw(scene, 1, [0, 64], 500);
        let lens = build.pass(Some(image), None);
        build.draw_with(lens, 7, [0, 64], 4096, reads(1));
    }
    let mirror = build.pass(Some(5), None);
    build.draw_with(mirror, 8, [0, 64], 4096, reads(8));
    build.show([[8, 0, 0, 64], [9, 0, 0, 64]]);
    let views = build.find(&Wanted::First).unwrap();
    let post = Role::Other(Other::PostProcessing);
    assert_eq!(views.rule, Rule::Shown);
    assert_eq!(views.roles, [LEFT, post, RIGHT, post, post]);

    // The eyes are shown in another order than that in which they are drawn, and copied layer by layer.
    let mut build = Build::default();
    for color in [3, 4] {
        let pass = build.pass(Some(color), None);
        build.draw(pass, 1, [0, 64], 500);
    }
    build.copy_layers(&[[3, 0, 9, 1], [4, 0, 9, 0]]);
    build.show([[9, 0, 0, 64], [9, 1, 0, 64]]);
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!((views.rule, views.roles), (Rule::Shown, vec![RIGHT, LEFT]));
}

#[test]
fn shown_rectangles_and_views_of_a_multiview_pass_are_the_eyes() {
    let mut build = Build::default();
    let pass = build.pass(Some(1), Some(2));
    for left in [32, 0] {
        build.draw(pass, 1, [left, 32], 300);
    }
    build.session.take(Event::Image(spool::ImageInfo {
        image: 1,
        format: 37,
        size: [SIZE, SIZE, 1],
        levels: 1,
        layers: 1,
        samples: 1,
        presented: false,
    }));
    // The right half is shown to the left eye.
    build.show([[1, 0, 32, 32], [1, 0, 0, 32]]);
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!(
        (views.rule, &views.roles[..]),
        (Rule::Shown, &[LEFT, RIGHT][..])
    );
    assert_eq!(views.eyes.map(|eye| eye.origin), [[32, 0], [0, 0]]);

    let mut build = Build::default();
    let pass = build.multiview(Some(1), Some(2), 0b11);
    build.draw(pass, 1, [0, 64], 500);
    build.show([[1, 1, 0, 64], [1, 0, 0, 64]]);
    let views = build.find(&Wanted::First).unwrap();
    assert_eq!((views.rule, views.layers), (Rule::Shown, [1, 0]));
    assert_eq!(views.roles, [Role::Multiview]);
}
