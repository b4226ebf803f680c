//! The receiver of however many antennas.

use num_complex::Complex32;

use super::config::ReceiverConfig;
use super::error::ReceiverError;
use super::heard::HeardSsb;
use super::stream::StreamReceiver;
use crate::dsp::tones::Tone;
use crate::search::SearchError;

/// A [`StreamReceiver`] whose number of antennas is not part of its type; places of SSBs are at the
/// input's rate. See the [module](super).
pub struct Receiver {
    config: ReceiverConfig,
    sample_rate_hz: f64,
    stream: Box<dyn Stream>,
}

/// A stream of any number of antennas.
trait Stream: Send {
    fn tracked(&self) -> usize;

    fn tones(&self) -> Vec<Tone>;

    fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&HeardSsb),
    ) -> Result<(), ReceiverError>;

    fn finish(&mut self, take: &mut dyn FnMut(&HeardSsb)) -> Result<(), ReceiverError>;
}

impl<const A: usize> Stream for StreamReceiver<A> {
    fn tracked(&self) -> usize {
        self.receiver().tracked()
    }

    fn tones(&self) -> Vec<Tone> {
        self.receiver().tones().collect()
    }

    fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&HeardSsb),
    ) -> Result<(), ReceiverError> {
        let ratio = self.input_per_output();
        self.push(antennas, &mut |mut seen| {
            take(&HeardSsb::new(&mut seen, ratio));
        })
    }

    fn finish(&mut self, take: &mut dyn FnMut(&HeardSsb)) -> Result<(), ReceiverError> {
        let ratio = self.input_per_output();
        self.finish(&mut |mut seen| {
            take(&HeardSsb::new(&mut seen, ratio));
        })?;
        self.reset();
        Ok(())
    }
}

impl Receiver {
    /// Plans transforms and buffers. `centre_frequency_hz` stands at 0 Hz in the samples.
    ///
    /// # Errors
    /// [`ReceiverError`] for a rate, band, number of antennas or setting that is not possible.
    pub fn new(
        config: ReceiverConfig,
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
    ) -> Result<Self, ReceiverError> {
        let told = config.clone();
        macro_rules! of {
            ($($antennas:literal)*) => {
                match told.search.antennas {
                    $($antennas => Box::new(StreamReceiver::<$antennas>::new(
                        told,
                        sample_rate_hz,
                        centre_frequency_hz,
                    )?),)*
                    other => return Err(SearchError::Antennas(other).into()),
                }
            };
        }
        let stream: Box<dyn Stream> = of!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        Ok(Self {
            config,
            sample_rate_hz,
            stream,
        })
    }

    /// The settings.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Samples per second and antenna.
    pub const fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Beams that are tracked now.
    pub fn tracked(&self) -> usize {
        self.stream.tracked()
    }

    /// DC offset and tones that are subtracted from what is received, the strongest first; frequencies from
    /// the SSB's centre.
    pub fn tones(&self) -> Vec<Tone> {
        self.stream.tones()
    }

    /// Takes the next samples of every antenna and shows `take` the SSBs that they complete, in order
    /// of time. What is searched is held back by 6 ms, what is tracked by the front end's block.
    ///
    /// # Errors
    /// [`ReceiverError::FrontEnd`] for another number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&HeardSsb),
    ) -> Result<(), ReceiverError> {
        self.stream.push(antennas, take)
    }

    /// Ends the stream: shows what is held back and forgets all cells.
    ///
    /// # Errors
    /// None that [`push`](Self::push) has not.
    pub fn finish(&mut self, take: &mut dyn FnMut(&HeardSsb)) -> Result<(), ReceiverError> {
        self.stream.finish(take)
    }
}
