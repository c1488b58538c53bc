//! Accelerated replays. Property tests hold each equal to the plain machine.

pub(super) mod one_pass;
