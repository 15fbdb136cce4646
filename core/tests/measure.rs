//! Conversions of measures along an edge, by hand: every cosine and the distance differ, so that
//! none can stand in for another.

use glam::Vec3;
use pathspace_core::measure::{Area, Density, Edge, End, Mass, ProjectedSolidAngle, SolidAngle};

/// (2, 3, 6) has length 7.
const A: End = End::Surface { p: Vec3::new(1.0, 1.0, 1.0), n: Vec3::X };
const B: End = End::Surface { p: Vec3::new(3.0, 4.0, 7.0), n: Vec3::NEG_Z };
const COS_A: f64 = 2.0 / 7.0;
const COS_B: f64 = 6.0 / 7.0;
const SKY: End = End::Infinite { to: Vec3::new(0.6, 0.0, 0.8) };

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-7 * expected.abs(), "{found}, expected {expected}");
}

#[test]
fn an_edge_has_the_cosines_and_the_distance_of_its_ends() {
    let edge = Edge::new(&A, &B);
    near(edge.cos_a(), COS_A);
    near(edge.cos_b(), COS_B);
    near(edge.distance2(), 49.0);
    near(edge.geometry_term(), COS_A * COS_B / 49.0);
    assert!(edge.direction().distance(Vec3::new(2.0, 3.0, 6.0) / 7.0) < 1e-7);
}

#[test]
fn directions_become_points_by_the_cosine_there_over_the_squared_distance() {
    let edge = Edge::new(&A, &B);
    near(edge.to_area(Density::new(3.0)).value(), 3.0 * COS_B / 49.0);
    near(edge.to_solid_angle(Density::new(3.0)).value(), 3.0 * 49.0 / COS_B);
}

#[test]
fn projected_solid_angle_has_the_cosine_of_the_first_end() {
    let edge = Edge::new(&A, &B);
    near(edge.to_projected(Density::new(3.0)).value(), 3.0 / COS_A);
    near(edge.from_projected(Density::<ProjectedSolidAngle>::new(3.0)).value(), 3.0 * COS_A);
}

#[test]
fn a_point_without_a_surface_has_cosine_one() {
    let edge = Edge::new(&End::Point { p: Vec3::ONE }, &B);
    near(edge.geometry_term(), COS_B / 49.0);
    near(edge.reversed().to_area(Density::new(3.0)).value(), 3.0 / 49.0);
}

#[test]
fn a_second_end_at_infinity_keeps_its_solid_angle() {
    let edge = Edge::new(&A, &SKY);
    near(edge.geometry_term(), 0.6);
    assert_eq!(edge.direction(), Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(edge.to_area(Density::new(3.0)).value(), 3.0);
    assert_eq!(edge.to_solid_angle(Density::new(3.0)).value(), 3.0);
}

#[test]
fn a_beam_falls_on_a_surface_by_the_cosine_there() {
    let edge = Edge::new(&SKY, &B);
    near(edge.geometry_term(), 0.8);
    assert_eq!(edge.direction(), Vec3::new(-0.6, 0.0, -0.8));
    near(edge.beam_to_area(Density::new(3.0)).value(), 3.0 * 0.8);
    near(edge.to_solid_angle(Density::new(3.0)).value(), 3.0 / 0.8);
}

#[test]
fn a_reversed_edge_is_the_edge_of_exchanged_ends() {
    for (a, b) in [(A, B), (End::Point { p: Vec3::ZERO }, B), (A, SKY), (SKY, B)] {
        assert_eq!(Edge::new(&a, &b).reversed(), Edge::new(&b, &a), "{a:?} {b:?}");
    }
}

#[test]
fn densities_of_one_measure_add_and_divide() {
    let (a, b) = (Density::<SolidAngle>::new(3.0), Density::<SolidAngle>::new(0.5));
    assert_eq!((a + b).value(), 3.5);
    assert_eq!(a / b, 6.0);
    assert!(a == a && a != b);
    assert!(Density::<Area>::ZERO.is_zero() && !a.is_zero());
}

#[test]
fn choices_multiply() {
    let (half, third) = (Mass::new(0.5), Mass::new(0.3));
    assert_eq!((half * third).value(), 0.15);
    assert_eq!((Density::<Area>::new(3.0) * half).value(), 1.5);
    assert_eq!(Density::at_delta(third).value(), 0.3);
}
