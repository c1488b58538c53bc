//! The self-contained HTML page: inline styles and pictures, no script, no external resources.
//!
//! A page is a title, a few facts and a list of [`Section`]s. Every subcommand that writes a page builds
//! sections and calls [`page`].

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Inline style sheet. It recolours the plots' inks by attribute to follow the reader's colour scheme.
const CSS: &str = include_str!("style.css");

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
#[must_use]
pub fn slug(title: &str) -> String {
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

/// The whole page. `lead` is the paragraph under the title.
#[must_use]
pub fn page(title: &str, lead: &Markup, sections: &[Section]) -> String {
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
                header { h1 { (title) } div.lead { (lead) } }
                nav aria-label="Contents" {
                    ol { @for s in sections { li { a href={ "#" (s.id) } { (s.title) } } } }
                }
                main {
                    @for s in sections {
                        section id=(s.id) { h2 { (s.title) } (s.body) }
                    }
                }
            }
        }
    }
    .into_string()
}

/// A picture with a caption; wide pictures scroll in their own box.
#[must_use]
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! {
        figure {
            div.scroll { (PreEscaped(svg)) }
            @if !caption.is_empty() { figcaption { (caption) } }
        }
    }
}

/// Pictures in rows that wrap to the window's width.
#[must_use]
pub fn figures(pictures: &[(String, String)]) -> Markup {
    html! {
        div.row { @for (svg, caption) in pictures { (figure(svg, caption)) } }
    }
}

/// Preformatted text (configuration, command lines) in a collapsible element.
#[must_use]
pub fn folded(summary: &str, text: &str) -> Markup {
    html! { details { summary { (summary) } pre { (text) } } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_loads_no_resources_and_runs_no_script() {
        let section = Section::new("Table 2: a & b", html! { p { "x" } });
        assert_eq!(section.id, "table-2-a-b");
        let text = page("T", &html! { "lead" }, &[section]);
        for forbidden in ["<script", "<link", "src=\"http", "url(", "@import"] {
            assert!(!text.contains(forbidden), "{forbidden}");
        }
        assert!(text.contains("href=\"#table-2-a-b\"") && text.contains("id=\"table-2-a-b\""));
        assert!(text.contains("Table 2: a &amp; b"));
    }
}
