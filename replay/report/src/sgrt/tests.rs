use super::*;
use crate::table::Style;
use sgrt::compose::Reuse;
use sgrt::config::SgrtConfig;
use sgrt::loaded::LoadedTrace;
use sgrt::result::{Config, SCHEMA};
use sgrt::rules::Rule;
use sgrt::testing::{View, globe, trace, wall};
use sgrt::variations::curve_rules;
use sim::model_version::RAY_MODEL_VERSION;
use sim::paper::sgrt::PaperValues;
use sim::result::TraceId;

fn entry() -> Entry {
    entry_of(View::default())
}

fn entry_of(view: View) -> Entry {
    let mut scene = wall(4.0, [30.0, 30.0], 0.0, 1);
    scene.extend(globe([0.1, 0.0, -1.5], 0.5, 2));
    let source = trace(&scene, view);
    let loaded = LoadedTrace::load(&source).expect("loads");
    let model = SgrtConfig::default();
    let rule: Rule = sgrt::DEFAULT_RULE.parse().expect("a rule");
    let run = |rule: &Rule| loaded.run(rule, Reuse::Primary, &model).expect("runs");
    let (ours, plain) = (run(&rule), run(&Rule::default()));
    let png = image_error::png::encode(&ours.picture).expect("a picture");
    Entry {
        report: Report {
            schema: SCHEMA.to_owned(),
            tool: "replay test".to_owned(),
            model_version: RAY_MODEL_VERSION,
            trace: TraceId {
                scene: "scenes/teapot.obj".to_owned(),
                checksum: "0badcafe".to_owned(),
                ..TraceId::default()
            },
            scene_triangles: 1,
            eye_size_px: [72, 40],
            rows: loaded.rows().summary,
            paper: Some(PaperValues {
                scene: "Teapot".to_owned(),
                relative_performance: 1.64,
                relative_energy: 0.96,
                frames_per_second: 131.3,
            }),
            curve: loaded
                .curve(&curve_rules()[..3], &Reuse::ALL, &model)
                .expect("runs"),
            sensitivity: loaded.sensitivity(&ours, &model).expect("runs"),
            config: Config {
                rule,
                reuse: Reuse::Primary,
                cache_misses: "rates".to_owned(),
                timing: Default::default(),
                model,
                rays: Vec::new(),
                tiles: None,
            },
            result: ours.outcome,
            plain: plain.outcome,
            hierarchy_update: None,
        },
        pictures: Some(Thumbnails {
            left: png.clone(),
            bad: png.clone(),
            flip: png.clone(),
            plain_bad: png.clone(),
            plain_flip: png,
        }),
    }
}

#[test]
fn the_page_shows_both_charts_the_pictures_and_the_papers_values() {
    let page = page(&[entry(), entry()]).expect("a page");
    for needle in [
        "Relative performance",
        "Relative energy",
        "91.54",
        "data:image/png;base64,",
        "Cycles against error",
        "Sensitivity",
        "tni.units",
        "dram_pj_per_byte",
    ] {
        assert!(page.contains(needle), "{needle}");
    }
}

#[test]
fn csv_has_as_many_cells_in_each_row_as_in_its_heading() {
    let text = tables::rows(&[entry()]).csv();
    let widths: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
    assert_eq!(widths.len(), 3);
    assert!(widths.iter().all(|w| *w == widths[0]), "{widths:?}");
}

#[test]
fn json_holds_the_agreed_fields() {
    let json = serde_json::to_value(entry().report).expect("json");
    assert_eq!(json["schema"], "replay.reproject/3");
    for field in [
        "reuse_pct",
        "wrong_object_pct",
        "relative_performance",
        "relative_energy",
        "tni_cycles",
        "srp_cycles",
        "flip_mean",
        "psnr_db",
    ] {
        assert!(json["result"][field].is_number(), "{field}");
    }
    assert_eq!(json["config"]["rule"], sgrt::DEFAULT_RULE);
}

#[test]
fn eyes_unsuitable_for_the_row_test_are_reported_in_every_output() {
    let canted = entry_of(View {
        cant_deg: 10.0,
        ..View::default()
    });
    let needle = "the paper's row test does not apply";
    assert!(details(std::slice::from_ref(&canted), Style::Terminal).contains(needle));
    let html = page(std::slice::from_ref(&canted)).expect("a page");
    assert!(html.contains("row test does not apply"));
    let json = serde_json::to_value(&canted.report).expect("json");
    assert_eq!(json["rows"]["row_test_applies"], false);
    assert!(
        tables::rows(&[canted])
            .csv()
            .lines()
            .nth(1)
            .expect("a row")
            .ends_with("false")
    );

    assert!(!details(&[entry()], Style::Terminal).contains(needle));
}

#[test]
fn the_terminal_tables_name_scene_and_rule() {
    let entries = vec![entry()];
    let report = ReprojectReport { entries };
    for with_details in [false, true] {
        let text = report.terminal(Style::Terminal, with_details);
        assert!(
            text.contains("teapot") && text.contains(sgrt::DEFAULT_RULE),
            "{text}"
        );
        assert!(text.ends_with('\n') && !text.ends_with("\n\n"));
    }
}
