//! Causes of different coordinates or footprints of a fragment that both sides have.

use super::geometry::{Coordinates, Sampled};
use super::lod::{clamped, level_of_detail};
use formats::footprint::LodFormula;
use formats::textrace::QuadRecord;
use formats::texture::Texture;
use glam::DVec2;
use serde::Serialize;

/// Distance of coordinates and of levels of detail that rounding in the trace and in single precision
/// explains.
pub(super) const SMALL: f64 = 1.0 / 64.0;

/// Screen error of a vertex that is transformed, clipped and projected in single precision: units in the last
/// place of its largest screen coordinate.
const VERTEX_ULPS: f64 = 32.0;

/// Limit of the differences in captured records: sums of four fit in 32 bits.
pub(super) const LARGEST_DIFFERENCE: u32 = 1 << 28;

/// A cause of an error of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum UvCause {
    /// At most 1/64 texel.
    Small,
    /// The driver uses the same derivatives for the whole quad, so the opposite lane lacks the cross term.
    NoCross,
    /// Vertices in single precision: near the horizon and on slivers, coordinates depend strongly on them.
    SinglePrecision,
    /// Slivers whose differences over a quad exceed the trace's fixed-point range.
    Saturated,
    /// None of these.
    Unexplained,
}

/// A cause of different levels or texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SampleCause {
    /// The driver's formula of the level of detail.
    Formula,
    /// One derivative per quad instead of the fragment's own.
    Quad,
    /// Both.
    FormulaAndQuad,
    /// Rounding at a boundary of levels or texels.
    Rounding,
    /// Coordinates that differ, for a cause of their own.
    Coordinates,
    /// None of these.
    Unexplained,
}

impl UvCause {
    /// Every cause.
    pub const ALL: [Self; 5] = [
        Self::Small,
        Self::NoCross,
        Self::SinglePrecision,
        Self::Saturated,
        Self::Unexplained,
    ];

    /// Description for reports.
    pub fn text(self) -> &'static str {
        match self {
            Self::Small => "within 1/64 texel",
            Self::NoCross => "quads without a cross term",
            Self::SinglePrecision => "vertices in single precision",
            Self::Saturated => "beyond the trace's fixed point",
            Self::Unexplained => "unexplained",
        }
    }
}

impl SampleCause {
    /// Every cause.
    pub const ALL: [Self; 6] = [
        Self::Formula,
        Self::Quad,
        Self::FormulaAndQuad,
        Self::Rounding,
        Self::Coordinates,
        Self::Unexplained,
    ];

    /// Description for reports.
    pub fn text(self) -> &'static str {
        match self {
            Self::Formula => "the LOD formula",
            Self::Quad => "one derivative a quad",
            Self::FormulaAndQuad => "the LOD formula and one derivative a quad",
            Self::Rounding => "rounding at the end of a level or texel",
            Self::Coordinates => "coordinates that differ (above)",
            Self::Unexplained => "unexplained",
        }
    }
}

/// A fragment's coordinates in one group, captured and expected.
pub struct FragmentCoordinates<'a> {
    /// The primitive's coordinates.
    pub coordinates: &'a Coordinates<'a>,
    /// The fragment's pixel.
    pub pixel: [u32; 2],
    /// Texels of the group.
    pub extent: DVec2,
    /// Size of the screen in pixels; drivers clip at its border.
    pub size_px: [u32; 2],
    /// The driver's formula of the level of detail and its choice of derivatives.
    pub formula: LodFormula,
}

impl FragmentCoordinates<'_> {
    /// The cause of a difference between the coordinates of a record and the true ones; `error` is captured
    /// minus true, in repeats.
    pub fn of_uv(&self, record: &QuadRecord, error: DVec2) -> UvCause {
        let texels = |uv: DVec2| (uv * self.extent).length();
        if texels(error) <= SMALL {
            return UvCause::Small;
        }
        let center = super::piece::center(self.pixel);
        let planes = self.coordinates.interpolation_error(center);
        let single = texels(self.by_single_precision(|s| s.uv) + planes);
        let derived = texels(self.coordinates.single_precision(center));
        let single = if derived.is_finite() {
            single.max(derived)
        } else {
            single
        };
        if self.formula == LodFormula::Softpipe {
            // The quad's coordinates may originate from any lane.
            let found = self.coordinates.at(center) + error;
            let near = |lane| texels(found - self.coordinates.without_cross(self.pixel, lane));
            if (0..4).any(|lane| near(lane) <= SMALL + single) {
                return UvCause::NoCross;
            }
        }
        if texels(error) <= SMALL + single {
            return UvCause::SinglePrecision;
        }
        let [cut] = (self.coordinates).single_precision_cut(center, self.size_px, [center]);
        if cut.is_finite() && texels(error) <= SMALL + texels(cut) {
            return UvCause::SinglePrecision;
        }
        let differences = [record.dx, record.dy, record.cross];
        if (differences.as_flattened().iter()).any(|d| d.unsigned_abs() >= LARGEST_DIFFERENCE) {
            return UvCause::Saturated;
        }
        UvCause::Unexplained
    }

    /// The cause of different levels or texels than expected. `reads` returns whether given coordinates and a
    /// level of detail would read what was captured; `lods` are the captured and the expected level. In
    /// comparisons with the specification, the driver's formula and derivatives are causes.
    pub fn of_sample(
        &self,
        texture: &Texture,
        uv: UvCause,
        lods: [f64; 2],
        reads: impl Fn(DVec2, f64) -> bool,
    ) -> SampleCause {
        let quad = self.coordinates.in_quad(self.pixel, self.formula);
        let own = self.coordinates.exact(super::piece::center(self.pixel));
        let lod = |at: &Sampled, formula| level_of_detail(at, texture, formula);
        let alone = [
            (SampleCause::Formula, lod(&own, self.formula)),
            (SampleCause::Quad, lod(&quad, LodFormula::Exact)),
            (SampleCause::FormulaAndQuad, lod(&quad, self.formula)),
        ];
        let [captured, expected] = lods;
        let of_driver = clamped(lod(&quad, self.formula), texture);
        if expected != of_driver {
            let found = alone.into_iter().find(|(_, lod)| reads(own.uv, *lod));
            if let Some((cause, _)) = found {
                return cause;
            }
        }
        if uv == UvCause::Unexplained {
            return SampleCause::Unexplained;
        }
        let level = |at: &Sampled| DVec2::X * clamped(lod(at, self.formula), texture);
        let allowed = || SMALL + self.by_single_precision(level).x;
        if (captured - of_driver).abs() > SMALL && (captured - of_driver).abs() > allowed() {
            return SampleCause::Unexplained;
        }
        match uv {
            UvCause::Small => SampleCause::Rounding,
            _ => SampleCause::Coordinates,
        }
    }

    /// Change of a value if the vertices move by their errors in single precision.
    fn by_single_precision(&self, of: impl Fn(&Sampled) -> DVec2) -> DVec2 {
        let piece = self.coordinates.piece();
        let here = of(&self.coordinates.in_quad(self.pixel, self.formula));
        let step = VERTEX_ULPS * f64::from(f32::EPSILON) * piece.largest_px();
        let mut sum = DVec2::ZERO;
        for corner in 0..3 {
            for by in [DVec2::X, DVec2::Y] {
                let moved = piece.moved(corner, by * step);
                let there = of(&(self.coordinates.on(&moved)).in_quad(self.pixel, self.formula));
                sum += (there - here).abs();
            }
        }
        sum
    }
}
