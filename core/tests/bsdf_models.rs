//! The models that the tests of scattering share.

use glam::Vec3;
use pathspace_core::Rgb;
use pathspace_core::bsdf::Bsdf;
use std::sync::Arc;

use pathspace_core::description::{
    MaterialKind, MicrofacetKind, PrincipledKind, PrincipledThinKind, ReliefMap, WardVariant,
};
use pathspace_core::texture::Texture;
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

pub fn rough_glass(
    distribution: MicrofacetKind,
    alpha_u: f32,
    alpha_v: f32,
    sample_visible: bool,
    [int_ior, ext_ior]: [f32; 2],
) -> MaterialKind {
    MaterialKind::RoughDielectric {
        distribution,
        alpha_u,
        alpha_v,
        sample_visible,
        int_ior,
        ext_ior,
        specular_reflectance: Rgb::new(1.0, 0.9, 0.8),
        specular_transmittance: Rgb::new(0.8, 0.9, 1.0),
    }
}

pub fn rough_plastic(distribution: MicrofacetKind, alpha: f32, nonlinear: bool) -> MaterialKind {
    MaterialKind::RoughPlastic {
        distribution,
        alpha,
        sample_visible: nonlinear,
        int_ior: 1.5,
        ext_ior: 1.0,
        diffuse_reflectance: Rgb::new(0.2, 0.5, 0.9),
        specular_reflectance: Rgb::new(1.0, 0.8, 0.9),
        nonlinear,
    }
}

pub fn pane() -> MaterialKind {
    MaterialKind::ThinDielectric {
        int_ior: 1.5,
        ext_ior: 1.0,
        specular_reflectance: Rgb::WHITE,
        specular_transmittance: Rgb::new(0.9, 1.0, 0.8),
    }
}

pub fn blend(a: MaterialKind, b: MaterialKind, weight: f32) -> MaterialKind {
    MaterialKind::Mixture { models: vec![(1.0 - weight, a), (weight, b)] }
}

pub fn mask(model: MaterialKind, opacity: f32) -> MaterialKind {
    MaterialKind::Mask { opacity, model: Box::new(model) }
}

/// A model about a normal that leans by `slope`.
pub fn relief(model: MaterialKind, slope: f32, flips: bool) -> MaterialKind {
    let n = Vec3::new(slope, 0.5 * slope, 1.0).normalize() * 0.5 + 0.5;
    MaterialKind::Relief {
        model: Box::new(model),
        map: ReliefMap::Normals(Arc::new(Texture::Constant(Rgb::new(n.x, n.y, n.z)))),
        flip_invalid_normals: flips,
        use_shadowing: flips,
    }
}

/// The later models: large ones, and those made of others. Names with "relief" need a scene,
/// because a texture tells their normal.
pub fn compound() -> Vec<(&'static str, MaterialKind)> {
    let base_color = Rgb::new(0.3, 0.6, 0.8);
    let cloth = PrincipledKind {
        base_color,
        roughness: 0.6,
        sheen: 0.4,
        sheen_tint: 0.5,
        flatness: 0.4,
        ..PrincipledKind::default()
    };
    let paint = PrincipledKind {
        base_color,
        roughness: 0.5,
        metallic: 0.6,
        anisotropic: 0.7,
        spec_tint: 0.5,
        clearcoat: 0.8,
        clearcoat_gloss: 0.1,
        ..PrincipledKind::default()
    };
    let frost = PrincipledKind {
        base_color,
        roughness: 0.5,
        spec_trans: 0.7,
        clearcoat: 0.3,
        eta: 1.4,
        ..PrincipledKind::default()
    };
    let leaf = PrincipledThinKind {
        base_color,
        roughness: 0.6,
        anisotropic: 0.5,
        spec_trans: 0.4,
        spec_tint: 0.3,
        diff_trans: 0.9,
        sheen: 0.2,
        ..PrincipledThinKind::default()
    };
    let grey = || diffuse(Rgb::new(0.2, 0.5, 0.9));
    let principled = |kind: PrincipledKind| MaterialKind::Principled(Box::new(kind));
    let smooth = || MaterialKind::Plastic {
        int_ior: 1.5,
        ext_ior: 1.0,
        diffuse_reflectance: Rgb::grey(0.5),
        specular_reflectance: Rgb::WHITE,
        nonlinear: false,
    };
    let ward = |variant| MaterialKind::Ward {
        variant,
        alpha_u: 0.3,
        alpha_v: 0.5,
        diffuse_reflectance: Rgb::grey(0.4),
        specular_reflectance: Rgb::grey(0.2),
    };
    let rough_diffuse = |fast| MaterialKind::RoughDiffuse {
        reflectance: Rgb::new(0.2, 0.5, 0.9),
        alpha: 0.6,
        fast,
    };
    vec![
        ("rough plastic", rough_plastic(Ggx, 0.3, false)),
        ("rough plastic nonlinear", rough_plastic(Beckmann, 0.2, true)),
        ("rough glass", rough_glass(Ggx, 0.4, 0.4, true, [1.5, 1.0])),
        ("rough glass beckmann", rough_glass(Beckmann, 0.3, 0.5, true, [1.0, 1.33])),
        ("rough glass all normals", rough_glass(Ggx, 0.4, 0.3, false, [1.5, 1.0])),
        ("pane", pane()),
        ("oren nayar", rough_diffuse(false)),
        ("oren nayar fast", rough_diffuse(true)),
        (
            "phong",
            MaterialKind::Phong {
                exponent: 20.0,
                diffuse_reflectance: Rgb::grey(0.4),
                specular_reflectance: Rgb::grey(0.3),
            },
        ),
        ("ward", ward(WardVariant::Balanced)),
        ("ward 1992", ward(WardVariant::Ward)),
        ("cloth", principled(cloth)),
        ("paint", principled(paint)),
        ("frost", principled(frost)),
        ("leaf", MaterialKind::PrincipledThin(Box::new(leaf))),
        ("blend", blend(smooth(), rough(Ggx, 0.3, 0.3, true), 0.3)),
        ("half a mirror", blend(conductor(Rgb::WHITE), grey(), 0.6)),
        ("mask", mask(rough_plastic(Ggx, 0.3, false), 0.7)),
        ("glass and paint", blend(dielectric(1.5, 1.0), mask(principled(paint), 0.5), 0.4)),
        ("deep", blend(mask(blend(smooth(), grey(), 0.5), 0.6), blend(pane(), grey(), 0.3), 0.5)),
        ("sides", two_sided(blend(smooth(), grey(), 0.5), principled(cloth))),
        ("relief", relief(grey(), 0.4, true)),
        ("relief without guards", relief(grey(), 0.4, false)),
        ("relief of plastic", relief(smooth(), 0.3, true)),
        ("relief of glass", relief(dielectric(1.5, 1.0), 0.2, true)),
        ("relief of rough glass", relief(rough_glass(Ggx, 0.4, 0.4, true, [1.5, 1.0]), 0.3, true)),
        ("sides of relief", two_sided(relief(smooth(), 0.3, true), grey())),
        ("mask of relief", mask(relief(smooth(), 0.3, false), 0.5)),
    ]
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
