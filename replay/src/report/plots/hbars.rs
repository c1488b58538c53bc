//! Horizontal grouped bars, for long names.

use super::{Anchor, PlotError, Scale, SeriesStyle, draw, fill, heading, stroke, text};
use crate::report::theme;

/// A chart of horizontal bars, one group a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HBarChart {
    /// Heading.
    pub title: String,
    /// What the bars show, with its unit.
    pub value_label: String,
    /// Series in drawing order.
    pub series: Vec<SeriesStyle>,
    /// Row names and values, one a series.
    pub rows: Vec<(String, Vec<Option<f64>>)>,
    /// Decimals of the values written at the bars' ends; `None` writes none.
    pub decimals: Option<usize>,
}

const TOP_PX: f64 = 66.0;
const BAR_PX: f64 = 6.0;
/// Bars with a number beside them are a line of text high.
const NUMBERED_BAR_PX: f64 = 12.0;
const ROW_GAP_PX: f64 = 7.0;
const PLOT_WIDTH_PX: f64 = 300.0;
const LONGEST_NAME_CHARS: usize = 34;

impl HBarChart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// A value that is not finite or negative.
    pub fn svg(&self) -> Result<String, PlotError> {
        for (name, values) in &self.rows {
            if let Some(bad) = values
                .iter()
                .flatten()
                .find(|v| !(v.is_finite() && **v >= 0.0))
            {
                return Err(PlotError {
                    title: self.title.clone(),
                    problem: format!("row `{name}` holds {bad}"),
                });
            }
        }
        let names: Vec<String> = self.rows.iter().map(|(name, _)| shorten(name)).collect();
        let name_width = names
            .iter()
            .map(|n| theme::text_width_px(n, theme::TICK_PX))
            .fold(40.0, f64::max);
        let left = 8.0 + name_width + 8.0;
        let bar_px = if self.decimals.is_some() {
            NUMBERED_BAR_PX
        } else {
            BAR_PX
        };
        let row_px = bar_px * self.series.len().max(1) as f64 + ROW_GAP_PX;
        let bottom = TOP_PX + row_px * self.rows.len() as f64;
        let largest = self
            .rows
            .iter()
            .flat_map(|(_, v)| v.iter().flatten().copied())
            .fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let step = theme::nice_step(largest, 5);
        let high = (largest / step).ceil() * step;
        let scale = Scale::linear(0.0, high, left, left + PLOT_WIDTH_PX);
        let width = (left + PLOT_WIDTH_PX + if self.decimals.is_some() { 60.0 } else { 22.0 })
            .max(theme::text_width_px(&self.title, theme::TITLE_PX) + 16.0);
        draw(
            &self.title,
            (width.ceil() as u32, (bottom + 26.0) as u32),
            |area| {
                heading(area, &self.title, &self.value_label)?;
                let mut x = left;
                for style in &self.series {
                    fill(area, (x, 48.0), (x + 12.0, 56.0), style.color)?;
                    text(
                        area,
                        (x + 17.0, 52.0),
                        &style.name,
                        theme::LABEL_PX,
                        theme::INK,
                        Anchor::Start,
                    )?;
                    x += 34.0 + theme::text_width_px(&style.name, theme::LABEL_PX);
                }
                for value in theme::ticks(0.0, high, step) {
                    let x = scale.at(value);
                    let color = if value == 0.0 {
                        theme::AXIS
                    } else {
                        theme::GRID
                    };
                    stroke(area, &[(x, TOP_PX), (x, bottom)], color, 1)?;
                    let label = theme::tick_label(value, step);
                    text(
                        area,
                        (x, bottom + 12.0),
                        &label,
                        theme::TICK_PX,
                        theme::MUTED,
                        Anchor::Middle,
                    )?;
                }
                for (r, ((_, values), name)) in self.rows.iter().zip(&names).enumerate() {
                    let top = TOP_PX + row_px * r as f64 + 3.5;
                    let middle = top + (row_px - ROW_GAP_PX) / 2.0;
                    text(
                        area,
                        (left - 8.0, middle),
                        name,
                        theme::TICK_PX,
                        theme::INK,
                        Anchor::End,
                    )?;
                    for (s, (value, style)) in values.iter().zip(&self.series).enumerate() {
                        if let Some(value) = value {
                            let y = top + bar_px * s as f64;
                            fill(
                                area,
                                (left, y),
                                (scale.at(*value), y + bar_px - 1.0),
                                style.color,
                            )?;
                            if let Some(decimals) = self.decimals {
                                let at = (scale.at(*value) + 4.0, y + bar_px / 2.0);
                                let label = format!("{value:.decimals$}");
                                text(area, at, &label, theme::TICK_PX, theme::INK, Anchor::Start)?;
                            }
                        }
                    }
                }
                Ok(())
            },
        )
    }
}

/// The end of a long name tells more than its start (folders).
fn shorten(name: &str) -> String {
    let chars: Vec<char> = name.chars().collect();
    if chars.len() <= LONGEST_NAME_CHARS {
        return name.to_owned();
    }
    let tail: String = chars[chars.len() - LONGEST_NAME_CHARS + 1..]
        .iter()
        .collect();
    format!("\u{2026}{tail}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_end() {
        let name = "textures/very/long/folder/names/sponza_curtain_blue_diff.png";
        let short = shorten(name);
        assert!(short.starts_with('\u{2026}') && short.ends_with("curtain_blue_diff.png"));
        assert_eq!(short.chars().count(), LONGEST_NAME_CHARS);
    }

    #[test]
    fn the_same_numbers_give_the_same_bytes_and_the_unit_is_drawn() {
        let chart = HBarChart {
            title: "by texture".into(),
            value_label: "L1 miss rate, %".into(),
            series: vec![SeriesStyle::nth("Morton", 0)],
            rows: vec![
                ("a.png".into(), vec![Some(3.0)]),
                ("b.png".into(), vec![None]),
            ],
            decimals: Some(1),
        };
        assert_eq!(chart.svg().unwrap(), chart.svg().unwrap());
        assert!(chart.svg().unwrap().contains("L1 miss rate, %"));
    }
}
