//! Integration tests of pathspace against exact answers: one binary, a module per subject.

mod chains;
mod classes;
mod crop;
mod determinism;
mod exact;
mod extremes;
mod faint;
mod hard;
mod mixed;
mod mlt;
mod models;
mod oracle;
mod radiosity;
