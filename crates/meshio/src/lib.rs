//! Read OBJ, glTF, PLY and scene files as a stream of triangle batches.
