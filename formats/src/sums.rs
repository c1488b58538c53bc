//! Sums of counters, field by field.

/// Adds the named fields of one value to those of another.
#[macro_export]
macro_rules! add_fields {
    ($sum:expr, $other:expr, $($field:ident),+ $(,)?) => {
        $($sum.$field += $other.$field;)+
    };
}
