//! Times of many cycles in a histogram of two digits, the same for us and for peers.

use anyhow::{Result, anyhow};
use hdrhistogram::Histogram;
use report::Distribution;
use serde_json::{Value, json};

/// The longest time told apart, ns: 100 s, as in the loop's own histograms.
const LONGEST_NS: u64 = 100_000_000_000;

/// Times in ns.
#[derive(Debug, Clone)]
pub struct Times {
    histogram: Histogram<u64>,
}

impl Times {
    /// None yet.
    ///
    /// # Errors
    /// Never with the constants here; the histogram checks them.
    pub fn new() -> Result<Self> {
        let histogram =
            Histogram::new_with_bounds(1, LONGEST_NS, 2).map_err(|error| anyhow!("histogram: {error}"))?;
        Ok(Self { histogram })
    }

    /// Takes times over from bins: a time in ns, and how often.
    pub fn add_bins(&mut self, bins: impl IntoIterator<Item = (u64, u64)>) {
        for (time_ns, count) in bins {
            self.histogram.saturating_record_n(time_ns, count);
        }
    }

    /// Takes one.
    pub fn add(&mut self, time_ns: u64) {
        self.histogram.saturating_record(time_ns);
    }

    /// Takes all of another's.
    pub fn add_times(&mut self, other: &Self) {
        self.add_bins(
            other.histogram.iter_recorded().map(|bin| (bin.value_iterated_to(), bin.count_at_value())),
        );
    }

    /// How many.
    pub fn count(&self) -> u64 {
        self.histogram.len()
    }

    /// How many were longer than this.
    pub fn count_over(&self, time_ns: u64) -> u64 {
        self.histogram
            .iter_recorded()
            .filter(|bin| bin.value_iterated_to() > time_ns)
            .map(|bin| bin.count_at_value())
            .sum()
    }

    /// The time that a part (0 to 1) of all does not exceed, ns; 0 without any.
    pub fn quantile_ns(&self, part: f64) -> u64 {
        self.histogram.value_at_quantile(part)
    }

    /// The longest, ns.
    pub fn max_ns(&self) -> u64 {
        self.histogram.max()
    }

    /// p50, p99, p99.9 and the longest, ns.
    pub fn percentiles_ns(&self) -> [u64; 4] {
        [self.quantile_ns(0.5), self.quantile_ns(0.99), self.quantile_ns(0.999), self.max_ns()]
    }

    /// For machines, bins included.
    pub fn json(&self) -> Value {
        let [p50, p99, p999, max] = self.percentiles_ns();
        let bins = self.histogram.iter_recorded().map(|bin| (bin.value_iterated_to(), bin.count_at_value()));
        json!({
            "count": self.count(), "p50_ns": p50, "p99_ns": p99, "p999_ns": p999, "max_ns": max,
            "bins_upper_edge_ns_and_count": bins.collect::<Vec<_>>(),
        })
    }

    /// For a page's histogram, in µs; coarser bins than kept, so that the curve is read easily.
    pub fn distribution(&self, name: &str) -> Distribution {
        let mut bins = Vec::new();
        let (mut edge_ns, mut count) = (250_u64, 0);
        for bin in self.histogram.iter_recorded() {
            while bin.value_iterated_to() > edge_ns {
                bins.push((edge_ns as f64 / 1e3, std::mem::take(&mut count)));
                // A tenth more, at least.
                edge_ns += (edge_ns / 10).max(1);
            }
            count += bin.count_at_value();
        }
        bins.push((edge_ns as f64 / 1e3, count));
        Distribution { name: name.to_owned(), lower_edge: 0.0, bins }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_holds_every_time_once() {
        let mut times = Times::new().unwrap();
        times.add_bins([(100, 5), (3_000, 90), (2_000_000, 5)]);
        let distribution = times.distribution("x");
        assert_eq!(distribution.count(), 100);
        let median_us = distribution.quantile(0.5).unwrap();
        assert!((3.0..3.4).contains(&median_us), "{median_us}");
        assert_eq!(times.quantile_ns(0.05), 100);
        assert!(times.max_ns().abs_diff(2_000_000) < 20_000);
    }
}
