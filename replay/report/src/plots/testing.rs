//! Finds what a chart draws, and checks that its texts can be read.

use crate::theme;
use proptest::test_runner::TestCaseError;

/// Position of `text` in `svg`, px.
pub(crate) fn text_at(svg: &str, text: &str) -> (f64, f64) {
    let end = svg.find(&format!("\n{text}\n")).expect("the text is drawn");
    let start = svg[..end].rfind("<text").expect("a text has an element");
    let number = |name| {
        attribute(&svg[start..end], name)
            .parse()
            .expect("a place is a number")
    };
    (number("x"), number("y"))
}

/// An attribute of an element.
fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    let start = element.find(&format!(" {name}=\"")).expect(name) + name.len() + 3;
    element[start..].split('"').next().unwrap_or_default()
}

/// A text with its box: left, top, right, bottom.
pub(crate) struct Text {
    pub text: String,
    pub area: [f64; 4],
}

/// Every text of a chart that is not empty.
pub(crate) fn texts(svg: &str) -> Vec<Text> {
    let mut texts = Vec::new();
    for element in svg.split("<text").skip(1) {
        let (tag, rest) = element.split_once('>').expect("an element ends");
        let text = rest.split("</text>").next().unwrap_or_default().trim();
        let text = text
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&amp;", "&");
        if text.is_empty() {
            continue;
        }
        let number = |name| attribute(tag, name).parse::<f64>().expect("a number");
        let (x, y, size) = (number("x"), number("y"), number("font-size"));
        let width = theme::text_width_px(&text, size.round() as u32);
        let left = match attribute(tag, "text-anchor") {
            "start" => x,
            "middle" => x - width / 2.0,
            _ => x - width,
        };
        let top = match attribute(tag, "dy") {
            "0.76em" => y,
            "-0.5ex" => y - size,
            _ => y - size / 2.0,
        };
        let area = [left, top, left + width, top + size];
        texts.push(Text { text, area });
    }
    texts
}

/// Checks that no two texts overlap, that none leaves the picture, and that no two names read the same.
pub(crate) fn check_texts(svg: &str) -> Result<(), TestCaseError> {
    let size = |name| attribute(svg, name).parse::<f64>().expect("a size");
    let (width, height) = (size("width"), size("height"));
    let texts = texts(svg);
    for (index, Text { text, area }) in texts.iter().enumerate() {
        let inside =
            area[0] >= -1.0 && area[1] >= 0.0 && area[2] <= width + 1.0 && area[3] <= height;
        proptest::prop_assert!(inside, "{text} at {area:?} leaves {width}x{height}");
        for other in &texts[..index] {
            let side = |low: usize| {
                area[low + 2].min(other.area[low + 2]) - area[low].max(other.area[low])
            };
            let apart = side(0) <= 1.0 || side(1) <= 1.0;
            proptest::prop_assert!(
                apart,
                "{text} {area:?} over {} {:?}",
                other.text,
                other.area
            );
        }
    }
    let names: Vec<&Text> = texts
        .iter()
        .filter(|t| t.text.starts_with(char::is_alphabetic))
        .collect();
    for (index, name) in names.iter().enumerate() {
        let same = names[..index].iter().any(|other| other.text == name.text);
        proptest::prop_assert!(!same, "two texts read {}", name.text);
    }
    Ok(())
}

/// Checks texts, and that leaders stay outside of the axes.
pub(crate) fn check_geometry(svg: &str) -> Result<(), TestCaseError> {
    check_texts(svg)?;
    // The axes end where the horizontal grid lines end.
    let lines = svg
        .split("<line")
        .skip(1)
        .map(|line| line.split("/>").next().unwrap_or_default());
    let right = lines.filter(|line| attribute(line, "stroke") == "#DDE1E6");
    let right = right
        .map(|line| attribute(line, "x2").parse::<f64>().expect("a number"))
        .fold(0.0, f64::max);
    for leader in svg.split("class=\"leader\"").skip(1) {
        for point in attribute(leader, "points").split(' ') {
            let x: f64 = point
                .split(',')
                .next()
                .unwrap_or_default()
                .parse()
                .expect("a number");
            proptest::prop_assert!(
                x >= right,
                "a leader at {x} inside of the axes, which end at {right}"
            );
        }
    }
    Ok(())
}
