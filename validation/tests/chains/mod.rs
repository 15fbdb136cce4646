//! L4: Markov chains, the driver and every mutation.

mod answers;
mod features;
mod invariance;
mod jumps;
mod starts;
mod toy;
