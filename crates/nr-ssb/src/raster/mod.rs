//! Search for the frequency and subcarrier spacing of SSBs: the synchronization raster of TS 38.104
//! §5.4.3, point by point through the recorded band, at 15 and 30 kHz or, in frequency range 2, at
//! 120 and 240 kHz. Test networks may use other frequencies; for them, and for recordings without a
//! centre frequency, see [`scan_off_raster`].

mod error;
mod find;
mod parallel;
mod placement;
mod point;
mod point_search;
mod pss_scan;
mod scan;

pub use error::ScanError;
pub use find::RasterFind;
pub use point::{RasterPoint, synchronization_raster};
pub use scan::{reach_hz, scan, scan_off_raster, scan_raster};
