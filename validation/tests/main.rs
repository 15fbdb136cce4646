//! Integration tests of pathspace against exact answers: one binary, a module per subject.

mod exact;
mod extremes;
mod models;
mod oracle;
