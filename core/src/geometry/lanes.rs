//! Eight lanes of f32 for boxes, of f64 for triangles: the few operations the kernels need, on
//! AVX-512, AVX2 or arrays.
//!
//! All implementations perform the same IEEE 754 operation in each lane, rounding included, and
//! treat NaN as the x86 instructions do: `max` and `min` return their second argument if either is
//! NaN, comparisons with NaN are false.

/// Eight lanes of f32.
///
/// The methods are `inline(always)` so that they take on the target features of the function they
/// end up in.
pub(super) trait Lanes: Copy {
    /// Eight lanes of f64.
    type Double: Doubles;

    fn splat(x: f32) -> Self;
    fn load(x: &[f32; 8]) -> Self;
    fn store(self) -> [f32; 8];
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    /// `self > b ? self : b`
    fn max(self, b: Self) -> Self;
    /// `self < b ? self : b`
    fn min(self, b: Self) -> Self;
    /// Bit i set where `self ≤ b` in lane i.
    fn le(self, b: Self) -> u32;
    /// Bit i set where lane i of `ids` is `id`.
    fn same(ids: &[u32; 8], id: u32) -> u32;
    /// Hint that the 256 bytes from `p` on will be read.
    fn prefetch(p: *const u8);
}

/// Eight lanes of f64.
pub(super) trait Doubles: Copy {
    fn splat(x: f64) -> Self;
    /// Exact.
    fn widen(x: &[f32; 8]) -> Self;
    fn store(self) -> [f64; 8];
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    /// `self > b ? self : b`
    fn max(self, b: Self) -> Self;
    /// `self < b ? self : b`
    fn min(self, b: Self) -> Self;
    /// Bit i set where `self ≤ b` in lane i.
    fn le(self, b: Self) -> u32;
}

/// Lanes as an array, for any target.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Portable<T>([T; 8]);

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

/// Bit i set where `$f` holds in lane i.
macro_rules! bits {
    (|$a:ident, $b:ident| $f:expr; $x:expr, $y:expr) => {{
        let (x, y) = ($x, $y);
        let mut bits = 0;
        let mut i = 0;
        while i < 8 {
            let ($a, $b) = (x[i], y[i]);
            bits |= u32::from($f) << i;
            i += 1;
        }
        bits
    }};
}

/// The operations that f32 and f64 have in common.
macro_rules! portable {
    ($t:ty) => {
        #[inline(always)]
        fn splat(x: $t) -> Self {
            Portable([x; 8])
        }
        #[inline(always)]
        fn store(self) -> [$t; 8] {
            self.0
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
        fn max(self, b: Self) -> Self {
            Portable(lanes!(|a, b| if a > b { a } else { b }; self.0, b.0))
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            Portable(lanes!(|a, b| if a < b { a } else { b }; self.0, b.0))
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            bits!(|a, b| a <= b; self.0, b.0)
        }
    };
}

impl Lanes for Portable<f32> {
    type Double = Portable<f64>;

    portable!(f32);

    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Portable(*x)
    }
    #[inline(always)]
    fn same(ids: &[u32; 8], id: u32) -> u32 {
        bits!(|a, b| a == b; ids, [id; 8])
    }
    #[inline(always)]
    fn prefetch(_p: *const u8) {}
}

impl Doubles for Portable<f64> {
    portable!(f64);

    #[inline(always)]
    fn widen(x: &[f32; 8]) -> Self {
        Portable(lanes!(|a, _b| f64::from(a); x, x))
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a + b; self.0, b.0))
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Portable(lanes!(|a, b| a / b; self.0, b.0))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx::{Avx, Pair, Whole};

#[cfg(target_arch = "x86_64")]
mod avx {
    use std::arch::x86_64::*;
    use std::marker::PhantomData;

    use super::{Doubles, Lanes};

    /// Lanes in one AVX register, with `D` for f64. To be used only inside functions compiled for
    /// AVX2 that run on a processor known to have it; the `SAFETY` of every intrinsic below rests
    /// on that.
    #[derive(Clone, Copy)]
    pub struct Avx<D>(__m256, PhantomData<D>);

    impl<D> Avx<D> {
        #[inline(always)]
        fn of(x: __m256) -> Self {
            Avx(x, PhantomData)
        }
    }

    impl<D: Doubles> Lanes for Avx<D> {
        type Double = D;

        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Self::of(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(x: &[f32; 8]) -> Self {
            // SAFETY: AVX2 is present, and the reference covers the 32 bytes read.
            Self::of(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: AVX2 is present, and `out` has the 32 bytes written.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Self::of(unsafe { _mm256_sub_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Self::of(unsafe { _mm256_mul_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Self::of(unsafe { _mm256_max_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            Self::of(unsafe { _mm256_min_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            // SAFETY: AVX2 is present, see the type.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)) as u32 }
        }
        #[inline(always)]
        fn same(ids: &[u32; 8], id: u32) -> u32 {
            // SAFETY: AVX2 is present, and the reference covers the 32 bytes read.
            unsafe {
                let ids = _mm256_loadu_si256(ids.as_ptr().cast());
                let same = _mm256_cmpeq_epi32(ids, _mm256_set1_epi32(id as i32));
                _mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32
            }
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

    /// Lanes of f64 in two AVX registers; for AVX2 as [`Avx`] is.
    #[derive(Clone, Copy)]
    pub struct Pair(__m256d, __m256d);

    impl Doubles for Pair {
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: AVX2 is present, see the type.
            let x = unsafe { _mm256_set1_pd(x) };
            Pair(x, x)
        }
        #[inline(always)]
        fn widen(x: &[f32; 8]) -> Self {
            let p = x.as_ptr();
            // SAFETY: AVX2 is present, and the reference covers the 32 bytes read.
            unsafe {
                Pair(_mm256_cvtps_pd(_mm_loadu_ps(p)), _mm256_cvtps_pd(_mm_loadu_ps(p.add(4))))
            }
        }
        #[inline(always)]
        fn store(self) -> [f64; 8] {
            let mut out = [0.0; 8];
            let p: *mut f64 = out.as_mut_ptr();
            // SAFETY: AVX2 is present, and `out` has the 64 bytes written.
            unsafe {
                _mm256_storeu_pd(p, self.0);
                _mm256_storeu_pd(p.add(4), self.1);
            }
            out
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_add_pd(self.0, b.0), _mm256_add_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_sub_pd(self.0, b.0), _mm256_sub_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_mul_pd(self.0, b.0), _mm256_mul_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_div_pd(self.0, b.0), _mm256_div_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_max_pd(self.0, b.0), _mm256_max_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            // SAFETY: AVX2 is present, see the type.
            unsafe { Pair(_mm256_min_pd(self.0, b.0), _mm256_min_pd(self.1, b.1)) }
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            // SAFETY: AVX2 is present, see the type.
            unsafe {
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, b.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.1, b.1));
                (low | high << 4) as u32
            }
        }
    }

    /// Lanes of f64 in one AVX-512 register. To be used only inside functions compiled for AVX-512F
    /// that run on a processor known to have it.
    #[derive(Clone, Copy)]
    pub struct Whole(__m512d);

    impl Doubles for Whole {
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_set1_pd(x) })
        }
        #[inline(always)]
        fn widen(x: &[f32; 8]) -> Self {
            // SAFETY: AVX-512F is present, and the reference covers the 32 bytes read.
            Whole(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(x.as_ptr())) })
        }
        #[inline(always)]
        fn store(self) -> [f64; 8] {
            let mut out = [0.0; 8];
            // SAFETY: AVX-512F is present, and `out` has the 64 bytes written.
            unsafe { _mm512_storeu_pd(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_add_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_sub_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_mul_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_div_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_max_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            // SAFETY: AVX-512F is present, see the type.
            Whole(unsafe { _mm512_min_pd(self.0, b.0) })
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            // SAFETY: AVX-512F is present, see the type.
            u32::from(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, b.0) })
        }
    }
}
