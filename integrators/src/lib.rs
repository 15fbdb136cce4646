//! pathspace-integrators
