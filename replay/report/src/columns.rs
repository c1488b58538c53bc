//! Columns: the names, the number format and the values of a row's figures.
//!
//! A row type lists its columns once ([`Row`]); the terminal table, the page's table and CSV
//! and the JSON objects ([`Table`](super::table::Table)) walk that list.

use serde::ser::{Serialize, Serializer};
use sim::figure::{Because, Figure};
use std::borrow::Cow;
use studies::experiment::ResultRow;

/// A cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Value {
    /// Nothing: an empty cell, `null` in JSON.
    #[default]
    None,
    /// Text.
    Text(String),
    /// A name, and its form in tables.
    Named(&'static str, &'static str),
    /// Yes or no.
    Flag(bool),
    /// A count.
    Whole(u64),
    /// A measure.
    Real(f64),
    /// A measure with its doubt.
    Figure(Box<Figure>),
}

/// The type of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Text.
    Text,
    /// Yes or no.
    Flag,
    /// Counts.
    Whole,
    /// Measures.
    Real,
}

/// A type that a column's function can return; it determines the column's kind.
pub trait Cell: Into<Value> {
    /// The column's kind.
    const KIND: Kind;
}

/// Implements [`Cell`] for a type.
macro_rules! cell {
    ($type:ty, $kind:ident, $value:expr) => {
        impl From<$type> for Value {
            fn from(value: $type) -> Self {
                $value(value)
            }
        }

        impl Cell for $type {
            const KIND: Kind = Kind::$kind;
        }
    };
}

cell!(String, Text, Value::Text);
cell!(&str, Text, |text: &str| Value::Text(text.to_owned()));
cell!(bool, Flag, Value::Flag);
cell!(u8, Whole, |n: u8| Value::Whole(n.into()));
cell!(u32, Whole, |n: u32| Value::Whole(n.into()));
cell!(u64, Whole, Value::Whole);
cell!(f32, Real, |x: f32| Value::Real(x.into()));
cell!(f64, Real, Value::Real);
cell!(Figure, Real, |figure| Value::Figure(Box::new(figure)));

/// A name and its title.
impl Cell for Value {
    const KIND: Kind = Kind::Text;
}

impl<T: Cell> Cell for Option<T> {
    const KIND: Kind = T::KIND;
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, Into::into)
    }
}

impl Value {
    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(n) => Some(*n as f64),
            Self::Real(x) => Some(*x),
            Self::Figure(figure) => Some(figure.value),
            Self::None | Self::Text(_) | Self::Named(..) | Self::Flag(_) => None,
        }
    }

    /// The figure, if it has a doubt.
    pub fn figure(&self) -> Option<&Figure> {
        match self {
            Self::Figure(figure) => Some(figure),
            _ => None,
        }
    }

    /// In full precision, for CSV.
    pub fn exact(&self) -> String {
        match self {
            Self::None => String::new(),
            Self::Text(text) => text.clone(),
            Self::Named(name, _) => (*name).to_owned(),
            Self::Flag(flag) => flag.to_string(),
            Self::Whole(n) => n.to_string(),
            Self::Real(x) => x.to_string(),
            Self::Figure(figure) => figure.value.to_string(),
        }
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::None => serializer.serialize_none(),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Named(name, _) => serializer.serialize_str(name),
            Self::Flag(flag) => serializer.serialize_bool(*flag),
            Self::Whole(n) => serializer.serialize_u64(*n),
            Self::Real(x) => serializer.serialize_f64(*x),
            Self::Figure(figure) => serializer.serialize_f64(figure.value),
        }
    }
}

/// Number format of a column in tables. CSV and JSON have full precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// Left-aligned text.
    Text,
    /// A count with groups of three digits.
    Whole,
    /// With this many decimals.
    Decimals(usize),
    /// In millions, with this many decimals.
    Millions(usize),
}

impl Show {
    /// The cell of a table. The ends of an interval are in parentheses, those of bounds in brackets.
    pub fn write(self, value: &Value) -> String {
        if let Value::Figure(figure) = value {
            let [text, low, high] =
                [figure.value, figure.low, figure.high].map(|x| self.write(&Value::Real(x)));
            return match figure.because {
                Because::Exact => text,
                Because::Sampling { .. } | Because::Residuals { .. } => {
                    format!("{text} ({low} to {high})")
                }
                Because::Bounds { .. } => format!("{text} [{low} to {high}]"),
            };
        }
        let fixed = |x: f64, decimals: usize| {
            // Values that round to negative zero print without a sign.
            let text = format!("{x:.decimals$}");
            match text.strip_prefix('-') {
                Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
                _ => text,
            }
        };
        match (self, value.number()) {
            (Self::Whole, Some(_)) => super::theme::group_thousands(&value.exact()),
            (Self::Decimals(decimals), Some(x)) => fixed(x, decimals),
            (Self::Millions(decimals), Some(x)) => fixed(x * 1e-6, decimals),
            _ => match value {
                Value::Named(_, title) => (*title).to_owned(),
                Value::Flag(flag) => if *flag { "yes" } else { "" }.to_owned(),
                _ => value.exact(),
            },
        }
    }
}

/// A column without its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    /// Name in CSV and JSON. In JSON, a dot makes a nested object (`paper.l1_footprint_miss_pct`); in CSV it becomes
    /// `_`.
    pub key: Cow<'static, str>,
    /// Heading of a table.
    pub name: Cow<'static, str>,
    /// Unit, or empty.
    pub unit: &'static str,
    /// Type of the values.
    pub kind: Kind,
    /// Number format in tables.
    pub show: Show,
    /// Definition of the figure, for charts and for the page's notes; may be empty.
    pub about: &'static str,
    /// Group of columns in tables of a page; may be empty.
    pub group: Cow<'static, str>,
    /// Whether it holds published figures, which tables print in a lighter ink.
    pub published: bool,
}

impl Heading {
    /// Name of the group of columns in tables of a page: the part of the key before the dot, unless one is
    /// set.
    pub(super) fn group_name(&self) -> String {
        match (self.group.is_empty(), self.key.split_once('.')) {
            (false, _) => self.group.to_string(),
            (true, Some((first, _))) => first.replace('_', " "),
            (true, None) => String::new(),
        }
    }

    /// Name in CSV and Parquet files.
    pub(super) fn flat_key(&self) -> String {
        self.key.replace('.', "_")
    }

    /// Definition and unit, for the axis of a chart.
    pub(super) fn axis_label(&self) -> String {
        format!("{}, {}", self.about, self.unit)
    }
}

/// A column of rows of type `R`.
pub struct Column<'a, R: ?Sized> {
    /// Name and format.
    pub heading: Heading,
    value: Box<dyn Fn(&R) -> Value + 'a>,
}

impl<'a, R: ?Sized> Column<'a, R> {
    /// A column with this number format and unit.
    pub fn new<V: Cell>(
        key: impl Into<Name>,
        name: impl Into<Name>,
        unit: &'static str,
        show: Show,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        let value = Box::new(move |row: &R| value(row).into());
        Self::of_kind(key.into(), name.into(), unit, V::KIND, show, value)
    }

    /// The part of `new` that is compiled once, not for every closure.
    fn of_kind(
        key: Cow<'static, str>,
        name: Cow<'static, str>,
        unit: &'static str,
        kind: Kind,
        show: Show,
        value: Box<dyn Fn(&R) -> Value + 'a>,
    ) -> Self {
        Self {
            heading: Heading {
                key,
                name,
                unit,
                kind,
                show,
                about: "",
                group: Cow::Borrowed(""),
                published: false,
            },
            value,
        }
    }

    /// A column of text.
    pub fn text<V: Cell>(
        key: impl Into<Name>,
        name: impl Into<Name>,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        Self::new(key, name, "", Show::Text, value)
    }

    /// A column of measures with this many decimals.
    pub fn real<V: Cell>(
        key: impl Into<Name>,
        name: impl Into<Name>,
        unit: &'static str,
        decimals: usize,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        Self::new(key, name, unit, Show::Decimals(decimals), value)
    }

    /// The same column for rows that contain such a row.
    pub fn on<S>(self, of: impl Fn(&S) -> &R + 'a) -> Column<'a, S>
    where
        R: 'a,
    {
        Column {
            heading: self.heading,
            value: Box::new(move |row| (self.value)(of(row))),
        }
    }

    /// Sets the definition of the figure.
    pub fn about(mut self, about: &'static str) -> Self {
        self.heading.about = about;
        self
    }

    /// Sets the group of columns in tables of a page.
    pub fn group(mut self, group: impl Into<Name>) -> Self {
        self.heading.group = group.into();
        self
    }

    /// Sets the type of the values where the function's return type does not determine it.
    pub fn kind(mut self, kind: Kind) -> Self {
        self.heading.kind = kind;
        self
    }

    /// Marks published figures.
    pub fn published(mut self) -> Self {
        self.heading.published = true;
        self
    }

    /// The cell of a row.
    pub fn value(&self, row: &R) -> Value {
        (self.value)(row)
    }
}

/// Text that is fixed or computed.
type Name = Cow<'static, str>;

/// An empty list of columns of rows of type `R`; [`Columns`] adds to it.
pub fn columns_of<'a, R: ?Sized>() -> Vec<Column<'a, R>> {
    Vec::new()
}

/// Adds columns to a list. A definition and a mark belong to the column before them.
pub trait Columns<'a, R: ?Sized>: Sized {
    /// Adds a column.
    #[must_use]
    fn and(self, column: Column<'a, R>) -> Self;

    /// Changes the last column.
    #[must_use]
    fn change_last(self, change: impl FnOnce(Column<'a, R>) -> Column<'a, R>) -> Self;

    /// Adds a column with this number format.
    #[must_use]
    fn shown<V: Cell>(
        self,
        key: impl Into<Name>,
        name: impl Into<Name>,
        unit: &'static str,
        show: Show,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        self.and(Column::new(key, name, unit, show, value))
    }

    /// Adds a column of text.
    #[must_use]
    fn text<V: Cell>(
        self,
        key: impl Into<Name>,
        name: impl Into<Name>,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        self.shown(key, name, "", Show::Text, value)
    }

    /// Adds a column of measures with this many decimals.
    #[must_use]
    fn real<V: Cell>(
        self,
        key: impl Into<Name>,
        name: impl Into<Name>,
        unit: &'static str,
        decimals: usize,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        self.shown(key, name, unit, Show::Decimals(decimals), value)
    }

    /// Adds a column of counts.
    #[must_use]
    fn whole<V: Cell>(
        self,
        key: impl Into<Name>,
        name: impl Into<Name>,
        unit: &'static str,
        value: impl Fn(&R) -> V + 'a,
    ) -> Self {
        self.shown(key, name, unit, Show::Whole, value)
    }

    /// Sets the definition of the figure.
    #[must_use]
    fn about(self, about: &'static str) -> Self {
        self.change_last(|column| column.about(about))
    }

    /// Marks published figures.
    #[must_use]
    fn published(self) -> Self {
        self.change_last(Column::published)
    }
}

impl<'a, R: ?Sized> Columns<'a, R> for Vec<Column<'a, R>> {
    fn and(mut self, column: Column<'a, R>) -> Self {
        self.push(column);
        self
    }

    fn change_last(mut self, change: impl FnOnce(Column<'a, R>) -> Column<'a, R>) -> Self {
        let last = self.pop().map(change);
        self.extend(last);
        self
    }
}

/// A row type. It lists its columns once, in the order of CSV and JSON.
pub trait Row {
    /// Every column.
    fn columns() -> Vec<Column<'static, Self>>;
}

/// The columns with these keys, in the order of `keys`. Skips a key that no column has; debug builds panic.
pub fn pick<R: Row>(keys: &[&str]) -> Vec<Column<'static, R>> {
    let mut all: Vec<Option<Column<R>>> = R::columns().into_iter().map(Some).collect();
    let mut take = |key: &&str| {
        let found = all
            .iter_mut()
            .find(|c| c.as_ref().is_some_and(|c| c.heading.key == *key));
        debug_assert!(found.is_some(), "no column `{key}`");
        found.and_then(Option::take)
    };
    keys.iter().filter_map(&mut take).collect()
}

/// The name of an enum's value in files and on the command line.
pub(super) fn name(value: &impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

/// A column of point results.
pub type PointColumn<'a> = Column<'static, ResultRow<'a>>;

/// `part / whole`, or `None` if the whole is zero.
pub(super) fn over(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Point {
        misses: u64,
        paper: Option<f64>,
    }

    impl Row for Point {
        fn columns() -> Vec<Column<'static, Self>> {
            columns_of::<Self>()
                .real("misses", "misses", "M", 1, |p| p.misses)
                .real("paper.half", "half", "%", 2, |p| p.paper.map(|x| x / 2.0))
        }
    }

    #[test]
    fn columns_are_selected_in_the_requested_order() {
        let picked = pick::<Point>(&["paper.half", "misses"]);
        let names: Vec<_> = picked.iter().map(|c| c.heading.name.as_ref()).collect();
        assert_eq!(names, ["half", "misses"]);
    }

    #[test]
    fn a_table_rounds_values_and_prints_zero_without_a_sign() {
        assert_eq!(Show::Decimals(1).write(&Value::Real(-0.04)), "0.0");
        assert_eq!(Show::Decimals(1).write(&Value::Real(-0.06)), "-0.1");
        assert_eq!(Show::Millions(2).write(&Value::Whole(1_234_567)), "1.23");
        assert_eq!(Show::Decimals(1).write(&Value::None), "");
    }
}
