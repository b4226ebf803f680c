//! Radio heads as the map knows them.

use crate::geometry::Point;
use crate::scenario::RadioHeadSettings;

/// A surveyed radio head and the SSB it sends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadioHead {
    /// Physical cell identity.
    pub pci: u16,
    /// Index of its SSB in the burst.
    pub ssb_index: u8,
    /// Its place.
    pub position: Point,
    /// Transmit power and antenna gain together (EIRP), in dBm.
    pub eirp_dbm: f64,
}

impl RadioHead {
    /// Whether this SSB of this cell is the one it sends.
    pub const fn sends(&self, pci: u16, ssb_index: u8) -> bool {
        self.pci == pci && self.ssb_index == ssb_index
    }
}

impl From<&RadioHeadSettings> for RadioHead {
    fn from(settings: &RadioHeadSettings) -> Self {
        Self {
            pci: settings.pci,
            ssb_index: settings.ssb_index,
            position: settings.position_m.into(),
            eirp_dbm: settings.tx_power_dbm + settings.tx_gain_dbi,
        }
    }
}
