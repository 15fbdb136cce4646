//! Parameters of models that vary over a surface.

use std::ops::Deref;
use std::rc::Rc;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{Bsdf, Compound, Opaque};
use crate::color::Rgb;
use crate::description::{MaterialKind, Parameter, ReliefMap};
use crate::texture::Texture;

/// Textures of a material: its own, its map of normals, and those of the models that it is made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Textures {
    own: Vec<(Parameter, Arc<Texture>)>,
    relief: Option<ReliefMap>,
    parts: Vec<Textures>,
}

/// Derivatives of the position by the texture coordinates, in the shading frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangents {
    /// ∂p/∂u in the normalised scene.
    pub du: Vec3,
    /// ∂p/∂v.
    pub dv: Vec3,
    /// n_g.
    pub n_g: Vec3,
    /// Normalised units per unit of the world.
    pub scale: f32,
}

/// Where a model is resolved.
pub(crate) struct Here<'a> {
    /// Texture coordinates.
    pub uv: Vec2,
    /// Asked for by bump maps alone.
    pub tangents: &'a dyn Fn() -> Tangents,
}

impl Textures {
    /// The textures that `kind` has, if any.
    pub(crate) fn of(kind: &MaterialKind) -> Option<Self> {
        let textures = Textures::all(kind);
        (!textures.is_empty()).then_some(textures)
    }

    fn all(kind: &MaterialKind) -> Self {
        let parts = |kinds: &[&MaterialKind]| kinds.iter().map(|k| Textures::all(k)).collect();
        match kind {
            MaterialKind::Textured { model, textures } => {
                let mut all = Textures::all(model);
                all.own.extend(textures.iter().cloned());
                all
            }
            MaterialKind::TwoSided { front, back } => {
                Textures { parts: parts(&[front, back]), ..Textures::default() }
            }
            MaterialKind::Mixture { models } => {
                let kinds: Vec<_> = models.iter().map(|(_, kind)| kind).collect();
                Textures { parts: parts(&kinds), ..Textures::default() }
            }
            // The first part of the mixture is what lets light through.
            MaterialKind::Mask { model, .. } => {
                Textures { parts: parts(&[&MaterialKind::Null, model]), ..Textures::default() }
            }
            MaterialKind::Relief { model, map, .. } => {
                Textures { own: Vec::new(), relief: Some(map.clone()), parts: parts(&[model]) }
            }
            _ => Textures::default(),
        }
    }

    fn is_empty(&self) -> bool {
        self.own.is_empty() && self.relief.is_none() && self.parts.iter().all(Textures::is_empty)
    }

    /// True where a texture makes the azimuth of the shading frame matter.
    pub(crate) fn need_tangent(&self) -> bool {
        let turns = |p: &Parameter| {
            matches!(p, Parameter::AlphaU | Parameter::AlphaV | Parameter::Anisotropic)
        };
        self.relief.is_some()
            || self.own.iter().any(|(p, _)| turns(p))
            || self.parts.iter().any(Textures::need_tangent)
    }

    /// The model with the parameters that it has at a point. Colours outside 0 to 1 are cut: no
    /// surface reflects more than it receives.
    pub(crate) fn resolve(&self, model: &Bsdf, here: &Here<'_>) -> Bsdf {
        let mut model = model.clone();
        self.apply(&mut model, here);
        model
    }

    fn apply(&self, model: &mut Bsdf, here: &Here<'_>) {
        self.own(here, |parameter, value| model.set(parameter, value));
        match model {
            Bsdf::TwoSided { front, back } => {
                for (textures, side) in self.parts.iter().zip([front, back]) {
                    textures.apply_to_side(side, here);
                }
            }
            Bsdf::Compound(compound) => match &mut **compound {
                Compound::Mixture(mixture) => {
                    for (textures, model) in self.parts.iter().zip(mixture.models_mut()) {
                        textures.apply(model, here);
                    }
                }
                Compound::Sides(sides) => {
                    for (textures, model) in self.parts.iter().zip(sides.models_mut()) {
                        textures.apply(model, here);
                    }
                }
                Compound::Relief(relief) => {
                    if let Some(map) = &self.relief {
                        relief.set_normal(normal(map, here));
                    }
                    // A relief on a relief stands on its normal.
                    let frame = *relief.frame();
                    let tangents = || {
                        let t = (here.tangents)();
                        let [du, dv, n_g] = [t.du, t.dv, t.n_g].map(|v| frame.to_local(v));
                        Tangents { du, dv, n_g, ..t }
                    };
                    let inner = Here { uv: here.uv, tangents: &tangents };
                    if let Some(textures) = self.parts.first() {
                        textures.apply(relief.model_mut(), &inner);
                    }
                }
                _ => {}
            },
            _ => {}
        }
    }

    fn apply_to_side(&self, side: &mut Opaque, here: &Here<'_>) {
        self.own(here, |parameter, value| side.set(parameter, value));
    }

    fn own(&self, here: &Here<'_>, mut set: impl FnMut(Parameter, Rgb)) {
        for (parameter, texture) in &self.own {
            let value = match parameter.is_colour() {
                true => texture.eval(here.uv).map(|v| v.clamp(0.0, 1.0)),
                false => Rgb::grey(texture.eval_scalar(here.uv)),
            };
            set(*parameter, value);
        }
    }
}

/// The normal that a map gives in the shading frame.
fn normal(map: &ReliefMap, here: &Here<'_>) -> Vec3 {
    match map {
        ReliefMap::Normals(texture) => {
            Vec3::from(texture.eval(here.uv).to_array()) * 2.0 - Vec3::ONE
        }
        ReliefMap::Heights { texture, scale } => {
            let slope = texture.gradient(here.uv) * *scale;
            let at = (here.tangents)();
            // The surface p + n_s h, its normal left where it is (Blinn 1978).
            let raised = |d: Vec3, h: f32| d.truncate().extend(h * at.scale);
            let n = raised(at.du, slope.x).cross(raised(at.dv, slope.y)).normalize_or(Vec3::Z);
            if n.dot(at.n_g) < 0.0 { -n } else { n }
        }
    }
}

/// A scattering model at a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Resolved<'a> {
    /// The same over the whole surface.
    Constant(&'a Bsdf),
    /// Made for this point (`bsdf::memo`).
    Here(Rc<Bsdf>),
}

impl Deref for Resolved<'_> {
    type Target = Bsdf;

    #[inline]
    fn deref(&self) -> &Bsdf {
        match self {
            Resolved::Constant(model) => model,
            Resolved::Here(model) => model,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Arc<Texture> {
        let colors = [0.8, 0.2].map(|v| Arc::new(Texture::Constant(Rgb::grey(v))));
        Arc::new(Texture::Checkerboard { colors, to_uv: glam::Affine2::IDENTITY })
    }

    fn flat() -> Tangents {
        Tangents { du: Vec3::X, dv: Vec3::Y, n_g: Vec3::Z, scale: 1.0 }
    }

    fn at(uv: [f32; 2]) -> Here<'static> {
        Here { uv: Vec2::from(uv), tangents: &flat }
    }

    fn varying(model: MaterialKind, parameter: Parameter) -> MaterialKind {
        MaterialKind::Textured { model: Box::new(model), textures: vec![(parameter, board())] }
    }

    #[test]
    fn each_side_has_its_own_textures() {
        let plain = MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) };
        let textured = varying(plain.clone(), Parameter::Reflectance);
        assert_eq!(Textures::of(&plain), None);
        let kind = MaterialKind::TwoSided { front: Box::new(plain), back: Box::new(textured) };
        let (model, textures) = (Bsdf::new(&kind).unwrap(), Textures::of(&kind).unwrap());
        for (uv, reflectance) in [([0.1, 0.1], 0.8), ([0.7, 0.1], 0.2)] {
            let here = textures.resolve(&model, &at(uv));
            let f = |z: f32| {
                let w = Vec3::new(0.0, 0.6, 0.8 * z);
                here.eval(w, w, crate::bsdf::TransportMode::Radiance).r * std::f32::consts::PI
            };
            assert!((f(1.0) - 0.5).abs() < 1e-6);
            assert!((f(-1.0) - reflectance).abs() < 1e-6);
        }
    }

    #[test]
    fn textures_reach_every_depth() {
        let diffuse = MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) };
        let inner = varying(diffuse, Parameter::Reflectance);
        let mask = MaterialKind::Mask { opacity: 0.5, model: Box::new(inner) };
        let mask = varying(mask, Parameter::Weight);
        let black = MaterialKind::Diffuse { reflectance: Rgb::BLACK };
        let kind = MaterialKind::Mixture { models: vec![(0.5, mask), (0.5, black)] };
        let (model, textures) = (Bsdf::new(&kind).unwrap(), Textures::of(&kind).unwrap());
        for (uv, value) in [([0.1, 0.1], 0.8), ([0.7, 0.1], 0.2)] {
            let here = textures.resolve(&model, &at(uv));
            let w = Vec3::new(0.0, 0.6, 0.8);
            let f = here.eval(w, w, crate::bsdf::TransportMode::Radiance).r;
            // A checkerboard has its squares the other way round as a number.
            let expected = 0.5 * value * (1.0 - value) * std::f32::consts::FRAC_1_PI;
            assert!((f - expected).abs() < 1e-6, "{f} {expected}");
        }
    }
}
