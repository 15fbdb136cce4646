//! `results.csv`: a line for each scene, integrator and budget.

use std::fmt::Write;

use crate::results::{BudgetKind, Results, SceneResults};
use crate::standing::{Standing, Standings};

const HEADING: &str = "scene,integrator,external,budget,unit,seconds,cpu_seconds,startup_seconds,spp,rays,replicates,\
mse,mse_low,mse_high,relmse,relmse_trimmed,flip,firefly_index,nonfinite,\
baseline,ratio,ratio_low,ratio_high,ratio_per_cpu_second,ratio_by_relmse,share_of_image,rests_on_rare_samples,machine_busy,\
verdict,detectable_bias";

/// The points of all curves as comma-separated values (RFC 4180). Numbers that are not finite are
/// empty fields.
pub fn csv(results: &Results) -> String {
    let mut text = format!("{HEADING}\n");
    for scene in &results.scenes {
        let standings = Standings::of(scene, results.machine.threads);
        for method in &scene.methods {
            for (n, p) in method.points.iter().enumerate() {
                let unit = match p.budget.kind {
                    BudgetKind::Seconds => "seconds",
                    BudgetKind::Spp => "spp",
                };
                let names = format!(
                    "{},{},{},{},{unit}",
                    quoted(&scene.name),
                    quoted(&method.integrator),
                    method.external,
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
                let _ = write!(text, ",{}", p.nonfinite);
                // Ratios and verdicts are those of the largest budget.
                let last = n + 1 == method.points.len();
                let row = standings.rows.iter().find(|r| last && r.integrator == method.integrator);
                beside_the_baseline(&mut text, scene, &standings, row);
                text.push('\n');
            }
        }
    }
    text
}

/// Columns on an integrator beside the baseline; empty where there is no row.
fn beside_the_baseline(
    text: &mut String,
    scene: &SceneResults,
    standings: &Standings,
    row: Option<&Standing>,
) {
    let Some(row) = row else {
        *text += ",,,,,,,,,,,";
        return;
    };
    *text += &format!(",{}", quoted(&standings.baseline));
    for v in [row.ratio, row.low, row.high, row.cpu_ratio, row.relative_ratio, row.seen] {
        text.push(',');
        if v.is_finite() {
            *text += &v.to_string();
        }
    }
    *text += &format!(",{},{}", row.heavy, row.busy);
    let (a, b) = (&row.integrator, &standings.baseline);
    let mut pairs = scene.pairs.iter().map(|p| &p.judgement);
    match pairs.find(|j| (&j.a == a && &j.b == b) || (&j.a == b && &j.b == a)) {
        Some(j) if j.mdb.is_finite() => *text += &format!(",{},{}", j.verdict, j.mdb),
        Some(j) => *text += &format!(",{},", j.verdict),
        None => *text += ",,",
    }
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
