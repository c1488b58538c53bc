//! To be filled: obj.
