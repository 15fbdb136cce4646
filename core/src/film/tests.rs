use glam::Vec2;

use super::*;
use crate::color::Rgb;
use crate::description::FilterKind;

fn contribution(x: f32, y: f32, value: f32) -> Contribution {
    Contribution {
        film: Vec2::new(x, y),
        value: Rgb::grey(value),
        weight: 1.0,
        s: 1,
        t: 1,
        emitter: 0,
        families: Families::ALL,
    }
}

fn film(filter: FilterKind, crop: Crop) -> Film {
    let description = FilmDescription { width: 20, height: 20, crop, filter };
    Film::new(&description, Layers { length: true, ..Layers::NONE })
}

#[test]
fn uniform_radiance_stays_uniform_up_to_the_border_for_every_filter() {
    let crop = Crop { x: 3, y: 5, width: 8, height: 6 };
    for filter in [
        FilterKind::Box,
        FilterKind::Tent { radius: 1.0 },
        FilterKind::Tent { radius: 1.7 },
        FilterKind::Gaussian { stddev: 0.5 },
    ] {
        let mut film = film(filter, crop);
        let mut chunk = Chunk::new(film.layers());
        // A fine grid over the window stands for the integral.
        let n = 40;
        for j in 0..crop.height * n {
            for i in 0..crop.width * n {
                let at = |i: u32, o: u32| o as f32 + (i as f32 + 0.5) / n as f32;
                chunk.add(contribution(at(i, crop.x), at(j, crop.y), 2.0));
            }
        }
        film.apply(&chunk);
        film.add_samples((crop.width * crop.height * n * n) as u64);
        for p in film.image() {
            assert!((p[0] - 2.0).abs() < 2e-3, "{filter:?}: {}", p[0]);
        }
    }
}

#[test]
fn layers_sum_to_the_image() {
    let mut film =
        film(FilterKind::Tent { radius: 1.0 }, Crop { x: 0, y: 0, width: 20, height: 20 });
    let mut chunk = Chunk::new(film.layers());
    for i in 0..100 {
        let c = contribution(0.2 * i as f32, 10.0 + 0.05 * i as f32, 1.0 + i as f32);
        chunk.add(Contribution { s: (i % 3) as u16, t: 2, ..c });
    }
    film.apply(&chunk);
    film.add_samples(1);
    let layers: Vec<_> = film.planes().keys().copied().collect();
    assert_eq!(layers, [LayerKey::Length(1), LayerKey::Length(2), LayerKey::Length(3)]);
    let image = film.image();
    for (i, p) in image.iter().enumerate() {
        let sum: f64 = layers.iter().filter_map(|&k| film.layer_image(k)).map(|l| l[i][1]).sum();
        assert!((sum - p[1]).abs() <= 1e-9 * p[1].abs().max(1.0));
    }
}

#[test]
fn non_finite_contributions_are_counted_and_kept_for_replay() {
    let mut film = film(FilterKind::Box, Crop { x: 0, y: 0, width: 20, height: 20 });
    let mut chunk = Chunk::new(film.layers());
    let address = crate::random::Address { seed: 1, step: 2, item: 3 };
    chunk.begin(address);
    chunk.add(contribution(1.0, 1.0, f32::NAN));
    chunk.add(contribution(1.0, 1.0, f32::INFINITY));
    chunk.add(contribution(1.0, 1.0, 4.0));
    film.apply(&chunk);
    film.add_samples(1);
    assert_eq!(film.nonfinite(), 2);
    assert_eq!(film.nonfinite_examples()[0].address, address);
    assert!(film.mean()[0].is_finite());
}

#[test]
fn many_small_splats_in_one_pixel_keep_their_sum() {
    // 2²⁶ numbers of U[0,1): an f32 sum stalls at 2²⁴; f64 must stay within a tenth of the standard
    // error.
    let n = 1u64 << 26;
    let mut plane = Plane::new(1);
    let mut exact: u128 = 0;
    let mut state = 1u64;
    for _ in 0..n {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let u = (state >> 40) as u32;
        exact += u as u128;
        plane.0[0][0] += u as f64 * (1.0 / 16_777_216.0);
    }
    let exact = exact as f64 / 16_777_216.0;
    let se = (n as f64 / 12.0).sqrt();
    assert!((plane.0[0][0] - exact).abs() < 0.1 * se);
}

/// A film with a contribution of length `s` at every multiple of 3, and one that is not finite.
fn exposed(s: u16) -> Film {
    let mut film =
        film(FilterKind::Tent { radius: 1.0 }, Crop { x: 0, y: 0, width: 20, height: 20 });
    let mut chunk = Chunk::new(film.layers());
    for i in 0..7 {
        let c = contribution(3.0 * i as f32 + 0.3, 9.1, 0.1 * f32::from(s));
        chunk.add(Contribution { s, ..c });
    }
    chunk.add(contribution(1.0, 1.0, f32::NAN));
    film.apply(&chunk);
    film.add_samples(7 * u64::from(s));
    film
}

fn parts(film: &Film) -> FilmParts {
    let planes = film.planes().iter().map(|(key, plane)| (*key, plane.sums().to_vec()));
    FilmParts {
        samples: film.samples(),
        nonfinite: film.nonfinite(),
        nonfinite_examples: film.nonfinite_examples().to_vec(),
        sums: film.sums().sums().to_vec(),
        planes: planes.collect(),
    }
}

#[test]
fn a_film_from_its_parts_is_the_same_to_the_bit() {
    let film = exposed(2);
    let back = Film::from_parts(film.description(), film.layers(), parts(&film)).unwrap();
    assert_eq!((back.sums(), back.planes()), (film.sums(), film.planes()));
    assert_eq!((back.samples(), back.nonfinite()), (film.samples(), 1));
    assert_eq!(back.nonfinite_examples()[0].address, film.nonfinite_examples()[0].address);
}

#[test]
fn parts_of_another_film_are_refused() {
    let film = exposed(2);
    let mut other = *film.description();
    other.crop.width = 19;
    let error = Film::from_parts(&other, film.layers(), parts(&film)).unwrap_err();
    assert_eq!(error.to_string(), "the image has 400 pixels, the window 380");
    let error = Film::from_parts(film.description(), Layers::NONE, parts(&film)).unwrap_err();
    assert_eq!(error, FilmError::Layer("length.02".into()));
}

#[test]
fn merged_films_weigh_by_their_samples() {
    let (a, b) = (exposed(1), exposed(3));
    let mut merged = a.clone();
    merged.merge(&b).unwrap();
    assert_eq!((merged.samples(), merged.nonfinite()), (28, 2));
    for (i, p) in merged.image().iter().enumerate() {
        let expected = (7.0 * a.image()[i][0] + 21.0 * b.image()[i][0]) / 28.0;
        assert!((p[0] - expected).abs() <= 1e-15 * expected);
    }
    // A layer that only one of them has is that one's.
    let keys: Vec<_> = merged.planes().keys().copied().collect();
    assert_eq!(keys, [LayerKey::Length(1), LayerKey::Length(3)]);
    assert_eq!(merged.planes()[&LayerKey::Length(3)], b.planes()[&LayerKey::Length(3)]);
}

#[test]
fn films_of_other_windows_are_not_merged() {
    let mut a = exposed(1);
    let b = film(FilterKind::Box, Crop { x: 0, y: 0, width: 20, height: 20 });
    assert_eq!(a.merge(&b), Err(FilmError::Different));
}

#[test]
fn records_that_would_overflow_stay_apart() {
    let mut film = Film::new(&FilmDescription::new(2, 2), Layers::NONE);
    let mut chunk = Chunk::new(film.layers());
    for value in [1.0, 2.0, 3.0e38, 3.0e38] {
        chunk.add(contribution(0.5, 0.5, value));
    }
    assert_eq!((chunk.records().len(), chunk.nonfinite_count()), (2, 0));
    film.apply(&chunk);
    assert!((film.sums().sums()[0][0] / 6.0e38 - 1.0).abs() < 1e-6);
}

#[test]
fn parts_are_held_to_their_description_before_there_is_room_made_for_it() {
    let parts = |n: usize| FilmParts { sums: vec![[1.0; 3]; n], ..FilmParts::default() };
    let error = |description: &FilmDescription| {
        Film::from_parts(description, Layers::NONE, parts(4)).map(|_| ()).unwrap_err().to_string()
    };
    let film = FilmDescription::new(2, 2);
    assert!(Film::from_parts(&film, Layers::NONE, parts(4)).is_ok());
    assert!(error(&FilmDescription::new(16_384, 16_384)).contains("has 4 pixels, the window"));
    assert!(error(&FilmDescription::new(u32::MAX, u32::MAX)).contains("over 65536 pixels"));
    let crop = Crop { x: u32::MAX, y: 0, width: 2, height: 2 };
    assert!(error(&FilmDescription { crop, ..film }).contains("is not within 2×2"));
    let filter = FilterKind::Tent { radius: f64::NAN };
    assert!(error(&FilmDescription { filter, ..film }).contains("no valid width"));
}
