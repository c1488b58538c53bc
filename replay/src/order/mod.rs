//! Tile orders, one a file: pure functions from the tile lists to a sequence of work.
