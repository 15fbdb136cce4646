//! Small dense linear equations by elimination with pivots.

/// A square matrix, row by row.
#[derive(Clone, Debug)]
pub(super) struct Matrix {
    n: usize,
    entries: Vec<f64>,
}

impl Matrix {
    pub(super) fn zero(n: usize) -> Self {
        Matrix { n, entries: vec![0.0; n * n] }
    }

    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row * self.n + column] = value;
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.n..(row + 1) * self.n]
    }

    /// Brings the matrix to triangular form, and `right` with it; gives the determinant.
    fn eliminate(&mut self, right: &mut [f64]) -> f64 {
        let n = self.n;
        let mut determinant = 1.0;
        for k in 0..n {
            let pivot = (k..n)
                .max_by(|&i, &j| self.row(i)[k].abs().total_cmp(&self.row(j)[k].abs()))
                .unwrap_or(k);
            if pivot != k {
                for column in 0..n {
                    self.entries.swap(k * n + column, pivot * n + column);
                }
                right.swap(k, pivot);
                determinant = -determinant;
            }
            let p = self.row(k)[k];
            determinant *= p;
            if p == 0.0 {
                return 0.0;
            }
            for i in k + 1..n {
                let factor = self.row(i)[k] / p;
                if factor != 0.0 {
                    for column in k..n {
                        self.entries[i * n + column] -= factor * self.entries[k * n + column];
                    }
                    right[i] -= factor * right[k];
                }
            }
        }
        determinant
    }

    pub(super) fn determinant(mut self) -> f64 {
        let mut right = vec![0.0; self.n];
        self.eliminate(&mut right)
    }

    /// x with A x = `right`; `None` for a singular matrix.
    pub(super) fn solve(mut self, mut right: Vec<f64>) -> Option<Vec<f64>> {
        if self.eliminate(&mut right) == 0.0 {
            return None;
        }
        for i in (0..self.n).rev() {
            let known: f64 = (i + 1..self.n).map(|j| self.row(i)[j] * right[j]).sum();
            right[i] = (right[i] - known) / self.row(i)[i];
        }
        right.iter().all(|x| x.is_finite()).then_some(right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix() -> Matrix {
        let entries = vec![0.0, 2.0, 1.0, 1.0, -1.0, 3.0, 4.0, 0.5, -2.0];
        Matrix { n: 3, entries }
    }

    #[test]
    fn solutions_solve_the_equations() {
        let x = matrix().solve(vec![1.0, 2.0, 3.0]).unwrap();
        for (i, wanted) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            let left: f64 = matrix().row(i).iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((left - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn determinants_follow_the_rule_of_sarrus() {
        // 0·(2 − 1.5) − 2·(−2 − 12) + 1·(0.5 + 4)
        assert!((matrix().determinant() - 32.5).abs() < 1e-12);
    }

    #[test]
    fn singular_matrices_have_no_solution() {
        assert!(Matrix::zero(2).solve(vec![1.0, 0.0]).is_none());
    }
}
