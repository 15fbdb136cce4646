//! Colours that vary over a surface, as functions of its texture coordinates (u, v).
//!
//! Textures are plain values: a description and the built scene share them. Materials evaluate them
//! once for each hit.

mod bitmap;

pub use bitmap::{Bitmap, BitmapError};

use std::sync::Arc;

use glam::{Affine2, Vec2};

use crate::color::Rgb;

/// A colour over a surface.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Texture {
    /// The same everywhere.
    Constant(Rgb),
    /// An image.
    Bitmap(Image),
    /// Squares of side ½ in two alternating textures.
    Checkerboard {
        /// The first one holds at (0, 0).
        colors: [Arc<Texture>; 2],
        /// Acts on (u, v) before.
        to_uv: Affine2,
    },
    /// A texture times a factor.
    Scaled {
        /// What is scaled.
        texture: Arc<Texture>,
        /// By how much.
        factor: Rgb,
    },
}

/// An image laid over (u, v): the first row lies at v = 0, the first column at u = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The texels.
    pub bitmap: Arc<Bitmap>,
    /// Between the texels.
    pub filter: Filter,
    /// Beyond \[0, 1\]².
    pub wrap: Wrap,
    /// Acts on (u, v) before.
    pub to_uv: Affine2,
}

/// How texels are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The texel that (u, v) lies in.
    Nearest,
    /// Bilinear between the centres of texels.
    #[default]
    Bilinear,
}

/// What lies beyond the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image and its mirror image in turn.
    Mirror,
    /// The texels of the border.
    Clamp,
}

impl Wrap {
    /// The index in 0..n that stands for any index.
    #[inline]
    fn index(self, i: i64, n: u32) -> u32 {
        let n = i64::from(n);
        let at = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let m = i.rem_euclid(2 * n);
                if m < n { m } else { 2 * n - 1 - m }
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        at as u32
    }
}

impl Texture {
    /// The colour at (u, v).
    pub fn eval(&self, uv: Vec2) -> Rgb {
        match self {
            Texture::Constant(c) => *c,
            Texture::Bitmap(image) => image.eval(uv),
            Texture::Checkerboard { colors, to_uv } => {
                colors[usize::from(is_second(*to_uv, uv))].eval(uv)
            }
            Texture::Scaled { texture, factor } => texture.eval(uv) * *factor,
        }
    }

    /// One number at (u, v), for roughness and the like: the luminance of the colour. Of a
    /// checkerboard it is that of the other square, as in Mitsuba 3.
    pub fn eval_scalar(&self, uv: Vec2) -> f32 {
        match self {
            Texture::Checkerboard { colors, to_uv } => {
                colors[usize::from(!is_second(*to_uv, uv))].eval_scalar(uv)
            }
            Texture::Scaled { texture, factor } if factor.r == factor.g && factor.g == factor.b => {
                texture.eval_scalar(uv) * factor.r
            }
            _ => luminance(self.eval(uv)),
        }
    }

    /// Derivatives of [`Texture::eval_scalar`] by u and v; of an image between the centres of its
    /// texels, 0 where it jumps.
    pub fn gradient(&self, uv: Vec2) -> Vec2 {
        match self {
            Texture::Constant(_) | Texture::Checkerboard { .. } => Vec2::ZERO,
            Texture::Bitmap(image) => image.gradient(uv),
            Texture::Scaled { texture, factor } => texture.gradient(uv) * luminance(*factor),
        }
    }

    /// Mean over one period, for the choice among emitters and lobes: not exact under clamped
    /// borders.
    pub fn mean(&self) -> Rgb {
        match self {
            Texture::Constant(c) => *c,
            Texture::Bitmap(image) => image.bitmap.mean(),
            Texture::Checkerboard { colors, .. } => (colors[0].mean() + colors[1].mean()) * 0.5,
            Texture::Scaled { texture, factor } => texture.mean() * *factor,
        }
    }

    /// A bound on every channel anywhere.
    pub fn max(&self) -> f32 {
        match self {
            Texture::Constant(c) => c.max_channel(),
            Texture::Bitmap(image) => image.bitmap.max(),
            Texture::Checkerboard { colors, .. } => colors[0].max().max(colors[1].max()),
            Texture::Scaled { texture, factor } => texture.max() * factor.max_channel(),
        }
    }

    /// A bound from below on every channel anywhere.
    pub fn min(&self) -> f32 {
        match self {
            Texture::Constant(c) => c.r.min(c.g).min(c.b),
            Texture::Bitmap(image) => image.bitmap.min(),
            Texture::Checkerboard { colors, .. } => colors[0].min().min(colors[1].min()),
            Texture::Scaled { texture, factor } => {
                texture.min() * factor.r.min(factor.g).min(factor.b)
            }
        }
    }

    /// The colour where it is the same everywhere.
    pub fn constant(&self) -> Option<Rgb> {
        match self {
            Texture::Constant(c) => Some(*c),
            Texture::Scaled { texture, factor } => texture.constant().map(|c| c * *factor),
            _ => None,
        }
    }
}

/// True on the squares of a checkerboard that have its second texture.
fn is_second(to_uv: Affine2, uv: Vec2) -> bool {
    let p = to_uv.transform_point2(uv);
    let upper = |x: f32| x - x.floor() > 0.5;
    upper(p.x) != upper(p.y)
}

fn luminance(c: Rgb) -> f32 {
    // Grey stays exactly what it is.
    if c.r == c.g && c.g == c.b {
        return c.r;
    }
    0.212_671 * c.r + 0.715_160 * c.g + 0.072_169 * c.b
}

impl Image {
    fn gradient(&self, uv: Vec2) -> Vec2 {
        if self.filter == Filter::Nearest {
            return Vec2::ZERO;
        }
        let (w, h) = (self.bitmap.width(), self.bitmap.height());
        let size = Vec2::new(w as f32, h as f32);
        let p = self.to_uv.transform_point2(uv) * size - 0.5;
        let (i, j) = (p.x.floor() as i64, p.y.floor() as i64);
        let f = p - p.floor();
        let texel = |x: i64, y: i64| {
            luminance(self.bitmap.texel(self.wrap.index(x, w), self.wrap.index(y, h)))
        };
        let [a, b, c, d] = [texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1)];
        let by_texel =
            Vec2::new((b - a) + f.y * ((d - c) - (b - a)), (c - a) + f.x * ((d - b) - (c - a)));
        self.to_uv.matrix2.transpose() * (by_texel * size)
    }

    /// The colour at (u, v).
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Rgb {
        let p = self.to_uv.transform_point2(uv);
        let (w, h) = (self.bitmap.width(), self.bitmap.height());
        let texel =
            |x: i64, y: i64| self.bitmap.texel(self.wrap.index(x, w), self.wrap.index(y, h));
        let (x, y) = (p.x * w as f32, p.y * h as f32);
        match self.filter {
            Filter::Nearest => texel(x.floor() as i64, y.floor() as i64),
            Filter::Bilinear => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (x0, y0) = (x.floor(), y.floor());
                let (fx, fy) = (x - x0, y - y0);
                let (i, j) = (x0 as i64, y0 as i64);
                let row = |j| texel(i, j) * (1.0 - fx) + texel(i + 1, j) * fx;
                row(j) * (1.0 - fy) + row(j + 1) * fy
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three by two texels, the first row red, black, green, the second one blue, grey, black.
    fn image() -> Image {
        let mut texels = vec![0.0; 18];
        texels[0] = 1.0;
        texels[7] = 1.0;
        texels[11] = 1.0;
        texels[12..15].fill(0.5);
        Image {
            bitmap: Arc::new(Bitmap::from_floats(3, 2, 3, texels).unwrap()),
            filter: Filter::Bilinear,
            wrap: Wrap::Repeat,
            to_uv: Affine2::IDENTITY,
        }
    }

    const POINTS: [[f32; 2]; 6] =
        [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.5, 0.5], [1.2, -0.3], [-0.7, 2.4]];

    fn assert_values(image: Image, expected: [[f32; 3]; 6]) {
        let texture = Texture::Bitmap(image);
        for (uv, expected) in POINTS.iter().zip(expected) {
            let found = texture.eval(Vec2::from(*uv)).to_array();
            for c in 0..3 {
                assert!((found[c] - expected[c]).abs() < 1e-5, "{uv:?}: {found:?} {expected:?}");
            }
        }
    }

    /// The numbers are those of Mitsuba 3.9.1 for the same image.
    #[test]
    fn images_are_interpolated_and_wrapped_as_in_mitsuba() {
        assert_values(
            Image { filter: Filter::Nearest, ..image() },
            [
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.5, 0.5, 0.5],
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 0.0],
            ],
        );
        assert_values(
            image(),
            [
                [0.56, 0.14, 0.24],
                [0.14, 0.56, 0.06],
                [0.24, 0.06, 0.56],
                [0.25, 0.25, 0.25],
                [0.135, 0.045, 0.855],
                [0.48, 0.06, 0.24],
            ],
        );
        assert_values(
            Image { wrap: Wrap::Mirror, ..image() },
            [
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.25, 0.25, 0.25],
                [0.005, 0.815, 0.005],
                [0.06, 0.48, 0.06],
            ],
        );
        assert_values(
            Image { wrap: Wrap::Clamp, ..image() },
            [
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.25, 0.25, 0.25],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
            ],
        );
        assert_values(
            Image { to_uv: Affine2::from_scale(Vec2::splat(2.0)), ..image() },
            [
                [0.815, 0.005, 0.095],
                [0.005, 0.815, 0.005],
                [0.135, 0.045, 0.855],
                [0.25, 0.25, 0.25],
                [0.315, 0.105, 0.195],
                [0.315, 0.345, 0.315],
            ],
        );
    }

    #[test]
    fn the_checkerboard_is_that_of_mitsuba() {
        let [a, b] = [0.8, 0.1].map(|v| Arc::new(Texture::Constant(Rgb::grey(v))));
        let board =
            Texture::Checkerboard { colors: [a, b], to_uv: Affine2::from_scale(Vec2::splat(2.0)) };
        let at = |u, v| board.eval(Vec2::new(u, v)).r;
        assert_eq!([at(0.1, 0.1), at(0.3, 0.1), at(0.1, 0.3)], [0.8, 0.1, 0.1]);
        assert_eq!([at(0.3, 0.3), at(-0.1, 0.1)], [0.8, 0.1]);
        // As a number it has its colours the other way round there.
        let number = |u, v| board.eval_scalar(Vec2::new(u, v));
        assert_eq!([number(0.1, 0.1), number(0.3, 0.1), number(0.3, 0.3)], [0.1, 0.8, 0.1]);
        assert!((board.mean().r - 0.45).abs() < 1e-6);
        assert_eq!((board.max(), board.min()), (0.8, 0.1));
    }

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let to_uv = Affine2::from_scale_angle_translation(Vec2::new(2.0, 0.7), 0.3, Vec2::ONE);
        let texture = Texture::Bitmap(Image { to_uv, ..image() });
        for uv in [[0.13, 0.21], [0.4, 0.77], [0.91, 0.35]].map(Vec2::from) {
            let step = 1e-3;
            let by = |d: Vec2| {
                (texture.eval_scalar(uv + d * step) - texture.eval_scalar(uv - d * step))
                    / (2.0 * step)
            };
            let difference = texture.gradient(uv) - Vec2::new(by(Vec2::X), by(Vec2::Y));
            assert!(difference.length() < 5e-3, "{uv}: {difference}");
        }
    }

    #[test]
    fn coordinates_that_are_no_numbers_still_give_a_colour() {
        for bad in [f32::NAN, f32::INFINITY, -1e30, 1e30] {
            for filter in [Filter::Nearest, Filter::Bilinear] {
                let image = Image { filter, ..image() };
                let _ = image.bitmap.texel(0, 0) + image.eval(Vec2::new(bad, 0.5));
                let _ = image.gradient(Vec2::new(bad, 0.5));
            }
        }
    }
}
