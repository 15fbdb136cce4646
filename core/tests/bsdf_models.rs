//! The models that the tests of scattering share.

use glam::Vec3;
use pathspace_core::Rgb;
use pathspace_core::bsdf::Bsdf;
use pathspace_core::description::{MaterialKind, MicrofacetKind};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

pub use MicrofacetKind::{Beckmann, Ggx};

/// Some metal, different in each channel.
pub const ETA: Rgb = Rgb::new(0.2, 0.9, 1.5);
pub const K: Rgb = Rgb::new(3.9, 2.4, 1.9);

pub fn build(kind: &MaterialKind) -> Bsdf {
    Bsdf::new(kind).unwrap()
}

pub fn diffuse(reflectance: Rgb) -> MaterialKind {
    MaterialKind::Diffuse { reflectance }
}

pub fn conductor(specular_reflectance: Rgb) -> MaterialKind {
    MaterialKind::Conductor { eta: ETA, k: K, specular_reflectance }
}

pub fn rough(
    distribution: MicrofacetKind,
    alpha_u: f32,
    alpha_v: f32,
    sample_visible: bool,
) -> MaterialKind {
    let specular_reflectance = Rgb::new(0.9, 0.8, 1.0);
    MaterialKind::RoughConductor {
        distribution,
        alpha_u,
        alpha_v,
        sample_visible,
        eta: ETA,
        k: K,
        specular_reflectance,
    }
}

/// A rough conductor with F = 1.
pub fn rough_mirror(
    distribution: MicrofacetKind,
    alpha: f32,
    sample_visible: bool,
) -> MaterialKind {
    MaterialKind::RoughConductor {
        distribution,
        alpha_u: alpha,
        alpha_v: alpha,
        sample_visible,
        eta: Rgb::BLACK,
        k: Rgb::WHITE,
        specular_reflectance: Rgb::WHITE,
    }
}

pub fn dielectric(int_ior: f32, ext_ior: f32) -> MaterialKind {
    MaterialKind::Dielectric {
        int_ior,
        ext_ior,
        specular_reflectance: Rgb::WHITE,
        specular_transmittance: Rgb::WHITE,
    }
}

pub fn two_sided(front: MaterialKind, back: MaterialKind) -> MaterialKind {
    MaterialKind::TwoSided { front: Box::new(front), back: Box::new(back) }
}

/// Models with a specular and a non-specular component on one side.
pub fn mixed() -> Vec<(&'static str, Bsdf)> {
    let plastic = |int_ior, nonlinear| MaterialKind::Plastic {
        int_ior,
        ext_ior: 1.0,
        diffuse_reflectance: Rgb::new(0.2, 0.5, 0.9),
        specular_reflectance: Rgb::new(1.0, 0.8, 0.9),
        nonlinear,
    };
    [
        ("plastic", plastic(1.5, false)),
        ("plastic nonlinear", plastic(1.9, true)),
        ("plastic twosided", two_sided(plastic(1.3, false), conductor(Rgb::WHITE))),
    ]
    .map(|(name, kind)| (name, build(&kind)))
    .into()
}

/// Models with lobes that spread.
pub fn spreading() -> Vec<(&'static str, Bsdf)> {
    [
        ("diffuse", diffuse(Rgb::new(0.2, 0.5, 0.9))),
        ("twosided", two_sided(diffuse(Rgb::new(0.2, 0.5, 0.9)), rough(Ggx, 0.3, 0.6, true))),
        ("ggx visible", rough(Ggx, 0.15, 0.4, true)),
        ("ggx all", rough(Ggx, 0.25, 0.1, false)),
        ("ggx smooth", rough(Ggx, 1e-3, 1e-3, true)),
        ("ggx rough", rough(Ggx, 1.0, 1.0, true)),
        ("beckmann visible", rough(Beckmann, 0.3, 0.5, true)),
        ("beckmann all", rough(Beckmann, 0.2, 0.1, false)),
        ("beckmann smooth", rough(Beckmann, 1e-3, 1e-3, true)),
    ]
    .map(|(name, kind)| (name, build(&kind)))
    .into()
}

/// Models with delta lobes only.
pub fn delta() -> Vec<(&'static str, Bsdf)> {
    [
        ("conductor", conductor(Rgb::new(0.9, 0.8, 1.0))),
        ("glass", dielectric(1.5, 1.0)),
        ("bubble", dielectric(1.0, 1.33)),
        ("matched", dielectric(1.3, 1.3)),
        ("null", MaterialKind::Null),
        ("twosided", two_sided(conductor(Rgb::WHITE), conductor(Rgb::grey(0.5)))),
    ]
    .map(|(name, kind)| (name, build(&kind)))
    .into()
}

/// Unit direction with the given cosine and azimuth.
pub fn direction(cos: f64, phi: f64) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), cos).as_vec3()
}

/// Uniform direction on the sphere.
pub fn random_direction(rng: &mut Pcg64Mcg) -> Vec3 {
    direction(rng.random_range(-1.0..1.0), rng.random_range(0.0..std::f64::consts::TAU))
}
