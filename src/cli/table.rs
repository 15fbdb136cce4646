//! Tables of text with aligned columns.

use std::io::{self, Write};

/// Rows of cells; the first column is flush left, the others flush right but for those asked to be left.
pub(super) struct Table {
    rows: Vec<Vec<String>>,
    left: &'static [usize],
}

impl Table {
    /// A table with a heading.
    pub(super) fn new(heading: &[&str], left: &'static [usize]) -> Self {
        Table { rows: vec![heading.iter().map(|s| (*s).to_owned()).collect()], left }
    }

    /// Adds a row.
    pub(super) fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// Writes it, each line after `indent`.
    pub(super) fn write(&self, indent: &str, out: &mut dyn Write) -> io::Result<()> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width: Vec<usize> = (0..columns)
            .map(|c| self.rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max())
            .map(Option::unwrap_or_default)
            .collect();
        for row in &self.rows {
            let mut line = indent.to_owned();
            for (c, cell) in row.iter().enumerate() {
                let pad = " ".repeat(width[c] - cell.chars().count());
                let gap = if c == 0 { "" } else { "  " };
                if self.left.contains(&c) {
                    line += &format!("{gap}{cell}{pad}");
                } else {
                    line += &format!("{gap}{pad}{cell}");
                }
            }
            writeln!(out, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// A percentage with about two digits.
pub(super) fn percent(share: f64) -> String {
    match 100.0 * share {
        p if !p.is_finite() => "—".into(),
        p if p >= 9.95 => format!("{p:.0} %"),
        p if p >= 0.095 => format!("{p:.1} %"),
        0.0 => "0 %".into(),
        p => format!("{p:.2} %"),
    }
}

/// A p-value.
pub(super) fn p_value(p: f64) -> String {
    if p >= 0.001 { format!("{p:.3}") } else { format!("{p:.0e}") }
}

/// A figure with three digits.
pub(super) fn figure(v: f64) -> String {
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
    fn columns_are_aligned() {
        let mut table = Table::new(&["name", "n"], &[0]);
        table.row(vec!["a".into(), "100".into()]);
        let mut out = Vec::new();
        table.write("  ", &mut out).unwrap();
        assert_eq!(String::from_utf8(out).unwrap(), "  name    n\n  a     100\n");
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
