//! Figures as people read them, on the terminal and on pages.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_keep_their_size() {
        assert_eq!(figure(0.0123), "0.012");
        assert_eq!(figure(1234.0), "1234");
        assert_eq!(figure(f64::INFINITY), "—");
        assert_eq!(percent(0.0312), "3.1 %");
        assert_eq!(p_value(2e-7), "2e-7");
    }
}
