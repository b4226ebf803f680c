//! Synthesis of the IQ samples that the receiver gets of an SSB burst. The samples include the SSBs
//! of all radio heads, multipath, Doppler shift, faults, frequency offset, clock drift, noise,
//! channel errors and the A/D converter.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nr_ssb::band::likely_lmax;
use nr_ssb::burst::ssb_grid;
use nr_ssb::grid::SUBCARRIERS;
use nr_ssb::ofdm::symbol_phase;
use nr_ssb::{
    BchPayload, Case, Complex32, Error, Lmax, Mib, Numerology, Ofdm, Pci, SubcarrierSpacing,
};
use num_complex::Complex64;
use onboard::settings::{SPEED_OF_LIGHT_MPS, Site};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::clocks::{Clocks, oscillator_of};
use super::head_channel::HeadChannel;
use crate::random::{Purpose, Streams};
use crate::scenario::{IqSettings, Scenario};
use crate::world::{Faults, VehicleState};

/// Standard deviation of the frequency error of a radio head's oscillator, in parts per million;
/// TS 38.104 (6.5.1) allows an error of 0.05.
const HEAD_OSCILLATOR_PPM: f64 = 0.02;

/// Full scale of the A/D converter relative to the RMS value of the strongest symbol, in dB: the
/// peak-to-average ratio of an OFDM signal.
const ADC_HEADROOM_DB: f64 = 12.0;

/// FFT size at the base sample rate.
const FFT_SIZE: usize = 256;
/// Samples before the first SSB and after the last SSB of a burst.
const MARGIN: usize = 64;
/// Subcarrier at the SSB's centre frequency.
const CENTRE: f64 = 120.0;

/// Transmitted signals and receiver hardware of one run.
pub struct IqAir {
    numerology: Numerology,
    case: Case,
    lmax: Lmax,
    ofdm: Ofdm,
    ssb_freq_hz: f64,
    settings: IqSettings,
    period_s: f64,
    /// Relative frequency error of the receiver's oscillator; positive means too fast.
    oscillator: f64,
    head_oscillators: Vec<f64>,
    clocks: Clocks,
    channel_gains: Vec<Complex64>,
    noise: ChaCha8Rng,
    /// Whether samples are also generated between the bursts.
    continuous: bool,
    faults: Faults,
    /// Antenna gains at each subcarrier.
    response: Vec<Complex64>,
    /// Samples of one OFDM symbol.
    symbol: Vec<Complex32>,
    /// Sum of all SSBs at each antenna before the A/D converter.
    sum: Vec<Vec<Complex64>>,
    burst: IqBurst,
}

/// Samples of one burst at the base sample rate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IqBurst {
    /// Index of the first sample according to the receiver's clock.
    pub start: u64,
    /// Vehicle time of the first sample in seconds.
    pub time_s: f64,
    /// Samples of each antenna, relative to the full scale of the A/D converter.
    pub antennas: Vec<Vec<Complex32>>,
    /// Sample index of the start of each radio head's SSB according to the receiver's clock, in the
    /// order of the radio heads.
    pub ssb_starts: Vec<f64>,
}

impl IqAir {
    /// Returns the carrier frequency offset of the SSB of radio head `index` due to the
    /// oscillators, in Hz. The Doppler shift is added path by path.
    pub fn cfo_hz(&self, index: usize) -> f64 {
        let oscillator = self.head_oscillators.get(index).copied().unwrap_or(0.0);
        (oscillator - self.oscillator) * self.ssb_freq_hz
    }

    /// Creates the transmitted signals of the run that `streams` belongs to. The site determines
    /// the signals, and the channels determine position and power.
    ///
    /// # Errors
    /// [`Error`] for a numerology of frequency range 2.
    pub fn new(scenario: &Scenario, streams: Streams) -> Result<Self, Error> {
        let site = &scenario.site;
        let elements = usize::from(scenario.vehicle.array.elements);
        let (case, spacing) = case_of(site);
        let ssb_freq_hz = site.carrier_mhz * 1e6;
        let settings = scenario.iq;
        let mut hardware = streams.generator(Purpose::ReceiverHardware, 0);
        let mut normal = || hardware.sample::<f64, _>(StandardNormal);
        let oscillator = 1e-6 * (settings.oscillator_ppm * normal());
        let channel_gains = (0..elements).map(|_| {
            let gain = 10f64.powf(0.05 * settings.channel_gain_db * normal());
            Complex64::from_polar(gain, settings.channel_phase_rad * normal())
        });
        let channel_gains = channel_gains.collect();
        let head_oscillators = (0..site.radio_heads.len())
            .map(|index| {
                let first = oscillator_of(&site.radio_heads, index);
                let mut rng = streams.generator(Purpose::HeadOscillator, first);
                1e-6 * HEAD_OSCILLATOR_PPM * rng.sample::<f64, _>(StandardNormal)
            })
            .collect();
        let numerology = Numerology::new(spacing, FFT_SIZE)?;
        Ok(Self {
            numerology,
            case,
            lmax: likely_lmax(spacing, Some(ssb_freq_hz)).likely,
            ofdm: Ofdm::new(numerology),
            ssb_freq_hz,
            settings,
            period_s: site.ssb.period_s(),
            oscillator,
            head_oscillators,
            clocks: Clocks::new(scenario, streams),
            channel_gains,
            noise: streams.generator(Purpose::SampleNoise, 0),
            continuous: false,
            faults: Faults::new(&scenario.faults),
            response: vec![Complex64::ZERO; elements * SUBCARRIERS],
            symbol: vec![Complex32::ZERO; numerology.ssb_symbol_len()],
            sum: vec![Vec::new(); elements],
            burst: IqBurst {
                antennas: vec![Vec::new(); elements],
                ..IqBurst::default()
            },
        })
    }

    /// Enables samples between the bursts.
    #[must_use]
    pub const fn continuous(mut self) -> Self {
        self.continuous = true;
        self
    }

    /// Returns the sample rate in Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.numerology.sample_rate_hz()
    }

    /// Returns the complex gains of the receive channels, as a calibration would measure them.
    pub fn channel_gains(&self) -> &[Complex64] {
        &self.channel_gains
    }

    /// Returns the samples of burst number `number`, received at the vehicle time `time_s`.
    /// `snrs_db` are the mean SNRs of the radio heads, and `state` returns the true vehicle state
    /// at any time.
    ///
    /// # Errors
    /// [`Error`] for an SSB index that a cell cannot have.
    pub fn receive(
        &mut self,
        number: u64,
        state: impl Fn(f64) -> VehicleState,
        heads: &[HeadChannel],
        snrs_db: &[f64],
    ) -> Result<&IqBurst, Error> {
        let rate_hz = self.sample_rate_hz();
        let time_s = number as f64 * self.period_s;
        let half_frame_start = self.half_frame_start(number);
        let (first, last) = self.span(heads)?;
        let symbol = |symbol| self.numerology.symbol_start(symbol);
        let (start, end) = if self.continuous {
            (
                half_frame_start.floor(),
                self.half_frame_start(number + 1).floor(),
            )
        } else {
            let start = half_frame_start.floor();
            let margin = MARGIN as f64;
            (
                start + symbol(first) as f64 - margin,
                start + symbol(last + 4) as f64 + margin,
            )
        };
        self.burst.start = start as u64;
        self.burst.time_s = time_s + (start - half_frame_start) / rate_hz;
        for antenna in &mut self.sum {
            antenna.clear();
            antenna.resize((end - start) as usize, Complex64::ZERO);
        }
        self.burst.ssb_starts.clear();
        self.clocks.advance_to(number);
        for (index, (head, snr_db)) in heads.iter().zip(snrs_db).enumerate() {
            let start = self.add_ssb(index, number, half_frame_start, &state, head, *snr_db)?;
            self.burst.ssb_starts.push(start);
        }
        self.add_noise(number);
        self.convert();
        Ok(&self.burst)
    }

    /// Returns the sample index at which the half frame of burst number `number` begins. A clock
    /// that is too fast has counted more samples.
    fn half_frame_start(&self, number: u64) -> f64 {
        number as f64 * self.period_s * self.sample_rate_hz() * (1.0 + self.oscillator)
    }

    /// Returns the first symbols of the earliest and the latest SSB.
    fn span(&self, heads: &[HeadChannel]) -> Result<(usize, usize), Error> {
        let mut span: Option<(usize, usize)> = None;
        for head in heads {
            let symbol = self.case.start_symbol(head.head().ssb_index)?;
            let (first, last) = span.unwrap_or((symbol, symbol));
            span = Some((first.min(symbol), last.max(symbol)));
        }
        Ok(span.unwrap_or_default())
    }

    /// Adds the SSB of one radio head and returns its start as a sample index.
    fn add_ssb(
        &mut self,
        index: usize,
        number: u64,
        half_frame_start: f64,
        state: &impl Fn(f64) -> VehicleState,
        channel: &HeadChannel,
        snr_db: f64,
    ) -> Result<f64, Error> {
        let head = channel.head();
        let rate_hz = self.sample_rate_hz();
        let grid = ssb_grid(
            Pci::new(head.pci)?,
            self.lmax,
            &self.payload(number, head.ssb_index)?,
        )?;
        let first_symbol = self.case.start_symbol(head.ssb_index)?;
        let time_s = number as f64 * self.period_s;
        let sight = channel.array().line_of_sight(&state(time_s), head);
        let clock_s = self.clocks.delay_s(index) + self.faults.delay_s(index, time_s);
        let delay = (sight.distance_m / SPEED_OF_LIGHT_MPS + clock_s) * rate_hz;
        let clock_turn = -(self.ssb_freq_hz * clock_s).fract();
        let start = half_frame_start + self.numerology.symbol_start(first_symbol) as f64 + delay;
        let place = (start - self.burst.start as f64).floor();
        // Apply the fractional part of the delay as a phase ramp over the subcarriers.
        let fraction = start - self.burst.start as f64 - place;
        let cfo = self.cfo_hz(index) / rate_hz;
        let symbol_len = self.numerology.ssb_symbol_len();
        let elements = self.channel_gains.len();
        for (l, subcarriers) in grid.symbols().enumerate() {
            let phase = symbol_phase(self.numerology, first_symbol + l, self.ssb_freq_hz);
            let mut shifted = *subcarriers;
            for (k, element) in shifted.iter_mut().enumerate() {
                let cycles = -(k as f64 - CENTRE) * fraction / FFT_SIZE as f64;
                let turn = Complex64::cis(TAU * cycles);
                *element *= phase * Complex32::new(turn.re as f32, turn.im as f32);
            }
            let middle_s =
                time_s + (self.numerology.symbol_start(first_symbol + l) as f64) / rate_hz;
            let here = state(middle_s);
            let step_hz = self.numerology.spacing().hz();
            channel.response(&here, snr_db, step_hz, &mut self.response);
            if self.faults.any_at(middle_s) {
                for gains in self.response.chunks_exact_mut(elements) {
                    let array = channel.array();
                    self.faults.distort(index, head, array, &here, gains);
                }
            }
            let begin = place as usize + l * symbol_len;
            for (antenna, sum) in self.sum.iter_mut().enumerate() {
                let mut faded = shifted;
                for (element, gains) in faded.iter_mut().zip(self.response.chunks_exact(elements)) {
                    let gain = gains.get(antenna).copied().unwrap_or_default();
                    *element *= Complex32::new(gain.re as f32, gain.im as f32);
                }
                self.ofdm.modulate(&faded, &mut self.symbol)?;
                for (n, (to, sample)) in sum.iter_mut().skip(begin).zip(&self.symbol).enumerate() {
                    let at = self.burst.start as f64 + (begin + n) as f64;
                    let turn = Complex64::cis(TAU * ((cfo * at).fract() + clock_turn));
                    *to += turn * Complex64::new(sample.re.into(), sample.im.into());
                }
            }
        }
        Ok(start)
    }

    /// Returns the PBCH payload of a cell in burst number `number`.
    fn payload(&self, number: u64, ssb_index: u8) -> Result<BchPayload, Error> {
        let half_frames = (number as f64 * self.period_s / 5e-3).round() as u64;
        let sfn = (half_frames / 2 % 1024) as u16;
        BchPayload::new(Mib::default(), sfn, half_frames % 2 == 1, ssb_index)
    }

    /// Adds noise with unit power per resource element. An FFT of size 256 adds up 256 samples.
    fn add_noise(&mut self, number: u64) {
        // Each burst has its own stream position, so that its noise does not depend on which bursts
        // were received before.
        self.noise.set_stream(number);
        self.noise.set_word_pos(0);
        let sigma = FRAC_1_SQRT_2 / (FFT_SIZE as f64).sqrt();
        for (sum, gain) in self.sum.iter_mut().zip(&self.channel_gains) {
            for sample in sum {
                let re: f64 = self.noise.sample(StandardNormal);
                let im: f64 = self.noise.sample(StandardNormal);
                *sample = (*sample + Complex64::new(re, im) * sigma) * gain;
            }
        }
    }

    /// Applies gain control, quantisation and clipping.
    fn convert(&mut self) {
        // The strongest symbol determines the gain. A mean that includes the pauses would overdrive
        // the converter during an SSB.
        let symbol_len = self.numerology.ssb_symbol_len();
        let power = |symbol: &[Complex64]| {
            symbol.iter().map(Complex64::norm_sqr).sum::<f64>() / symbol.len() as f64
        };
        let strongest = self
            .sum
            .iter()
            .flat_map(|samples| samples.chunks_exact(symbol_len).map(power))
            .fold(f64::MIN_POSITIVE, f64::max);
        // I and Q each have half of the power.
        let rms = (0.5 * strongest).sqrt();
        let scale = 10f64.powf(-0.05 * ADC_HEADROOM_DB) / rms;
        let steps = f64::from(1u32 << (self.settings.adc_bits - 1));
        let convert =
            |part: f64| ((part * scale * steps).round().clamp(-steps, steps - 1.0) / steps) as f32;
        for (samples, sum) in self.burst.antennas.iter_mut().zip(&self.sum) {
            samples.clear();
            samples.extend(
                sum.iter()
                    .map(|x| Complex32::new(convert(x.re), convert(x.im))),
            );
        }
    }
}

fn case_of(site: &Site) -> (Case, SubcarrierSpacing) {
    if site.ssb.subcarrier_spacing_khz == 30.0 {
        (Case::C, SubcarrierSpacing::Khz30)
    } else {
        (Case::A, SubcarrierSpacing::Khz15)
    }
}
