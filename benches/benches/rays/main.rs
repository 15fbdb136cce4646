//! Rays per second of the core's traversal, and of Embree 4 on the same meshes and rays.
//!
//! ```text
//! PATHSPACE_EMBREE=…/libembree4.so.4 cargo bench -p pathspace-benches --bench rays [-- SCENE…]
//! ```
//!
//! Without PATHSPACE_EMBREE only our own traversal is measured. Times are CPU times of the threads.
//! The contestants take turns on each chunk of rays. `1T` is the sum over the chunks of the least
//! time of any pass; `2T` the least over the passes of half of what two threads take together.

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use glam::Vec3;
use pathspace_core::geometry::{Accel, Primitives};
use pathspace_core::math::Ray;

mod embree;
mod scenes;

const CHUNKS: usize = 16;
const PASSES: usize = 8;
const PASSES_2T: usize = 6;

/// One traversal to be measured.
enum Contestant {
    Own(Accel),
    Portable,
    Embree(embree::Scene),
}

struct Entry {
    name: &'static str,
    what: Contestant,
}

/// Time spent in `f` by this thread.
#[cfg(target_os = "linux")]
fn timed(f: impl FnOnce()) -> Duration {
    let now = || {
        let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: `t` is a valid place for the answer.
        unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut t) };
        Duration::new(t.tv_sec as u64, t.tv_nsec as u32)
    };
    let start = now();
    f();
    now() - start
}

#[cfg(not(target_os = "linux"))]
fn timed(f: impl FnOnce()) -> Duration {
    let start = Instant::now();
    f();
    start.elapsed()
}

/// Flush-to-zero, as Embree's manual asks for, on while this lives.
struct FlushToZero(#[cfg(target_arch = "x86_64")] u32);

#[cfg(target_arch = "x86_64")]
impl FlushToZero {
    fn new() -> Self {
        let (mut old, mut new) = (0_u32, 0_u32);
        // SAFETY: MXCSR is saved here and restored on drop; bits 15 and 6 are FTZ and DAZ.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &mut old);
            new |= old | 0x8040;
            std::arch::asm!("ldmxcsr [{}]", in(reg) &new);
        }
        FlushToZero(old)
    }
}

#[cfg(target_arch = "x86_64")]
impl Drop for FlushToZero {
    fn drop(&mut self) {
        // SAFETY: restores what `new` found.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &self.0) };
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl FlushToZero {
    fn new() -> Self {
        FlushToZero()
    }
}

/// A set of rays in both forms.
struct Set {
    name: &'static str,
    any: bool,
    rays: Vec<Ray>,
    prepared: Vec<embree::RayHit>,
}

impl Set {
    fn run(&self, entry: &Entry, own: &Accel, from: usize, to: usize) -> (Duration, usize) {
        let rays = &self.rays[from..to];
        let mut hits = 0;
        let time = match (&entry.what, self.any) {
            (Contestant::Own(a), false) => {
                timed(|| hits = rays.iter().filter(|r| a.closest(black_box(r)).is_some()).count())
            }
            (Contestant::Own(a), true) => {
                timed(|| hits = rays.iter().filter(|r| a.occluded(black_box(r))).count())
            }
            (Contestant::Portable, false) => timed(|| {
                hits = rays.iter().filter(|r| own.closest_portable(black_box(r)).is_some()).count()
            }),
            (Contestant::Portable, true) => {
                timed(|| hits = rays.iter().filter(|r| own.occluded_portable(black_box(r))).count())
            }
            (Contestant::Embree(s), any) => {
                let rays = &self.prepared[from..to];
                let _mode = FlushToZero::new();
                timed(|| {
                    hits = if any {
                        rays.iter().filter(|r| s.occluded(black_box(r))).count()
                    } else {
                        rays.iter().filter(|r| s.closest(black_box(r)).is_some()).count()
                    }
                })
            }
        };
        (time, black_box(hits))
    }
}

/// Rays per microsecond with one and two threads, and the number of hits, for every entry.
fn measure(set: &Set, entries: &[Entry], own: &Accel) -> Vec<(f64, f64, usize)> {
    let n = set.rays.len();
    let cut = |i: usize| i * n / CHUNKS;
    let mut best = vec![vec![Duration::MAX; entries.len()]; CHUNKS];
    let mut hits = vec![0; entries.len()];
    for pass in 0..PASSES {
        for (chunk, best) in best.iter_mut().enumerate() {
            for (e, entry) in entries.iter().enumerate() {
                let (t, h) = set.run(entry, own, cut(chunk), cut(chunk + 1));
                best[e] = best[e].min(t);
                if pass == 0 {
                    hits[e] += h;
                }
            }
        }
    }
    let mut both = vec![Duration::MAX; entries.len()];
    for _ in 0..PASSES_2T {
        for (e, entry) in entries.iter().enumerate() {
            let sum = std::thread::scope(|s| {
                let halves = [0, 1]
                    .map(|k| s.spawn(move || set.run(entry, own, k * n / 2, (k + 1) * n / 2).0));
                halves.into_iter().map(|h| h.join().unwrap_or(Duration::MAX / 4)).sum::<Duration>()
            });
            both[e] = both[e].min(sum / 2);
        }
    }
    let rate = |t: Duration| n as f64 / t.as_secs_f64() / 1e6;
    let one = |e: usize| best.iter().map(|b| b[e]).sum();
    (0..entries.len()).map(|e| (rate(one(e)), rate(both[e]), hits[e])).collect()
}

/// Vertices once each, and indices.
fn indexed(triangles: &[[Vec3; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut ids = std::collections::HashMap::new();
    let mut vertices = vec![];
    let indices = triangles
        .iter()
        .map(|t| {
            t.map(|v| {
                *ids.entry(v.to_array().map(f32::to_bits)).or_insert_with(|| {
                    vertices.push(v);
                    vertices.len() as u32 - 1
                })
            })
        })
        .collect();
    (vertices, indices)
}

fn library() -> Option<embree::Embree> {
    let Some(path) = std::env::var_os("PATHSPACE_EMBREE") else {
        println!(
            "PATHSPACE_EMBREE is not set: measuring our own traversal alone. To compare, `pip \
             download embreex` (or install it), and set the variable to the file \
             embreex.libs/libembree4-….so.4 inside the wheel."
        );
        return None;
    };
    match embree::Embree::load(Path::new(&path)) {
        Ok(e) => Some(e),
        Err(e) => {
            println!("{}: {e}; measuring our own traversal alone", path.display());
            None
        }
    }
}

fn main() {
    let only: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let library = library();
    for scene in scenes::all() {
        if !only.is_empty() && !only.iter().any(|o| o == scene.name) {
            continue;
        }
        let start = Instant::now();
        let prims = Primitives { triangles: scene.triangles.clone(), ..Primitives::default() };
        let (own, other) = match (Accel::build(prims.clone()), Accel::build(prims)) {
            (Ok(a), Ok(b)) => (a, b),
            (Err(e), _) | (_, Err(e)) => {
                println!("{}: {e}", scene.name);
                continue;
            }
        };
        let seconds = start.elapsed().as_secs_f64() / 2.0;
        let stats = own.stats();
        println!(
            "\n{}: {} triangles, built in {seconds:.3} s, {} nodes, {} blocks ({:.1} of 8 lanes \
             used), {} levels, {:.1} MB",
            scene.name,
            scene.triangles.len(),
            stats.nodes,
            stats.blocks,
            scene.triangles.len() as f64 / stats.blocks as f64,
            stats.depth,
            stats.bytes as f64 / 1e6,
        );
        let mut entries = vec![];
        if let Some(e) = &library {
            let (vertices, indices) = indexed(&scene.triangles);
            for (name, robust) in [("Embree fast", false), ("Embree robust", true)] {
                let what = Contestant::Embree(e.scene(&vertices, &indices, robust));
                entries.push(Entry { name, what });
            }
        }
        entries.push(Entry { name: "own", what: Contestant::Own(other) });
        entries.push(Entry { name: "own, portable", what: Contestant::Portable });
        println!(
            "{:<16}{:<15}{:>9}{:>9}{:>10}{:>18}{:>18}",
            "rays", "", "1T Mr/s", "2T Mr/s", "hits", "own/this 1T", "own/this 2T"
        );
        for w in scenes::workloads(&scene, &own) {
            let prepared = w.rays.iter().map(embree::RayHit::new).collect();
            let set = Set { name: w.name, any: w.any, rays: w.rays, prepared };
            let results = measure(&set, &entries, &own);
            let ours = entries
                .iter()
                .zip(&results)
                .find(|(e, _)| matches!(e.what, Contestant::Own(_)))
                .map_or((0.0, 0.0), |(_, r)| (r.0, r.1));
            for (entry, (one, two, hits)) in entries.iter().zip(&results) {
                println!(
                    "{:<16}{:<15}{one:>9.2}{two:>9.2}{hits:>10}{:>18.2}{:>18.2}",
                    set.name,
                    entry.name,
                    ours.0 / one,
                    ours.1 / two,
                );
            }
        }
    }
}
