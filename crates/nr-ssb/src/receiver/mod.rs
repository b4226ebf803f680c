//! Receiver: input samples of any rate, output SSBs with the channel of every antenna.
//!
//! All samples of a period are searched until a beam is detected, and then every
//! [`search_every_s`](ReceiverConfig::search_every_s), unless all known
//! [`beams`](ReceiverConfig::beams) are received. Between searches, SSBs are received at their
//! expected times only. [`WindowReceiver`] does this for windows of samples at the base rate.
//! [`Receiver`] adds the [front end](crate::front_end), for samples of any rate in blocks of any
//! length, with gaps.
//!
//! ```
//! # use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci};
//! # use nr_ssb::SubcarrierSpacing::Khz30;
//! use nr_ssb::receiver::{Receiver, ReceiverConfig};
//! # let beams = vec![Beam::new(1), Beam::new(6)];
//! # let payload = BchPayload::new(Mib::default(), 784, false, 0)?;
//! # let burst = Burst { pci: Pci::new(601)?, case: Case::C, lmax: Lmax::L8, payload, beams, ssb_freq_hz: Some(3_700.8e6) };
//! # let mut sent = burst.iq(&mut Ofdm::new(Numerology::from_sample_rate(Khz30, 15.36e6)?))?;
//! # sent.resize(4 * sent.len(), Complex32::ZERO);
//! # let quarter_turn: Vec<_> = sent.iter().map(|x| x * Complex32::I).collect();
//!
//! // Two antennas at 15.36 Msps, the SSB at the recording's centre.
//! let mut receiver = Receiver::new(ReceiverConfig::new(3_700.8e6, Khz30, 2), 15.36e6, 3_700.8e6)?;
//! let mut beams = Vec::new();
//! for _ in 0..3 {
//!     // A period of 20 ms.
//!     receiver.push(&[&sent, &quarter_turn], &mut |mut beam| {
//!         let ssb = beam.tracked_ssb();
//!         let turn = ssb.channel[1][120] / ssb.channel[0][120];
//!         assert!((turn.arg().to_degrees() - 90.0).abs() < 0.1);
//!         beams.push((ssb.pci.get(), ssb.ssb_index, ssb.tracked));
//!     })?;
//! }
//! receiver.finish(&mut |beam| {
//!     beams.push((beam.ssb.pci.get(), beam.ssb.ssb_index, beam.is_followed));
//! })?;
//! assert_eq!(beams[..2], [(601, 1, false), (601, 6, false)]);
//! assert_eq!(beams[2..], [(601, 1, true), (601, 6, true), (601, 1, true), (601, 6, true)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod beam;
mod config;
mod error;
mod stream;
mod tracked_ssb;
mod window;

pub use config::ReceiverConfig;
pub use error::ReceiverError;
pub use stream::Receiver;
pub use tracked_ssb::TrackedSsb;
pub use window::{ReceivedBeam, Window, WindowReceiver};
