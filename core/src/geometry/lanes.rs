//! Eight lanes of f32: the few operations the kernels need, on AVX2 or on arrays.
//!
//! Both implementations perform the same IEEE 754 operation in each lane, rounding included, and
//! treat NaN as the x86 instructions do: `max` and `min` return their second argument if either is
//! NaN, comparisons with NaN are false.

/// Eight lanes.
///
/// The methods are `inline(always)` so that they take on the target features of the function they
/// end up in.
pub(super) trait Lanes: Copy {
    /// All-ones or all-zeros lanes.
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    fn load(x: &[f32; 8]) -> Self;
    fn store(self) -> [f32; 8];
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    fn abs(self) -> Self;
    /// `self > b ? self : b`
    fn max(self, b: Self) -> Self;
    /// `self < b ? self : b`
    fn min(self, b: Self) -> Self;
    fn le(self, b: Self) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `a` but for the lanes where `ids` holds `id`.
    fn without(a: Self::Mask, ids: &[u32; 8], id: u32) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Bit i set where lane i is.
    fn bits(m: Self::Mask) -> u32;
    /// Hint that the 256 bytes from `p` on will be read.
    fn prefetch(p: *const u8);
}

/// Lanes as an array, for any target.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Portable([f32; 8]);

/// Array of `$f` over the lanes; a loop that the compiler unrolls and vectorises.
macro_rules! lanes {
    (|$a:ident, $b:ident| $f:expr; $x:expr, $y:expr) => {{
        let (x, y) = ($x, $y);
        let mut out = [Default::default(); 8];
        let mut i = 0;
        while i < 8 {
            let ($a, $b) = (x[i], y[i]);
            out[i] = $f;
            i += 1;
        }
        out
    }};
}

impl Lanes for Portable {
    type Mask = [u32; 8];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; 8])
    }
    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Portable(*x)
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a + b; self.0, b.0))
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a - b; self.0, b.0))
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a * b; self.0, b.0))
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a / b; self.0, b.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Portable(lanes!(|a, _b| f32::abs(a); self.0, self.0))
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Portable(lanes!(|a, b| if a > b { a } else { b }; self.0, b.0))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Portable(lanes!(|a, b| if a < b { a } else { b }; self.0, b.0))
    }
    #[inline(always)]
    fn le(self, b: Self) -> [u32; 8] {
        lanes!(|a, b| if a <= b { u32::MAX } else { 0 }; self.0, b.0)
    }
    #[inline(always)]
    fn and(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes!(|a, b| a & b; a, b)
    }
    #[inline(always)]
    fn without(a: [u32; 8], ids: &[u32; 8], id: u32) -> [u32; 8] {
        lanes!(|a, b| if b == id { 0 } else { a }; a, ids)
    }
    #[inline(always)]
    fn or(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes!(|a, b| a | b; a, b)
    }
    #[inline(always)]
    fn bits(m: [u32; 8]) -> u32 {
        let mut bits = 0;
        let mut i = 0;
        while i < 8 {
            bits |= m[i] & 1 << i;
            i += 1;
        }
        bits
    }
    #[inline(always)]
    fn prefetch(_p: *const u8) {}
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::Lanes;

    /// Lanes in one AVX register. To be used only inside functions compiled for AVX2 that run on a
    /// processor known to have it; the `SAFETY` of every intrinsic below rests on that.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256);

    impl Lanes for Avx2 {
        type Mask = __m256;

        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(x: &[f32; 8]) -> Self {
            // SAFETY: AVX2 is present, and the reference covers the 32 bytes read.
            Avx2(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: AVX2 is present, and `out` has the 32 bytes written.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_add_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_sub_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_mul_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_div_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_max_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Avx2(unsafe { _mm256_min_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn le(self, b: Self) -> __m256 {
            // SAFETY: AVX2 is present, see the type.
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0) }
        }
        #[inline(always)]
        fn and(a: __m256, b: __m256) -> __m256 {
            // SAFETY: AVX2 is present, see the type.
            unsafe { _mm256_and_ps(a, b) }
        }
        #[inline(always)]
        fn without(a: __m256, ids: &[u32; 8], id: u32) -> __m256 {
            // SAFETY: AVX2 is present, and the reference covers the 32 bytes read.
            unsafe {
                let ids = _mm256_loadu_si256(ids.as_ptr().cast());
                let same = _mm256_cmpeq_epi32(ids, _mm256_set1_epi32(id as i32));
                _mm256_andnot_ps(_mm256_castsi256_ps(same), a)
            }
        }
        #[inline(always)]
        fn or(a: __m256, b: __m256) -> __m256 {
            // SAFETY: AVX2 is present, see the type.
            unsafe { _mm256_or_ps(a, b) }
        }
        #[inline(always)]
        fn bits(m: __m256) -> u32 {
            // SAFETY: AVX2 is present, see the type.
            unsafe { _mm256_movemask_ps(m) as u32 }
        }
        #[inline(always)]
        fn prefetch(p: *const u8) {
            let p = p.cast::<i8>();
            for line in 0..4 {
                // SAFETY: a prefetch never faults, whatever the address; SSE is part of x86-64.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(p.wrapping_add(64 * line)) };
            }
        }
    }
}
