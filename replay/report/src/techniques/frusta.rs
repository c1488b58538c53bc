//! A top view of both eyes' frusta, the cones of their lenses, the superfrustum and the splits of far fields.

use crate::plots::escape;
use crate::theme;
use formats::view::{Hmd, Lens};
use plotters::prelude::RGBColor;
use sim::palette::{self, Rgb};
use std::fmt::Write;

/// Edge of each of the two drawings, px.
const PANEL_PX: f64 = 430.0;
const GAP_PX: f64 = 46.0;
const TOP_PX: f64 = 84.0;
const BOTTOM_PX: f64 = 46.0;
/// Least distance ahead that the far drawing shows, metres.
const FAR_M: f64 = 10.0;
/// Height of a row of labels, px.
const LINE_PX: f64 = 15.0;

/// Input of the drawing.
pub(super) struct Frusta<'a> {
    /// Heading.
    pub title: String,
    /// The display.
    pub hmd: &'a Hmd,
    /// The visible areas of the lenses.
    pub lens: [Lens; 2],
    /// Split distances of far fields in metres, by the technique's name.
    pub splits: Vec<(String, f64)>,
}

/// An edge seen from above: its origin, x to the right and z ahead, and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edge {
    from: [f64; 2],
    /// Angle to the right of straight ahead, radians.
    angle: f64,
}

impl Edge {
    fn direction(&self) -> [f64; 2] {
        [self.angle.sin(), self.angle.cos()]
    }
}

impl Frusta<'_> {
    /// Left and right edge of eye 0 (left) or 1 (right) between two tangents to its own axis.
    fn edges(&self, eye: usize, left: f64, right: f64) -> [Edge; 2] {
        let side = if eye == 0 { -1.0 } else { 1.0 };
        let from = [side * f64::from(self.hmd.ipd_m) / 2.0, 0.0];
        let turn = side * f64::from(self.hmd.cant_deg).to_radians();
        [-left, right].map(|tangent| Edge {
            from,
            angle: tangent.atan() + turn,
        })
    }

    fn frustum(&self, eye: usize) -> [Edge; 2] {
        let fov = &self.hmd.fov[eye];
        self.edges(eye, fov.left.into(), fov.right.into())
    }

    fn cone(&self, eye: usize) -> [Edge; 2] {
        let Lens { center, radius } = self.lens[eye];
        let [center, radius] = [center[0], radius].map(f64::from);
        self.edges(eye, radius - center, radius + center)
    }

    /// Intersection of the outermost edges behind the eyes; `None` if they do not meet there.
    fn apex(&self) -> Option<[f64; 2]> {
        let (left, right) = (self.frustum(0)[0], self.frustum(1)[1]);
        let ([ax, az], [bx, bz]) = (left.direction(), right.direction());
        let turn = ax * bz - az * bx;
        // With 180 degrees or more together, the edges do not meet behind the eyes.
        if left.angle - right.angle >= 0.0 || right.angle - left.angle >= std::f64::consts::PI {
            return None;
        }
        let across = [right.from[0] - left.from[0], right.from[1] - left.from[1]];
        let along = (across[0] * bz - across[1] * bx) / turn;
        Some([left.from[0] + along * ax, left.from[1] + along * az])
    }

    /// The drawing as SVG: one panel near the eyes in millimetres, one up to the splits in metres.
    pub fn svg(&self) -> String {
        let width = 2.0 * PANEL_PX + 3.0 * GAP_PX;
        let height = TOP_PX + PANEL_PX + BOTTOM_PX;
        let mut out = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="{}">"#,
            theme::FONT
        );
        label(
            &mut out,
            [GAP_PX, 22.0],
            "start",
            theme::TITLE_PX,
            INK,
            &self.title,
        );
        self.legend(&mut out);
        let ipd = f64::from(self.hmd.ipd_m).max(1e-3);
        // The eyes take a third of the near drawing's width.
        let near = TopView {
            left_px: GAP_PX,
            low: [-1.5 * ipd, -1.2 * ipd],
            span: 3.0 * ipd,
        };
        let farthest = self
            .splits
            .iter()
            .map(|(_, split)| *split)
            .fold(0.0, f64::max);
        let ahead = if farthest > 0.0 {
            1.25 * farthest
        } else {
            FAR_M
        };
        let far = TopView {
            left_px: 2.0 * GAP_PX + PANEL_PX,
            low: [-0.5 * ahead, -0.04 * ahead],
            span: ahead,
        };
        self.draw(&mut out, &near, "between the eyes, mm", 1e3);
        self.draw(&mut out, &far, "ahead, m", 1.0);
        self.draw_splits(&mut out, &far);
        out + "</svg>"
    }

    fn legend(&self, out: &mut String) {
        let apex = match self.apex() {
            Some([_, z]) => format!("superfrustum, apex {:.1} mm behind the eyes", -1e3 * z),
            None => "no superfrustum: 180\u{b0} or more together".to_owned(),
        };
        let entries = [
            (LEFT, "", "left eye's frustum".to_owned()),
            (RIGHT, "", "right eye's frustum".to_owned()),
            (MUTED, "4 3", "cones of the lenses".to_owned()),
            (SUPER, "8 3", apex),
        ];
        let mut x = GAP_PX;
        for (color, dashes, name) in entries {
            let y = 46.0;
            stroke(out, [[x, y], [x + 22.0, y]], color, dashes);
            label(
                out,
                [x + 28.0, y + 4.0],
                "start",
                theme::LABEL_PX,
                INK,
                &name,
            );
            x += 28.0 + theme::text_width_px(&name, theme::LABEL_PX) + 24.0;
        }
    }

    fn draw(&self, out: &mut String, panel: &TopView, axis: &str, scale: f64) {
        panel.frame(out, axis, scale);
        let id = format!("panel-{}", panel.left_px as u32);
        let _ = write!(
            out,
            r#"<clipPath id="{id}"><rect x="{}" y="{TOP_PX}" width="{PANEL_PX}" height="{PANEL_PX}"/></clipPath><g clip-path="url(#{id})">"#,
            panel.left_px
        );
        // Longer than any diagonal of the drawing.
        let reach = 3.0 * panel.span;
        for (eye, color) in [(0, LEFT), (1, RIGHT)] {
            let frustum = self.frustum(eye).map(|edge| panel.ray(edge, reach));
            let [[tip, a], [_, b]] = frustum;
            let _ = write!(
                out,
                r#"<path d="M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z" fill="{}" fill-opacity="0.10"/>"#,
                tip[0],
                tip[1],
                a[0],
                a[1],
                b[0],
                b[1],
                hex(color)
            );
            for line in self.cone(eye).map(|edge| panel.ray(edge, reach)) {
                stroke(out, line, MUTED, "4 3");
            }
            for line in frustum {
                stroke(out, line, color, "");
            }
        }
        if let Some(apex) = self.apex() {
            for edge in [self.frustum(0)[0], self.frustum(1)[1]] {
                stroke(
                    out,
                    panel.ray(Edge { from: apex, ..edge }, reach),
                    SUPER,
                    "8 3",
                );
            }
        }
        for eye in 0..2 {
            let [x, y] = panel.px(self.frustum(eye)[0].from);
            let _ = write!(
                out,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="3" fill="{}"/>"#,
                hex(INK)
            );
        }
        *out += "</g>";
    }

    /// Draws each split as a horizontal line with its label above, without overlapping labels.
    fn draw_splits(&self, out: &mut String, panel: &TopView) {
        let mut splits: Vec<(f64, Vec<&str>)> = Vec::new();
        for (name, split) in &self.splits {
            // Splits with the same label text become one line.
            match splits
                .iter_mut()
                .find(|(known, _)| (known - split).abs() < 0.005)
            {
                Some((_, names)) => names.push(name),
                None => splits.push((*split, vec![name])),
            }
        }
        splits.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut free_px = TOP_PX + LINE_PX;
        for (split, names) in splits {
            let y = panel.px([0.0, split])[1];
            let right = panel.left_px + PANEL_PX;
            stroke(out, [[panel.left_px, y], [right, y]], SPLIT, "");
            let more = match names.len() {
                1 => String::new(),
                count => format!(" and {} more", count - 1),
            };
            let text = format!("{split:.2} m: {}{more}", names[0]);
            let at = (y - 4.0).max(free_px);
            free_px = at + LINE_PX;
            lifted(out, [panel.left_px + PANEL_PX / 2.0, at], &text);
        }
    }
}

/// One of the two drawings.
struct TopView {
    left_px: f64,
    /// Its left and lower edge, metres.
    low: [f64; 2],
    /// Width and height, metres.
    span: f64,
}

impl TopView {
    fn px(&self, [x, z]: [f64; 2]) -> [f64; 2] {
        let part = [(x - self.low[0]) / self.span, (z - self.low[1]) / self.span];
        [
            self.left_px + part[0] * PANEL_PX,
            TOP_PX + (1.0 - part[1]) * PANEL_PX,
        ]
    }

    fn ray(&self, edge: Edge, reach: f64) -> [[f64; 2]; 2] {
        let [x, z] = edge.direction();
        let end = [edge.from[0] + reach * x, edge.from[1] + reach * z];
        [self.px(edge.from), self.px(end)]
    }

    /// Draws the frame, and ticks in the axis's unit along the lower and the left edge.
    fn frame(&self, out: &mut String, axis: &str, scale: f64) {
        let step = tick_step(self.span * scale) / scale;
        for side in 0..2 {
            let first = (self.low[side] / step).ceil() as i64;
            let last = ((self.low[side] + self.span) / step).floor() as i64;
            for tick in first..=last {
                let at = tick as f64 * step;
                let text = format!("{:.*}", usize::from(step * scale < 1.0), at * scale);
                let mut place = self.low;
                place[side] = at;
                let [x, y] = self.px(place);
                let end = if side == 0 {
                    [x, TOP_PX]
                } else {
                    [x + PANEL_PX, y]
                };
                stroke(out, [[x, y], end], GRID, "");
                match side {
                    0 => label(out, [x, y + 15.0], "middle", theme::TICK_PX, MUTED, &text),
                    _ => label(out, [x - 5.0, y + 4.0], "end", theme::TICK_PX, MUTED, &text),
                }
            }
        }
        let _ = write!(
            out,
            r#"<rect x="{}" y="{TOP_PX}" width="{PANEL_PX}" height="{PANEL_PX}" fill="none" stroke="{}"/>"#,
            self.left_px,
            hex(AXIS)
        );
        let middle = [self.left_px + PANEL_PX / 2.0, TOP_PX + PANEL_PX + 34.0];
        let text = format!("seen from above, straight ahead is up; {axis}");
        label(out, middle, "middle", theme::LABEL_PX, MUTED, &text);
    }
}

const INK: Rgb = rgb(theme::INK);
const MUTED: Rgb = rgb(theme::MUTED);
const GRID: Rgb = rgb(theme::GRID);
const AXIS: Rgb = rgb(theme::AXIS);
const PAPER: Rgb = rgb(theme::PAPER);
const LEFT: Rgb = palette::BLUE;
const RIGHT: Rgb = palette::VERMILION;
const SUPER: Rgb = palette::GREEN;
const SPLIT: Rgb = palette::PURPLE;

const fn rgb(color: RGBColor) -> Rgb {
    [color.0, color.1, color.2]
}

/// A colour in the form that the page's style sheet matches.
fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// The distance between ticks of an axis of this length: 1, 2 or 5 times a power of ten, at most ten ticks.
fn tick_step(span: f64) -> f64 {
    let power = 10_f64.powf((span / 10.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power);
    step.into_iter()
        .find(|step| span / step <= 10.0)
        .unwrap_or(10.0 * power)
}

fn stroke(out: &mut String, [[x1, y1], [x2, y2]]: [[f64; 2]; 2], color: Rgb, dashes: &str) {
    let width = if color == GRID { 1.0 } else { 1.8 };
    let dashes = match dashes {
        "" => String::new(),
        dashes => format!(r#" stroke-dasharray="{dashes}""#),
    };
    let _ = write!(
        out,
        r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{}" stroke-width="{width}"{dashes}/>"#,
        hex(color)
    );
}

fn label(out: &mut String, [x, y]: [f64; 2], anchor: &str, size_px: u32, color: Rgb, text: &str) {
    let _ = write!(
        out,
        r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{size_px}" fill="{}">{}</text>"#,
        hex(color),
        escape(text)
    );
}

/// A label on a background in the page's colour, which hides lines behind it.
fn lifted(out: &mut String, [x, y]: [f64; 2], text: &str) {
    let half = theme::text_width_px(text, theme::LABEL_PX) / 2.0 + 3.0;
    let _ = write!(
        out,
        r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="14" fill="{}"/>"#,
        x - half,
        y - 11.0,
        2.0 * half,
        hex(PAPER)
    );
    label(out, [x, y], "middle", theme::LABEL_PX, INK, text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::view::FovTangents;

    fn frusta(outer: f32, inner: f32, cant_deg: f32, splits: &[(&str, f64)]) -> String {
        drawing(&hmd(outer, inner, cant_deg), splits).svg()
    }

    fn hmd(outer: f32, inner: f32, cant_deg: f32) -> Hmd {
        let fov = |left, right| FovTangents {
            left,
            right,
            up: 1.0,
            down: 1.0,
        };
        Hmd {
            fov: [fov(outer, inner), fov(inner, outer)],
            ipd_m: 0.064,
            cant_deg,
            ..Hmd::default()
        }
    }

    fn drawing<'a>(hmd: &'a Hmd, splits: &[(&str, f64)]) -> Frusta<'a> {
        Frusta {
            title: "a display".into(),
            hmd,
            lens: hmd.fov.map(|fov| Lens::of(&fov)),
            splits: splits
                .iter()
                .map(|(name, at)| ((*name).to_owned(), *at))
                .collect(),
        }
    }

    #[test]
    fn the_apex_of_parallel_eyes_matches_the_closed_form() {
        // Symmetric eyes of 90 degrees, 64 mm apart: 32 mm behind them.
        let [x, z] = drawing(&hmd(1.0, 1.0, 0.0), &[]).apex().unwrap();
        assert!(x.abs() < 1e-7 && (z + 0.032).abs() < 1e-7, "{x} {z}");
        let [_, z] = drawing(&hmd(1.4, 0.9, 0.0), &[]).apex().unwrap();
        assert!((z + 0.064 / 2.8).abs() < 1e-7);
        // Canted eyes look further out, so the apex is nearer; beyond 180 degrees there is none.
        let [_, canted] = drawing(&hmd(1.4, 0.9, 10.0), &[]).apex().unwrap();
        assert!(canted > z && canted < 0.0);
        assert_eq!(drawing(&hmd(6.0, 1.0, 12.0), &[]).apex(), None);
        assert!(frusta(6.0, 1.0, 12.0, &[]).contains("no superfrustum"));
    }

    #[test]
    fn the_edges_of_a_canted_eye_are_turned_outwards() {
        let hmd = hmd(1.0, 1.0, 10.0);
        let degrees = drawing(&hmd, &[])
            .frustum(1)
            .map(|edge| edge.angle.to_degrees());
        assert!((degrees[0] + 35.0).abs() < 1e-5 && (degrees[1] - 55.0).abs() < 1e-5);
    }

    #[test]
    fn labels_of_splits_do_not_overlap_and_equal_ones_are_merged() {
        let text = frusta(
            1.2,
            1.2,
            0.0,
            &[
                ("far-field", 6.4),
                ("least-work", 6.3),
                ("shift", 6.4),
                ("a<b", 6.35),
            ],
        );
        let heights: Vec<f64> = text
            .split("<text ")
            .filter(|part| part.contains(" m: "))
            .map(|part| {
                let from = part.find("y=\"").unwrap() + 3;
                part[from..].split('"').next().unwrap().parse().unwrap()
            })
            .collect();
        assert_eq!(heights.len(), 3);
        assert!(
            heights
                .windows(2)
                .all(|pair| (pair[0] - pair[1]).abs() >= 14.0),
            "{heights:?}"
        );
        assert!(text.contains("6.40 m: far-field and 1 more") && text.contains("a&lt;b"));
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(
            [96.0, 10.0, 7.9, 192.0].map(tick_step),
            [10.0, 1.0, 1.0, 20.0]
        );
        assert!((tick_step(0.45) - 0.05).abs() < 1e-12);
    }
}
