//! Which samples are wanted: between the bursts that are listened to none are.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use onboard::settings::Site;

/// Samples before and after an SSB that the receiver needs, in seconds: the reach of its low-pass and of the
/// clocks' drift since the last burst.
const GUARD_S: f64 = 4e-4;

/// The stretch of time of which samples are wanted, set by the pipeline and read by the sources.
#[derive(Debug)]
pub struct Gate {
    is_open: AtomicBool,
    from_s: AtomicU64,
    until_s: AtomicU64,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            is_open: AtomicBool::new(true),
            from_s: AtomicU64::new(0),
            until_s: AtomicU64::new(0),
        }
    }
}

impl Gate {
    /// Everything is wanted.
    pub fn open(&self) {
        self.is_open.store(true, Ordering::Release);
    }

    /// Samples of this stretch are wanted, before it none.
    pub fn set(&self, [from_s, until_s]: [f64; 2]) {
        self.from_s.store(from_s.to_bits(), Ordering::Release);
        self.until_s.store(until_s.to_bits(), Ordering::Release);
        self.is_open.store(false, Ordering::Release);
    }

    /// The stretch of which samples are wanted; `None` for all.
    pub fn wanted(&self) -> Option<[f64; 2]> {
        if self.is_open.load(Ordering::Acquire) {
            return None;
        }
        let read = |it: &AtomicU64| f64::from_bits(it.load(Ordering::Acquire));
        Some([read(&self.from_s), read(&self.until_s)])
    }
}

/// From the first to the last SSB of a burst that the site's radio heads send, in seconds.
fn span_s(site: &Site) -> f64 {
    let indices = || site.radio_heads.iter().map(|head| head.ssb_index);
    let between = indices().max().unwrap_or(0) - indices().min().unwrap_or(0);
    // Two SSBs to a slot of 14 symbols (TS 38.213, 4.1), at least; a slot is 1 ms at 15 kHz.
    f64::from(between.div_ceil(2)) * 15e-3 / site.ssb.subcarrier_spacing_khz
}

/// The stretch of samples that holds a burst of which one SSB, whichever, begins at a time.
#[derive(Debug, Clone, Copy)]
pub struct Windows {
    before_s: f64,
    after_s: f64,
}

impl Windows {
    /// For the SSBs of a site.
    pub fn new(site: &Site) -> Self {
        let ssb_s = 4.3e-3 / site.ssb.subcarrier_spacing_khz / 14.0 * 15.0;
        let before_s = span_s(site) + GUARD_S;
        Self {
            before_s,
            after_s: before_s + ssb_s,
        }
    }

    /// The stretch.
    pub fn around(&self, burst_s: f64) -> [f64; 2] {
        [burst_s - self.before_s, burst_s + self.after_s]
    }
}

#[cfg(test)]
mod tests {
    use onboard::settings::{Shipped, TomlFile};

    use super::*;

    #[test]
    fn a_window_holds_every_ssb_of_its_burst() {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let windows = Windows::new(&site);
        // SSBs of indices 0 and 3 begin at symbols 2 and 22 at 15 kHz (case A), and are 4 symbols long.
        let symbol_s = 1e-3 / 14.0;
        for (seen, other) in [(2.0, 22.0), (22.0, 2.0)] {
            let [from_s, until_s] = windows.around(seen * symbol_s);
            assert!(from_s < (other - 1.0) * symbol_s && until_s > (other + 5.0) * symbol_s);
        }
        let [from_s, until_s] = windows.around(0.0);
        assert!(until_s - from_s < 6e-3);
    }

    #[test]
    fn what_is_set_is_what_is_wanted() {
        let gate = Gate::default();
        assert_eq!(gate.wanted(), None);
        gate.set([1.0, 2.0]);
        assert_eq!(gate.wanted(), Some([1.0, 2.0]));
        gate.open();
        assert_eq!(gate.wanted(), None);
    }
}
