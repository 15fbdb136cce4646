//! pathspace-benches
