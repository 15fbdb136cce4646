//! Linear sRGB triples: radiance, reflectance and throughput.

use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Sub};

/// Linear sRGB triple in `f32`; radiance in W·m⁻²·sr⁻¹ per channel where it is radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Rgb {
    /// All channels 0.
    pub const BLACK: Rgb = Rgb::grey(0.0);
    /// All channels 1.
    pub const WHITE: Rgb = Rgb::grey(1.0);

    /// From three channels.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Rgb { r, g, b }
    }

    /// The same value in every channel.
    pub const fn grey(v: f32) -> Self {
        Rgb { r: v, g: v, b: v }
    }

    /// Largest channel.
    pub fn max_channel(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// Arithmetic mean of the channels.
    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) * (1.0 / 3.0)
    }

    /// True where every channel is exactly 0.
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }

    /// True where no channel is NaN or infinite.
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Applies `f` to each channel.
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Rgb::new(f(self.r), f(self.g), f(self.b))
    }

    /// The channels as `[r, g, b]`.
    pub fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }
}

impl From<[f32; 3]> for Rgb {
    fn from(v: [f32; 3]) -> Self {
        Rgb::new(v[0], v[1], v[2])
    }
}

impl Index<usize> for Rgb {
    type Output = f32;
    fn index(&self, i: usize) -> &f32 {
        match i {
            0 => &self.r,
            1 => &self.g,
            2 => &self.b,
            _ => panic!("an Rgb has the channels 0..3, not {i}"),
        }
    }
}

/// Rec. 709 luminance of a pixel, Y = 0.212671 r + 0.715160 g + 0.072169 b, the weights that
/// Mitsuba uses. They sum to 1: grey keeps its value.
pub fn luminance(p: &[f64; 3]) -> f64 {
    0.212671 * p[0] + 0.715160 * p[1] + 0.072169 * p[2]
}

impl Add for Rgb {
    type Output = Rgb;
    fn add(self, o: Rgb) -> Rgb {
        Rgb::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl Sub for Rgb {
    type Output = Rgb;
    fn sub(self, o: Rgb) -> Rgb {
        Rgb::new(self.r - o.r, self.g - o.g, self.b - o.b)
    }
}

impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, o: Rgb) -> Rgb {
        Rgb::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    fn mul(self, k: f32) -> Rgb {
        Rgb::new(self.r * k, self.g * k, self.b * k)
    }
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    fn div(self, k: f32) -> Rgb {
        self * (1.0 / k)
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl MulAssign for Rgb {
    fn mul_assign(&mut self, o: Rgb) {
        *self = *self * o;
    }
}

impl MulAssign<f32> for Rgb {
    fn mul_assign(&mut self, k: f32) {
        *self = *self * k;
    }
}
