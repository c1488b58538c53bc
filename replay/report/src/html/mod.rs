//! The self-contained HTML page: inline styles, script and pictures, no external resources.
//!
//! A [`Page`] is a title, its [`Answer`] and a list of [`Section`]s. The script sorts and filters tables; the page is whole without it.

mod words;

pub use words::{change, count, list};

use crate::plots::PlotError;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::Serialize;

/// Inline style sheet. It recolours the plots' inks by attribute to follow the reader's colour scheme.
const CSS: &str = include_str!("style.css");

/// Sorting, filtering and choice of columns.
const SCRIPT: &str = include_str!("script.js");

/// The top of a page: what was found, in up to three sentences and one chart.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Sentences, computed from the figures.
    pub sentences: Vec<String>,
    /// The chart that shows it; empty if there is nothing to draw.
    pub chart: Markup,
    /// What was done, and where the figures are.
    pub about: Markup,
}

/// One part of a page.
#[derive(Clone, Debug)]
pub struct Section {
    /// Heading, also the entry in the table of contents.
    pub title: String,
    /// Anchor, unique in the page: letters, digits and hyphens.
    pub id: String,
    /// Content.
    pub body: Markup,
}

impl Section {
    /// A section whose anchor is derived from its title.
    pub fn new(title: impl Into<String>, body: Markup) -> Self {
        let title = title.into();
        Self {
            id: slug(&title),
            title,
            body,
        }
    }
}

/// Lower-case letters and digits of a title, joined by hyphens.
pub(super) fn slug(title: &str) -> String {
    let mut out = String::new();
    for c in title.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.is_empty() && !out.ends_with('-') {
            out.push('-');
        }
    }
    out.trim_end_matches('-').to_owned()
}

/// A page before it is written.
#[derive(Debug, Default)]
pub struct Page {
    /// Its parts.
    pub sections: Vec<Section>,
}

impl Page {
    /// Adds a section whose anchor is derived from its title.
    pub fn add(&mut self, title: impl Into<String>, body: Markup) {
        self.sections.push(Section::new(title, body));
    }

    /// The page as text.
    pub fn text(&self, title: &str, answer: &Answer) -> String {
        page(title, answer, &self.sections)
    }
}

/// The whole page.
fn page(title: &str, answer: &Answer, sections: &[Section]) -> String {
    let notices = crate::notices::printed();
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(CSS)) }
            }
            body {
                header {
                    h1 { (title) }
                    @if !answer.sentences.is_empty() { p.answer { (answer.sentences.join(" ")) } }
                    (answer.chart)
                    div.lead { (answer.about) }
                    @if !notices.is_empty() { ul { @for notice in &notices { li { (notice) } } } }
                }
                nav aria-label="Contents" {
                    ol { @for s in sections { li { a href={ "#" (s.id) } { (s.title) } } } }
                }
                main {
                    @for s in sections {
                        section id=(s.id) { h2 { (s.title) } (s.body) }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
    .into_string()
}

/// A picture with a caption; wide pictures scroll in their own box.
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! {
        figure {
            div.scroll { (PreEscaped(svg)) }
            @if !caption.is_empty() { figcaption { (caption) } }
        }
    }
}

/// Pictures in rows that wrap to the window's width.
pub fn figures(pictures: &[(String, String)]) -> Markup {
    html! {
        div.row { @for (svg, caption) in pictures { (figure(svg, caption)) } }
    }
}

/// Charts without captions, in rows.
///
/// # Errors
/// The first chart that cannot be drawn.
pub fn charts(
    svgs: impl IntoIterator<Item = Result<String, PlotError>>,
) -> Result<Markup, PlotError> {
    let pictures = svgs.into_iter().map(|svg| Ok((svg?, String::new())));
    Ok(figures(&pictures.collect::<Result<Vec<_>, PlotError>>()?))
}

/// A chart, if there is one.
///
/// # Errors
/// It cannot be drawn.
pub fn chart(svg: Option<Result<String, PlotError>>, caption: &str) -> Result<Markup, PlotError> {
    Ok(match svg {
        Some(svg) => figure(&svg?, caption),
        None => html! {},
    })
}

/// Settings as TOML in a collapsible element.
pub fn settings(summary: &str, settings: &impl Serialize) -> Markup {
    folded(summary, &toml::to_string(settings).unwrap_or_default())
}

/// Preformatted text (configuration, command lines) in a collapsible element.
fn folded(summary: &str, text: &str) -> Markup {
    html! { details { summary { (summary) } pre { (text) } } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_begins_with_its_answer_and_loads_no_resources() {
        let section = Section::new("Table 2: a & b", html! { p { "x" } });
        assert_eq!(section.id, "table-2-a-b");
        let answer = Answer {
            sentences: vec!["One.".into(), "Two.".into()],
            chart: html! { "chart" },
            about: html! { "about" },
        };
        let text = page("T", &answer, &[section]);
        for forbidden in [
            "<script src",
            "<link",
            "src=\"http",
            "url(",
            "@import",
            "fetch(",
        ] {
            assert!(!text.contains(forbidden), "{forbidden}");
        }
        let place = |part: &str| text.find(part).expect("the part is on the page");
        assert!(place("One. Two.") < place("chart") && place("chart") < place("<nav"));
        assert!(text.contains("href=\"#table-2-a-b\"") && text.contains("id=\"table-2-a-b\""));
        assert!(text.contains("Table 2: a &amp; b"));
    }
}
