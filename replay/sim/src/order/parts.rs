//! The parts of an order, and order names that list them: `zig-zag+sta+offset+boustro`.

use super::assignment::Assignment;
use super::cost::Cost;
use super::curve::{Curve, Ground, shuffle};
use super::pairing::{Pairing, Placement, tiles};
use super::{Interleave, PlanInputs, TileRef, View, WorkItem};
use std::fmt;

/// How an order combines the tiles of both eyes along the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eyes {
    /// The whole left view, then the whole right view.
    ViewByView,
    /// The left tile, then the right tile of the same cell.
    InTurn,
    /// Both tiles of a cell as one item for one core.
    OneCore(Interleave),
}

impl Eyes {
    /// All values.
    pub const ALL: [Self; 5] = [
        Self::ViewByView,
        Self::InTurn,
        Self::OneCore(Interleave::Alternate),
        Self::OneCore(Interleave::Merge),
        Self::OneCore(Interleave::Halves),
    ];

    /// Name in an order's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ViewByView => "sv",
            Self::InTurn => "lrta",
            Self::OneCore(Interleave::Alternate) => "sta",
            Self::OneCore(Interleave::Merge) => "merge",
            Self::OneCore(Interleave::Halves) => "halves",
        }
    }

    fn cost(self) -> Cost {
        match self {
            Self::ViewByView => Cost::state(1),
            Self::InTurn | Self::OneCore(Interleave::Halves) => Cost::state(2),
            // The second tile, and a buffer for it.
            Self::OneCore(Interleave::Alternate | Interleave::Merge) => {
                Cost::state(2).with_tile_buffers(2)
            }
        }
    }
}

/// The direction of traversal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Always the same.
    Same,
    /// Backwards in every other frame (Boustrophedonic Frames, PACT 2023).
    Boustro,
    /// Backwards in the right view.
    RightReversed,
}

impl Direction {
    /// All values.
    pub const ALL: [Self; 3] = [Self::Same, Self::Boustro, Self::RightReversed];

    /// Name in an order's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Boustro => "boustro",
            Self::RightReversed => "right-reversed",
        }
    }

    fn cost(self) -> Cost {
        // Costs count whole bytes, even for a single bit.
        Cost::state(u32::from(self == Self::Boustro))
    }
}

/// The parts of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// The path through the cells of a grid.
    pub curve: Curve,
    /// The number after the curve's name; none for the curve's default.
    pub size: Option<u32>,
    /// How the tiles of both eyes are combined.
    pub eyes: Eyes,
    /// Which tiles share a cell.
    pub pairing: Pairing,
    /// Direction of traversal.
    pub direction: Direction,
    /// The assignment of items to cores; none if the configuration decides.
    pub assignment: Option<Assignment>,
}

/// The largest number after a curve's name.
const MOST_SIZE: u32 = 1 << 20;

impl Parts {
    /// A curve that traverses one view after the other.
    pub const fn of(curve: Curve) -> Self {
        Self {
            curve,
            size: None,
            eyes: Eyes::ViewByView,
            pairing: Pairing::INDEX,
            direction: Direction::Same,
            assignment: None,
        }
    }

    /// These parts with another combination of the eyes.
    #[must_use]
    pub const fn with(self, eyes: Eyes) -> Self {
        Self { eyes, ..self }
    }

    /// Parses an order's name: the name of the curve, then a `+` and a name for each other part.
    ///
    /// # Errors
    /// An unknown part, two parts of one kind, or parts that cannot be combined.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut names = text.split('+');
        let (curve, size) = curve(names.next().unwrap_or_default())?;
        let mut parts = Self {
            size,
            ..Self::of(curve)
        };
        let mut known: Vec<&str> = Vec::new();
        for name in names {
            let kind = parts.set(name).ok_or_else(|| unknown_part(name))?;
            if known.contains(&kind) {
                return Err(format!("`{name}`: expected one {kind}, found two"));
            }
            known.push(kind);
        }
        parts.check()
    }

    /// True for a name with several parts, and for a curve with or without a number.
    pub(super) fn is_composed(name: &str) -> bool {
        let curve = name.trim_end_matches(|c: char| c.is_ascii_digit());
        name.contains('+') || Curve::find(curve).is_some()
    }

    /// Sets the part with this name. Returns its kind.
    fn set(&mut self, name: &str) -> Option<&'static str> {
        if let Some(eyes) = Eyes::ALL.into_iter().find(|eyes| eyes.name() == name) {
            self.eyes = eyes;
            return Some("way to combine the eyes");
        }
        if let Some(pairing) = Pairing::find(name) {
            self.pairing = pairing;
            return Some("pairing");
        }
        if let Some(direction) = Direction::ALL.into_iter().find(|of| of.name() == name) {
            self.direction = direction;
            return Some("direction");
        }
        let assignment = Assignment::ALL.into_iter().find(|of| of.name() == name)?;
        self.assignment = Some(assignment);
        Some("assignment")
    }

    /// Refuses parts that cannot be combined.
    fn check(self) -> Result<Self, String> {
        let alone = self.eyes == Eyes::ViewByView;
        if alone && self.pairing != Pairing::INDEX {
            return Err(format!(
                "`{}` pairs tiles: expected lrta, sta, merge or halves with it",
                self.pairing.name()
            ));
        }
        if !alone && self.direction == Direction::RightReversed {
            return Err(
                "`right-reversed` turns the right view: expected it view by view, without lrta, sta, merge or halves"
                    .to_owned(),
            );
        }
        Ok(self)
    }

    /// These parts with the curve's default number for this L2, unless they contain a number.
    #[must_use]
    pub(super) fn resolved(self, l2_bytes: u64) -> Self {
        let usual = || self.curve.usual_size(l2_bytes);
        let size = self
            .curve
            .size_unit()
            .map(|_| self.size.unwrap_or_else(usual));
        Self { size, ..self }
    }

    /// True if the order needs counters of the last frame.
    pub fn needs_counters(&self) -> bool {
        let pairing = self.pairing == Pairing::ROW_PRIMITIVES || self.pairing == Pairing::ROW_LINES;
        pairing || self.curve == Curve::ADAPTIVE
    }

    /// The hardware cost for views of `tiles`.
    pub fn cost(&self, tiles: [u32; 2], cores: u32) -> Cost {
        let assignment = self.assignment.unwrap_or(Assignment::FirstIdle);
        let parts = [
            self.pairing.rule().cost(tiles),
            self.eyes.cost(),
            self.direction.cost(),
            assignment.cost(cores),
        ];
        let curve = self.curve.path().cost(tiles);
        parts.into_iter().fold(curve, Cost::and)
    }

    /// The grid of cells for a view, or for a left view and its partner.
    fn ground(&self, grid: [u32; 2], view: View, inputs: &PlanInputs<'_>) -> Ground {
        Ground {
            grid,
            size: self
                .size
                .unwrap_or_else(|| self.curve.usual_size(inputs.l2_bytes)),
            seed: inputs.seed,
            frame_bytes: inputs.counted(view).map(|of| of.bytes),
        }
    }

    /// The work of a single view.
    pub(super) fn mono(&self, view: View, inputs: &PlanInputs<'_>) -> Vec<WorkItem> {
        let cells = self
            .curve
            .path()
            .cells(&self.ground(view.tiles, view, inputs));
        let tile = |at| view.tile(at).map(WorkItem::Tile);
        cells.into_iter().filter_map(tile).collect()
    }

    /// The work of a stereo pair. A tile without a partner is an item of its own.
    pub fn stereo(&self, left: View, right: View, inputs: &PlanInputs<'_>) -> Vec<WorkItem> {
        if self.eyes == Eyes::ViewByView {
            return self.view_by_view(left, right, inputs);
        }
        let placement = self.pairing.rule().place([left, right], inputs);
        let ground = self.ground(placement.grid, left, inputs);
        let cells = self.curve.path().cells(&ground);
        let mut items = Vec::with_capacity(cells.len());
        for [left, right] in by_cell(&placement, &cells, [left, right]) {
            let (mut left, mut right) = (left.into_iter(), right.into_iter());
            loop {
                match (left.next(), right.next(), self.eyes) {
                    (None, None, _) => break,
                    (Some(l), Some(r), Eyes::OneCore(interleave)) => {
                        items.push(WorkItem::Pair(l, r, interleave));
                    }
                    (l, r, _) => items.extend([l, r].into_iter().flatten().map(WorkItem::Tile)),
                }
            }
        }
        items
    }

    fn view_by_view(&self, left: View, right: View, inputs: &PlanInputs<'_>) -> Vec<WorkItem> {
        if self.curve == Curve::RANDOM {
            let all = [left, right].into_iter().flat_map(|view| {
                tiles(view).filter_map(move |at| view.tile(at).map(WorkItem::Tile))
            });
            let mut items: Vec<WorkItem> = all.collect();
            shuffle(inputs.seed, &mut items);
            return items;
        }
        let (left, mut right) = (self.mono(left, inputs), self.mono(right, inputs));
        if self.direction == Direction::RightReversed {
            right.reverse();
        }
        [left, right].concat()
    }
}

/// The tiles of each cell in the order of the curve, separately for each eye.
fn by_cell(placement: &Placement, cells: &[[u32; 2]], eyes: [View; 2]) -> Vec<[Vec<TileRef>; 2]> {
    let columns = placement.grid[0] as usize;
    let index = |[x, y]: [u32; 2]| y as usize * columns + x as usize;
    let mut steps = vec![0_u32; columns * placement.grid[1] as usize];
    for (step, &cell) in (0..).zip(cells) {
        steps[index(cell)] = step;
    }
    let mut found: Vec<[Vec<TileRef>; 2]> = vec![[Vec::new(), Vec::new()]; cells.len()];
    for (eye, (view, of_eye)) in eyes.iter().zip(&placement.cells).enumerate() {
        for (tile, &cell) in (0..).zip(of_eye) {
            let pass = view.pass;
            found[steps[index(cell)] as usize][eye].push(TileRef { pass, tile });
        }
    }
    found
}

/// Splits a curve's name and the number after it.
fn curve(text: &str) -> Result<(Curve, Option<u32>), String> {
    if let Some(curve) = Curve::find(text) {
        return Ok((curve, None));
    }
    let name = text.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &text[name.len()..];
    let Some(curve) = Curve::find(name) else {
        let known: Vec<&str> = Curve::all().map(Curve::name).collect();
        return Err(format!(
            "`{text}`: expected a curve, one of {}",
            known.join(", ")
        ));
    };
    let Some(unit) = curve.size_unit() else {
        return Err(format!("`{text}`: expected no number behind {name}"));
    };
    let size = digits.parse().ok();
    let size = size.filter(|size| (1..=MOST_SIZE).contains(size) && !digits.starts_with('0'));
    let size = size.ok_or_else(|| format!("`{text}`: expected 1 to {MOST_SIZE} {unit}"))?;
    Ok((curve, Some(size)))
}

fn unknown_part(name: &str) -> String {
    let eyes = Eyes::ALL.map(Eyes::name);
    let pairings = Pairing::all().map(Pairing::name);
    let directions = Direction::ALL.map(Direction::name);
    let assignments = Assignment::ALL.map(Assignment::name);
    let known: Vec<&str> = (eyes.into_iter().chain(pairings))
        .chain(directions)
        .chain(assignments)
        .collect();
    format!("`{name}`: expected a part, one of {}", known.join(", "))
}

/// The name without default parts.
impl fmt::Display for Parts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.curve.name())?;
        if let Some(size) = self.size {
            write!(f, "{size}")?;
        }
        let others = [
            Some(self.eyes.name()).filter(|_| self.eyes != Eyes::ViewByView),
            Some(self.pairing.name()).filter(|_| self.pairing != Pairing::INDEX),
            Some(self.direction.name()).filter(|_| self.direction != Direction::Same),
            self.assignment.map(Assignment::name),
        ];
        for name in others.into_iter().flatten() {
            write!(f, "+{name}")?;
        }
        Ok(())
    }
}
