//! Models and scenes to packs.
