//! L4: Markov chains, the driver and every mutation.

mod invariance;
mod toy;
