//! raystrips.
fn main() {}
