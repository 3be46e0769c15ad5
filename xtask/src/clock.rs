//! Processor time, which other programs on the machine disturb less than time on the wall.

use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// Processor time of this thread so far.
pub fn thread_time() -> Duration {
    time_of(ClockId::ThreadCPUTime)
}

/// Processor time of all threads of this process so far.
pub fn process_time() -> Duration {
    time_of(ClockId::ProcessCPUTime)
}

fn time_of(clock: ClockId) -> Duration {
    let time = clock_gettime(clock);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Times of the same work, round by round.
#[derive(Clone, Debug, Default)]
pub struct Times(Vec<f64>);

impl Times {
    /// Takes in the time of the next round.
    pub fn push(&mut self, time: Duration) {
        self.0.push(time.as_secs_f64());
    }

    /// The middle one, in seconds.
    pub fn median(&self) -> f64 {
        median(self.0.clone())
    }

    /// The least one, in seconds.
    pub fn best(&self) -> f64 {
        self.0.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The median of how many times as long as `other` this took in the same round: what slows the machine for a while
    /// slows both.
    pub fn ratio_to(&self, other: &Times) -> f64 {
        median(self.0.iter().zip(&other.0).map(|(a, b)| a / b).collect())
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(seconds: [u64; 3]) -> Times {
        let mut times = Times::default();
        seconds.into_iter().for_each(|s| times.push(Duration::from_secs(s)));
        times
    }

    #[test]
    fn medians_and_ratios() {
        let a = times([6, 2, 4]);
        assert_eq!((a.median(), a.best()), (4.0, 2.0));
        assert_eq!(a.ratio_to(&times([3, 1, 1])), 2.0);
    }
}
