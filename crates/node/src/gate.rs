//! Gate for samples: sources drop samples between the received bursts.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use nr_ssb::Case;
use onboard::settings::Site;

/// Samples before and after an SSB that the receiver needs, in seconds: length of its low-pass
/// filter, and clock drift since the last burst.
const GUARD_S: f64 = 4e-4;

/// Time interval of required samples, set by the pipeline and read by the sources.
#[derive(Debug)]
pub struct RxWindow {
    is_open: AtomicBool,
    from_s: AtomicU64,
    until_s: AtomicU64,
}

impl Default for RxWindow {
    fn default() -> Self {
        Self {
            is_open: AtomicBool::new(true),
            from_s: AtomicU64::new(0),
            until_s: AtomicU64::new(0),
        }
    }
}

impl RxWindow {
    /// Opens the gate for all samples.
    pub fn open(&self) {
        self.is_open.store(true, Ordering::Release);
    }

    /// Sets the interval of required samples.
    pub fn set(&self, [from_s, until_s]: [f64; 2]) {
        self.from_s.store(from_s.to_bits(), Ordering::Release);
        self.until_s.store(until_s.to_bits(), Ordering::Release);
        self.is_open.store(false, Ordering::Release);
    }

    /// Returns the interval of required samples; `None` for all samples.
    pub fn wanted(&self) -> Option<[f64; 2]> {
        if self.is_open.load(Ordering::Acquire) {
            return None;
        }
        let read = |it: &AtomicU64| f64::from_bits(it.load(Ordering::Acquire));
        Some([read(&self.from_s), read(&self.until_s)])
    }
}

/// Calculator of the interval of a burst from the time of one of its SSBs.
#[derive(Debug, Clone, Copy)]
pub struct BurstWindows {
    symbol_s: f64,
    /// SSB pattern. For 30 kHz case C is used; the SSBs of case B differ by at most four symbols,
    /// for which [`GUARD_S`] is sufficient.
    case: Case,
    /// First symbols of the first and the last SSB of the site's radio heads.
    symbols: [usize; 2],
}

impl BurstWindows {
    /// Creates the calculator for the SSBs of a site.
    pub fn new(site: &Site) -> Self {
        let spacing_khz = site.ssb.subcarrier_spacing_khz;
        let is_spaced = |case: &Case| f64::from(case.spacing().khz()) == spacing_khz;
        let case = Case::ALL.into_iter().rfind(is_spaced).unwrap_or(Case::C);
        let heads = || site.radio_heads.iter();
        let symbols = || heads().filter_map(|head| case.start_symbol(head.ssb_index).ok());
        Self {
            symbol_s: 15e-3 / 14.0 / spacing_khz,
            case,
            symbols: [symbols().min().unwrap_or(0), symbols().max().unwrap_or(0)],
        }
    }

    /// Returns the duration of an SSB in seconds.
    pub const fn ssb_s(&self) -> f64 {
        4.0 * self.symbol_s
    }

    /// Returns the interval of the burst whose SSB with this index begins at `ssb_s`.
    pub fn around(&self, ssb_s: f64, ssb_index: u8) -> [f64; 2] {
        let symbol = self.case.start_symbol(ssb_index).unwrap_or(self.symbols[0]) as f64;
        let begins_s = |other: usize| ssb_s + (other as f64 - symbol) * self.symbol_s;
        let [from_s, until_s] = self.symbols.map(begins_s);
        [from_s - GUARD_S, until_s + self.ssb_s() + GUARD_S]
    }
}

#[cfg(test)]
mod tests {
    use onboard::settings::{Shipped, TomlFile};

    use super::*;

    #[test]
    fn a_window_contains_every_ssb_of_its_burst() {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let windows = BurstWindows::new(&site);
        // SSBs of indices 0 and 3 begin at symbols 2 and 22 at 15 kHz (case A), and are 4 symbols long.
        let symbol_s = 1e-3 / 14.0;
        for (index, symbol) in [(0, 2.0), (1, 8.0), (3, 22.0)] {
            let [from_s, until_s] = windows.around(symbol * symbol_s, index);
            assert!((from_s - (2.0 * symbol_s - GUARD_S)).abs() < 1e-9);
            assert!((until_s - (26.0 * symbol_s + GUARD_S)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_receive_window_returns_the_configured_interval() {
        let gate = RxWindow::default();
        assert_eq!(gate.wanted(), None);
        gate.set([1.0, 2.0]);
        assert_eq!(gate.wanted(), Some([1.0, 2.0]));
        gate.open();
        assert_eq!(gate.wanted(), None);
    }
}
