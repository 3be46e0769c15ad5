//! The pack file: bytes in, checked views out.
