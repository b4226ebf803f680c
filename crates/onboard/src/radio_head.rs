//! Radio heads of the nominal model.

use crate::geometry::Point;
use crate::range::{HeadClock, METRES_PER_NS, RangeOffset};
use crate::settings::{HeadArraySettings, RadioHeadSettings, Site, Vehicle};

/// Surveyed radio head and its SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadioHead {
    /// Physical cell identity.
    pub pci: u16,
    /// Index of its SSB in the burst.
    pub ssb_index: u8,
    /// Position.
    pub position: Point,
    /// Height in metres.
    pub height_m: f64,
    /// Standard deviation of x and y, each in metres.
    pub position_std_m: f64,
    /// Equivalent isotropically radiated power (EIRP) in dBm: transmit power plus antenna gain.
    pub eirp_dbm: f64,
    /// Array of the radio head, if it measures angles.
    pub array: Option<HeadArraySettings>,
    /// Clock of the radio head, for one-way delays.
    pub clock: HeadClock,
    /// Offset of its ranges: cables, hardware and multipath.
    pub range_offset: RangeOffset,
}

impl RadioHead {
    /// Whether this radio head transmits an SSB with this cell identity and index.
    pub const fn sends(&self, pci: u16, ssb_index: u8) -> bool {
        self.pci == pci && self.ssb_index == ssb_index
    }

    /// Returns the number, from 0, of the radio head in a list that transmits the same SSB.
    pub fn number_in(&self, heads: &[Self]) -> Option<usize> {
        heads
            .iter()
            .position(|it| it.sends(self.pci, self.ssb_index))
    }

    /// Returns the distance in metres from a position at a height.
    pub fn distance_m(&self, place: Point, height_m: f64) -> f64 {
        place
            .distance_m(self.position)
            .hypot(self.height_m - height_m)
    }

    /// Returns the radio heads of a site that a vehicle receives.
    pub fn received_by(site: &Site, vehicle: &Vehicle) -> Vec<Self> {
        let heads = site.radio_heads.iter();
        heads
            .filter(|head| vehicle.receiver.receives(head.pci))
            .map(Self::from)
            .collect()
    }
}

impl From<&RadioHeadSettings> for RadioHead {
    fn from(settings: &RadioHeadSettings) -> Self {
        let [x_m, y_m, height_m] = settings.position_m;
        Self {
            pci: settings.pci,
            ssb_index: settings.ssb_index,
            position: Point::new(x_m, y_m),
            height_m,
            position_std_m: settings.position_std_m,
            eirp_dbm: settings.eirp_dbm,
            array: settings.array,
            clock: HeadClock {
                group: settings.clock_group,
                offset_std_m: settings.clock_offset_std_ns.map(|ns| METRES_PER_NS * ns),
                wander_m_per_sqrt_s: (settings.clock_wander_ns_per_sqrt_s)
                    .map(|ns| METRES_PER_NS * ns),
                // 1 ppb is 1 ns/s.
                frequency_std_mps: (settings.clock_frequency_std_ppb)
                    .map(|ppb| METRES_PER_NS * ppb),
            },
            range_offset: RangeOffset {
                mean_m: settings.range_offset_m.unwrap_or(0.0),
                std_m: settings.range_offset_std_m,
            },
        }
    }
}
