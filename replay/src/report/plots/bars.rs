//! Grouped bars with optional reference marks (a paper's values) over them.

use super::{
    Anchor, LegendEntry, PlotError, Scale, SeriesStyle, Symbol, draw, fill, heading,
    horizontal_grid, legend, legend_width_px, stroke, text, wrap,
};
use crate::report::theme;

/// One group of bars: a scene, a cache configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarGroup {
    /// Name under the bars.
    pub label: String,
    /// One value a series; `None` leaves the place empty.
    pub values: Vec<Option<f64>>,
    /// One reference mark a series, in the values' unit.
    pub marks: Vec<Option<f64>>,
}

/// A grouped bar chart. Values start at zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarChart {
    /// Heading.
    pub title: String,
    /// What the bars show, with its unit: `external traffic, MB per frame`.
    pub value_label: String,
    /// What the groups are, with the unit where they have one.
    pub group_label: String,
    /// Series in drawing order.
    pub series: Vec<SeriesStyle>,
    /// Groups from left to right.
    pub groups: Vec<BarGroup>,
    /// What the marks are; `None` when there are none.
    pub mark_name: Option<String>,
    /// Draws a line at this value (1.0 for ratios).
    pub reference: Option<f64>,
    /// Decimals of the values written over the bars; `None` writes none.
    pub decimals: Option<usize>,
}

const LEFT_PX: f64 = 58.0;
const TOP_PX: f64 = 72.0;
const PLOT_HEIGHT_PX: f64 = 210.0;
const RIGHT_PX: f64 = 14.0;

impl BarChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A value that is not finite or negative, or a group whose values do not match the series.
    pub fn svg(&self) -> Result<String, PlotError> {
        let fail = |problem: String| PlotError {
            title: self.title.clone(),
            problem,
        };
        for group in &self.groups {
            if group.values.len() != self.series.len() {
                return Err(fail(format!(
                    "group `{}` has {} values for {} series",
                    group.label,
                    group.values.len(),
                    self.series.len()
                )));
            }
            if let Some(bad) = group
                .values
                .iter()
                .chain(&group.marks)
                .flatten()
                .find(|v| !(v.is_finite() && **v >= 0.0))
            {
                return Err(fail(format!("group `{}` holds {bad}", group.label)));
            }
        }

        let per_group = self.series.len().max(1) as f64;
        let bar_px = self.bar_width_px();
        let gap_px = (bar_px * 0.8).max(14.0);
        let group_px = (bar_px * per_group + gap_px).max(self.widest_word_px() + 10.0);
        let plot_width = (group_px * self.groups.len() as f64).max(320.0);
        let group_px = plot_width / self.groups.len().max(1) as f64;
        let label_lines = self
            .groups
            .iter()
            .map(|g| wrap(&g.label, group_px - 6.0, theme::LABEL_PX).len())
            .max()
            .unwrap_or(1);
        let legend_width: f64 = legend_width_px(&self.legend()) + LEFT_PX + RIGHT_PX;
        let heading_width = theme::text_width_px(&self.title, theme::TITLE_PX)
            .max(theme::text_width_px(&self.value_label, theme::LABEL_PX))
            + 16.0;
        let width = (LEFT_PX + plot_width + RIGHT_PX)
            .max(legend_width)
            .max(heading_width);
        let bottom = TOP_PX + PLOT_HEIGHT_PX;
        let axis_title = if self.group_label.is_empty() {
            0.0
        } else {
            18.0
        };
        let height = bottom + 10.0 + 15.0 * label_lines as f64 + axis_title;

        let top_value = self
            .groups
            .iter()
            .flat_map(|g| g.values.iter().chain(&g.marks).flatten().copied())
            .chain(self.reference)
            .fold(0.0, f64::max);
        let top_value = if top_value > 0.0 { top_value } else { 1.0 };
        let step = theme::nice_step(top_value * 1.02, 5);
        let high = (top_value * 1.02 / step).ceil() * step;
        let scale = Scale::linear(0.0, high, bottom, TOP_PX);
        let at: Vec<(f64, String)> = theme::ticks(0.0, high, step)
            .into_iter()
            .map(|v| (v, theme::tick_label(v, step)))
            .collect();

        draw(
            &self.title,
            (width.ceil() as u32, height.ceil() as u32),
            |area| {
                heading(area, &self.title, &self.value_label)?;
                legend(area, (LEFT_PX, 53.0), &self.legend())?;
                horizontal_grid(
                    area,
                    &scale,
                    &at,
                    (LEFT_PX, LEFT_PX + plot_width),
                    Some(0.0),
                )?;
                for (g, group) in self.groups.iter().enumerate() {
                    let centre = LEFT_PX + group_px * (g as f64 + 0.5);
                    let first = centre - bar_px * per_group / 2.0;
                    for (s, (value, style)) in group.values.iter().zip(&self.series).enumerate() {
                        let x = first + bar_px * s as f64;
                        let Some(value) = *value else { continue };
                        fill(
                            area,
                            (x + 1.0, scale.at(value)),
                            (x + bar_px - 1.0, bottom),
                            style.color,
                        )?;
                        let mark = group.marks.get(s).copied().flatten();
                        if let Some(mark) = mark {
                            let y = scale.at(mark);
                            stroke(
                                area,
                                &[(x - 1.0, y), (x + bar_px, y)],
                                theme::INK,
                                theme::LINE_PX,
                            )?;
                        }
                        if let Some(decimals) = self.decimals {
                            let label = format!("{value:.decimals$}");
                            let lines = [self.reference, mark];
                            let y = label_y(scale.at(value), lines.map(|v| v.map(|v| scale.at(v))));
                            text(
                                area,
                                (x + bar_px / 2.0, y),
                                &label,
                                theme::TICK_PX,
                                theme::INK,
                                Anchor::Middle,
                            )?;
                        }
                    }
                    for (i, line) in wrap(&group.label, group_px - 6.0, theme::LABEL_PX)
                        .iter()
                        .enumerate()
                    {
                        let y = bottom + 14.0 + 15.0 * i as f64;
                        text(
                            area,
                            (centre, y),
                            line,
                            theme::LABEL_PX,
                            theme::INK,
                            Anchor::Middle,
                        )?;
                    }
                }
                if let Some(reference) = self.reference {
                    let y = scale.at(reference);
                    stroke(
                        area,
                        &[(LEFT_PX, y), (LEFT_PX + plot_width, y)],
                        theme::AXIS,
                        1,
                    )?;
                }
                if !self.group_label.is_empty() {
                    let at = (LEFT_PX + plot_width / 2.0, height - 9.0);
                    text(
                        area,
                        at,
                        &self.group_label,
                        theme::LABEL_PX,
                        theme::MUTED,
                        Anchor::Middle,
                    )?;
                }
                Ok(())
            },
        )
    }

    /// Group names break at spaces, so that neighbours cannot touch when a group has this width.
    fn widest_word_px(&self) -> f64 {
        self.groups
            .iter()
            .flat_map(|g| wrap(&g.label, 0.0, theme::LABEL_PX))
            .map(|word| theme::text_width_px(&word, theme::LABEL_PX))
            .fold(0.0, f64::max)
    }

    /// Wide enough that the numbers over neighbouring bars do not touch.
    fn bar_width_px(&self) -> f64 {
        let Some(decimals) = self.decimals else {
            return 22.0;
        };
        let widest = self
            .groups
            .iter()
            .flat_map(|g| g.values.iter().flatten())
            .map(|v| theme::text_width_px(&format!("{v:.decimals$}"), theme::TICK_PX))
            .fold(0.0, f64::max);
        (widest + 5.0).max(22.0)
    }

    fn legend(&self) -> Vec<LegendEntry<'_>> {
        let series = self.series.iter().map(|s| LegendEntry {
            name: &s.name,
            color: s.color,
            symbol: Symbol::Box,
        });
        let mark = self.mark_name.as_deref().map(|name| LegendEntry {
            name,
            color: theme::INK,
            symbol: Symbol::Stroke,
        });
        series.chain(mark).collect()
    }
}

/// Middle of the number over a bar: above the lines that would strike it through.
fn label_y(bar_top: f64, lines: [Option<f64>; 2]) -> f64 {
    let mut lines: Vec<f64> = lines.into_iter().flatten().collect();
    // From the lowest up: a number moved off one line may come to lie on the next.
    lines.sort_by(|a, b| b.total_cmp(a));
    lines.into_iter().fold(bar_top - 8.0, |y, line| {
        if (line - y).abs() < 8.0 {
            line.min(bar_top) - 8.0
        } else {
            y
        }
    })
}

#[cfg(test)]
mod tests {
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
    fn no_line_strikes_a_number_through() {
        assert_eq!(label_y(100.0, [None, None]), 92.0);
        assert_eq!(
            label_y(100.0, [Some(110.0), None]),
            92.0,
            "a line below the top"
        );
        assert_eq!(label_y(100.0, [Some(94.0), None]), 86.0);
        assert_eq!(
            label_y(100.0, [Some(82.0), Some(94.0)]),
            74.0,
            "both in turn"
        );
        assert_eq!(label_y(100.0, [Some(50.0), None]), 92.0, "a line far above");
    }

    #[test]
    fn long_group_names_do_not_touch() {
        let mut long = chart();
        long.groups[0].label = "layout.base_align_bytes = 65536".into();
        let mut second = long.groups[0].clone();
        second.label = "sampling.helper_lanes = true".into();
        long.groups.push(second);
        let svg = long.svg().unwrap();
        let centre = |word: &str| -> f64 {
            let end = svg.find(&format!("\n{word}\n")).unwrap();
            let x = svg[..end].rfind(" x=\"").unwrap() + 4;
            svg[x..].split('"').next().unwrap().parse().unwrap()
        };
        let apart = centre("sampling.helper_lanes =") - centre("layout.base_align_bytes =");
        let widest = theme::text_width_px("layout.base_align_bytes =", theme::LABEL_PX);
        assert!(apart >= widest, "{apart} < {widest}");
    }

    #[test]
    fn bars_are_as_wide_as_their_numbers() {
        let mut wide = chart();
        wide.groups[0].values[0] = Some(123_456.7);
        assert!(wide.bar_width_px() > theme::text_width_px("123456.7", theme::TICK_PX));
    }
}
