//! Checkpoints, with the hash that belongs to the bytes: what is behind it is not trusted either.

#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;
use pathspace_benches::checkpoint::{Checkpoint, merge};

fuzz_target!(|bytes: &[u8]| {
    let content = [&b"pathspace checkpoint 2\n"[..], bytes].concat();
    let hash = blake3::hash(&content);
    let path = common::file("c.film", &[&content, hash.as_bytes()]);
    if Checkpoint::read(&path).is_ok() {
        let _ = merge(&[path]);
    }
});
