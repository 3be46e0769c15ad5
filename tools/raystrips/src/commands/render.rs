//! `raystrips render`.
