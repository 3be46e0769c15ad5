//! Closest hit and any hit over the pages of a pack.
