//! Figures as people read them, on the terminal and on pages.

use crate::stats::Verdict;

/// A percentage with about two digits.
pub fn percent(share: f64) -> String {
    match 100.0 * share {
        p if !p.is_finite() => "—".into(),
        p if p >= 9.95 => format!("{p:.0} %"),
        p if p >= 0.095 => format!("{p:.1} %"),
        0.0 => "0 %".into(),
        p => format!("{p:.2} %"),
    }
}

/// A p-value.
pub fn p_value(p: f64) -> String {
    if p >= 0.001 { format!("{p:.3}") } else { format!("{p:.0e}") }
}

/// A figure with three digits.
pub fn figure(v: f64) -> String {
    match v.abs() {
        _ if !v.is_finite() => "—".into(),
        0.0 => "0".into(),
        a if (0.01..10.0).contains(&a) => format!("{v:.3}"),
        a if (10.0..100.0).contains(&a) => format!("{v:.1}"),
        a if (100.0..1e6).contains(&a) => format!("{v:.0}"),
        _ => format!("{v:.2e}"),
    }
}

/// A ratio or an error with two significant digits, three from 100 on.
pub fn ratio(v: f64) -> String {
    if !v.is_finite() {
        return "—".into();
    }
    let size = v.abs();
    // Rounded first: 99.6 has three digits as it is shown.
    let decade = if size > 0.0 { (size * 1.005).log10().floor() as i32 } else { 0 };
    match decade {
        6.. => format!("{v:.1e}"),
        2.. => {
            let step = 10.0_f64.powi(decade - 2);
            format!("{:.0}", (v / step).round() * step)
        }
        -4.. => format!("{v:.*}", usize::try_from(1 - decade).unwrap_or(0)),
        _ => format!("{v:.1e}"),
    }
}

/// Share of an image: a percentage with one decimal, `100 %` where nothing is missing that would
/// show.
pub fn share(share: f64) -> String {
    match 100.0 * share {
        p if !p.is_finite() => "—".into(),
        p if p >= 99.95 => "100 %".into(),
        p => format!("{p:.1} %"),
    }
}

/// A verdict as people read it, the same everywhere.
pub fn verdict_words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree => "no difference found",
        Verdict::Differ => "differs",
        Verdict::Inconclusive => "needs more samples",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_have_two_or_three_digits() {
        for (v, text) in [
            (3.789, "3.8"),
            (109.4, "109"),
            (12345.0, "12300"),
            (99.7, "100"),
            (12.3, "12"),
            (9.97, "10"),
            (0.347, "0.35"),
            (0.0721, "0.072"),
            (0.6, "0.60"),
            (1.0, "1.0"),
            (0.0, "0.0"),
            (5.4e-7, "5.4e-7"),
            (f64::NAN, "—"),
        ] {
            assert_eq!(ratio(v), text, "{v}");
        }
        assert_eq!((share(0.905), share(0.9996)), ("90.5 %".into(), "100 %".into()));
    }

    #[test]
    fn figures_keep_their_size() {
        assert_eq!(figure(0.0123), "0.012");
        assert_eq!(figure(1234.0), "1234");
        assert_eq!(figure(f64::INFINITY), "—");
        assert_eq!(percent(0.0312), "3.1 %");
        assert_eq!(p_value(2e-7), "2e-7");
    }
}
