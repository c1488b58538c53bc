//! Named points with two costs, and the front of those that are not dominated. Each point's label is near
//! it and covers no other label or point. With many points, the labels are numbers, and a list to the right
//! of the axes has their names.

use super::axis::{Axis, Ticked, draw_axes};
use super::frame::{AXIS_PX, Area, DOT_PX, Drawn, Frame, LegendEntry, Symbol, text_style};
use super::lines::exact;
use super::marks::{Marks, Shape};
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::style::TextStyle;
use plotters::style::text_anchor::HPos;
use std::ops::Range;

/// A chart of named points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScatterChart {
    /// Heading.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Names of the two kinds of points: not dominated, then dominated.
    pub kinds: [String; 2],
    /// The points.
    pub points: Vec<NamedPoint>,
}

/// A named point.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// Name and colour.
    pub style: SeriesStyle,
    /// Position.
    pub at: (f64, f64),
    /// Whether another point is at least as good in both costs and better in one; drawn hollow.
    pub dominated: bool,
}

const RIGHT_PX: u32 = 120;
const PLOT_PX: (f64, f64) = (620.0, 380.0);
/// With more points than this, names stand in a list.
const MOST_NAMES: usize = 6;
const LIST_GAP_PX: f64 = 15.0;
const NAME_HEIGHT_PX: f64 = 14.0;
/// Labels within this distance from their point need no leader line.
const NEAR_PX: f64 = 16.0;
const FARTHEST_PX: f64 = 400.0;

/// The texts of a chart.
struct Labels {
    /// The points in the order of their numbers.
    order: Vec<usize>,
    /// Whether points have numbers and a list names them.
    listed: bool,
    /// Text beside each point.
    labels: Vec<String>,
    /// Lines of the list.
    list_names: Vec<String>,
}

/// The front as steps: the points with less error than all that are faster. A point whose lead is too small to
/// count as dominating may lie above the line without being marked as dominated.
fn steps(dots: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut front = dots.to_vec();
    front.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let mut lowest = f64::MIN;
    front.retain(|dot| {
        let is_lower = dot.1 > lowest;
        lowest = lowest.max(dot.1);
        is_lower
    });
    // A point dominates everything to the right of and above it.
    let corner = |pair: &[(f64, f64)]| [pair[0], (pair[1].0, pair[0].1)];
    let mut steps: Vec<(f64, f64)> = front.windows(2).flat_map(corner).collect();
    steps.extend(front.last());
    steps
}

impl ScatterChart {
    /// The points in the order of their numbers, which go up from the front's first point.
    fn numbered(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        let key = |index: usize| self.points[index].at;
        order.sort_by(|&a, &b| {
            let by_error = key(a).1.total_cmp(&key(b).1);
            by_error.then(key(a).0.total_cmp(&key(b).0)).then(a.cmp(&b))
        });
        order
    }

    fn labels(&self) -> Labels {
        let names: Vec<&str> = self.points.iter().map(|p| p.style.name.as_str()).collect();
        let names = theme::distinct(&names, 40);
        let listed = names.len() > MOST_NAMES;
        let order = self.numbered();
        let mut number = vec![0; names.len()];
        for (place, &index) in (1..).zip(&order) {
            number[index] = place;
        }
        let numbered = (1..).zip(&order);
        Labels {
            list_names: numbered
                .map(|(place, &index)| format!("{place}  {}", names[index]))
                .collect(),
            labels: match listed {
                true => number.iter().map(ToString::to_string).collect(),
                false => names,
            },
            order,
            listed,
        }
    }

    /// The chart as SVG.
    ///
    /// # Errors
    /// A point that is not finite.
    pub fn svg(&self) -> Result<String, PlotError> {
        self.check()?;
        let (x, y) = self.axes();
        let labels = self.labels();
        self.frame(&labels, &y).draw(|root, mut builder, marks| {
            let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
            draw_axes(&mut chart, &self.x.label, [&x, &y])?;
            let in_px = |point: &NamedPoint| {
                let (x, y) = chart.backend_coord(&self.place_of(point));
                (f64::from(x), f64::from(y))
            };
            let dots: Vec<(f64, f64)> = self.points.iter().map(in_px).collect();
            let area = chart.plotting_area().get_pixel_range();
            self.draw_points(&dots, &labels, &area, (root, marks))?;
            match labels.listed {
                true => self.draw_list(&labels, &area, (root, marks)),
                false => Ok(()),
            }
        })
    }

    /// Checks that all points are finite.
    fn check(&self) -> Result<(), PlotError> {
        let is_bad = |p: &&NamedPoint| !(p.at.0.is_finite() && p.at.1.is_finite());
        match self.points.iter().find(is_bad) {
            Some(NamedPoint { style, at, .. }) => {
                let problem = format!("point `{}` at {at:?}", style.name);
                Err(PlotError::new(&self.title, problem))
            }
            None => Ok(()),
        }
    }

    /// Position of a point on the axes.
    fn place_of(&self, point: &NamedPoint) -> (f64, f64) {
        (self.x.place(point.at.0), self.y.place(point.at.1))
    }

    /// The axes with their ticks.
    fn axes(&self) -> (Ticked, Ticked) {
        let x = self.x.fit(self.points.iter().map(|p| self.place_of(p).0));
        let mut y = self.y.fit(self.points.iter().map(|p| self.place_of(p).1));
        if y.start == 0.0 {
            // Points at zero are not clipped.
            y.start = -0.03 * y.end;
        }
        (self.x.ticked(x).thinned(PLOT_PX.0), self.y.ticked(y))
    }

    /// The frame, with room for the list of names if there is one.
    fn frame(&self, labels: &Labels, y: &Ticked) -> Frame<'_> {
        let (right, height) = match labels.listed {
            true => {
                let list_height = LIST_GAP_PX * labels.labels.len() as f64;
                let list_px = theme::widest_px(&labels.list_names, theme::TICK_PX);
                (list_px as u32 + 36, PLOT_PX.1.max(list_height))
            }
            false => (RIGHT_PX, PLOT_PX.1),
        };
        let kinds = [(0, true), (1, false)];
        Frame {
            title: &self.title,
            value_label: &self.y.label,
            legend: kinds
                .map(|(kind, filled)| LegendEntry {
                    name: &self.kinds[kind],
                    color: theme::INK,
                    symbol: Symbol::Point(Shape::Circle, filled),
                })
                .into(),
            plot_px: (PLOT_PX.0, height),
            around_px: [72, right, AXIS_PX, 58.max(y.widest_px() as u32 + 16)],
        }
    }

    /// Draws the front, the points at `dots`, and a label for each.
    fn draw_points(
        &self,
        dots: &[(f64, f64)],
        labels: &Labels,
        (across, down): &PixelRanges,
        (root, marks): (&Area, &mut Marks),
    ) -> Drawn {
        let steps = steps(dots);
        marks.line(&whole(&steps), theme::AXIS, (1.0, ""));
        let widths: Vec<f64> = (labels.labels.iter())
            .map(|label| theme::text_width_px(label, theme::TICK_PX))
            .collect();
        let beyond = if labels.listed { 0 } else { RIGHT_PX as i32 };
        let room = Rect {
            left: f64::from(across.start) + 4.0,
            top: f64::from(down.start),
            right: f64::from(across.end + beyond) - 2.0,
            bottom: f64::from(down.end) - 2.0,
        };
        // Leader lines are below dots and labels.
        let places = place(dots, &widths, &steps, room);
        for (dot, label) in dots.iter().zip(&places) {
            let to = label.nearest(*dot);
            if distance(*dot, to) > NEAR_PX {
                marks.leader(&whole(&[*dot, to]));
            }
        }
        for (point, dot) in self.points.iter().zip(dots) {
            let title = format!(
                "{}: {} at {}",
                point.style.name,
                exact(point.at.1),
                exact(point.at.0)
            );
            point.draw_symbol(whole(&[*dot])[0], &title, marks);
        }
        for ((point, at), label) in self.points.iter().zip(&places).zip(&labels.labels) {
            let middle = f64::midpoint(at.top, at.bottom);
            root.draw_text(label, &point.text_style(), (at.left as i32, middle as i32))?;
        }
        Ok(())
    }

    /// Draws the list of names to the right of the axes.
    fn draw_list(
        &self,
        labels: &Labels,
        (across, down): &PixelRanges,
        (root, marks): (&Area, &mut Marks),
    ) -> Drawn {
        for (row, (&index, name)) in labels.order.iter().zip(&labels.list_names).enumerate() {
            let point = &self.points[index];
            let y = down.start + (LIST_GAP_PX * (row as f64 + 0.5)) as i32;
            point.draw_symbol((across.end + 16, y), "", marks);
            root.draw_text(name, &point.text_style(), (across.end + 26, y))?;
        }
        Ok(())
    }
}

impl NamedPoint {
    fn draw_symbol(&self, at: (i32, i32), title: &str, marks: &mut Marks) {
        let style = (self.style.color, !self.dominated);
        marks.symbol(Shape::Circle, at, style, title);
    }

    fn text_style(&self) -> TextStyle<'static> {
        let ink = match self.dominated {
            true => theme::MUTED,
            false => theme::INK,
        };
        text_style(theme::TICK_PX, ink, HPos::Left)
    }
}

/// Horizontal and vertical extent of an area in pixels.
type PixelRanges = (Range<i32>, Range<i32>);

/// Positions in whole pixels.
fn whole(points: &[(f64, f64)]) -> Vec<(i32, i32)> {
    points.iter().map(|(x, y)| (*x as i32, *y as i32)).collect()
}

/// A rectangle in pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rect {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Rect {
    fn contains(&self, other: &Self) -> bool {
        other.left >= self.left
            && other.right <= self.right
            && other.top >= self.top
            && other.bottom <= self.bottom
    }

    fn overlap(&self, other: &Self) -> f64 {
        let side = |a: (f64, f64), b: (f64, f64)| (a.1.min(b.1) - a.0.max(b.0)).max(0.0);
        side((self.left, self.right), (other.left, other.right))
            * side((self.top, self.bottom), (other.top, other.bottom))
    }

    /// The point of the rectangle closest to another point.
    fn nearest(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            x.clamp(self.left, self.right),
            y.clamp(self.top, self.bottom),
        )
    }

    fn around((x, y): (f64, f64), half: f64) -> Self {
        Self {
            left: x - half,
            top: y - half,
            right: x + half,
            bottom: y + half,
        }
    }
}

fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

/// Whether two segments cross.
fn cross(a: [(f64, f64); 2], b: [(f64, f64); 2]) -> bool {
    let side = |line: [(f64, f64); 2], p: (f64, f64)| {
        (line[1].0 - line[0].0) * (p.1 - line[0].1) - (line[1].1 - line[0].1) * (p.0 - line[0].0)
    };
    side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0
}

/// Number of points of a leader line that lie on labels. Such a line would look like the other label's.
fn points_on_labels(leader: [(f64, f64); 2], labels: &[Rect]) -> usize {
    let [from, to] = leader;
    let steps = (distance(from, to) / 4.0) as usize;
    let is_on_label = |step: &usize| {
        let t = *step as f64 / steps.max(1) as f64;
        let lerp = |a: f64, b: f64| a + t * (b - a);
        let on = Rect::around((lerp(from.0, to.0), lerp(from.1, to.1)), 1.0);
        labels.iter().any(|label| label.overlap(&on) > 0.0)
    };
    (0..=steps).filter(is_on_label).count()
}

/// A rectangle for the label of each dot: the closest place around it that covers no placed label, no dot
/// and none of the front's `steps`, and whose leader line crosses none.
fn place(dots: &[(f64, f64)], widths: &[f64], steps: &[(f64, f64)], room: Rect) -> Vec<Rect> {
    let mut placed: Vec<Rect> = Vec::new();
    let mut leaders: Vec<[(f64, f64); 2]> = Vec::new();
    for (index, (&dot, &width)) in dots.iter().zip(widths).enumerate() {
        let cost = |place: &Rect| {
            let names: f64 = placed.iter().map(|other| place.overlap(other)).sum();
            let marks: f64 = dots
                .iter()
                .map(|dot| place.overlap(&Rect::around(*dot, f64::from(DOT_PX) + 1.0)))
                .sum();
            // A step is vertical or horizontal, so it is a narrow rectangle.
            let on_steps = steps.windows(2).filter(|ends| {
                let between = |a: f64, b: f64| (a.min(b) - 1.0, a.max(b) + 1.0);
                let ((left, right), (top, bottom)) =
                    (between(ends[0].0, ends[1].0), between(ends[0].1, ends[1].1));
                let step = Rect {
                    left,
                    top,
                    right,
                    bottom,
                };
                place.overlap(&step) > 0.0
            });
            let on_steps = 25.0 * on_steps.count() as f64;
            let leader = [dot, place.nearest(dot)];
            let away = distance(leader[0], leader[1]);
            let crossed = leaders
                .iter()
                .filter(|other| cross(**other, leader))
                .count();
            let through = match away > NEAR_PX {
                true => points_on_labels(leader, &placed),
                false => 0,
            };
            // A label at the height of its dot is easiest to read.
            let aside = (f64::midpoint(place.top, place.bottom) - dot.1).abs();
            away + aside
                + on_steps
                + 40.0 * (names + marks)
                + 30.0 * crossed as f64
                + 30.0 * through as f64
        };
        let mut best: Option<(f64, Rect)> = None;
        let mut radius = f64::from(DOT_PX) + 4.0;
        while radius <= FARTHEST_PX {
            // Stop at the best possible place.
            if best.is_some_and(|(cost, _)| cost < radius) {
                break;
            }
            for step in 0..24 {
                // Right first, then alternately above and below.
                let turn = f64::from((step + 1) / 2) * if step % 2 == 1 { -1.0 } else { 1.0 };
                let angle = turn * std::f64::consts::TAU / 24.0;
                let (x, y) = (dot.0 + radius * angle.cos(), dot.1 + radius * angle.sin());
                let left = x - width * (0.5 - 0.5 * angle.cos());
                let candidate = Rect {
                    left,
                    top: y - NAME_HEIGHT_PX / 2.0,
                    right: left + width,
                    bottom: y + NAME_HEIGHT_PX / 2.0,
                };
                if !room.contains(&candidate) {
                    continue;
                }
                let cost = cost(&candidate);
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, candidate));
                }
            }
            radius += 6.0;
        }
        // If nothing fits, the label is to the right of its dot.
        let beside = Rect {
            left: dot.0 + 8.0,
            top: dot.1 - NAME_HEIGHT_PX / 2.0,
            right: dot.0 + 8.0 + width,
            bottom: dot.1 + NAME_HEIGHT_PX / 2.0,
        };
        let name = best.map_or(beside, |(_, name)| name);
        leaders.push([dot, name.nearest(dot)]);
        placed.push(name);
        debug_assert_eq!(placed.len(), index + 1);
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Rect = Rect {
        left: 0.0,
        top: 0.0,
        right: 800.0,
        bottom: 400.0,
    };

    #[test]
    fn labels_of_crowded_points_overlap_neither_each_other_nor_a_point() {
        // Ten techniques without error and with similar times, such as lossless ones.
        let dots: Vec<(f64, f64)> = (0..10)
            .map(|i| (300.0 + 9.0 * f64::from(i), 390.0))
            .collect();
        let widths = [90.0; 10];
        let names = place(&dots, &widths, &[], ROOM);
        for (i, name) in names.iter().enumerate() {
            assert!(ROOM.contains(name), "{name:?}");
            for other in &names[..i] {
                assert_eq!(name.overlap(other), 0.0, "{name:?} {other:?}");
            }
            for dot in &dots {
                assert_eq!(
                    name.overlap(&Rect::around(*dot, 4.0)),
                    0.0,
                    "{name:?} {dot:?}"
                );
            }
        }
    }

    #[test]
    fn a_single_point_has_its_label_to_its_right() {
        let names = place(&[(100.0, 100.0)], &[50.0], &[], ROOM);
        assert!(
            names[0].left > 104.0 && names[0].left < 112.0,
            "{:?}",
            names[0]
        );
        assert!((f64::midpoint(names[0].top, names[0].bottom) - 100.0).abs() < 1.0);
    }

    #[test]
    fn a_label_does_not_cover_the_line_from_its_point() {
        let steps = [(100.0, 100.0), (300.0, 100.0)];
        let names = place(&[(100.0, 100.0)], &[50.0], &steps, ROOM);
        let name = names[0];
        assert!(
            name.bottom < 100.0 || name.top > 100.0 || name.right < 100.0,
            "{name:?}"
        );
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(60))]
        #[test]
        fn labels_do_not_overlap_and_stay_inside_the_plot(
            names in proptest::collection::vec("[a-z]{1,3}|[a-zA-Z+]{20,60}|same", 1..20),
            kind in 0..4,
            seed in 0_u32..1000,
        ) {
            let noise = |n: u32| f64::from((seed + 31 * n) * 7919 % 1009) / 1009.0;
            let points = (0..).zip(&names).map(|(n, name)| NamedPoint {
                style: SeriesStyle::nth(name, 0),
                at: match kind {
                    0 => (1.0, 0.0),
                    1 => (0.8 + 0.01 * noise(n), if n % 4 == 0 { noise(n + 7) } else { 0.0 }),
                    2 => (noise(n), 10_f64.powf(-9.0 * noise(n + 3))),
                    _ => (-1e9 * noise(n), noise(n + 5)),
                },
                dominated: n % 3 == 0,
            });
            let points: Vec<NamedPoint> = points.collect();
            let y = Axis::from_zero("error", points.iter().map(|p| p.at.1));
            let kinds = ["best".into(), "dominated".into()];
            let svg = ScatterChart { title: "T".into(), x: Axis::linear("time"), y, kinds, points }.svg().unwrap();
            super::super::testing::check_texts(&svg)?;
        }
    }

    #[test]
    fn the_same_points_give_the_same_bytes() {
        let point = |name: &str, at, dominated| NamedPoint {
            style: SeriesStyle::nth(name, 0),
            at,
            dominated,
        };
        let chart = ScatterChart {
            title: "Time against error".into(),
            x: Axis::linear("time"),
            y: Axis::linear("error"),
            kinds: ["best".into(), "dominated".into()],
            points: vec![
                point("a", (1.0, 0.0), false),
                point("b", (0.8, 0.1), false),
                point("c", (1.1, 0.2), true),
            ],
        };
        let svg = chart.svg().unwrap();
        assert_eq!(svg, chart.svg().unwrap());
        for text in ["\na\n", "\nb\n", "\nc\n", "dominated"] {
            assert!(svg.contains(text), "{text}");
        }
    }
}
