//! What a comparison says first: are they right, which is best, and where to look on.

use std::io::{self, Write};

use pathspace_benches::results::{BudgetKind, Results, SceneResults};
use pathspace_benches::standing::{Standing, Standings};
use pathspace_validation::page::{percent, ratio, share};

use super::super::table::Table;

/// What is said of paths that light tracing can not make.
const SPECULAR_AT_SENSOR: &str = "paths whose vertex at the sensor is specular";

/// The first screen of every scene.
pub(in super::super) fn tell(results: &Results, out: &mut dyn Write) -> io::Result<()> {
    for (n, scene) in results.scenes.iter().enumerate() {
        if n > 0 {
            writeln!(out)?;
        }
        tell_scene(results, scene, out)?;
    }
    Ok(())
}

fn tell_scene(results: &Results, scene: &SceneResults, out: &mut dyn Write) -> io::Result<()> {
    let threads = results.machine.threads;
    let standings = Standings::of(scene, threads);
    writeln!(out, "{}", heading(scene, threads))?;
    if !results.complete {
        writeln!(out, "Interrupted: what follows is from the renders that were finished.")?;
    }
    writeln!(out, "\nARE THEY RIGHT?  {}", standings.right)?;
    writeln!(out, "WHICH IS BEST?   {}\n", standings.best)?;
    table(scene, &standings, out)
}

/// `cornell-caustic 128×128 · 8 integrators × 16 renders · 0.3 s each · 2 threads`
fn heading(scene: &SceneResults, threads: usize) -> String {
    let plural = |n: usize| if n == 1 { "" } else { "s" };
    let points = scene.methods.iter().filter_map(|a| a.points.last());
    let renders = points.map(|p| p.replicates).min().unwrap_or(0);
    let budget = scene.methods.iter().find_map(|a| a.points.last()).map_or(String::new(), |p| {
        match p.budget.kind {
            BudgetKind::Seconds => format!(" · {} s each", ratio(p.budget.value)),
            BudgetKind::Spp => format!(" · {} samples per pixel each", p.budget.value),
        }
    });
    let n = scene.methods.len();
    format!(
        "{} {}×{} · {n} integrator{} × {renders} renders{budget} · {threads} thread{}",
        scene.name,
        scene.width,
        scene.height,
        plural(n),
        plural(threads)
    )
}

fn table(scene: &SceneResults, standings: &Standings, out: &mut dyn Write) -> io::Result<()> {
    let partial = standings.any_partial();
    let busy = standings.rows.iter().any(|r| r.busy);
    let against = scene.reference.is_some();
    let over = format!("× {}", standings.baseline);
    let mut heading = vec!["", &over, "[95 %]", "relMSE"];
    if partial {
        heading.push("image");
    }
    let mut table = Table::new(&heading, &[0, 1, 2]);
    for row in &standings.rows {
        let mut cells = vec![
            format!("{}{}", row.integrator, if row.whole { "" } else { "*" }),
            value(row),
            interval(row),
            ratio(row.relmse),
        ];
        if partial {
            cells.push(share(row.seen));
        }
        table.row(cells);
    }
    table.write("  ", out)?;
    if partial {
        writeln!(out, "  * {}: ratio on the light that both make", blindness(scene))?;
    }
    writeln!(out, "  × {}: efficiency 1/(MSE·s), higher is better", standings.baseline)?;
    if busy {
        let used = standings
            .busy
            .map_or(String::new(), |u| format!(" ({} of their time used)", percent(u)));
        writeln!(
            out,
            "  ! the processors were shared with other work{used}:
    \
             repeat it on a quiet machine, or compare by processor time, with --verbose"
        )?;
    }
    if against {
        writeln!(out, "  errors are measured against a reference")?;
    }
    Ok(())
}

/// What those who do not make the whole image can not make.
fn blindness(scene: &SceneResults) -> &'static str {
    let mut unseen = scene.pairs.iter().flat_map(|p| &p.judgement.unseen).peekable();
    let mirrors = unseen.peek().is_some() && unseen.all(|u| u.reason == SPECULAR_AT_SENSOR);
    if mirrors { "cannot see glass or mirrors directly" } else { "cannot make the whole image" }
}

/// The ratio, with a mark where the machine was busy.
fn value(row: &Standing) -> String {
    if row.is_baseline {
        return "1".into();
    }
    let text = ratio(row.ratio);
    if row.busy { format!("{text}!") } else { text }
}

fn interval(row: &Standing) -> String {
    if row.is_baseline {
        "baseline".into()
    } else if row.low.is_finite() && row.high.is_finite() {
        format!("[{}, {}]", ratio(row.low), ratio(row.high))
    } else {
        String::new()
    }
}
