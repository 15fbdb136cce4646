//! States as bytes.

use pathspace_integrators::chain::{ChainTarget, Reader, Writer};

use super::{chain, starts};
use crate::models;

#[test]
fn states_survive_their_encoding_to_the_bit() {
    for (name, scene) in models::all() {
        let chain = chain(&scene, "max_depth=6");
        for (x, _) in starts(&chain, &scene, 5).take(300) {
            let mut out = Writer::new();
            chain.encode(&x, &mut out);
            let bytes = out.into_bytes();
            let back = chain.decode(&scene, &mut Reader::new(&bytes));
            assert!(back.as_ref() == Some(&x), "{name}");
        }
    }
}

#[test]
fn bytes_that_are_no_state_are_refused() {
    let (_, scene) = models::all().remove(0);
    let chain = chain(&scene, "max_depth=6");
    let (x, _) = starts(&chain, &scene, 5).next().unwrap();
    let mut out = Writer::new();
    chain.encode(&x, &mut out);
    let bytes = out.into_bytes();
    for end in 0..bytes.len() {
        assert!(chain.decode(&scene, &mut Reader::new(&bytes[..end])).is_none(), "{end}");
    }
    for i in 0..bytes.len() {
        for flip in [0x01, 0x40, 0x80, 0xff] {
            let mut wrong = bytes.clone();
            wrong[i] ^= flip;
            // No panic; what it takes for a state has a value.
            if let Some(x) = chain.decode(&scene, &mut Reader::new(&wrong)) {
                assert!(x.target() > 0.0 && x.target().is_finite());
            }
        }
    }
}
