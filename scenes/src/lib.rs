//! pathspace-scenes
