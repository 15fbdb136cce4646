//! Points that fill the unit square evenly without a grid's alignment to edges.

/// Point k of the additive sequence of the plastic number φ (φ³ = φ + 1; Roberts 2018), moved by
/// `shift` on the torus: (s₁ + k/φ, s₂ + k/φ²) mod 1.
pub fn r2(k: u32, shift: [f64; 2]) -> [f64; 2] {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let k = f64::from(k);
    [(shift[0] + k / PLASTIC).fract(), (shift[1] + k / (PLASTIC * PLASTIC)).fract()]
}
