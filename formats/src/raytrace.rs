//! The ray trace (`.raytrace`): its data model.
