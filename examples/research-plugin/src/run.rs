//! A run: every step traces N light subpaths, keeps their vertices, and then N sensor subpaths, N the number of pixels.

use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::driver::{self, Work};
use pathspace::core::film::{Chunk, Film, Sink};
use pathspace::core::glam::Vec2;
use pathspace::core::integrator::{Run, State};
use pathspace::core::random::{Address, PrimarySample, RandomStream, derive_seed};
use rayon::prelude::*;

use crate::Vcm;
use crate::connect::Connector;
use crate::photons::PhotonGrid;
use crate::subpath::{LightSubpath, Walks};

/// Light subpaths in a parallel task.
const BATCH: u64 = 1024;

/// Vertex connection and merging at work. The radius depends on the step alone, so that the step is all there is to save.
pub(crate) struct VcmRun {
    vcm: Vcm,
    scene: Arc<Scene>,
    seed: u64,
    step: u64,
}

impl VcmRun {
    pub(crate) fn new(vcm: Vcm, scene: Arc<Scene>, seed: u64, step: u64) -> Self {
        VcmRun { vcm, scene, seed, step }
    }

    /// Light subpaths of this step in order, with the contributions of t = 1.
    fn trace_light(&self, walks: Walks<'_>, film: &Film) -> (Vec<Chunk>, Vec<LightSubpath>, u64) {
        let items = film.pixels();
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
                    chunk.begin(address);
                    subpaths.push(light(walks, &mut RandomStream::new(address), &mut chunk));
                }
                (chunk, subpaths, driver::rays_on_this_thread() - before)
            })
            .collect();
        let (mut chunks, mut subpaths, mut rays) = (Vec::new(), Vec::new(), 0);
        for (chunk, batch, n) in batches {
            chunks.push(chunk);
            subpaths.extend(batch);
            rays += n;
        }
        (chunks, subpaths, rays)
    }
}

impl Run for VcmRun {
    fn step(&mut self, film: &mut Film) -> Work {
        let items = film.pixels();
        let radius = self.vcm.radius(self.step);
        let walks = self.vcm.walks(&self.scene, items, radius);
        let (chunks, light, light_rays) = self.trace_light(walks, film);
        for chunk in &chunks {
            film.apply(chunk);
        }
        let photons = self.vcm.merge.then(|| PhotonGrid::new(&light, radius as f32));
        let crop = film.description().crop;
        let mut work = driver::run_items(film, self.seed, self.step, items, |item, u, chunk| {
            let (x, y) = (item % crop.width as u64, item / crop.width as u64);
            let pixel = Some([crop.x + x as u32, crop.y + y as u32]);
            sensor(walks, pixel, item as usize, &light, photons.as_ref(), u, chunk);
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

/// One light subpath, with technique t = 1 of each of its vertices.
pub(crate) fn light<U: PrimarySample, S: Sink>(
    walks: Walks<'_>,
    u: &mut U,
    sink: &mut S,
) -> LightSubpath {
    let subpath = walks.light(u);
    if walks.weights.connect {
        let mut connector = Connector { walks, sink, film: Vec2::ZERO };
        for s in 1..=subpath.vertices.len().min(walks.max_length) {
            let lens = walks.lens(u);
            if subpath.vertices[s - 1].connectible {
                connector.onto_film(&subpath.vertices[..s], subpath.emitter, lens);
            }
        }
    }
    subpath
}

/// One sensor subpath, with all techniques t ≥ 2: connections to the light subpath `own`, merges with all.
pub(crate) fn sensor<U: PrimarySample, S: Sink>(
    walks: Walks<'_>,
    pixel: Option<[u32; 2]>,
    own: usize,
    light: &[LightSubpath],
    photons: Option<&PhotonGrid>,
    u: &mut U,
    sink: &mut S,
) {
    let subpath = walks.sensor(pixel, u);
    let mut connector = Connector { walks, sink, film: subpath.film };
    for t in 2..=subpath.vertices.len() {
        let sensor = &subpath.vertices[..t];
        connector.hit_emitter(sensor);
        if walks.weights.connect {
            let on_emitter = (u.next(), u.next2());
            connector.connect(&light[own], sensor, on_emitter);
        }
        if let Some(photons) = photons {
            connector.merge(sensor, photons, light);
        }
    }
}
