//! Ray traversal.
