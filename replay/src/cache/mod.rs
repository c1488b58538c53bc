//! Set-associative caches and their hierarchy.
