//! Built-in scenes that need no file.
