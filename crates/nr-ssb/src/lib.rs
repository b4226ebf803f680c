//! Synchronization signal blocks (SSBs) of 5G NR: search, tracking, decoding and generation.
//!
//! An SSB is 240 subcarriers × 4 OFDM symbols. The primary and secondary synchronization signals
//! (PSS, SSS) encode the cell identity. The physical broadcast channel (PBCH) with its reference
//! signal (DM-RS) encodes the time and the master information block (MIB). This crate follows TS
//! 38.104, 38.211 to 38.213, 38.215 and 38.331; each item names its clause.
//!
//! # Receive
//! A [`Receiver`](receiver::Receiver) processes samples of any rate in blocks of any length, and
//! returns SSBs with the channel of every antenna. It searches until a cell is detected, then
//! tracks the beams of the cell. Its parts can be used separately:
//!
//! # Search for cells
//! The [front end](front_end) shifts the SSB to 0 Hz and resamples a recording to 256 samples per
//! symbol, 7.68 Msps at 30 kHz spacing. A [`Searcher`](search::Searcher) detects every SSB of every
//! cell at this rate, in a whole recording or block by block in a stream. It returns cell, beam,
//! time, frequency offset, power and the PBCH message.
//!
//! ```
//! # use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci};
//! use nr_ssb::SubcarrierSpacing;
//! use nr_ssb::front_end::FrontEnd;
//! use nr_ssb::search::{SearchConfig, Searcher};
//! # let beams = vec![Beam::new(1), Beam::new(6)];
//! # let payload = BchPayload::new(Mib::default(), 784, false, 0)?;
//! # let burst = Burst { pci: Pci::new(601)?, case: Case::C, lmax: Lmax::L8, payload, beams, ssb_freq_hz: Some(3_700.8e6) };
//! # let numerology = Numerology::from_sample_rate(Case::C.spacing(), 15.36e6)?;
//! # let sent = burst.iq(&mut Ofdm::new(numerology))?;
//! # let recording = [sent.clone(), sent.iter().map(|x| x * Complex32::I).collect()];
//!
//! // Two antennas at 15.36 Msps, the SSB at the recording's centre.
//! let spacing = SubcarrierSpacing::Khz30;
//! let base = FrontEnd::new(15.36e6, 0.0, spacing.hz(), 2)?.process(&recording)?;
//! let antennas = [base[0].as_slice(), base[1].as_slice()];
//!
//! let config = SearchConfig { ssb_freq_hz: Some(3_700.8e6), ..SearchConfig::new(spacing, 2) };
//! let found = Searcher::new(config)?.search(&antennas)?.to_vec();
//! let beams: Vec<u8> = found.iter().map(|ssb| ssb.ssb_index).collect();
//! assert_eq!((found[0].pci.get(), beams), (601, vec![1, 6]));
//! assert_eq!(found[0].payload.map(|payload| payload.sfn()), Some(784));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! If the frequency or the spacing is unknown, [`raster::scan`] searches the recorded band.
//! [`diagnose`] reports faults of a recording's channels.
//!
//! # Track a cell
//! A [`Tracker`](track::Tracker) processes further SSBs of a known cell in a fraction of a search's
//! time. It returns the beam, the time, and one complex amplitude per antenna, from which an array
//! estimates the direction.
//!
//! ```
//! # use nr_ssb::{BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci};
//! # use nr_ssb::SubcarrierSpacing;
//! # use nr_ssb::search::{SearchConfig, Searcher};
//! use nr_ssb::track::Tracker;
//! # let beams = vec![Beam::new(1), Beam::new(6)];
//! # let payload = BchPayload::new(Mib::default(), 784, false, 0)?;
//! # let burst = Burst { pci: Pci::new(601)?, case: Case::C, lmax: Lmax::L8, payload, beams, ssb_freq_hz: Some(3_700.8e6) };
//! # let numerology = Numerology::from_sample_rate(Case::C.spacing(), 7.68e6)?;
//! # let sent = burst.iq(&mut Ofdm::new(numerology))?;
//! # let quarter_turn: Vec<_> = sent.iter().map(|x| x * Complex32::I).collect();
//! # let antennas = [sent.as_slice(), quarter_turn.as_slice()];
//! # let config = SearchConfig { ssb_freq_hz: Some(3_700.8e6), ..SearchConfig::new(SubcarrierSpacing::Khz30, 2) };
//! # let found = Searcher::new(config.clone())?.search(&antennas)?.to_vec();
//!
//! let mut tracker = Tracker::new(&config, &found[0])?;
//! // The window that begins 20 ms after the first one holds the same beam again.
//! let period = 0.02 * 7.68e6;
//! let tracked = tracker.track(&antennas, period, tracker.expected_start(period), false)?;
//! let tracked = tracked.expect("the cell is still there");
//! assert_eq!(tracked.ssb_index, 1);
//! let [first, second] = [0, 1].map(|antenna| tracked.blocks[0][antenna]);
//! assert!(((second / first).arg().to_degrees() - 90.0).abs() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//! Resource elements are stored with the subcarrier as the fastest index, k + 240·l; k = 120 is the
//! SSB's centre. Samples are [`Complex32`] with the SSB's centre at 0 Hz. Log-likelihood ratios are
//! positive for bit 0. In integers, the first bit of a bit string is the most significant one.
//!
//! # Build a burst
//! A cell transmits its SSBs, one per beam, in a half frame of 5 ms. [`Burst`] generates them at
//! any multiple of the 256-point rate (3.84 Msps at 15 kHz, 7.68 at 30, 30.72 at 120, 61.44 at
//! 240).
//!
//! ```
//! use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci};
//!
//! let mib = Mib { ssb_subcarrier_offset: 6, pdcch_config_sib1: 0x60, ..Mib::default() };
//! let burst = Burst {
//!     pci: Pci::new(601)?,
//!     case: Case::C,
//!     lmax: Lmax::L8,
//!     payload: BchPayload::new(mib, 784, false, 0)?,
//!     beams: (0..8).map(Beam::new).collect(),
//!     ssb_freq_hz: Some(3_700.8e6),
//! };
//! let numerology = Numerology::from_sample_rate(Case::C.spacing(), 7.68e6)?;
//! let samples = burst.iq(&mut Ofdm::new(numerology))?;
//! assert_eq!(samples.len(), numerology.half_frame_len());
//! # Ok::<(), nr_ssb::Error>(())
//! ```
//!
//! # Decode an SSB step by step
//! The start of the SSB is known in this example; a search would detect it. Each symbol is
//! demodulated, its phase of TS 38.211 §5.4 is removed, and log-likelihood ratios of the PBCH
//! elements are computed.
//!
//! ```
//! # use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci};
//! use nr_ssb::{SsbGrid, grid::pbch_indices, ofdm::symbol_phase, pbch};
//! # let (pci, lmax) = (Pci::new(601)?, Lmax::L8);
//! # let payload = BchPayload::new(Mib::default(), 784, false, 3)?;
//! # let numerology = Numerology::from_sample_rate(Case::C.spacing(), 7.68e6)?;
//! # let mut ofdm = Ofdm::new(numerology);
//! # let beams = vec![Beam::new(3)];
//! # let burst = Burst { pci, case: Case::C, lmax, payload, beams, ssb_freq_hz: Some(3_700.8e6) };
//! # let samples = burst.iq(&mut ofdm)?;
//!
//! let mut grid = SsbGrid::zeros();
//! for (l, subcarriers) in grid.symbols_mut().enumerate() {
//!     let symbol = Case::C.start_symbol(3)? + l;
//!     // Begin in the middle of the cyclic prefix: the echoes may come early or late.
//!     let early = numerology.ssb_cp_len() / 2;
//!     let start = numerology.symbol_start(symbol) + numerology.cp_len(symbol) - early;
//!     ofdm.demodulate(&samples[start..start + numerology.fft_size()], early, subcarriers)?;
//!     let phase = symbol_phase(numerology, symbol, 3_700.8e6).conj();
//!     subcarriers.iter_mut().for_each(|x| *x *= phase);
//! }
//!
//! let received = pbch_indices(pci).map(|index| grid.elements()[index]);
//! let mut llr = [0.0; 864];
//! pbch::llr(&received, 0.1, &mut llr);
//! let decoded = pbch::Decoder::default().decode(&llr, pci, lmax.index_lsb(3), lmax)?;
//! assert_eq!(decoded.map(|d| d.payload.sfn()), Some(784));
//! # Ok::<(), nr_ssb::Error>(())
//! ```
//!
//! # The parts
//! | task | item |
//! |---|---|
//! | receive SSBs from a sample stream | [`receiver`] |
//! | find the SSBs at a known frequency | [`search`] |
//! | process further SSBs of a known cell | [`track`] |
//! | measure delay, carrier phase, range rate and power | [`observables`] |
//! | find SSBs anywhere in a band | [`raster`] |
//! | resample a recording to the rate of the search | [`front_end`] |
//! | diagnose the channels of a recording | [`diagnose`] |
//! | list the DC offset and interfering tones, which searches and receivers remove |
//! [`tones`](fn@tones) |
//! | definitions of SS-RSRP, SS-RSRQ and SS-SINR | [`measure`] |
//! | identify a cell | [`Pci`] |
//! | positions of SSBs in time | [`Case`], [`Lmax`], [`Numerology`] |
//! | positions of SSBs in frequency | [`grid`] |
//! | synchronization raster and burst set size of a band | [`band`] |
//! | generate sequences | [`mod@pss`], [`mod@sss`], [`mod@dmrs`], [`gold`] |
//! | read and write the MIB | [`Mib`], [`BchPayload`] |
//! | encode and decode the PBCH | [`pbch`]; its parts [`crc`], [`polar`], [`rate_matching`] |
//! | combine the PBCHs of several periods | [`pbch::Decoder::combine`] |
//! | convert between subcarriers and samples | [`Ofdm`] |
//! | plan Fourier transforms | [`fft`] |
//!
//! # Errors
//! Invalid inputs return an [`Error`]. Errors of a recording, a search or a tracked cell are a
//! [`FrontEndError`](front_end::FrontEndError), a [`SearchError`](search::SearchError), a
//! [`ScanError`](raster::ScanError) or a [`TrackError`](track::TrackError); those of a receiver are
//! a [`ReceiverError`](receiver::ReceiverError). This crate does not panic.

// Each folder depends on the previous ones only: numeric, standard; transmit, dsp; input, one_ssb,
// observables; search; track, raster; receiver.
mod dsp;
mod error;
mod input;
mod numeric;
pub mod observables;
mod one_ssb;
pub mod raster;
pub mod receiver;
pub mod search;
mod standard;
pub mod track;
mod transmit;

pub use dsp::channel_covariance::ChannelCovariance;
pub use dsp::tones::{Tone, tones};
pub use error::Error;
pub use input::{diagnose, front_end};
pub use num_complex::Complex32;
pub use numeric::fft;
pub use one_ssb::measure;
pub use standard::band::{self, Band};
pub use standard::coding::{polar, rate_matching};
pub use standard::grid::{self, SsbGrid};
pub use standard::message::crc;
pub use standard::message::mib::{self, Mib};
pub use standard::message::payload::{self, BchPayload};
pub use standard::numerology::{self, Case, Lmax, Numerology, SubcarrierSpacing};
pub use standard::pbch;
pub use standard::pci::Pci;
pub use standard::sequence::gold::{self, Gold};
pub use standard::sequence::{dmrs, pss, sss};
pub use transmit::burst::{self, Beam, Burst};
pub use transmit::ofdm::{self, Ofdm};
