//! Tests of the program, its configuration keys, its documents and its rooms, in one program.

mod cli;
mod configuration;
mod rooms;
mod worked_examples;
