//! Rows of settings: a table of a configuration file is written once, as one row per key.

/// A key of a table, and how to read its value.
pub type Key<T> = (&'static str, fn(&T) -> serde_json::Value);

/// Defines a table of a configuration: per key its meaning, type, default and, for numbers, the accepted range. The
/// type's keys, defaults and checks follow; so do the TOML keys, the schema, the columns of reports and
/// `docs/use/configuration.md`.
macro_rules! settings {
    ($(#[$meta:meta])* pub struct $type:ident in $table:literal {
        $($(#[$of_key:meta])* pub $key:ident: $kind:ty = $default:expr $(, in $range:expr)?;)+
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields, default)]
        pub struct $type {
            $($(#[$of_key])* pub $key: $kind,)+
        }

        impl Default for $type {
            fn default() -> Self {
                Self { $($key: $default),+ }
            }
        }

        impl $type {
            /// The keys, each with its table and its value, which may be a default.
            pub const KEYS: &'static [$crate::config::Key<Self>] =
                &[$((concat!($table, stringify!($key)), |of| serde_json::json!(of.$key))),+];

            /// Checks the numbers that have a range.
            pub(crate) fn check_ranges(&self) -> Result<(), $crate::config::ConfigError> {
                $($({
                    let key = concat!($table, stringify!($key));
                    $crate::config::in_range(key, self.$key, $range)?;
                })?)+
                Ok(())
            }
        }
    };
}
pub(crate) use settings;
