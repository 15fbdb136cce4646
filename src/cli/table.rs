//! Tables of text with aligned columns.

use std::io::{self, Write};

pub(super) use pathspace_validation::page::{figure, p_value, percent};

/// Rows of cells; the first column is flush left, the others flush right but for those asked to be
/// left.
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
}
