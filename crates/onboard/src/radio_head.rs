//! Radio heads as the vehicle knows them.

use crate::geometry::Point;
use crate::settings::{RadioHeadSettings, Site, Vehicle};

/// A surveyed radio head and the SSB it sends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadioHead {
    /// Physical cell identity.
    pub pci: u16,
    /// Index of its SSB in the burst.
    pub ssb_index: u8,
    /// Its place.
    pub position: Point,
    /// Its height in metres.
    pub height_m: f64,
    /// Standard deviation of its place in each of x and y, in metres.
    pub position_std_m: f64,
    /// Transmit power and antenna gain together (EIRP), in dBm.
    pub eirp_dbm: f64,
}

impl RadioHead {
    /// Whether this SSB of this cell is the one it sends.
    pub const fn sends(&self, pci: u16, ssb_index: u8) -> bool {
        self.pci == pci && self.ssb_index == ssb_index
    }

    /// Distance in metres from a place at this height.
    pub fn distance_m(&self, place: Point, height_m: f64) -> f64 {
        place
            .distance_m(self.position)
            .hypot(self.height_m - height_m)
    }

    /// The radio heads of a site that a vehicle listens to.
    pub fn heard(site: &Site, vehicle: &Vehicle) -> Vec<Self> {
        let heads = site.radio_heads.iter();
        heads
            .filter(|head| vehicle.receiver.hears(head.pci))
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
        }
    }
}
