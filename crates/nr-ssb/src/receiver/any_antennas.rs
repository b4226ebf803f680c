//! Receiver for any number of antennas.

use num_complex::Complex32;

use super::config::ReceiverConfig;
use super::error::ReceiverError;
use super::stream::StreamReceiver;
use super::tracked_ssb::TrackedSsb;
use crate::dsp::tones::Tone;
use crate::search::SearchError;

/// [`StreamReceiver`] for a number of antennas that is known at run time. Sample indices are at the
/// input's rate. See the [module](super).
pub struct Receiver {
    config: ReceiverConfig,
    sample_rate_hz: f64,
    stream: Box<dyn Stream>,
}

/// Stream of any number of antennas.
trait Stream: Send {
    fn tracked(&self) -> usize;

    fn tones(&self) -> Vec<Tone>;

    fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&TrackedSsb),
    ) -> Result<(), ReceiverError>;

    fn finish(&mut self, take: &mut dyn FnMut(&TrackedSsb)) -> Result<(), ReceiverError>;
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
        take: &mut dyn FnMut(&TrackedSsb),
    ) -> Result<(), ReceiverError> {
        let ratio = self.input_per_output();
        self.push(antennas, &mut |mut seen| {
            take(&TrackedSsb::new(&mut seen, ratio));
        })
    }

    fn finish(&mut self, take: &mut dyn FnMut(&TrackedSsb)) -> Result<(), ReceiverError> {
        let ratio = self.input_per_output();
        self.finish(&mut |mut seen| {
            take(&TrackedSsb::new(&mut seen, ratio));
        })?;
        self.reset();
        Ok(())
    }
}

impl Receiver {
    /// Creates FFT plans and buffers. `centre_frequency_hz` is the frequency at 0 Hz of the
    /// samples.
    ///
    /// # Errors
    /// [`ReceiverError`] for an invalid rate, band, number of antennas or setting.
    pub fn new(
        config: ReceiverConfig,
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
    ) -> Result<Self, ReceiverError> {
        let stream_config = config.clone();
        macro_rules! of {
            ($($antennas:literal)*) => {
                match stream_config.search.antennas {
                    $($antennas => Box::new(StreamReceiver::<$antennas>::new(
                        stream_config,
                        sample_rate_hz,
                        centre_frequency_hz,
                    )?),)*
                    other => return Err(SearchError::Antennas(other).into()),
                }
            };
        }
        #[cfg(not(test))]
        let stream: Box<dyn Stream> = of!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        // The unit tests use no receiver; its code is half of their build time.
        #[cfg(test)]
        let stream: Box<dyn Stream> = of!(1);
        Ok(Self {
            config,
            sample_rate_hz,
            stream,
        })
    }

    /// Returns the configuration.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Returns the sample rate per antenna.
    pub const fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Returns the number of tracked beams.
    pub fn tracked(&self) -> usize {
        self.stream.tracked()
    }

    /// Returns the DC offset and tones that are subtracted, the strongest first; frequencies are
    /// relative to the SSB's centre.
    pub fn tones(&self) -> Vec<Tone> {
        self.stream.tones()
    }

    /// Processes the next samples of every antenna and passes each completed SSB to `take`, in
    /// order of time. The latency is 6 ms for a search, and one block of the front end for
    /// tracking.
    ///
    /// # Errors
    /// [`ReceiverError::FrontEnd`] for a wrong number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(&TrackedSsb),
    ) -> Result<(), ReceiverError> {
        self.stream.push(antennas, take)
    }

    /// Ends the stream: passes on pending SSBs and removes all cells.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn finish(&mut self, take: &mut dyn FnMut(&TrackedSsb)) -> Result<(), ReceiverError> {
        self.stream.finish(take)
    }
}
