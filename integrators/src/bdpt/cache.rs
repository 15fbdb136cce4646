//! Connections to a cache of light vertices (Davidovič, Křivánek, Hašan and Slusallek 2014,
//! "Progressive light transport simulation on the GPU", light vertex cache).
//!
//! A step traces as many light subpaths as there are pixels and keeps them. With V vertices (s ≥ 2)
//! in N subpaths, the sum over the vertices of one subpath has the expectation of V/N times a
//! vertex picked uniformly; each sensor vertex is connected to m = round(V/N) of them, so that a
//! sample costs as many rays as with every pair of its own two subpaths.

use std::sync::Arc;

use pathspace_core::Scene;
use pathspace_core::driver::{self, Work};
use pathspace_core::film::{Chunk, Film};
use pathspace_core::integrator::{Run, State};
use pathspace_core::random::{Address, PrimarySample, RandomStream, derive_seed};
use pathspace_core::walk::{LightSubpath, always, next_event_numbers};
use rayon::prelude::*;

use super::{Bdpt, Sample};

/// Light subpaths in a parallel task.
const BATCH: u64 = 1024;

/// A run whose steps share light vertices.
pub(super) struct CachedRun {
    bdpt: Arc<Bdpt>,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
}

impl CachedRun {
    pub(super) fn new(bdpt: Arc<Bdpt>, scene: Arc<Scene>, seed: u64, step: u64) -> Self {
        CachedRun { bdpt, scene, seed, step }
    }

    /// Light subpaths of this step with the contributions of t ≤ 1, in order.
    fn trace_light(&self, film: &Film) -> (Vec<(Chunk, Vec<LightSubpath>)>, u64) {
        let (scene, items) = (&*self.scene, film.pixels());
        let walks = self.bdpt.walks(scene);
        // Numbers of their own, apart from those of the sensor subpaths.
        let seed = derive_seed(self.seed, u64::MAX);
        let batches: Vec<_> = (0..items.div_ceil(BATCH))
            .into_par_iter()
            .map(|batch| {
                let before = driver::rays_on_this_thread();
                let mut chunk = Chunk::new(film.layers());
                let mut subpaths = Vec::new();
                for item in batch * BATCH..((batch + 1) * BATCH).min(items) {
                    let address = Address { seed, step: self.step, item };
                    let mut u = RandomStream::new(address);
                    chunk.begin(address);
                    let (sink, film) = (&mut chunk, Default::default());
                    let mut sample = Sample { scene, walks: &walks, sink, film };
                    let light = sample.light_subpath(&mut u, always);
                    sample.onto_film(&light, &mut u);
                    subpaths.push(light);
                }
                ((chunk, subpaths), driver::rays_on_this_thread() - before)
            })
            .collect();
        let rays = batches.iter().map(|(_, rays)| rays).sum();
        (batches.into_iter().map(|(batch, _)| batch).collect(), rays)
    }
}

impl Run for CachedRun {
    fn step(&mut self, film: &mut Film) -> Work {
        let scene = &*self.scene;
        let walks = self.bdpt.walks(scene);
        let (batches, light_rays) = self.trace_light(film);
        let mut cache: Vec<(&LightSubpath, usize)> = Vec::new();
        for (chunk, subpaths) in &batches {
            film.apply(chunk);
            for light in subpaths {
                cache.extend((2..=light.vertices.len()).map(|s| (light, s)));
            }
        }
        let crop = film.description().crop;
        let items = film.pixels();
        let per_path = cache.len() as f64 / items as f64;
        let connections = (per_path.round() as usize).max(1);
        let scale = (per_path / connections as f64) as f32;
        let mut work = driver::run_items(film, self.seed, self.step, items, |item, u, chunk| {
            let (x, y) = (item % crop.width as u64, item / crop.width as u64);
            let pixel = [crop.x + x as u32, crop.y + y as u32];
            let mut sensor = walks.sensor_subpath(scene, Some(pixel), u, always);
            let film = sensor.film;
            let mut sample = Sample { scene, walks: &walks, sink: chunk, film };
            sample.hit_emitters(&mut sensor);
            for t in 2..=sensor.vertices.len().min(walks.max) {
                let sensor = &sensor.vertices[..t];
                let numbers = next_event_numbers(u);
                if !sensor[t - 1].connectible {
                    continue;
                }
                sample.next_event(sensor, numbers);
                for _ in 0..connections {
                    let i = (u.next() as f64 * cache.len() as f64) as usize;
                    let Some(&(light, s)) = cache.get(i) else { continue };
                    if s + t > walks.max + 1 {
                        continue;
                    }
                    let connection = walks.connect(scene, &light.vertices[..s], sensor);
                    let Some(connection) = connection.filter(|c| c.is_visible(scene)) else {
                        continue;
                    };
                    let weight = connection.weight(scene, &walks);
                    connection.emit(scene, sample.sink, film, weight, scale);
                }
            }
        });
        work.rays += light_rays;
        self.step += 1;
        work
    }

    fn save(&self) -> State {
        State { step: self.step, bytes: Vec::new() }
    }

    fn seek(&mut self, step: u64) -> bool {
        self.step = step;
        true
    }
}
