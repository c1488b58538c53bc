//! Accelerators of replays. Each equals the plain machine, as property tests hold.

pub(super) mod one_pass;
