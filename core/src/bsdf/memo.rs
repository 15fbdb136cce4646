//! The models of the last hits on textured surfaces, so that what a path asks of a vertex again
//! looks nothing up twice.
//!
//! A model at a point is a function of the scene, the primitive and the position. A path asks for
//! it several times: to sample, for each connection, for the densities of the opposite walk, for
//! weights. Each thread keeps those of its last hits by that key. Surface points stay small and can
//! be copied, and a surface without textures never comes here.

use std::cell::RefCell;
use std::rc::Rc;

use glam::Vec3;

use super::Bsdf;

/// Vertices of some paths; a power of two.
const ENTRIES: usize = 64;

/// What a model at a point depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key {
    scene: u64,
    prim: u32,
    position: [u32; 3],
}

impl Key {
    /// Of position `p` on primitive `prim` of a scene.
    #[inline]
    pub(crate) fn new(scene: u64, prim: u32, p: Vec3) -> Self {
        Key { scene, prim, position: p.to_array().map(f32::to_bits) }
    }

    /// Multiplication by odd constants carries every bit up, the highest ones are the index.
    #[inline]
    fn entry(&self) -> usize {
        let [x, y, z] = self.position.map(u64::from);
        let low = (x | (y << 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let high = (z | (u64::from(self.prim) << 32)).wrapping_mul(0xd1b5_4a32_d192_ed03);
        ((low ^ high.rotate_left(23)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % ENTRIES
    }
}

/// A point and its model; `None` where there was none yet.
type Entry = Option<(Key, Rc<Bsdf>)>;

thread_local! {
    static LAST: RefCell<Vec<Entry>> = const { RefCell::new(Vec::new()) };
}

/// The model of `key`, made by `make` where it is not among the last ones.
#[inline]
pub(crate) fn resolved(key: Key, make: impl FnOnce() -> Bsdf) -> Rc<Bsdf> {
    LAST.with_borrow_mut(|last| {
        if last.is_empty() {
            last.resize(ENTRIES, None);
        }
        let entry = &mut last[key.entry()];
        match entry {
            Some((kept, model)) if *kept == key => return model.clone(),
            // Nobody else holds it: its memory serves again.
            Some((kept, model)) => {
                if let Some(place) = Rc::get_mut(model) {
                    *place = make();
                    *kept = key;
                    return model.clone();
                }
            }
            None => {}
        }
        let model = Rc::new(make());
        *entry = Some((key, model.clone()));
        model
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_point_is_resolved_once_and_a_scene_has_its_own() {
        let made = Cell::new(0);
        let get = |scene, x| {
            resolved(Key::new(scene, 3, Vec3::new(x, 0.5, 0.25)), || {
                made.set(made.get() + 1);
                Bsdf::Null
            })
        };
        let first = get(1, 0.5);
        assert!(Rc::ptr_eq(&first, &get(1, 0.5)) && made.get() == 1);
        get(2, 0.5);
        get(1, 0.625);
        assert_eq!(made.get(), 3);
    }

    #[test]
    fn the_points_of_a_path_rarely_share_an_entry() {
        let mut used = [false; ENTRIES];
        for i in 0..ENTRIES as u32 {
            let p = Vec3::new(0.1 + i as f32 * 0.013, 0.2, 0.3 - i as f32 * 0.007);
            used[Key::new(1, i % 5, p).entry()] = true;
        }
        // A random map fills 1 − 1/e of them.
        assert!(used.iter().filter(|u| **u).count() > ENTRIES / 2);
    }
}
