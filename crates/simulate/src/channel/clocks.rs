//! Clocks of the vehicle and of the radio heads: offsets and random walks, drawn from the nominal
//! model of the site and of the vehicle's ranging.

use onboard::radio_head::RadioHead;
use onboard::range::RangeModel;
use onboard::settings::{RadioHeadSettings, SPEED_OF_LIGHT_MPS};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::random::{Purpose, Streams};
use crate::scenario::Scenario;

/// Index of the vehicle's clock among those of [`Purpose::RangingClock`].
const VEHICLE: usize = usize::MAX;

/// Clock whose error is a constant and a random walk.
struct Clock {
    generator: ChaCha8Rng,
    error_s: f64,
    wander_s_per_sqrt_s: f64,
}

impl Clock {
    fn new(streams: Streams, index: usize, [offset_m, wander_m]: [f64; 2], scale: f64) -> Self {
        let mut generator = streams.generator(Purpose::RangingClock, index);
        let normal: f64 = generator.sample(StandardNormal);
        Self {
            error_s: scale * offset_m / SPEED_OF_LIGHT_MPS * normal,
            wander_s_per_sqrt_s: scale * wander_m / SPEED_OF_LIGHT_MPS,
            generator,
        }
    }

    fn advance(&mut self, duration_s: f64) {
        let normal: f64 = self.generator.sample(StandardNormal);
        self.error_s += self.wander_s_per_sqrt_s * duration_s.sqrt() * normal;
    }
}

/// Clocks of one run; exact clocks unless the vehicle uses one-way delays.
pub(super) struct Clocks {
    vehicle: Option<Clock>,
    /// Clock of each oscillator.
    oscillators: Vec<Clock>,
    /// Index of the oscillator of each radio head.
    of_heads: Vec<usize>,
    period_s: f64,
    /// Number of the burst to which the clocks have advanced.
    number: u64,
}

/// Returns the index of the first radio head with the oscillator of radio head `index`: its own
/// index, or the first one of its clock group.
pub(super) fn oscillator_of(heads: &[RadioHeadSettings], index: usize) -> usize {
    let group = heads.get(index).and_then(|head| head.clock_group);
    let first = group.and_then(|_| heads.iter().position(|head| head.clock_group == group));
    first.unwrap_or(index)
}

impl Clocks {
    pub fn new(scenario: &Scenario, streams: Streams) -> Self {
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        let mut made = Self {
            vehicle: None,
            oscillators: Vec::new(),
            of_heads: Vec::new(),
            period_s: site.ssb.period_s(),
            number: 0,
        };
        let Some(ranging) = vehicle.ranging.filter(|_| vehicle.has_one_way_ranging()) else {
            return made;
        };
        let model = RangeModel::new(&ranging, &vehicle.array, site.wavelength_m());
        let scale = scenario.iq.clock_error_scale;
        // The receiver measures delays relative to its first SSB, so that the offset of the
        // vehicle's clock has no effect.
        let vehicle_m = [0.0, model.clock_wander_m_per_sqrt_s];
        made.vehicle = Some(Clock::new(streams, VEHICLE, vehicle_m, scale));
        for (index, head) in site.radio_heads.iter().enumerate() {
            let shared = made.of_heads.get(oscillator_of(&site.radio_heads, index));
            let shared = shared.copied();
            made.of_heads.push(shared.unwrap_or(made.oscillators.len()));
            if shared.is_none() {
                let clock_m = model.head_clock(&RadioHead::from(head).clock);
                let clock = Clock::new(streams, index, clock_m, scale);
                made.oscillators.push(clock);
            }
        }
        made
    }

    /// Advances the clocks to a burst, which is not before the last one.
    pub fn advance_to(&mut self, number: u64) {
        while self.number < number {
            self.number += 1;
            for clock in self.oscillators.iter_mut().chain(&mut self.vehicle) {
                clock.advance(self.period_s);
            }
        }
    }

    /// Returns the delay of the SSBs of radio head `index` due to the clocks in seconds. It is
    /// positive if the radio head transmits late or the vehicle's clock is fast.
    pub fn delay_s(&self, index: usize) -> f64 {
        let oscillator = self.of_heads.get(index);
        let head = oscillator.and_then(|&at| self.oscillators.get(at));
        let error_s = |clock: &Clock| clock.error_s;
        head.map_or(0.0, error_s) + self.vehicle.as_ref().map_or(0.0, error_s)
    }
}

#[cfg(test)]
mod tests {
    use onboard::settings::{Shipped, Site, TomlFile};

    use super::*;

    #[test]
    fn radio_heads_of_a_clock_group_share_the_first_oscillator() {
        let groups = [
            "",
            "clock_group = 4",
            "clock_group = 7",
            "clock_group = 4",
            "",
            "clock_group = 7",
        ];
        let heads = (0..).zip(groups).map(|(pci, group)| {
            format!("[[radio_heads]]\npci = {pci}\nposition_m = [1{pci}.0, 5.0, 3.0]\n{group}\n")
        });
        let text = format!("name = 'hall'\n{}", heads.collect::<String>());
        let site = Site::from_toml(&text, "site", &Shipped).unwrap();
        let first = |index| oscillator_of(&site.radio_heads, index);
        assert_eq!([0, 1, 2, 3, 4, 5].map(first), [0, 1, 2, 1, 4, 2]);
    }
}
