//! pathspace-validation
