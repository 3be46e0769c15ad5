//! One in-core piece of mesh to a hierarchy over Ray-Strips.
