//! The tests on the image and on path lengths, with what an arm has hardly seen as uncertainty.

use std::collections::BTreeSet;

use pathspace_core::film::Families;

use super::observe::{Arm, PathClass, common_classes};
use super::tiles::firefly_light;
use crate::stats::{
    Claim, CompareConfig, Gates, Moments, Reason, Rule, StatsError, Verdict, Welch, decide, holm,
    welch_within,
};

/// The test on one cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CellTest {
    /// Path length; `None` for the image.
    pub length: Option<u16>,
    /// Welch's test, with the minimum detectable bias.
    pub test: Welch,
    /// p-value after Holm's adjustment over the cells.
    pub p: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
}

/// Tests the image, then every path length, over `classes` of paths that both arms can make.
///
/// Replicates of rare paths (caustics of a small lamp) over well-sampled ones look harmless as long as none of the rare paths
/// was found: the mean is too small, and so is its variance. Path classes tell the two apart. A class that an arm has
/// undersampled adds its light (that of the arm that saw more) to the half-width u of the null hypothesis
/// |E Y_A − E Y_B| ≤ u: a difference that it could explain is none, and an agreement has to be as good in spite of it. Where the tiles of a class
/// show a heavy tail, the light that came as fireflies does the same.
pub(super) fn test_cells(
    a: &Arm,
    b: &Arm,
    classes: &BTreeSet<PathClass>,
    config: &CompareConfig,
) -> Result<Vec<CellTest>, StatsError> {
    let mut lengths: Vec<u16> = classes.iter().map(|c| c.length).collect();
    lengths.dedup();
    let n = 1 + lengths.len();
    let mut columns = [vec![Vec::new(); n], vec![Vec::new(); n]];
    let mut unseen = vec![0.0; n];
    for (sums, arm) in columns.iter_mut().zip([a, b]) {
        for column in sums.iter_mut() {
            column.resize(arm.replicates.len(), 0.0);
        }
    }
    for class in classes {
        let cell = 1 + lengths.partition_point(|k| *k < class.length);
        let own = [a.class_column(class), b.class_column(class)];
        for (sums, column) in columns.iter_mut().zip(&own) {
            for (r, y) in column.iter().enumerate() {
                sums[0][r] += y;
                sums[cell][r] += y;
            }
        }
        let [one, two] = [Moments::of(&own[0])?, Moments::of(&own[1])?];
        let few = config.rule.n_eff_min;
        if is_undersampled(a, class, &one, few) || is_undersampled(b, class, &two, few) {
            let light = one.mean.abs().max(two.mean.abs());
            unseen[0] += light;
            unseen[cell] += light;
        } else {
            let light = firefly_light(&tiles(a, class))?.max(firefly_light(&tiles(b, class))?);
            unseen[0] += light;
            unseen[cell] += light;
        }
    }
    let [x, y] = columns;
    let mut claims = Vec::new();
    for c in 0..n {
        let (one, two) = (Moments::of(&x[c])?, Moments::of(&y[c])?);
        let scale = one.mean.abs().max(two.mean.abs());
        let test = welch_within(&x[c], &y[c], unseen[c] + config.tolerance * scale)?;
        let zero = (is_zero(&x[c]), is_zero(&y[c]));
        let n_eff = Some(effective(&one).min(effective(&two)));
        claims.push((
            test,
            Claim { p_adjusted: 1.0, mdb: test.mdb, gates: Gates { n_eff, khat: None }, zero },
        ));
    }
    // Cells without light are no hypotheses.
    let tested: Vec<usize> = (0..n).filter(|&c| claims[c].1.zero != (true, true)).collect();
    let p: Vec<f64> = tested.iter().map(|&c| claims[c].0.p).collect();
    for (&c, p) in tested.iter().zip(holm(&p)) {
        claims[c].1.p_adjusted = p;
    }
    let lengths = std::iter::once(None).chain(lengths.into_iter().map(Some));
    Ok(lengths
        .zip(claims)
        .map(|(length, (test, claim))| {
            let (verdict, reason) = decide(&claim, &config.rule);
            CellTest { length, test, p: claim.p_adjusted, verdict, reason }
        })
        .collect())
}

/// Path classes that both arms can make and of which neither has fewer effective contributions to a replicate than `rule` asks for.
///
/// # Errors
/// With fewer than two replicates of an arm, or means that are not finite.
pub fn well_sampled(a: &Arm, b: &Arm, rule: &Rule) -> Result<BTreeSet<PathClass>, StatsError> {
    let mut classes = common_classes(a, b);
    for class in classes.clone() {
        for arm in [a, b] {
            let moments = Moments::of(&arm.class_column(&class))?;
            if is_undersampled(arm, &class, &moments, rule.n_eff_min) {
                classes.remove(&class);
            }
        }
    }
    Ok(classes)
}

/// True where the replicates of an arm say little about a class: fewer effective contributions than `few`.
///
/// None at all is held against the arm, unless it can make the class only by hitting emitter or lens by chance: with a
/// connection it would have made some, and it does not where it has a mistake or a limit.
fn is_undersampled(arm: &Arm, class: &PathClass, m: &Moments, few: f64) -> bool {
    let connects = [Families::S1, Families::INNER, Families::T1]
        .iter()
        .any(|f| f.intersects(arm.families) && f.intersects(class.families));
    effective(m) < few && (m.mean != 0.0 || !connects)
}

/// Ȳ²/s², an upper bound on the effective number of contributions to a replicate; infinite without noise.
fn effective(m: &Moments) -> f64 {
    if m.mean == 0.0 { 0.0 } else { m.mean * m.mean / m.variance }
}

/// Tiles of a class in every replicate.
fn tiles(arm: &Arm, class: &PathClass) -> Vec<Vec<f64>> {
    let found = arm.replicates.iter().find_map(|r| r.classes.get(class));
    arm.class_tiles(class, found.map_or(0, |c| c.tiles.len()))
}

fn is_zero(column: &[f64]) -> bool {
    column.iter().all(|v| *v == 0.0)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::observe::{ClassMean, Observation};
    use super::*;

    const SMOOTH: PathClass = PathClass { length: 2, families: Families::S1 };
    const CAUSTIC: PathClass = PathClass { length: 2, families: Families::S0 };

    /// An arm whose replicates hold the given luminance in each class.
    fn arm(rows: &[(f64, f64)]) -> Arm {
        let replicate = |(smooth, caustic): &(f64, f64)| {
            let class = |mean| ClassMean { mean, tiles: Vec::new() };
            let classes = [(SMOOTH, class(*smooth)), (CAUSTIC, class(*caustic))];
            Observation { classes: BTreeMap::from(classes) }
        };
        let mut arm = Arm::new("a".into(), Families::ALL);
        arm.replicates = rows.iter().map(replicate).collect();
        arm
    }

    fn test(a: &Arm, b: &Arm) -> Vec<CellTest> {
        let classes = BTreeSet::from([SMOOTH, CAUSTIC]);
        test_cells(a, b, &classes, &CompareConfig::default()).unwrap()
    }

    fn noise(r: usize) -> f64 {
        0.001 * ((r * 7 % 16) as f64 - 7.5)
    }

    #[test]
    fn a_caustic_that_was_never_found_is_no_difference() {
        let blind = arm(&(0..16).map(|r| (1.0 + noise(r), 0.0)).collect::<Vec<_>>());
        let seeing = arm(&(0..16).map(|r| (1.0 - noise(r), 0.2 + noise(r))).collect::<Vec<_>>());
        let cells = test(&blind, &seeing);
        assert_eq!(cells[0].verdict, Verdict::Inconclusive);
        // And it is not an agreement either: a fifth of the light is in doubt.
        assert!(cells[0].test.mdb > 0.15);
    }

    #[test]
    fn paths_that_a_connection_would_have_made_are_missed() {
        // The same numbers with the classes the other way round.
        let lame = arm(&(0..16).map(|r| (0.0, 1.0 + noise(r))).collect::<Vec<_>>());
        let good = arm(&(0..16).map(|r| (0.2 + noise(r), 1.0 - noise(r))).collect::<Vec<_>>());
        assert_eq!(test(&lame, &good)[0].verdict, Verdict::Differ);
    }

    #[test]
    fn what_is_well_sampled_differs_in_spite_of_a_rare_rest() {
        let rare = |r: usize| if r == 3 { 0.05 } else { 0.0 };
        let a = arm(&(0..16).map(|r| (1.0 + noise(r), rare(r))).collect::<Vec<_>>());
        let b = arm(&(0..16).map(|r| (1.1 - noise(r), 0.003)).collect::<Vec<_>>());
        assert!(test(&a, &b).iter().all(|c| c.verdict == Verdict::Differ));
    }

    #[test]
    fn equal_arms_agree() {
        let a = arm(&(0..16).map(|r| (1.0 + noise(r), 0.2)).collect::<Vec<_>>());
        let b = arm(&(0..16).map(|r| (1.0 - noise(r), 0.2)).collect::<Vec<_>>());
        let cells = test(&a, &b);
        assert_eq!(cells.len(), 2);
        assert!(cells.iter().all(|c| c.verdict == Verdict::Agree && c.test.mdb < 0.01));
    }
}
