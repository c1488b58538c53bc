//! Finds where a chart draws a text.

/// Position of `text` in `svg`, px.
pub(crate) fn text_at(svg: &str, text: &str) -> (f64, f64) {
    let end = svg.find(&format!("\n{text}\n")).expect("the text is drawn");
    let attribute = |name: &str| {
        let start = svg[..end].rfind(name).expect("a text has a place") + name.len();
        let number = svg[start..].split('"').next().unwrap_or_default();
        number.parse().expect("a place is a number")
    };
    (attribute(" x=\""), attribute(" y=\""))
}
