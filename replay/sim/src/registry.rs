//! Tables of things that a user picks by name (tile orders, replacement policies), one row each.
//!
//! Configurations, results, command-line flags, their help and error messages all derive from the table.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::hash::{Hash, Hasher};

/// A row of a table.
pub trait Row: fmt::Debug + Sized + Sync + 'static {
    /// Name in configurations, results and flags; unique in its table.
    fn name(&self) -> &'static str;
    /// One line of help.
    fn help(&self) -> &'static str;
    /// The whole table, in display order.
    fn table() -> &'static [Named<Self>];
    /// The table's names, in the same order.
    fn names() -> &'static [&'static str];
    /// The meaning of a name that is not in the table.
    ///
    /// # Errors
    /// A name without a meaning. Tables that allow only their own names always fail.
    fn other(_name: &str) -> Result<Named<Self>, Option<String>> {
        Err(None)
    }
}

/// The name most similar to a mistyped one, if any is similar.
pub fn most_similar<'n>(typed: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    /// Jaro-Winkler similarity of a suggestion.
    const LEAST_SIMILARITY: f64 = 0.8;
    let typed = typed.to_lowercase();
    names
        .map(|name| (strsim::jaro_winkler(name, &typed), name))
        .filter(|(similarity, _)| *similarity > LEAST_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// A reference to a row, serialized as its name.
#[derive(Debug)]
pub struct Named<R: 'static>(&'static R);

impl<R: Row> Named<R> {
    /// A reference to `row`.
    pub const fn new(row: &'static R) -> Self {
        Self(row)
    }

    /// Every row, in the order of the table.
    pub fn all() -> impl ExactSizeIterator<Item = Self> {
        R::table().iter().copied()
    }

    /// The row with this name.
    pub fn find(name: &str) -> Option<Self> {
        Self::by_name(name).ok()
    }

    /// The row with this name, or the meaning of a name that is not in the table.
    ///
    /// # Errors
    /// An unknown name, with the reason if there is more to report than that.
    pub fn by_name(name: &str) -> Result<Self, Option<String>> {
        let row = Self::all().find(|row| row.name() == name);
        row.map_or_else(|| R::other(name), Ok)
    }

    /// The row whose name is most similar to a mistyped one, if any is similar.
    pub fn similar(name: &str) -> Option<Self> {
        most_similar(name, R::names().iter().copied()).and_then(Self::find)
    }

    /// Name in configurations, results and flags.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// The row itself.
    pub const fn row(self) -> &'static R {
        self.0
    }
}

impl<R> Clone for Named<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Named<R> {}

impl<R: Row> PartialEq for Named<R> {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl<R: Row> Eq for Named<R> {}

impl<R: Row> Hash for Named<R> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

impl<R: Row> Serialize for Named<R> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de, R: Row> Deserialize<'de> for Named<R> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::by_name(&name).map_err(|why| match why {
            Some(why) => de::Error::custom(why),
            None => de::Error::unknown_variant(&name, R::names()),
        })
    }
}

/// A type whose values a user picks by name.
pub trait Choice: Copy + Send + Sync + 'static {
    /// Every value with a name of its own, in display order.
    fn choices() -> &'static [Self];
    /// Name in configurations, results and flags.
    fn choice_name(self) -> &'static str;
    /// One line of help.
    fn help(self) -> &'static str;
}

impl<R: Row> Choice for Named<R> {
    fn choices() -> &'static [Self] {
        R::table()
    }

    fn choice_name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        self.0.help()
    }
}

/// Defines an enum whose values a user picks by name: its meaning, and a row per value with its name and its help.
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* $type:ident = $about:tt $(, default $default:ident)?:
        $($variant:ident = $name:tt, $help:tt;)+
    ) => {
        #[doc = $about]
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
        pub enum $type {
            $(#[doc = $help] #[serde(rename = $name)] $variant,)+
        }

        $(impl Default for $type {
            fn default() -> Self {
                Self::$default
            }
        })?

        impl $type {
            /// Every value, in display order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Name in configurations, results and flags.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }

        impl $crate::registry::Choice for $type {
            fn choices() -> &'static [Self] {
                &Self::ALL
            }

            fn choice_name(self) -> &'static str {
                self.name()
            }

            fn help(self) -> &'static str {
                let help = match self {
                    $(Self::$variant => $help,)+
                };
                help.trim_end_matches('.')
            }
        }
    };
}

/// Implements [`Row`] for a type with the fields `name` and `help` from its rows as [`Named`].
#[macro_export]
macro_rules! rows {
    ($row:ty $(, other = $other:path)?: $($named:expr $(, if $only:meta)*;)+) => {
        impl $crate::registry::Row for $row {
            fn name(&self) -> &'static str {
                self.name
            }

            fn help(&self) -> &'static str {
                self.help
            }

            fn table() -> &'static [$crate::registry::Named<Self>] {
                const TABLE: &[$crate::registry::Named<$row>] = &[$($(#[$only])* $named),+];
                TABLE
            }

            fn names() -> &'static [&'static str] {
                const NAMES: &[&str] = &[$($(#[$only])* $named.row().name),+];
                NAMES
            }

            $(fn other(name: &str) -> Result<$crate::registry::Named<Self>, Option<String>> {
                $other(name)
            })?
        }
    };
}

/// Implements [`Row`] for a type with the fields `name` and `help`, and defines one constant per row.
/// `other = FUNCTION` gives the meaning of names that are not in the table.
macro_rules! registry {
    ($row:ty $(, other = $other:path)?: $($(#[$only:meta])* $id:ident = $value:expr;)+) => {
        impl $crate::registry::Named<$row> {
            $(
                $(#[$only])*
                #[doc = concat!("`", stringify!($id), "` of the table.")]
                pub const $id: Self = Self::new(&$value);
            )+
        }

        $crate::registry::rows! { $row $(, other = $other)?: $(<$crate::registry::Named<$row>>::$id $(, if $only)*;)+ }
    };
}
pub(crate) use {registry, rows};
