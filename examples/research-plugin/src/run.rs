//! A run: every step traces N light subpaths, keeps their vertices, and then N sensor subpaths, N
//! the number of pixels.

use std::sync::Arc;

use pathspace::core::Scene;
use pathspace::core::driver::{self, Work};
use pathspace::core::film::{Chunk, Film, Sink};
use pathspace::core::glam::Vec2;
use pathspace::core::integrator::{Run, State};
use pathspace::core::random::{Address, PrimarySample, RandomStream, derive_seed};
use pathspace::core::walk::{WalkVertex, Walks, always, next_event_numbers};
use rayon::prelude::*;

use crate::Vcm;
use crate::merge::Merger;
use crate::photons::PhotonGrid;

/// Light subpaths in a parallel task.
const BATCH: u64 = 1024;

/// Vertex connection and merging at work. The radius depends on the step alone, so that the step is
/// all there is to save.
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
    fn trace_light(&self, at: &At<'_>, film: &Film) -> (Vec<Chunk>, Vec<Vec<WalkVertex>>, u64) {
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
                    subpaths.push(at.light(&mut RandomStream::new(address), &mut chunk));
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
        let at = At::new(&self.vcm, &self.scene, items, radius);
        let (chunks, light, light_rays) = self.trace_light(&at, film);
        for chunk in &chunks {
            film.apply(chunk);
        }
        let photons = self.vcm.merge.then(|| PhotonGrid::new(&light, radius as f32));
        let crop = film.description().crop;
        let mut work = driver::run_items(film, self.seed, self.step, items, |item, u, chunk| {
            let (x, y) = (item % crop.width as u64, item / crop.width as u64);
            let pixel = Some([crop.x + x as u32, crop.y + y as u32]);
            at.sensor(pixel, &light[item as usize], (&light, photons.as_ref()), u, chunk);
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

/// What the samples of a step share.
pub(crate) struct At<'a> {
    scene: &'a Scene,
    pub walks: Walks,
    pub eta: f64,
    connect: bool,
}

impl<'a> At<'a> {
    pub(crate) fn new(vcm: &Vcm, scene: &'a Scene, n: u64, radius: f64) -> Self {
        let eta = vcm.eta(n, radius);
        At { scene, walks: vcm.walks(scene, eta), eta, connect: vcm.connect }
    }

    /// One technique (s, t) of two subpaths, connected or hit.
    fn connect<S: Sink>(
        &self,
        light: &[WalkVertex],
        sensor: &[WalkVertex],
        film: Vec2,
        sink: &mut S,
    ) {
        let (scene, walks) = (self.scene, &self.walks);
        let connection = walks.connect(scene, light, sensor);
        if let Some(connection) = connection.filter(|c| c.is_visible(scene)) {
            connection.emit(scene, sink, film, connection.weight(scene, walks), 1.0);
        }
    }

    /// One light subpath, with technique t = 1 of each of its vertices.
    pub(crate) fn light<U: PrimarySample, S: Sink>(
        &self,
        u: &mut U,
        sink: &mut S,
    ) -> Vec<WalkVertex> {
        let vertices = self.walks.light_subpath(self.scene, u, |_| (), always).vertices;
        for s in (1..=vertices.len().min(self.walks.max)).filter(|_| self.connect) {
            let (lens, pdf) = self.scene.sensor().sample_vertex(self.walks.lens(u));
            let lens = WalkVertex::on_lens(lens, pdf);
            self.connect(&vertices[..s], &[lens], Vec2::ZERO, sink);
        }
        vertices
    }

    /// One sensor subpath, with all techniques t ≥ 2: connections to the light subpath `own`,
    /// merges with all.
    pub(crate) fn sensor<U: PrimarySample, S: Sink>(
        &self,
        pixel: Option<[u32; 2]>,
        own: &[WalkVertex],
        (light, photons): (&[Vec<WalkVertex>], Option<&PhotonGrid>),
        u: &mut U,
        sink: &mut S,
    ) {
        let (scene, walks) = (self.scene, &self.walks);
        let mut subpath = walks.sensor_subpath(scene, pixel, u, always);
        let film = subpath.film;
        let merger = Merger { scene, walks, eta: self.eta, film };
        for t in 2..=subpath.vertices.len() {
            let sensor = &subpath.vertices[..t];
            let z = &sensor[t - 1];
            if z.vertex.emitter().is_some() {
                self.connect(&[], sensor, film, sink);
            }
            if self.connect {
                let (pick, on_emitter) = next_event_numbers(u);
                let p = z.vertex.position().filter(|_| z.connectible && t <= walks.max);
                if let Some(direct) = p.and_then(|p| scene.sample_direct(p, pick, on_emitter)) {
                    let x0 = WalkVertex::next_event(scene, &direct);
                    self.connect(&[x0], sensor, film, sink);
                }
                for s in 2..=own.len().min((walks.max + 1).saturating_sub(t)) {
                    self.connect(&own[..s], sensor, film, sink);
                }
            }
            if let Some(photons) = photons {
                merger.merge(sensor, photons, light, sink);
            }
        }
        walks.on_background(scene, &mut subpath, |sensor| self.connect(&[], sensor, film, sink));
    }
}
