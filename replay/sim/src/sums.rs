//! What a model conserves.

/// A sum that a model did not conserve: a defect of the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{model}: expected {expected} {what}, found {found}")]
pub struct Unbalanced {
    /// Name of the model.
    pub model: &'static str,
    /// What was counted.
    pub what: &'static str,
    /// Its value by the input or by another counter.
    pub expected: u64,
    /// The counter.
    pub found: u64,
}

/// Compares sums of a model: what each is, its value by the input or by another counter, and the counter.
///
/// # Errors
/// The first sum that differs.
pub fn check_balance(
    model: &'static str,
    sums: &[(&'static str, u64, u64)],
) -> Result<(), Unbalanced> {
    match sums.iter().find(|(_, expected, found)| expected != found) {
        None => Ok(()),
        Some(&(what, expected, found)) => Err(Unbalanced {
            model,
            what,
            expected,
            found,
        }),
    }
}
