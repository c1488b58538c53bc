//! The SGRT paper's model: reprojection, traversal and intersection, energy.
