//! The common style of all plots: colours, type, strokes, and placement of labels.
//!
//! Inks and grid are sentinel colours that the page's style sheet maps to a dark scheme (see
//! `html/style.css`), so one SVG serves both.

use plotters::style::RGBColor;
use sim::palette::{self, Rgb};

/// Series colours; the last one is neutral.
pub(super) const SERIES: [RGBColor; 8] = [
    color(palette::ORANGE),
    color(palette::SKY_BLUE),
    color(palette::BLUE),
    color(palette::GREEN),
    color(palette::VERMILION),
    color(palette::PURPLE),
    color(palette::YELLOW),
    color(palette::GREY),
];

/// The plotting library's form of a colour.
pub const fn color([red, green, blue]: Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Text.
pub(super) const INK: RGBColor = RGBColor(0x1F, 0x23, 0x28);
/// Background of text that covers lines.
pub(super) const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);
/// Secondary text: tick labels, notes.
pub(super) const MUTED: RGBColor = RGBColor(0x5B, 0x63, 0x6C);
/// Horizontal grid lines.
pub const GRID: RGBColor = RGBColor(0xDD, 0xE1, 0xE6);
/// The zero line and frames.
pub(super) const AXIS: RGBColor = RGBColor(0x9A, 0xA2, 0xAB);

/// System font stack; nothing is fetched or embedded.
pub(super) const FONT: &str = "system-ui, sans-serif";
/// Plot titles, px.
pub(super) const TITLE_PX: u32 = 15;
/// Axis and series labels, px.
pub(super) const LABEL_PX: u32 = 12;
/// Tick labels and value labels, px.
pub(super) const TICK_PX: u32 = 11;
/// Series strokes, px.
pub(super) const LINE_PX: u32 = 2;

/// Upper estimate of the width of `text` at `size_px`, in pixels.
///
/// The viewer's font is unknown; these advance widths bound those of common system fonts.
pub(super) fn text_width_px(text: &str, size_px: u32) -> f64 {
    let em: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | '\'' | '|' | '.' | ',' | ':' | ';' | '!' => 0.30,
            'f' | 't' | 'r' | ' ' | '(' | ')' | '[' | ']' | '/' | '-' | 'I' => 0.38,
            'm' | 'w' | 'M' | 'W' | '%' | '@' | '+' => 0.90,
            'A'..='Z' => 0.70,
            _ => 0.58,
        })
        .sum();
    1.07 * em * f64::from(size_px)
}

/// Width of the widest text, px.
pub(super) fn widest_px<S: AsRef<str>>(texts: &[S], size_px: u32) -> f64 {
    let widths = texts
        .iter()
        .map(|text| text_width_px(text.as_ref(), size_px));
    widths.fold(0.0, f64::max)
}

/// Names of at most `most` characters that all differ. The middle of a long name is left out, and names
/// that would read the same get a number.
pub fn distinct<S: AsRef<str>>(names: &[S], most: usize) -> Vec<String> {
    let mut out: Vec<String> = Vec::with_capacity(names.len());
    // The part that differs should stay, so as much of the end is kept as of the start, then less and less.
    for name in names {
        let chars: Vec<char> = name.as_ref().chars().collect();
        let candidate = |start: usize, mark: &str| -> String {
            let room = most.saturating_sub(mark.chars().count());
            if chars.len() <= room {
                return chars.iter().copied().chain(mark.chars()).collect();
            }
            let end = room.saturating_sub(start + 1);
            let head = chars[..start.min(room)].iter().copied();
            let tail = chars[chars.len() - end..].iter().copied();
            head.chain(['\u{2026}'])
                .chain(tail)
                .chain(mark.chars())
                .collect()
        };
        let cuts = (0..most.saturating_sub(1)).map(|cut| {
            // From the middle outwards.
            let half = most / 2;
            if cut % 2 == 0 {
                half.saturating_sub(cut / 2)
            } else {
                half + cut / 2 + 1
            }
        });
        let cuts = cuts.filter(|start| start + 1 < most);
        let plain = cuts.map(|start| candidate(start, ""));
        let numbered = (2..).map(|number| candidate(most / 2 - 2, &format!(" ({number})")));
        let found = plain.chain(numbered).find(|name| !out.contains(name));
        out.extend(found);
    }
    out
}

/// Moves label positions apart to at least `gap`, as close to `wishes` as possible (least squares), inside
/// `low..=high`. The result is in the order of `wishes`.
///
/// Labels that do not all fit keep the gap and exceed `high`.
pub fn spread(wishes: &[f64], gap: f64, low: f64, high: f64) -> Vec<f64> {
    let mut by_position: Vec<usize> = (0..wishes.len()).collect();
    by_position.sort_by(|&a, &b| wishes[a].total_cmp(&wishes[b]).then(a.cmp(&b)));

    // After subtracting the gaps, the constraint is "not descending": pool adjacent violators.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (rank, &index) in by_position.iter().enumerate() {
        let mut pool = (wishes[index] - rank as f64 * gap, 1);
        while let Some(&(mean, count)) = pools.last() {
            if mean <= pool.0 {
                break;
            }
            pools.pop();
            let total = count + pool.1;
            pool = (
                (mean * count as f64 + pool.0 * pool.1 as f64) / total as f64,
                total,
            );
        }
        pools.push(pool);
    }

    let room = (high - gap * wishes.len().saturating_sub(1) as f64).max(low);
    let mut placed = vec![0.0; wishes.len()];
    let mut rank = 0;
    for (mean, count) in pools {
        for _ in 0..count {
            placed[by_position[rank]] = mean.clamp(low, room) + rank as f64 * gap;
            rank += 1;
        }
    }
    placed
}

/// Puts a thin space between groups of three digits before the point.
pub(super) fn group_thousands(number: &str) -> String {
    let (sign, rest) = match number.strip_prefix('-') {
        Some(rest) => ("-", rest),
        None => ("", number),
    };
    let (whole, fraction) = rest
        .split_once('.')
        .map_or((rest, None), |(w, f)| (w, Some(f)));
    let mut out = String::from(sign);
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 && whole.len() > 4 {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    if let Some(fraction) = fraction {
        out.push('.');
        out.push_str(fraction);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_keeps_the_gap_and_stays_inside() {
        let placed = spread(&[10.0, 11.0, 12.0, 90.0, 99.0], 14.0, 0.0, 100.0);
        let mut sorted = placed.clone();
        sorted.sort_by(f64::total_cmp);
        assert!(
            sorted.windows(2).all(|w| w[1] - w[0] >= 14.0 - 1e-9),
            "{sorted:?}"
        );
        assert!(sorted[0] >= 0.0 && sorted[4] <= 100.0, "{sorted:?}");
    }

    #[test]
    fn spread_does_not_move_labels_that_do_not_collide() {
        assert_eq!(
            spread(&[80.0, 10.0, 40.0], 14.0, 0.0, 100.0),
            [80.0, 10.0, 40.0]
        );
    }

    #[test]
    fn spread_centres_a_cluster_on_its_wanted_positions() {
        assert_eq!(spread(&[50.0, 50.0], 10.0, 0.0, 100.0), [45.0, 55.0]);
    }

    #[test]
    fn short_names_stay_and_long_ones_lose_their_middle() {
        assert_eq!(distinct(&["a", "b"], 12), ["a", "b"]);
        assert_eq!(
            distinct(&["textures/curtain.png"], 13),
            ["textur\u{2026}in.png"]
        );
        assert_eq!(distinct(&["a", "a", "a"], 12), ["a", "a (2)", "a (3)"]);
        assert_eq!(distinct(&["", ""], 12), ["", " (2)"]);
    }

    proptest::proptest! {
        #[test]
        fn shortened_names_differ_and_fit(
            names in proptest::collection::vec("[ab]{0,40}", 0..20),
            most in 10_usize..40,
        ) {
            let short = distinct(&names, most);
            proptest::prop_assert_eq!(short.len(), names.len());
            for (index, name) in short.iter().enumerate() {
                proptest::prop_assert!(name.chars().count() <= most, "{}", name);
                proptest::prop_assert!(!short[..index].contains(name), "{}", name);
            }
        }
    }

    #[test]
    fn thousands_are_separated_only_in_long_numbers() {
        assert_eq!(group_thousands("1234"), "1234");
        assert_eq!(
            group_thousands("-1234567.25"),
            "-1\u{2009}234\u{2009}567.25"
        );
    }
}
