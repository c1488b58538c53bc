//! Grouped bars with optional reference marks, such as a paper's values.

use super::bands::{ColumnBands, boxes, check_bars, end_above};
use super::frame::{LegendEntry, Symbol, text_style};
use super::lines::exact;
use super::{PlotError, SeriesStyle};
use crate::theme;
use plotters::style::text_anchor::HPos;

/// One group of bars, such as a scene or a cache configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarGroup {
    /// Name under the bars.
    pub label: String,
    /// One value per series; `None` leaves its place empty.
    pub values: Vec<Option<f64>>,
    /// One reference mark per series, in the values' unit.
    pub marks: Vec<Option<f64>>,
    /// Lowest and highest value per series, drawn as an error bar.
    pub ends: Vec<Option<[f64; 2]>>,
}

impl BarGroup {
    /// Every number that is drawn.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &f64> {
        let ends = self.ends.iter().flatten().flatten();
        self.values.iter().chain(&self.marks).flatten().chain(ends)
    }
}

/// A grouped bar chart. Values start at zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarChart {
    /// Heading.
    pub title: String,
    /// What the bars show, with its unit: `external traffic, MB per frame`.
    pub value_label: String,
    /// What the groups are, with the unit if they have one.
    pub group_label: String,
    /// Series in drawing order.
    pub series: Vec<SeriesStyle>,
    /// Groups from left to right.
    pub groups: Vec<BarGroup>,
    /// Name of the marks; `None` without marks.
    pub mark_name: Option<String>,
    /// Draws a line at this value (1.0 for ratios).
    pub reference: Option<f64>,
    /// Decimals of the values written over the bars; `None` writes none.
    pub decimals: Option<usize>,
}

/// Factor on the axis that leaves room for the number over the highest bar.
const HEADROOM: f64 = 1.08;

impl BarChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A value that is not finite or negative, or a group whose values do not match the series.
    pub fn svg(&self) -> Result<String, PlotError> {
        self.check()?;
        let bars = self.series.len().max(1) as f64;
        let groups = self.groups.len().max(1) as f64;
        let bar_px = self.bar_width_px();
        let group_px = (bar_px * bars + (bar_px * 0.8).max(14.0))
            .max(self.widest_word_px() + 10.0)
            .max(320.0 / groups);
        let names = self.groups.iter();
        let names = names.map(|g| wrap(&g.label, group_px - 6.0, theme::LABEL_PX));
        let all = self.groups.iter().flat_map(BarGroup::numbers);
        // Without a value, the axis still has room for a number.
        let largest = end_above(all.copied().chain(self.reference), 1.0);
        let axis = ColumnBands {
            title: &self.title,
            value_label: &self.value_label,
            legend: self.legend(),
            names: names.collect(),
            name_px: (theme::LABEL_PX, 14),
            width_px: (group_px * groups).floor(),
            x_label: &self.group_label,
            highest: HEADROOM * largest,
            reference: self.reference,
        };
        let number = text_style(theme::TICK_PX, theme::INK, HPos::Center);
        let bar = bar_px / group_px;
        axis.draw(|g, root, axes, marks| {
            let group = &self.groups[g];
            let middle = g as f64 + 0.5;
            for (s, (value, style)) in group.values.iter().zip(&self.series).enumerate() {
                let Some(value) = *value else { continue };
                let left = middle + bar * (s as f64 - bars / 2.0);
                let right = left + bar;
                let [(x0, y0), (x1, y1)] =
                    [(left, 0.0), (right, value)].map(|at| axes.backend_coord(&at));
                let mark = group.marks.get(s).copied().flatten();
                let mut title = format!("{}, {}: {}", group.label, style.name, exact(value));
                if let (Some(mark), Some(name)) = (mark, &self.mark_name) {
                    title += &format!(" ({name}: {})", exact(mark));
                }
                let ends = group.ends.get(s).copied().flatten();
                if let Some([low, high]) = ends {
                    title += &format!(", {} to {}", exact(low), exact(high));
                }
                marks.rect([(x0 + 1, y0), (x1 - 1, y1)], style.color, &title);
                let mut top = y1;
                if let Some(ends) = ends {
                    let x = (x0 + x1) / 2;
                    let [low, high] = ends.map(|end| axes.backend_coord(&(left, end)).1);
                    for line in [
                        [(x, low), (x, high)],
                        [(x - 3, low), (x + 3, low)],
                        [(x - 3, high), (x + 3, high)],
                    ] {
                        marks.line(&line, theme::INK, (1.0, ""));
                    }
                    top = top.min(high);
                }
                if let Some(mark) = mark {
                    let y = axes.backend_coord(&(left, mark)).1;
                    let width = f64::from(theme::LINE_PX);
                    marks.line(&[(x0, y), (x1, y)], theme::INK, (width, ""));
                }
                if let Some(decimals) = self.decimals {
                    let x = axes.backend_coord(&(left + bar / 2.0, value)).0;
                    let strokes =
                        [self.reference, mark].map(|v| v.map(|v| axes.backend_coord(&(left, v)).1));
                    let at = (x, label_y(top, strokes));
                    root.draw_text(&format!("{value:.decimals$}"), &number, at)?;
                }
            }
            Ok(())
        })
    }

    fn check(&self) -> Result<(), PlotError> {
        for group in &self.groups {
            let (values, series) = (group.values.len(), self.series.len());
            if values != series {
                let label = &group.label;
                let problem = format!("group `{label}` has {values} values for {series} series");
                return Err(PlotError::new(&self.title, problem));
            }
            check_bars(&self.title, ("group", &group.label), group.numbers())?;
        }
        Ok(())
    }

    /// Width of the longest word in the group names, which break at spaces: the minimum width of a group.
    fn widest_word_px(&self) -> f64 {
        let words = self.groups.iter();
        let words: Vec<String> = words
            .flat_map(|g| wrap(&g.label, 0.0, theme::LABEL_PX))
            .collect();
        theme::widest_px(&words, theme::LABEL_PX)
    }

    /// Minimum width at which the numbers over neighbouring bars do not touch.
    fn bar_width_px(&self) -> f64 {
        let Some(decimals) = self.decimals else {
            return 22.0;
        };
        let values = self.groups.iter().flat_map(|g| g.values.iter().flatten());
        let numbers: Vec<String> = values.map(|v| format!("{v:.decimals$}")).collect();
        let widest = theme::widest_px(&numbers, theme::TICK_PX);
        (widest + 5.0).max(22.0)
    }

    fn legend(&self) -> Vec<LegendEntry<'_>> {
        let mut legend = boxes(&self.series);
        legend.extend(self.mark_name.as_deref().map(|name| LegendEntry {
            name,
            color: theme::INK,
            symbol: Symbol::Stroke,
        }));
        legend
    }
}

/// Breaks a label at spaces, hyphens or slashes into lines no wider than `width_px`.
pub(super) fn wrap(label: &str, width_px: f64, size_px: u32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in label.split_inclusive([' ', '-', '/']) {
        let longer = format!("{line}{word}");
        if !line.is_empty() && theme::text_width_px(longer.trim_end(), size_px) > width_px {
            lines.push(line.trim_end().to_owned());
            line = word.to_owned();
        } else {
            line = longer;
        }
    }
    lines.push(line.trim_end().to_owned());
    lines
}

/// Centre of the number over a bar, in pixels, moved up if a line would cross it.
fn label_y(bar_top: i32, lines: [Option<i32>; 2]) -> i32 {
    let mut lines: Vec<i32> = lines.into_iter().flatten().collect();
    // From the lowest line up, because moving off one line can move the number onto the next.
    lines.sort_by(|a, b| b.cmp(a));
    lines.into_iter().fold(bar_top - 8, |y, line| {
        if (line - y).abs() < 8 {
            line.min(bar_top) - 8
        } else {
            y
        }
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::text_at;
    use super::*;

    fn chart() -> BarChart {
        BarChart {
            title: "Crytek".into(),
            value_label: "external traffic, MB per frame".into(),
            group_label: "L1/L2, KiB".into(),
            series: vec![SeriesStyle::nth("Morton", 0), SeriesStyle::nth("Z2 STA", 2)],
            groups: vec![BarGroup {
                label: "8/128".into(),
                values: vec![Some(12.5), Some(8.25)],
                marks: vec![None, Some(9.0)],
                ..BarGroup::default()
            }],
            mark_name: Some("paper".into()),
            reference: None,
            decimals: Some(1),
        }
    }

    #[test]
    fn the_same_numbers_give_the_same_bytes() {
        assert_eq!(chart().svg().unwrap(), chart().svg().unwrap());
    }

    #[test]
    fn the_value_label_with_its_unit_is_drawn() {
        let svg = chart().svg().unwrap();
        assert!(svg.contains("external traffic, MB per frame"));
        assert!(svg.contains("L1/L2, KiB"));
        assert!(svg.contains("\n10\n"), "a tick of the value axis");
    }

    #[test]
    fn a_value_that_is_not_a_number_is_refused() {
        let mut bad = chart();
        bad.groups[0].values[0] = Some(f64::NAN);
        assert_eq!(
            bad.svg().unwrap_err().to_string(),
            "plot `Crytek`: group `8/128` holds NaN"
        );
    }

    #[test]
    fn an_error_bar_spans_its_ends_and_the_axis_has_room_for_it() {
        let mut with_ends = chart();
        with_ends.groups[0].ends = vec![Some([9.0, 31.0]), None];
        let svg = with_ends.svg().unwrap();
        assert!(svg.contains("Morton: 12.500, 9 to 31</title>"), "{svg}");
        assert!(svg.contains("\n30\n"), "a tick above the bars");
        assert!(text_at(&svg, "12.5").1 < text_at(&svg, "30").1 + 8.0);
    }

    #[test]
    fn no_line_crosses_a_number() {
        assert_eq!(label_y(100, [None, None]), 92);
        assert_eq!(label_y(100, [Some(110), None]), 92, "a line below the top");
        assert_eq!(label_y(100, [Some(94), None]), 86);
        assert_eq!(label_y(100, [Some(82), Some(94)]), 74, "two lines");
        assert_eq!(label_y(100, [Some(50), None]), 92, "a line far above");
    }

    #[test]
    fn long_group_names_do_not_touch() {
        let mut long = chart();
        long.groups[0].label = "layout.base_align_bytes = 65536".into();
        let mut second = long.groups[0].clone();
        second.label = "sampling.helper_lanes = true".into();
        long.groups.push(second);
        let svg = long.svg().unwrap();
        let centre = |word: &str| text_at(&svg, word).0;
        let apart = centre("sampling.helper_lanes =") - centre("layout.base_align_bytes");
        let widest = theme::text_width_px("layout.base_align_bytes", theme::LABEL_PX);
        assert!(apart >= widest, "{apart} < {widest}");
    }

    #[test]
    fn bars_are_as_wide_as_their_numbers() {
        let mut wide = chart();
        wide.groups[0].values[0] = Some(123_456.7);
        assert!(wide.bar_width_px() > theme::text_width_px("123456.7", theme::TICK_PX));
    }
}
