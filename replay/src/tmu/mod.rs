//! The texture mapping unit: looping for the next chance.
