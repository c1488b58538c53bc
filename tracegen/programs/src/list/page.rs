//! The list as an HTML page.

use super::{COLUMNS, List, PassRow, Thumbnail, cells};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::fmt::Write as _;

const STYLE: &str =
    ":root { color-scheme: light dark; } body { font: 14px sans-serif; margin: 2em; } table { border-collapse: collapse; }
.scroll { overflow-x: auto; } th, td { border: 1px solid #888; padding: 4px 8px; text-align: left; vertical-align: top; }
img { max-width: 256px; max-height: 256px; background: #888; } 
.why { color: light-dark(#a30, #f0914a); } .draws { display: flex; flex-wrap: wrap; gap: 8px; } figure { margin: 0; width: 136px; font-size: 12px; }
figure span { display: inline-block; background: var(--picture) 0 0 / 100% 100%; } figure img { display: block; background: none; }";

/// The page with lists of frames of a program.
pub fn page(program: &str, lists: &[List]) -> String {
    let title = escaped(program);
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Passes of {title}</title>\n<style>{STYLE}</style>\n\
         <h1>Passes of {title}</h1>\n"
    );
    for list in lists {
        let _ = writeln!(
            text,
            "<h2>{}</h2>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"passes of frame {}\">\n<table>\n<tr><th>picture</th>",
            escaped(&list.eyes_text()),
            list.frame
        );
        for column in COLUMNS {
            let _ = write!(text, "<th>{column}</th>");
        }
        let _ = writeln!(text, "</tr>");
        for row in &list.rows {
            line(row, &mut text);
        }
        let _ = writeln!(text, "</table>\n</div>");
    }
    text
}

fn line(row: &PassRow, text: &mut String) {
    let picture = row.picture.as_ref().and_then(png);
    let picture = picture.map_or_else(String::new, |data| {
        format!("<img alt=\"pass {}\" src=\"{data}\">", row.number)
    });
    let _ = write!(text, "<tr><td>{picture}</td>");
    for cell in cells(row) {
        let _ = write!(text, "<td>{}</td>", escaped(&cell));
    }
    let _ = writeln!(text, "</tr>");
    if row.draw_rows.iter().any(|draw| draw.covered.is_some()) {
        draws(row, text);
    }
    if !row.caveats.is_empty() {
        let why = escaped(&row.caveats.join("; "));
        let span = COLUMNS.len() + 1;
        let _ = writeln!(
            text,
            "<tr><td colspan=\"{span}\" class=\"why\">{why}</td></tr>"
        );
    }
}

/// The draws: the pass's picture, grey where the draw covers no pixel.
fn draws(row: &PassRow, text: &mut String) {
    let data = row.picture.as_ref().and_then(png).unwrap_or_default();
    let _ = write!(
        text,
        "<tr><td colspan=\"{}\"><details style=\"--picture: url({data})\"><summary>{} draws of pass {}, with the pixels that each covers</summary>\n<div class=\"draws\">",
        COLUMNS.len() + 1,
        row.draws,
        row.number
    );
    for draw in &row.draw_rows {
        let covered = draw.covered.as_ref().and_then(|of| {
            // Grey, which differs from black scenes as well as from bright ones.
            let alpha: Vec<u8> = of
                .texels
                .chunks_exact(4)
                .flat_map(|of| [136, of[3]])
                .collect();
            encoded(of.size, &alpha, ExtendedColorType::La8)
        });
        let name = format!("draw {}", draw.number);
        let picture = covered.map_or_else(String::new, |data| {
            format!("<span><img alt=\"pixels of {name}\" src=\"{data}\"></span>")
        });
        let shows = draw.shows.map_or("", |role| role.name());
        let _ = writeln!(
            text,
            "<figure>{picture}<figcaption>{name} {shows}: {} fragments, {} samples; textures: {}</figcaption></figure>",
            draw.fragments, draw.samples, draw.textures
        );
    }
    let _ = writeln!(text, "</div></details></td></tr>");
}

/// A picture as PNG in a URI, without its alpha.
fn png(picture: &Thumbnail) -> Option<String> {
    let rgb: Vec<u8> = (picture.texels.chunks_exact(4))
        .flat_map(|texel| [texel[0], texel[1], texel[2]])
        .collect();
    encoded(picture.size, &rgb, ExtendedColorType::Rgb8)
}

fn encoded([width, height]: [u32; 2], samples: &[u8], color: ExtendedColorType) -> Option<String> {
    let mut bytes = Vec::new();
    let written = PngEncoder::new(&mut bytes).write_image(samples, width, height, color);
    let data = |()| format!("data:image/png;base64,{}", STANDARD.encode(bytes));
    written.ok().map(data)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::list::DrawRow;
    use crate::views::{Role, Rule, View};

    #[test]
    fn a_picture_that_is_bottom_up_is_turned() {
        let picture = Thumbnail {
            size: [1, 2],
            texels: vec![1, 2, 3, 4, 5, 6, 7, 8],
        };
        assert_eq!(picture.upside_down().texels, [5, 6, 7, 8, 1, 2, 3, 4]);
    }

    #[test]
    fn a_page_shows_passes_and_their_pictures_and_escapes_names() {
        let row = PassRow {
            shows: vec![Role::Shadow],
            target: "64x64 D32_SFLOAT".to_owned(),
            viewports: vec![View {
                origin: [0, 0],
                size: [64, 64],
            }],
            draws: 3,
            caveats: vec!["alpha to coverage".to_owned()],
            picture: Some(Thumbnail {
                size: [1, 1],
                texels: vec![255; 4],
            }),
            draw_rows: vec![DrawRow {
                number: 0,
                shows: Some(Role::Shadow),
                fragments: 12,
                samples: 0,
                textures: 1,
                covered: Some(Thumbnail {
                    size: [1, 1],
                    texels: vec![0; 4],
                }),
            }],
            ..PassRow::default()
        };
        let list = List {
            frame: 4,
            eyes: Ok(Rule::Halves),
            rows: vec![row],
        };
        let text = page("a<b", std::slice::from_ref(&list));
        assert!(text.contains("<title>Passes of a&lt;b</title>"));
        assert!(text.contains("frame 4: both eyes by viewport halves"));
        assert!(text.contains("shadow map") && text.contains("data:image/png;base64,iVBOR"));
        assert!(text.contains("alpha to coverage"));
        assert!(text.contains("alt=\"pixels of draw 0\""));
        assert!(text.contains("draw 0 shadow map: 12 fragments, 0 samples; textures: 1"));
        let table = list.table();
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[0].starts_with("pass  shows"), "{table}");
        assert!(lines[1].contains("64x64 at 0,0"), "{table}");
    }
}
