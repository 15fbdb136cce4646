//! Parameters of models that vary over a surface.

use std::ops::Deref;
use std::rc::Rc;
use std::sync::Arc;

use glam::Vec2;

use super::Bsdf;
use crate::description::{MaterialKind, Parameter};
use crate::texture::Texture;

/// Textures of a material, for the model in front and the one behind.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Textures {
    sides: [Vec<(Parameter, Arc<Texture>)>; 2],
}

impl Textures {
    /// The textures that `kind` has, if any.
    pub(crate) fn of(kind: &MaterialKind) -> Option<Self> {
        let of_one = |kind: &MaterialKind| match kind {
            MaterialKind::Textured { textures, .. } => textures.clone(),
            _ => Vec::new(),
        };
        let sides = match kind {
            MaterialKind::TwoSided { front, back } => [of_one(front), of_one(back)],
            other => [of_one(other), Vec::new()],
        };
        sides.iter().any(|side| !side.is_empty()).then_some(Textures { sides })
    }

    /// The model with the parameters that it has at (u, v). Values outside 0 to 1 are cut: no surface reflects more than it
    /// receives.
    pub(crate) fn resolve(&self, model: &Bsdf, uv: Vec2) -> Bsdf {
        let mut model = *model;
        for (behind, side) in self.sides.iter().enumerate() {
            for (parameter, texture) in side {
                let colour = texture.eval(uv).map(|v| v.clamp(0.0, 1.0));
                model.set(behind == 1, *parameter, colour);
            }
        }
        model
    }
}

/// A scattering model at a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Resolved<'a> {
    /// The same over the whole surface.
    Constant(&'a Bsdf),
    /// Made for this point ([`super::memo`]).
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
    use crate::color::Rgb;
    use glam::Vec3;

    fn board() -> Arc<Texture> {
        let colors = [0.8, 0.2].map(|v| Arc::new(Texture::Constant(Rgb::grey(v))));
        Arc::new(Texture::Checkerboard { colors, to_uv: glam::Affine2::IDENTITY })
    }

    #[test]
    fn each_side_has_its_own_textures() {
        let plain = MaterialKind::Diffuse { reflectance: Rgb::grey(0.5) };
        let textured = MaterialKind::Textured {
            model: Box::new(plain.clone()),
            textures: vec![(Parameter::Reflectance, board())],
        };
        assert_eq!(Textures::of(&plain), None);
        let kind = MaterialKind::TwoSided { front: Box::new(plain), back: Box::new(textured) };
        let (model, textures) = (Bsdf::new(&kind).unwrap(), Textures::of(&kind).unwrap());
        for (uv, reflectance) in [([0.1, 0.1], 0.8), ([0.7, 0.1], 0.2)] {
            let here = textures.resolve(&model, Vec2::from(uv));
            let f = |z: f32| {
                let w = Vec3::new(0.0, 0.6, 0.8 * z);
                here.eval(w, w, crate::bsdf::TransportMode::Radiance).r * std::f32::consts::PI
            };
            assert!((f(1.0) - 0.5).abs() < 1e-6);
            assert!((f(-1.0) - reflectance).abs() < 1e-6);
        }
    }
}
