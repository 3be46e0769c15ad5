//! Which pages of a pack are in memory, and getting the others.
