//! A path space of twenty states whose transition matrix is known, run through the production
//! driver.

use std::sync::Arc;

use glam::Vec2;
use pathspace_core::Scene;
use pathspace_core::description::FilmDescription;
use pathspace_core::film::{Film, Layers, RecordingSink, Sink};
use pathspace_core::integrator::{Run, State};
use pathspace_core::random::{Address, PrimarySample, RandomStream};
use pathspace_integrators::chain::{
    Chain, ChainOptions, ChainRun, ChainTarget, Proposal, Reader, Writer,
};
use pathspace_validation::stats::{chi_squared_sf, normal_sf};

use super::grey;
use crate::models;

const N: usize = 20;

/// States 0 … 19, each a pixel of its own; f* of state 7 is 0.
#[derive(Clone)]
struct Toy {
    f: [f64; N],
    /// p of the bootstrap.
    p: [f64; N],
    /// T(x→y).
    t: [[f64; N]; N],
}

fn normalised(mut row: [f64; N]) -> [f64; N] {
    let sum: f64 = row.iter().sum();
    row.iter_mut().for_each(|v| *v /= sum);
    row
}

fn pick(row: &[f64; N], u: f32) -> usize {
    let mut x = u as f64;
    row.iter().position(|p| (x -= p, x < 0.0).1).unwrap_or(N - 1)
}

impl Toy {
    fn new() -> Self {
        let mut u = RandomStream::new(Address { seed: 3, step: 0, item: 0 });
        let mut row = || normalised(std::array::from_fn(|_| (3.0 * u.next() as f64).exp()));
        let mut f = row();
        f[7] = 0.0;
        let t = std::array::from_fn(|_| row());
        Toy { f, p: row(), t }
    }

    fn acceptance(&self, x: usize, y: usize) -> f64 {
        (self.f[y] * self.t[y][x] / (self.f[x] * self.t[x][y])).min(1.0)
    }

    /// P(x→y) of the whole mutation.
    fn transition(&self, x: usize) -> [f64; N] {
        let mut row =
            std::array::from_fn(
                |y| {
                    if y == x { 0.0 } else { self.t[x][y] * self.acceptance(x, y) }
                },
            );
        row[x] = 1.0 - row.iter().sum::<f64>();
        row
    }
}

impl ChainTarget for Toy {
    type State = usize;

    fn kinds(&self) -> Vec<String> {
        vec!["jump".to_owned()]
    }

    fn bootstrap(&self, _: &Scene, u: &mut RandomStream) -> Option<(usize, f64)> {
        let x = pick(&self.p, u.next());
        (self.f[x] > 0.0).then(|| (x, self.f[x] / self.p[x]))
    }

    fn propose(&self, _: &Scene, x: &mut usize, u: &mut RandomStream) -> Proposal<usize> {
        let y = pick(&self.t[*x], u.next());
        if self.f[y] == 0.0 {
            return Proposal::rejected(0);
        }
        Proposal::new(y, self.acceptance(*x, y), 0)
    }

    fn splat<S: Sink>(&self, _: &Scene, x: &usize, weight: f64, sink: &mut S) {
        sink.add(grey(Vec2::new((x % 5) as f32 + 0.5, (x / 5) as f32 + 0.5), weight));
    }

    fn encode(&self, x: &usize, out: &mut Writer) {
        out.u32(*x as u32);
    }

    fn decode(&self, _: &Scene, bytes: &mut Reader<'_>) -> Option<usize> {
        bytes.u32().map(|x| x as usize).filter(|x| *x < N)
    }
}

fn scene() -> Arc<Scene> {
    Arc::new(models::build(&models::lamp_in_a_shell()))
}

fn film() -> Film {
    Film::new(&FilmDescription::new(5, 4), Layers::NONE)
}

fn options(chains: u64, bootstrap: u64) -> ChainOptions {
    ChainOptions { chains: Some(chains), bootstrap: Some(bootstrap), rounds: true }
}

fn run(
    scene: &Arc<Scene>,
    toy: &Toy,
    seed: u64,
    options: ChainOptions,
    state: &State,
) -> ChainRun<Toy> {
    ChainRun::resume("toy", toy.clone(), scene.clone(), seed, state, options).unwrap()
}

/// Where the mutation goes to and what it splats, from every state.
#[test]
fn mutations_follow_the_transition_matrix_and_splat_a_weight_of_one() {
    let (toy, scene) = (Toy::new(), scene());
    let tries = 40_000;
    for x in (0..N).filter(|x| toy.f[*x] > 0.0) {
        let mut counts = [0.0; N];
        let mut splats = [0.0; N];
        for item in 0..tries {
            let mut u = RandomStream::new(Address { seed: 5, step: x as u64, item });
            let (mut chain, mut sink) = (Chain::new(x, 1), RecordingSink::default());
            chain.mutate(&toy, &scene, 2.0, &mut u, &mut sink);
            chain.flush(&toy, &scene, &mut sink);
            counts[chain.state] += 1.0;
            let mut sum = 0.0;
            for c in &sink.contributions {
                splats[5 * c.film.y as usize + c.film.x as usize] += c.value.r as f64;
                sum += c.value.r as f64;
            }
            assert!((sum - 2.0).abs() < 1e-6, "weights of a mutation sum to b: {sum}");
        }
        let expected = toy.transition(x).map(|p| p * tries as f64);
        let chi2 = |seen: &[f64; N]| -> f64 {
            let cells = seen.iter().zip(&expected).filter(|(_, e)| **e > 5.0);
            cells.map(|(o, e)| (o - e) * (o - e) / e).sum()
        };
        let df = expected.iter().filter(|e| **e > 5.0).count() as f64 - 1.0;
        let p = chi_squared_sf(chi2(&counts), df);
        assert!(p > 1e-6, "state {x}: p {p:.1e}");
        // Expected values: the splats have the same mean and less variance.
        let splats = splats.map(|s| 0.5 * s);
        let p = chi_squared_sf(chi2(&splats), df);
        assert!(p > 1e-6, "splats of state {x}: p {p:.1e}");
        assert!(counts[7] == 0.0 && splats[7] == 0.0);
    }
}

/// E[b̂ h(X_n)] = ∫ f h with four bootstrap samples and few mutations, whatever the number of
/// chains and rounds.
#[test]
fn films_are_unbiased_with_four_bootstrap_samples() {
    let (toy, scene) = (Toy::new(), scene());
    for (chains, steps) in [(1, 1), (3, 2), (20, 3), (50, 1)] {
        let asked = options(chains, 4);
        let (mut sum, mut sum2) = ([0.0; N], [0.0; N]);
        let replicates = 8000;
        for seed in 0..replicates {
            let mut film = film();
            let mut run = run(&scene, &toy, seed, asked, &State::default());
            for _ in 0..steps {
                run.step(&mut film);
            }
            for (i, p) in film.image().iter().enumerate() {
                // The film spreads a sample over its pixels.
                let v = p[0] / N as f64;
                sum[i] += v;
                sum2[i] += v * v;
            }
        }
        let n = replicates as f64;
        for i in 0..N {
            let mean = sum[i] / n;
            if toy.f[i] == 0.0 {
                assert_eq!(mean, 0.0);
                continue;
            }
            let se = ((sum2[i] / n - mean * mean) / (n - 1.0)).sqrt();
            let p = 2.0 * normal_sf((mean - toy.f[i]).abs() / se);
            assert!(p > 1e-6, "{chains} chains, state {i}: {mean} against {}, p {p:.1e}", toy.f[i]);
        }
    }
}

#[test]
fn rounds_and_threads_do_not_change_the_film() {
    let (toy, scene) = (Toy::new(), scene());
    // One chain does all mutations of a step, in two rounds.
    let description = FilmDescription::new(128, 80);
    for chains in [1, 3] {
        let asked = options(chains, 100);
        let film = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut film = Film::new(&description, Layers::NONE);
            let mut run = run(&scene, &toy, 1, asked, &State::default());
            pool.install(|| (run.step(&mut film), run.step(&mut film)));
            (film.sums().clone(), run.save())
        };
        assert_eq!(film(1), film(4), "{chains} chains");
    }
}

#[test]
fn resumed_chains_go_on_to_the_bit_and_bad_bytes_are_refused() {
    let (toy, scene) = (Toy::new(), scene());
    let asked = options(7, 100);
    let (mut whole, mut parts) = (film(), film());
    let mut first = run(&scene, &toy, 1, asked, &State::default());
    for _ in 0..4 {
        first.step(&mut whole);
    }
    let mut second = run(&scene, &toy, 1, asked, &State::default());
    second.step(&mut parts);
    let state = second.save();
    let mut third = run(&scene, &toy, 1, asked, &state);
    for _ in 0..3 {
        third.step(&mut parts);
    }
    assert_eq!(whole.sums(), parts.sums());
    assert_eq!(first.save(), third.save());
    for n in [0, 3, state.bytes.len() - 1] {
        let cut = State { step: 1, bytes: state.bytes[..n].to_vec() };
        let resumed = ChainRun::resume("toy", toy.clone(), scene.clone(), 1, &cut, asked);
        assert!(resumed.is_err(), "{n} bytes");
    }
    let other = options(8, 100);
    assert!(ChainRun::resume("toy", toy.clone(), scene.clone(), 1, &state, other).is_err());
}

#[test]
fn preparing_takes_the_bootstrap_out_of_the_first_step() {
    let (toy, scene) = (Toy::new(), scene());
    let asked = options(3, 50);
    let (mut plain, mut prepared) = (film(), film());
    run(&scene, &toy, 1, asked, &State::default()).step(&mut plain);
    let mut second = run(&scene, &toy, 1, asked, &State::default());
    assert!(second.normalisation().is_none());
    second.prepare(&mut prepared);
    let b = second.normalisation();
    assert!(b.is_some() && prepared.samples() == 0);
    second.prepare(&mut prepared);
    second.step(&mut prepared);
    assert_eq!(second.normalisation(), b);
    assert_eq!(plain.sums(), prepared.sums());
}

#[test]
fn where_nothing_shines_the_film_stays_black() {
    let (mut toy, scene) = (Toy::new(), scene());
    toy.f = [0.0; N];
    let asked = options(4, 16);
    let mut film = film();
    let mut run = run(&scene, &toy, 1, asked, &State::default());
    run.step(&mut film);
    let state = run.save();
    ChainRun::resume("toy", toy, scene, 1, &state, asked).unwrap().step(&mut film);
    assert_eq!((film.mean(), film.samples()), ([0.0; 3], 40));
}

/// b̂ is better with each round, and its error is the one that it is said to have.
#[test]
fn normalisation_comes_to_be_exact_over_the_rounds() {
    let (toy, scene) = (Toy::new(), scene());
    let exact: f64 = toy.f.iter().sum();
    let (mut sum2, mut said, mut said_first) = (0.0, 0.0, 0.0);
    for seed in 0..100 {
        let mut film = film();
        let mut run = run(&scene, &toy, seed, options(2, 16), &State::default());
        assert!(run.normalisation().is_none());
        run.step(&mut film);
        let (_, first_error) = run.normalisation().unwrap();
        said_first += first_error.powi(2) / 100.0;
        for _ in 0..7 {
            run.step(&mut film);
        }
        let (b, error) = run.normalisation().unwrap();
        sum2 += (b - exact).powi(2) / 100.0;
        said += error.powi(2) / 100.0;
        assert_eq!(run.tallies()[0].1.tried, 160);
        let figures = run.figures();
        assert_eq!(figures[0], ("b".to_owned(), b));
        assert_eq!(figures[2].0, "acceptance, jump");
        assert!(figures[2].1 > 0.0 && figures[2].1 < 1.0);
    }
    // Eight steps, the later ones with more bootstrap samples.
    assert!(said < said_first / 8.0, "{said} after {said_first}");
    // A mean of a hundred squares is known to 14 %.
    assert!((sum2 / said - 1.0).abs() < 0.6, "{sum2} against {said}");
}

#[test]
fn an_acceptance_that_is_no_number_rejects() {
    let proposal = Proposal::new(3_usize, f64::NAN, 0);
    assert_eq!((proposal.acceptance, proposal.weight_current), (0.0, 1.0));
    assert_eq!(proposal.weight_proposed, 0.0);
    assert_eq!(Proposal::new(3_usize, f64::INFINITY, 0).acceptance, 1.0);
}
