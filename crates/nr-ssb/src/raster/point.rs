//! Synchronization raster.

/// Frequency at which a cell may transmit an SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterPoint {
    /// Global synchronization channel number; `None` off the raster.
    pub gscn: Option<u16>,
    /// Frequency of the SSB's centre (subcarrier 120) in Hz; relative to the recording's centre if
    /// that is unknown.
    pub ssb_freq_hz: f64,
}

impl RasterPoint {
    /// Creates a point off the raster.
    pub(super) const fn off(ssb_freq_hz: f64) -> Self {
        Self {
            gscn: None,
            ssb_freq_hz,
        }
    }
}

/// Returns the points of the synchronization raster from `low_hz` to `high_hz` (TS 38.104 Table
/// 5.4.3.1-1): `N · 1.2 MHz + M · 50 kHz`, M = 1, 3, 5, below 3 GHz, `3 GHz + N · 1.44 MHz` up to
/// 24.25 GHz, `24.25008 GHz + N · 17.28 MHz` up to 100 GHz.
pub fn synchronization_raster(low_hz: f64, high_hz: f64) -> impl Iterator<Item = RasterPoint> {
    let below = (1..2500_u16).flat_map(|n| {
        [1, 3, 5].map(move |m| RasterPoint {
            gscn: Some(3 * n + (m - 1) / 2 - 1),
            ssb_freq_hz: f64::from(n) * 1.2e6 + f64::from(m) * 50e3,
        })
    });
    let above = (0..14757_u16).map(|n| RasterPoint {
        gscn: Some(7499 + n),
        ssb_freq_hz: 3e9 + f64::from(n) * 1.44e6,
    });
    let high = (0..4384_u16).map(|n| RasterPoint {
        gscn: Some(22256 + n),
        ssb_freq_hz: 24.25008e9 + f64::from(n) * 17.28e6,
    });
    below
        .chain(above)
        .chain(high)
        .filter(move |point| (low_hz..=high_hz).contains(&point.ssb_freq_hz))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raster_points_have_the_numbers_of_the_standard() {
        let at = |hz: f64| {
            synchronization_raster(hz - 1.0, hz + 1.0)
                .next()
                .unwrap()
                .gscn
        };
        // TS 38.104 Table 5.4.3.1-1: GSCN = 3N + (M − 3)/2, 7499 + N and 22256 + N.
        assert_eq!(at(1.25e6), Some(2));
        assert_eq!(at(2_134.85e6), Some(3 * 1779 - 1));
        assert_eq!(at(1_862.65e6), Some(3 * 1552 + 1));
        assert_eq!(at(3_000e6), Some(7499));
        assert_eq!(at(3_512.64e6), Some(7499 + 356));
        assert_eq!(at(24_250.08e6), Some(22_256));
        assert_eq!(at(26_531.04e6), Some(22_388));
        assert_eq!(synchronization_raster(3_001e6, 3_001.4e6).count(), 0);
    }
}
