//! `replay`: trace to answer.

fn main() {}
