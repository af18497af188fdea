//! Times of several things that take turns.

use std::time::Instant;

use rayon::ThreadPool;

use crate::document::Document;

/// Rounds of what is quick and of what takes seconds, and how many more are tried while memory is disturbed.
pub(crate) const ROUNDS: usize = 15;
pub(crate) const FEW_ROUNDS: usize = 3;
const PATIENCE: usize = 8;
/// Difference of the floor from its median, as a share of it, above which a round is disturbed.
const DISTURBED: f64 = 0.15;

/// Something that can be done, and says how many seconds that took.
pub(crate) struct Contestant<'a> {
    name: String,
    run: Box<dyn FnMut() -> f64 + 'a>,
}

impl<'a> Contestant<'a> {
    pub(crate) fn new(name: impl Into<String>, run: impl FnMut() -> f64 + 'a) -> Self {
        Self { name: name.into(), run: Box::new(run) }
    }

    /// One on one thread that is done so many times in a row, of which the mean counts.
    pub(crate) fn repeated(name: impl Into<String>, times: usize, mut work: impl FnMut() + 'a) -> Self {
        Self::new(name, move || seconds_of(times, &mut work))
    }

    /// One in a pool of one thread that is done once, and then so many times in a row: caches that others have filled are
    /// its own again, as they are in the middle of work. The thread itself reads the clock, which of others lags behind.
    pub(crate) fn going_on(
        name: impl Into<String>,
        pool: &'a ThreadPool,
        times: usize,
        mut work: impl FnMut() + Send + 'a,
    ) -> Self {
        let mut work = move || {
            work();
            seconds_of(times, &mut work)
        };
        Self::new(name, move || pool.install(&mut work))
    }

    /// One on several threads, or in a process of its own: what counts is how long one waits.
    pub(crate) fn awaited(name: impl Into<String>, mut work: impl FnMut() + 'a) -> Self {
        Self::new(name, move || seconds_waited(&mut work))
    }
}

/// Mean seconds that this process computes, doing something so many times.
pub(crate) fn seconds_of(times: usize, mut work: impl FnMut()) -> f64 {
    let start = computed();
    (0..times).for_each(|_| work());
    (computed() - start) / times as f64
}

/// Seconds on the wall's clock of doing something once.
pub(crate) fn seconds_waited(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// Seconds that this process has computed on all its threads: what others do meanwhile does not count.
fn computed() -> f64 {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64()
    }
}

/// Median and the range of the middle 80 %.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spread {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |tenths: usize| values[(tenths * (values.len() - 1) + 5) / 10];
        Self { median: at(5), low: at(1), high: at(9) }
    }

    /// In another unit.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { median: self.median * factor, low: self.low * factor, high: self.high * factor }
    }
}

/// Seconds of all contestants in the rounds that count; the floor is the first.
pub(crate) struct Times {
    names: Vec<String>,
    rounds: Vec<Vec<f64>>,
}

impl Times {
    fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// How many times as long one takes as another.
    pub(crate) fn ratio(&self, one: &str, other: &str) -> Option<Spread> {
        self.both(one, other, |one, other| one / other)
    }

    /// What follows from the seconds of two in the same round.
    pub(crate) fn both(&self, one: &str, other: &str, follows: impl Fn(f64, f64) -> f64) -> Option<Spread> {
        let (one, other) = (self.index(one)?, self.index(other)?);
        Some(Spread::of(self.rounds.iter().map(|round| follows(round[one], round[other])).collect()))
    }

    /// Seconds of one.
    pub(crate) fn seconds(&self, name: &str) -> Option<Spread> {
        let index = self.index(name)?;
        Some(Spread::of(self.rounds.iter().map(|round| round[index]).collect()))
    }
}

/// Lets all take turns, and tells the document what was disturbed.
///
/// A round counts if the floor at its start and at its end is within 15 % of the median of all; as long as too few count,
/// further ones are tried, eight times as many at most. What the contestants take is not looked at.
pub(crate) fn alternate(
    document: &mut Document,
    what: &str,
    rounds: usize,
    floor: &[f64],
    mut contestants: Vec<Contestant<'_>>,
) -> Times {
    let read = || (0..3).map(|_| crate::floor::read_once(floor)).fold(f64::INFINITY, f64::min);
    let mut tried: Vec<Round> = Vec::new();
    while tried.len() < PATIENCE * rounds && quiet(&tried).len() < rounds {
        let before = read();
        let mut times = vec![before];
        times.extend(contestants.iter_mut().map(|contestant| (contestant.run)()));
        tried.push(Round { times, after: read() });
    }
    let mut counted = quiet(&tried);
    eprintln!("{what}: {} of {} rounds count", counted.len(), tried.len());
    if counted.len() < rounds {
        document.disturbed(format!(
            "{what}: the floor varied by more than 15 % in {} of {} rounds",
            tried.len() - counted.len(),
            tried.len()
        ));
        counted = tried.into_iter().map(|round| round.times).collect();
    }
    let names = std::iter::once("floor".to_owned()).chain(contestants.into_iter().map(|c| c.name)).collect();
    Times { names, rounds: counted }
}

/// Seconds of a round: of the floor and all contestants, and of the floor again.
struct Round {
    times: Vec<f64>,
    after: f64,
}

/// The times of the rounds in which memory was as fast as usual.
fn quiet(tried: &[Round]) -> Vec<Vec<f64>> {
    if tried.is_empty() {
        return Vec::new();
    }
    let usual = Spread::of(tried.iter().flat_map(|round| [round.times[0], round.after]).collect()).median;
    let as_usual = |floor: f64| (floor / usual - 1.0).abs() <= DISTURBED;
    let counts = |round: &&Round| as_usual(round.times[0]) && as_usual(round.after);
    tried.iter().filter(counts).map(|round| round.times.clone()).collect()
}
