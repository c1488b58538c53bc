//! `tracegen`: scene to trace.

fn main() {}
