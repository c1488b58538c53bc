//! Studies of many replays: sweeps, orders, accuracy, stereo rendering techniques.

pub mod accuracy;
pub mod compare;
pub mod experiment;
pub mod orders_study;
pub mod predict;
pub mod sampling;
pub mod techniques;
