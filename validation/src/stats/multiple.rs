//! Many hypotheses at once: adjusted p-values.

/// Holm's step-down adjusted p-values (Holm 1979), in the order of the input.
///
/// With p₍₁₎ ≤ … ≤ p₍ₘ₎, p̃₍ᵢ₎ = max_{j≤i} min(1, (m−j+1) p₍ⱼ₎). Rejecting where p̃ ≤ α errs in at
/// least one true null with probability ≤ α, whatever the dependence. A NaN counts as 1.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let order = ascending(p);
    let m = p.len();
    let mut adjusted = vec![1.0; m];
    let mut floor: f64 = 0.0;
    for (rank, &i) in order.iter().enumerate() {
        floor = floor.max(((m - rank) as f64 * value(p[i])).min(1.0));
        adjusted[i] = floor;
    }
    adjusted
}

fn value(p: f64) -> f64 {
    if p.is_nan() { 1.0 } else { p }
}

fn ascending(p: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&i, &j| value(p[i]).total_cmp(&value(p[j])));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: &[f64], b: &[f64]) {
        assert_eq!(a.len(), b.len());
        for (x, y) in a.iter().zip(b) {
            assert!((x - y).abs() < 1e-12, "{a:?} against {b:?}");
        }
    }

    #[test]
    fn holm_steps_down_in_the_order_of_the_input() {
        // 4·0.005, 3·0.01, 2·0.03, then the running maximum holds the last one up.
        close(&holm(&[0.01, 0.04, 0.03, 0.005]), &[0.03, 0.06, 0.06, 0.02]);
    }

    #[test]
    fn holm_caps_at_one_and_takes_nan_as_one() {
        close(&holm(&[0.6, f64::NAN, 0.7]), &[1.0, 1.0, 1.0]);
        assert!(holm(&[]).is_empty());
    }

    /// The fifteen p-values of Benjamini & Hochberg (1995), section 3.2.
    const THROMBOLYSIS: [f64; 15] = [
        0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
        0.5719, 0.6528, 0.7590, 1.0000,
    ];

    #[test]
    fn holm_rejects_three_in_the_published_example() {
        assert_eq!(holm(&THROMBOLYSIS).iter().filter(|p| **p <= 0.05).count(), 3);
    }
}
