//! Lists the render passes of a frame, as a table and as a page with pictures of passes and draws.

mod draws;
mod page;

pub use draws::DrawRow;
pub use page::page;

use crate::drain::weight;
use crate::session::{ProgramFrame, Session, SessionError};
use crate::texture::texture;
use crate::views::{self, Role, View, Views, ViewsError, Wanted, viewport};
use ash::vk;
use spool::{RawSample, What};
use spool::{ShaderInfo, ViewInfo};
use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

/// A small picture: red, green, blue and alpha, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Thumbnail {
    /// Width and height.
    pub size: [u32; 2],
    /// Texels.
    pub texels: Vec<u8>,
}

impl Thumbnail {
    pub(crate) fn upside_down(self) -> Self {
        let rows = self.texels.chunks(4 * self.size[0] as usize);
        Self {
            texels: rows.rev().flatten().copied().collect(),
            size: self.size,
        }
    }
}

/// A render pass of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassRow {
    /// Number within the frame.
    pub number: usize,
    /// Distinct roles of its draws.
    pub shows: Vec<Role>,
    /// Size and format of the target.
    pub target: String,
    /// Distinct viewports.
    pub viewports: Vec<View>,
    /// View mask.
    pub views: u32,
    /// Number of draws.
    pub draws: u64,
    /// Distinct reasons why draws are not recorded or are recorded less exactly.
    pub caveats: Vec<String>,
    /// Number of fragments.
    pub fragments: u64,
    /// Number of texture samples.
    pub samples: u64,
    /// Number of distinct textures that were read.
    pub textures: usize,
    /// Size of these textures in bytes, with all levels.
    pub texture_bytes: u64,
    /// Size of the target.
    pub target_size: [u32; 2],
    /// Picture of the target.
    pub picture: Option<Thumbnail>,
    /// Its draws; empty without pictures.
    pub draw_rows: Vec<DrawRow>,
}

/// The render passes of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct List {
    /// Number of the frame.
    pub frame: u32,
    /// Rule that identified the eyes, or the reason why none did.
    pub eyes: Result<views::Rule, ViewsError>,
    /// Render passes in the order of execution.
    pub rows: Vec<PassRow>,
}

/// Lists a frame.
///
/// # Errors
/// The frame has no draws, or the records cannot be read.
pub fn list(session: &mut Session, number: u32, wanted: &Wanted) -> Result<List, SessionError> {
    let frame = session.drawn(number)?;
    let records = session.records(number)?;
    let weight = |draw| weight(session, draw, &records);
    let weights: Vec<u64> = frame.draws.iter().map(weight).collect();
    let views = views::find(session, &frame, &weights, wanted);
    let rows = rows(session, &frame, &weights, &records, views.as_ref().ok());
    Ok(List {
        frame: number,
        eyes: views.map(|views| views.rule),
        rows,
    })
}

fn rows(
    session: &Session,
    frame: &ProgramFrame,
    weights: &[u64],
    records: &HashMap<u32, Vec<RawSample>>,
    views: Option<&Views>,
) -> Vec<PassRow> {
    let numbers = views::pass_numbers(frame);
    let mut rows: Vec<PassRow> = Vec::new();
    let mut textures: Vec<HashSet<ViewInfo>> = Vec::new();
    let mut bottom_up: Vec<bool> = Vec::new();
    for (place, executed) in frame.draws.iter().enumerate() {
        let number = numbers[place];
        if number == rows.len() {
            rows.push(empty_row(session, number, executed.pass));
            textures.push(HashSet::new());
            bottom_up.push(false);
        }
        let row = &mut rows[number];
        // Draws that are not recorded have only the count of their query.
        let fragments = match session.draw(executed.draw).and_then(|draw| draw.shader) {
            Some(_) => weights[place],
            None => executed.occlusion.unwrap_or(0),
        };
        let mut draw = DrawRow {
            number: row.draws,
            shows: views.map(|views| views.roles[place]),
            fragments,
            samples: 0,
            textures: 0,
            covered: None,
        };
        row.draws += 1;
        row.fragments += fragments;
        if let Some(views) = views {
            add_once(&mut row.shows, views.roles[place]);
        }
        let Some(info) = session.draw(executed.draw) else {
            continue;
        };
        add_once(&mut row.viewports, viewport(info));
        let role = views.map(|views| views.roles[place]);
        bottom_up[number] |= session.is_bottom_up(info, role);
        for caveat in info.unrecorded.iter().chain(&info.caveats) {
            add_once(&mut row.caveats, caveat.clone());
        }
        if let (Some(shader), Some(of)) = (session.shader_of(info), records.get(&executed.draw)) {
            draw.samples = samples(shader, of);
            row.samples += draw.samples;
            draw.covered = Some(draws::covered(of, row.target_size));
        }
        draw.textures = info.textures.iter().filter(|of| of.view.is_some()).count();
        if row.picture.is_some() {
            row.draw_rows.push(draw);
        }
        textures[number].extend(info.textures.iter().filter_map(|texture| texture.view));
    }
    for (row, textures) in rows.iter_mut().zip(textures) {
        row.textures = textures.len();
        let bytes = textures.iter().filter_map(|view| {
            let texture = texture(view, session.image(view.image)?, view.image)?;
            let block = texture.format.block();
            let level = |level| {
                let size = texture.level_size(level);
                let blocks = [0, 1].map(|axis| u64::from(size[axis].div_ceil(block.texels[axis])));
                blocks[0] * blocks[1] * u64::from(block.bytes)
            };
            Some((0..texture.levels).map(level).sum::<u64>() * u64::from(texture.layers))
        });
        row.texture_bytes = bytes.sum();
    }
    for (row, _) in rows
        .iter_mut()
        .zip(bottom_up)
        .filter(|(_, bottom_up)| *bottom_up)
    {
        row.picture = row.picture.take().map(Thumbnail::upside_down);
        for draw in &mut row.draw_rows {
            draw.covered = draw.covered.take().map(Thumbnail::upside_down);
        }
    }
    rows
}

/// Adds an element unless it is present.
fn add_once<T: PartialEq>(all: &mut Vec<T>, one: T) {
    if !all.contains(&one) {
        all.push(one);
    }
}

fn empty_row(session: &Session, number: usize, pass: u32) -> PassRow {
    let info = session.pass(pass).cloned().unwrap_or_default();
    let size = |view: &ViewInfo| {
        session.image(view.image).map_or([0; 2], |image| {
            [0, 1].map(|axis| (image.size[axis] >> view.levels[0]).max(1))
        })
    };
    let name = |view: &ViewInfo| {
        let size = size(view);
        let format = vk::Format::from_raw(view.format);
        format!("{}x{} {format:?}", size[0], size[1])
    };
    let target = match (&info.colors[..], &info.depth) {
        ([], None) => "nothing".to_owned(),
        ([], Some(depth)) => name(depth),
        ([one], _) => name(one),
        ([first, rest @ ..], _) => format!("{} and {} more", name(first), rest.len()),
    };
    PassRow {
        number,
        target,
        target_size: (info.colors.first().or(info.depth.as_ref())).map_or([0; 2], size),
        views: info.view_mask.count_ones(),
        picture: (session.picture(pass)).map(|(size, texels)| Thumbnail { size, texels }),
        ..PassRow::default()
    }
}

/// Number of texture samples in records.
fn samples(shader: &ShaderInfo, records: &[RawSample]) -> u64 {
    let mut of_groups: HashMap<u16, u64> = HashMap::new();
    for site in &shader.sites {
        if matches!(site.what, What::Texture(_)) {
            *of_groups.entry(site.group).or_default() += 1;
        }
    }
    let of = |record: &RawSample| {
        let sites = of_groups.get(&record.group()).copied().unwrap_or(0);
        sites * u64::from(record.lanes().count_ones())
    };
    records.iter().map(of).sum()
}

/// Names of the roles of the draws.
fn shows(row: &PassRow) -> String {
    let names: Vec<&str> = row.shows.iter().map(|role| role.name()).collect();
    names.join(" + ")
}

fn rectangles(row: &PassRow) -> String {
    const MOST: usize = 3;
    let name = |view: &View| {
        let View {
            origin: [x, y],
            size: [width, height],
        } = view;
        format!("{width}x{height} at {x},{y}")
    };
    let mut names: Vec<String> = row.viewports.iter().take(MOST).map(name).collect();
    if row.viewports.len() > MOST {
        names.push(format!("{} more", row.viewports.len() - MOST));
    }
    if row.views > 0 {
        names.push(format!("{} views", row.views));
    }
    names.join(" + ")
}

const COLUMNS: [&str; 8] = [
    "pass",
    "shows",
    "target",
    "viewports",
    "draws",
    "fragments",
    "samples",
    "textures",
];

fn cells(row: &PassRow) -> [String; 8] {
    [
        row.number.to_string(),
        shows(row),
        row.target.clone(),
        rectangles(row),
        row.draws.to_string(),
        row.fragments.to_string(),
        row.samples.to_string(),
        format!(
            "{} ({:.1} MB)",
            row.textures,
            row.texture_bytes as f64 / 1e6
        ),
    ]
}

impl List {
    /// Text about how the eyes were identified.
    pub fn eyes_text(&self) -> String {
        match &self.eyes {
            Ok(rule) => format!("frame {}: both eyes by {}", self.frame, rule.name()),
            Err(error) => error.to_string(),
        }
    }

    /// The list as text.
    pub fn table(&self) -> String {
        let mut lines = vec![COLUMNS.map(str::to_owned)];
        lines.extend(self.rows.iter().map(cells));
        let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
        let widths: Vec<usize> = (0..COLUMNS.len()).filter_map(width).collect();
        let mut text = String::new();
        for line in &lines {
            let cells = line.iter().zip(&widths);
            let cells: Vec<String> = cells
                .map(|(cell, width)| format!("{cell:width$}"))
                .collect();
            let _ = writeln!(text, "{}", cells.join("  ").trim_end());
        }
        text
    }
}
