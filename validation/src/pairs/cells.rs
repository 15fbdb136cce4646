//! The tests on the image and on path lengths, with what an integrator has hardly seen as
//! uncertainty.

use std::collections::BTreeSet;

use pathspace_core::film::Families;
use serde::{Deserialize, Serialize};

use super::observe::{Method, PathClass, common_classes};
use super::tiles::firefly_light;
use crate::stats::{
    Claim, CompareConfig, Gates, Moments, Reason, Rule, StatsError, Verdict, Welch, decide, holm,
    welch_within,
};

/// Contributions that the other integrator's same techniques make in as many samples, of which none
/// at all can not be chance. A chain's samples are not independent and a lit pixel may hold several
/// contributions, so that this is far more than the 30 of p = e⁻³⁰.
pub(crate) const LOST: f64 = 200.0;
/// An emitter that an integrator saw in fewer effective contributions than this over all replicates
/// was hardly sampled.
const HARDLY: f64 = 100.0;
/// Share of the light of a class above which an emitter is no rare one to an integrator that
/// connects to it.
const COMMON: f64 = 0.01;
/// Channels nearer to the luminance than this, relative, are grey.
const GREY: f64 = 1e-5;

/// What of the light a cell looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Luminance.
    Luminance,
    /// Red.
    Red,
    /// Blue; green is nearly the luminance.
    Blue,
}

/// The test on one cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CellTest {
    /// Path length; `None` for the image.
    pub length: Option<u16>,
    /// What was looked at.
    pub channel: Channel,
    /// Welch's test, with the minimum detectable bias.
    pub test: Welch,
    /// p-value after Holm's adjustment over the cells.
    pub p: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
}

/// Sums over classes: the image, then every path length.
struct Sums {
    /// Cell by cell, of either integrator.
    columns: [Vec<Vec<f64>>; 2],
    /// Light of a cell that one of them hardly saw.
    unseen: Vec<f64>,
    /// Cells of which one of them lost all, though it can not be chance.
    lost: Vec<bool>,
}

/// Tests the image, then every path length, over `classes` of paths that both can make: their
/// luminance, and red and blue where there are colours.
///
/// Replicates of rare paths (caustics of a small lamp) over well-sampled ones look harmless as long
/// as none of the rare paths was found: the mean is too small, and so is its variance. Path classes
/// tell the two apart, and emitters within a class. A class that one side has undersampled adds its
/// light (that of the side that saw more) to the half-width u of the null hypothesis
/// |E Y_A − E Y_B| ≤ u: a difference that it could explain is none, and an agreement has to be as good in spite of it. So does the light of an emitter
/// that one side has hardly met in the class, and, where the tiles of a class show a heavy tail,
/// the light that came as fireflies.
pub(super) fn test_cells(
    a: &Method,
    b: &Method,
    classes: &BTreeSet<PathClass>,
    config: &CompareConfig,
) -> Result<Vec<CellTest>, StatsError> {
    let mut lengths: Vec<u16> = classes.iter().map(|c| c.length).collect();
    lengths.dedup();
    let mut cells: Vec<(Option<u16>, Channel)> = Vec::new();
    let mut claims = Vec::new();
    for channel in channels(a, b, classes) {
        let sums = sums(a, b, classes, &lengths, channel, &config.rule)?;
        cells.extend(
            std::iter::once(None).chain(lengths.iter().copied().map(Some)).map(|k| (k, channel)),
        );
        claims.extend(
            (0..=lengths.len()).map(|c| sums.claim(c, config)).collect::<Result<Vec<_>, _>>()?,
        );
    }
    // Cells without light are no hypotheses.
    let tested: Vec<usize> =
        (0..claims.len()).filter(|&c| claims[c].1.zero != (true, true)).collect();
    let p: Vec<f64> = tested.iter().map(|&c| claims[c].0.p).collect();
    for (&c, p) in tested.iter().zip(holm(&p)) {
        claims[c].1.p_adjusted = p;
    }
    Ok(cells
        .into_iter()
        .zip(claims)
        .map(|((length, channel), (test, claim))| {
            let (verdict, reason) = decide(&claim, &config.rule);
            CellTest { length, channel, test, p: claim.p_adjusted, verdict, reason }
        })
        .collect())
}

/// Luminance alone of grey scenes.
fn channels(a: &Method, b: &Method, classes: &BTreeSet<PathClass>) -> Vec<Channel> {
    let of = |method: &Method| {
        let met = method.replicates.iter().flat_map(|r| &r.classes);
        met.filter(|(class, _)| classes.contains(class))
            .any(|(_, c)| c.channels.iter().any(|v| (v - c.mean).abs() > GREY * c.mean.abs()))
    };
    // What has no channels shows a difference of all of them.
    let known = |method: &Method| {
        let mut met = method.replicates.iter().flat_map(|r| r.classes.values());
        met.all(|c| c.mean == 0.0 || c.channels != [0.0; 3])
    };
    if known(a) && known(b) && (of(a) || of(b)) {
        vec![Channel::Luminance, Channel::Red, Channel::Blue]
    } else {
        vec![Channel::Luminance]
    }
}

fn sums(
    a: &Method,
    b: &Method,
    classes: &BTreeSet<PathClass>,
    lengths: &[u16],
    channel: Channel,
    rule: &Rule,
) -> Result<Sums, StatsError> {
    let n = 1 + lengths.len();
    let empty = |method: &Method| vec![vec![0.0; method.replicates.len()]; n];
    let mut sums =
        Sums { columns: [empty(a), empty(b)], unseen: vec![0.0; n], lost: vec![false; n] };
    for class in classes {
        let cell = 1 + lengths.partition_point(|k| *k < class.length);
        let own = [column(a, class, channel), column(b, class, channel)];
        for (sums, column) in sums.columns.iter_mut().zip(&own) {
            for (r, y) in column.iter().enumerate() {
                sums[0][r] += y;
                sums[cell][r] += y;
            }
        }
        let means = [Moments::of(&own[0])?.mean.abs(), Moments::of(&own[1])?.mean.abs()];
        let seen = [seen(a, b, class, rule.n_eff_min)?, seen(b, a, class, rule.n_eff_min)?];
        let light = if seen.contains(&Seen::Hardly) {
            means[0].max(means[1])
        } else {
            let fireflies = firefly_light(&tiles(a, class))?.max(firefly_light(&tiles(b, class))?);
            fireflies + rare_emitters(a, b, class)?
        };
        sums.unseen[0] += light;
        sums.unseen[cell] += light;
        if seen.contains(&Seen::Lost) {
            sums.lost[0] = true;
            sums.lost[cell] = true;
        }
    }
    Ok(sums)
}

fn column(method: &Method, class: &PathClass, channel: Channel) -> Vec<f64> {
    match channel {
        Channel::Luminance => method.class_column(class),
        Channel::Red => method.channel_column(class, 0),
        Channel::Blue => method.channel_column(class, 2),
    }
}

impl Sums {
    fn claim(&self, cell: usize, config: &CompareConfig) -> Result<(Welch, Claim), StatsError> {
        let [x, y] = [&self.columns[0][cell], &self.columns[1][cell]];
        let (one, two) = (Moments::of(x)?, Moments::of(y)?);
        let scale = one.mean.abs().max(two.mean.abs());
        let test = welch_within(x, y, self.unseen[cell] + config.tolerance * scale)?;
        let mut zero = (is_zero(x), is_zero(y));
        let mut n_eff = implied(&one).min(implied(&two));
        if self.lost[cell] && zero.0 != zero.1 {
            // That nothing came is what the test is about.
            n_eff = implied(&one).max(implied(&two));
            zero = (false, false);
        }
        let gates = Gates { n_eff: Some(n_eff), khat: None };
        Ok((test, Claim { p_adjusted: 1.0, mdb: test.mdb, gates, zero }))
    }
}

/// Path classes that both can make and of which neither has fewer effective contributions to a
/// replicate than `rule` asks for.
///
/// # Errors
/// With fewer than two replicates of either, or means that are not finite.
pub fn well_sampled(
    a: &Method,
    b: &Method,
    rule: &Rule,
) -> Result<BTreeSet<PathClass>, StatsError> {
    let mut chosen = BTreeSet::new();
    for class in common_classes(a, b) {
        let seen = [seen(a, b, &class, rule.n_eff_min)?, seen(b, a, &class, rule.n_eff_min)?];
        if !seen.contains(&Seen::Hardly) {
            chosen.insert(class);
        }
    }
    Ok(chosen)
}

/// What an integrator has seen of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    /// Enough to know its mean.
    Well,
    /// Too little to say what is missing.
    Hardly,
    /// Nothing, where its own techniques make many contributions in the other integrator.
    Lost,
}

/// What an integrator has seen of a class, by the effective contributions to a replicate (`few` are
/// too few).
///
/// None at all is held against it, unless it can make the class only by hitting emitter or lens by
/// chance: with a connection it would have made some, and it does not where it has a mistake or a
/// limit.
fn seen(method: &Method, other: &Method, class: &PathClass, few: f64) -> Result<Seen, StatsError> {
    let m = Moments::of(&method.class_column(class))?;
    if m.mean == 0.0 {
        return Ok(if expected(method, other, class, None) >= LOST {
            Seen::Lost
        } else if connects(method, class) {
            Seen::Well
        } else {
            Seen::Hardly
        });
    }
    Ok(if effective(method, class, &m)? < few { Seen::Hardly } else { Seen::Well })
}

fn connects(method: &Method, class: &PathClass) -> bool {
    [Families::S1, Families::INNER, Families::T1]
        .iter()
        .any(|f| f.intersects(method.families) && f.intersects(class.families))
}

/// Contributions that an integrator should have made to a class, from one emitter or all: those
/// that the other one made by techniques that both use, for as many samples.
fn expected(method: &Method, other: &Method, class: &PathClass, emitter: Option<u16>) -> f64 {
    let (own, theirs) = (method.samples() as f64, other.samples() as f64);
    if theirs == 0.0 {
        return 0.0;
    }
    other.made(class, emitter, method.families.common(other.families)) as f64 * own / theirs
}

/// Light of a class from emitters that one side has hardly met: a small lamp beside a large one.
fn rare_emitters(a: &Method, b: &Method, class: &PathClass) -> Result<f64, StatsError> {
    let met = [a, b].into_iter().flat_map(|method| &method.replicates);
    let met = met.filter_map(|r| r.classes.get(class)).flat_map(|c| c.sources.keys().copied());
    let emitters: BTreeSet<u16> = met.collect();
    if emitters.len() < 2 {
        return Ok(0.0);
    }
    let mut light = Vec::new();
    for &emitter in &emitters {
        let one = Moments::of(&a.source_column(class, emitter))?;
        let two = Moments::of(&b.source_column(class, emitter))?;
        light.push((emitter, one, two, one.mean.abs().max(two.mean.abs())));
    }
    let all: f64 = light.iter().map(|l| l.3).sum();
    let mut rare = 0.0;
    for (emitter, one, two, own) in light {
        let hardly = |method: &Method, other: &Method, m: &Moments| {
            if m.mean != 0.0 {
                return implied(m) * (m.n as f64) < HARDLY;
            }
            let lost = expected(method, other, class, Some(emitter)) >= LOST;
            !(lost || connects(method, class) && own >= COMMON * all)
        };
        if hardly(a, b, &one) || hardly(b, a, &two) {
            rare += own;
        }
    }
    Ok(rare)
}

/// Ȳ²/s², an upper bound on the effective number of contributions to a replicate; infinite without
/// noise.
fn implied(m: &Moments) -> f64 {
    if m.mean == 0.0 { 0.0 } else { m.mean * m.mean / m.variance }
}

/// The same for a class, its variance from all of its tiles together: that of the mean itself would
/// favour replicates whose rare bright paths have not come yet, since their mean and its variance
/// are small together.
fn effective(method: &Method, class: &PathClass, m: &Moments) -> Result<f64, StatsError> {
    let rows = tiles(method, class);
    let count = rows.first().map_or(0, Vec::len);
    if count == 0 {
        return Ok(implied(m));
    }
    let mut variance = 0.0;
    for tile in 0..count {
        let column: Vec<f64> = rows.iter().map(|r| r[tile]).collect();
        variance += Moments::of(&column)?.variance;
    }
    Ok(m.mean * m.mean * (count * count) as f64 / variance)
}

/// Tiles of a class in every replicate.
fn tiles(method: &Method, class: &PathClass) -> Vec<Vec<f64>> {
    let found = method.replicates.iter().find_map(|r| r.classes.get(class));
    method.class_tiles(class, found.map_or(0, |c| c.tiles.len()))
}

fn is_zero(column: &[f64]) -> bool {
    column.iter().all(|v| *v == 0.0)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::observe::{ClassMean, Observation, Source};
    use super::*;

    const SMOOTH: PathClass = PathClass { length: 2, families: Families::S1 };
    const CAUSTIC: PathClass = PathClass { length: 2, families: Families::S0 };

    /// An method whose replicates hold the given luminance in each class.
    fn method(rows: &[(f64, f64)]) -> Method {
        let replicate = |(smooth, caustic): &(f64, f64)| {
            let class = |mean| ClassMean { mean, ..ClassMean::default() };
            let classes = [(SMOOTH, class(*smooth)), (CAUSTIC, class(*caustic))];
            Observation { classes: BTreeMap::from(classes), samples: 0 }
        };
        let mut method = Method::new("a".into(), Families::ALL);
        method.replicates = rows.iter().map(replicate).collect();
        method
    }

    fn test(a: &Method, b: &Method) -> Vec<CellTest> {
        let classes = BTreeSet::from([SMOOTH, CAUSTIC]);
        test_cells(a, b, &classes, &CompareConfig::default()).unwrap()
    }

    fn noise(r: usize) -> f64 {
        0.001 * ((r * 7 % 16) as f64 - 7.5)
    }

    #[test]
    fn a_caustic_that_was_never_found_is_no_difference() {
        let blind = method(&(0..16).map(|r| (1.0 + noise(r), 0.0)).collect::<Vec<_>>());
        let seeing = method(&(0..16).map(|r| (1.0 - noise(r), 0.2 + noise(r))).collect::<Vec<_>>());
        let cells = test(&blind, &seeing);
        assert_eq!(cells[0].verdict, Verdict::Inconclusive);
        // And it is not an agreement either: a fifth of the light is in doubt.
        assert!(cells[0].test.mdb > 0.15);
    }

    #[test]
    fn paths_that_a_connection_would_have_made_are_missed() {
        // The same numbers with the classes the other way round.
        let lame = method(&(0..16).map(|r| (0.0, 1.0 + noise(r))).collect::<Vec<_>>());
        let good = method(&(0..16).map(|r| (0.2 + noise(r), 1.0 - noise(r))).collect::<Vec<_>>());
        assert_eq!(test(&lame, &good)[0].verdict, Verdict::Differ);
    }

    #[test]
    fn what_is_well_sampled_differs_in_spite_of_a_rare_rest() {
        let rare = |r: usize| if r == 3 { 0.05 } else { 0.0 };
        let a = method(&(0..16).map(|r| (1.0 + noise(r), rare(r))).collect::<Vec<_>>());
        let b = method(&(0..16).map(|r| (1.1 - noise(r), 0.003)).collect::<Vec<_>>());
        assert!(test(&a, &b).iter().all(|c| c.verdict == Verdict::Differ));
    }

    #[test]
    fn equal_arms_agree() {
        let a = method(&(0..16).map(|r| (1.0 + noise(r), 0.2)).collect::<Vec<_>>());
        let b = method(&(0..16).map(|r| (1.0 - noise(r), 0.2)).collect::<Vec<_>>());
        let cells = test(&a, &b);
        assert_eq!(cells.len(), 2);
        assert!(cells.iter().all(|c| c.verdict == Verdict::Agree && c.test.mdb < 0.01));
    }

    /// Replicates of 1000 samples that hold light of emitters 0 and 1 by next-event estimation,
    /// each with so many contributions.
    fn two_lamps(rows: &[[f64; 2]], lit: [u64; 2]) -> Method {
        let replicate = |row: &[f64; 2]| {
            let source = |e: usize| {
                let lit = BTreeMap::from([(Families::S1, lit[e])]);
                (e as u16, Source { mean: row[e], lit })
            };
            let sources = BTreeMap::from([source(0), source(1)]);
            let class = ClassMean { mean: row[0] + row[1], sources, ..ClassMean::default() };
            Observation { classes: BTreeMap::from([(SMOOTH, class)]), samples: 1000 }
        };
        let mut method = Method::new("a".into(), Families::S1);
        method.replicates = rows.iter().map(replicate).collect();
        method
    }

    fn one_class(a: &Method, b: &Method) -> Vec<CellTest> {
        test_cells(a, b, &BTreeSet::from([SMOOTH]), &CompareConfig::default()).unwrap()
    }

    #[test]
    fn a_length_is_lost_where_the_same_technique_makes_it_in_the_other_integrator() {
        let good = |r: usize| [1.0 + noise(r), 0.0];
        let good = two_lamps(&(0..16).map(good).collect::<Vec<_>>(), [500, 0]);
        let dark = two_lamps(&[[0.0; 2]; 16], [0, 0]);
        assert!(one_class(&dark, &good).iter().all(|c| c.verdict == Verdict::Differ));
        // With ten contributions in all the replicates of the other nothing can be said.
        let mut rare = good.clone();
        rare.replicates.iter_mut().skip(10).for_each(|r| r.samples = 0);
        rare.replicates.iter_mut().for_each(|r| {
            r.classes.values_mut().for_each(|c| c.sources.clear());
        });
        assert!(one_class(&dark, &rare).iter().all(|c| c.verdict != Verdict::Differ));
    }

    #[test]
    fn a_small_lamp_that_was_hardly_met_beside_a_large_one_is_no_difference() {
        // Both see the large one; a has met the small one, a fiftieth of the light, in one
        // replicate of 16.
        let hit = |r: usize| if r == 3 { 0.02 } else { 0.0 };
        let a = two_lamps(&(0..16).map(|r| [1.0 + noise(r), hit(r)]).collect::<Vec<_>>(), [500, 0]);
        let b = two_lamps(&(0..16).map(|r| [1.0 - noise(r), 0.02]).collect::<Vec<_>>(), [500, 300]);
        assert!(one_class(&a, &b).iter().all(|c| c.verdict == Verdict::Agree));
        // One that it lost, though the same technique meets it often, is.
        let lost = two_lamps(&(0..16).map(|r| [1.0 + noise(r), 0.0]).collect::<Vec<_>>(), [500, 0]);
        assert!(one_class(&lost, &b).iter().all(|c| c.verdict == Verdict::Differ));
    }

    #[test]
    fn a_channel_of_little_luminance_differs_by_itself() {
        let coloured = |blue: f64| {
            let replicate = |r: usize| {
                let channels = [0.5 + noise(r), 1.0 - noise(r), blue + noise(r)];
                let mean = pathspace_core::color::luminance(&channels);
                let class = ClassMean { mean, channels, ..ClassMean::default() };
                Observation { classes: BTreeMap::from([(SMOOTH, class)]), samples: 0 }
            };
            let mut method = Method::new("a".into(), Families::ALL);
            method.replicates = (0..16).map(replicate).collect();
            method
        };
        let cells = one_class(&coloured(0.2), &coloured(0.23));
        let differ: Vec<Channel> =
            cells.iter().filter(|c| c.verdict == Verdict::Differ).map(|c| c.channel).collect();
        assert!(differ.contains(&Channel::Blue) && !differ.contains(&Channel::Red), "{cells:?}");
    }

    #[test]
    fn contributions_are_counted_by_the_noise_of_all_tiles() {
        // Two tiles whose noise cancels in the image: the image alone has none.
        let replicate = |r: usize| {
            let tiles = vec![1.0 + 100.0 * noise(r), 1.0 - 100.0 * noise(r)];
            let class = ClassMean { mean: 1.0, tiles, ..ClassMean::default() };
            Observation { classes: BTreeMap::from([(SMOOTH, class)]), samples: 0 }
        };
        let mut method = Method::new("a".into(), Families::S0);
        method.replicates = (0..16).map(replicate).collect();
        assert_eq!(seen(&method, &method, &SMOOTH, 10.0), Ok(Seen::Hardly));
    }
}
