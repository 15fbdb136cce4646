//! `results.csv`: a line for each scene, integrator and budget.

use std::fmt::Write;

use crate::results::{BudgetKind, Results};

const HEADING: &str = "scene,integrator,external,budget,unit,seconds,cpu_seconds,startup_seconds,spp,rays,replicates,\
mse,mse_low,mse_high,relmse,relmse_trimmed,flip,firefly_index,nonfinite";

/// The points of all curves as comma-separated values (RFC 4180). Numbers that are not finite are empty fields.
pub fn csv(results: &Results) -> String {
    let mut text = format!("{HEADING}\n");
    for scene in &results.scenes {
        for arm in &scene.arms {
            for p in &arm.points {
                let unit = match p.budget.kind {
                    BudgetKind::Seconds => "seconds",
                    BudgetKind::Spp => "spp",
                };
                let names = format!(
                    "{},{},{},{},{unit}",
                    quoted(&scene.name),
                    quoted(&arm.integrator),
                    arm.external,
                    p.budget.value
                );
                text += &names;
                let numbers = [p.seconds, p.cpu_seconds, p.startup_seconds, p.spp, p.rays];
                let errors = [p.mse.value, p.mse.low, p.mse.high, p.relmse, p.relmse_trimmed];
                let rest = [p.flip.unwrap_or(f64::NAN), p.firefly_index];
                let count = p.replicates as f64;
                for v in numbers.iter().chain(&[count]).chain(&errors).chain(&rest) {
                    text.push(',');
                    if v.is_finite() {
                        // Writing to a string does not fail.
                        let _ = write!(text, "{v}");
                    }
                }
                let _ = writeln!(text, ",{}", p.nonfinite);
            }
        }
    }
    text
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_specs_are_quoted() {
        assert_eq!(quoted("bdpt:s=1,t=2"), "\"bdpt:s=1,t=2\"");
        assert_eq!(quoted("pt"), "pt");
        assert_eq!(quoted("a\"b"), "\"a\"\"b\"");
    }
}
