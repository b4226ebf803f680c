//! Out-of-sequence measurements: replay of late angles and ranges.
//!
//! On a vehicle, the angle of an SSB always arrives after newer odometry. Copies of the localizer
//! are therefore stored at intervals, with all subsequent inputs. For a late angle, the newest copy
//! before it is restored, and the subsequent inputs are repeated, once for all angles of a burst.
//! Ranges are processed alike. The result is bit-identical to that of measurements in order. After
//! initialisation nothing is allocated.

use std::collections::VecDeque;

use super::localizer::Localizer;
use super::output::{OdometryResult, UpdateReason, UpdateResult};
use crate::BoxError;
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Guaranteed maximum delay of an angle, in seconds.
pub const HISTORY_S: f64 = 0.5;

/// Number of stored copies.
const COPIES: usize = 8;

/// Time between two copies in seconds: the oldest one is at least [`HISTORY_S`] old.
const SPACING_S: f64 = HISTORY_S / (COPIES - 2) as f64;

/// Usual number of stored inputs, for which memory is allocated at the start.
const USUAL_EVENTS: usize = 256;

/// Maximum number of stored inputs. Above it, the oldest copies are removed early.
const MAX_EVENTS: usize = 4096;

/// Localizer with replay of late angles.
pub struct OutOfSequenceBuffer {
    localizer: Box<dyn Localizer>,
    /// Inputs since the oldest copy, in order of their times.
    events: VecDeque<Event>,
    /// Copies in order of time; those beyond `copies` are unused and kept for reuse.
    kept: [Checkpoint; COPIES],
    copies: usize,
    /// Memory that is exchanged with the localizer's in a replay, so that it can be reused.
    spare: Option<Box<dyn Localizer>>,
    /// Time of the newest odometry (s).
    now_s: f64,
    /// Time of the newest input (s).
    newest_s: f64,
}

/// Measurement of a radio head, and the result of its update.
#[derive(Debug, Clone, Copy)]
pub struct Update<M> {
    /// Index of the measurement in the results of its burst.
    pub number: usize,
    /// Radio head of the measurement.
    pub head: RadioHead,
    /// Measured value.
    pub measured: M,
    /// Result of the update.
    pub verdict: UpdateResult,
}

/// Angle, and the result of its update.
pub type AngleUpdate = Update<AngleMeasurement>;

/// Range, range rate or carrier phase, and the result of its update.
pub type RangeUpdate = Update<RangeMeasurement>;

/// Measurement of a radio head.
#[derive(Debug, Clone, Copy)]
pub enum Measurement {
    /// Angle.
    Angle(AngleMeasurement),
    /// Range, range rate or carrier phase.
    Range(RangeMeasurement),
}

impl From<AngleMeasurement> for Measurement {
    fn from(measured: AngleMeasurement) -> Self {
        Self::Angle(measured)
    }
}

impl From<RangeMeasurement> for Measurement {
    fn from(measured: RangeMeasurement) -> Self {
        Self::Range(measured)
    }
}

impl Measurement {
    const fn time_s(&self) -> f64 {
        match self {
            Self::Angle(measured) => measured.time_s,
            Self::Range(measured) => measured.time_s,
        }
    }
}

impl<M: Copy + Into<Measurement>> Update<M> {
    fn time_s(&self) -> f64 {
        self.measured.into().time_s()
    }

    /// Returns the input, with its index in its burst while the burst is processed.
    fn event(&self, number: Option<usize>) -> Event {
        Event::Measurement(self.head, self.measured.into(), number)
    }
}

#[derive(Clone, Copy)]
enum Event {
    Odometry(OdometrySample),
    /// Measurement, and its index in its burst while the burst is processed.
    Measurement(RadioHead, Measurement, Option<usize>),
}

impl Event {
    const fn time_s(&self) -> f64 {
        match self {
            Self::Odometry(sample) => sample.time_s,
            Self::Measurement(_, measured, _) => measured.time_s(),
        }
    }
}

#[derive(Default)]
struct Checkpoint {
    localizer: Option<Box<dyn Localizer>>,
    time_s: f64,
    /// Number of the `events` that the copy contains.
    events: usize,
}

impl OutOfSequenceBuffer {
    /// Creates a history with this localizer.
    pub fn new(localizer: Box<dyn Localizer>) -> Self {
        let mut made = Self {
            localizer,
            events: VecDeque::with_capacity(USUAL_EVENTS),
            kept: Default::default(),
            copies: 0,
            spare: None,
            now_s: f64::NEG_INFINITY,
            newest_s: f64::NEG_INFINITY,
        };
        made.keep_copy(f64::NEG_INFINITY, 0);
        made
    }

    /// Returns the current localizer.
    pub fn localizer(&self) -> &dyn Localizer {
        self.localizer.as_ref()
    }

    /// Keeps a journal for smoothing from now on, and no copies: late angles are rejected.
    pub fn keep_journal(&mut self) {
        self.localizer.keep_journal();
        self.copies = 0;
    }

    /// Predicts with an odometry sample that is later than the previous one.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        let verdict = self.localizer.odometry(sample)?;
        self.store_event(Event::Odometry(*sample));
        Ok(verdict)
    }

    /// Updates with the measurements of a burst at their own times, and stores the result of each.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn update<M: Copy + Into<Measurement>>(
        &mut self,
        burst: &mut [Update<M>],
    ) -> Result<(), BoxError> {
        for number in 0..burst.len() {
            let (_, rest) = burst.split_at_mut(number);
            let Some(update) = rest.first_mut() else {
                break;
            };
            // Between the same two odometry samples, the order of angles does not matter. The
            // localizer rejects a time that is NaN.
            let time_s = update.time_s();
            if time_s < self.now_s || (self.copies > 0 && time_s < self.newest_s) {
                return self.update_late(rest);
            }
            let event = update.event(None);
            if let Some(verdict) = self.process(&event)? {
                update.verdict = verdict;
            }
            self.store_event(event);
        }
        Ok(())
    }

    /// Updates with a range at its own time.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn update_range(
        &mut self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        let mut update = [RangeUpdate {
            number: 0,
            head: *head,
            measured: *measured,
            verdict: UpdateResult::unused(UpdateReason::Unusable),
        }];
        if measured.time_s.is_finite() {
            self.update(&mut update)?;
        }
        let [RangeUpdate { verdict, .. }] = update;
        Ok(verdict)
    }

    /// Passes an input to the localizer and returns the result of a measurement.
    fn process(&mut self, event: &Event) -> Result<Option<UpdateResult>, BoxError> {
        match event {
            Event::Odometry(sample) => self.localizer.odometry(sample).map(|_| None),
            Event::Measurement(head, Measurement::Angle(measured), _) => {
                self.localizer.update(head, measured).map(Some)
            }
            Event::Measurement(head, Measurement::Range(measured), _) => {
                self.localizer.update_range(head, measured).map(Some)
            }
        }
    }

    fn update_late<M: Copy + Into<Measurement>>(
        &mut self,
        burst: &mut [Update<M>],
    ) -> Result<(), BoxError> {
        for update in &mut *burst {
            let reason = if update.time_s().is_nan() {
                UpdateReason::Unusable
            } else {
                UpdateReason::TooLate
            };
            update.verdict = UpdateResult::unused(reason);
        }
        let copies = self.kept.iter().take(self.copies);
        let oldest_s = (copies.clone().next()).map_or(f64::INFINITY, |copy| copy.time_s);
        let in_memory = |update: &&Update<M>| update.time_s() >= oldest_s;
        let times_s = burst.iter().filter(in_memory).map(Update::time_s);
        let first_s = times_s.fold(f64::INFINITY, f64::min);
        let from = copies.take_while(|copy| copy.time_s <= first_s).count();
        let Some(copy) = from.checked_sub(1).and_then(|from| self.kept.get(from)) else {
            return Ok(());
        };
        let taken_in = copy.events;
        if let Some(saved) = &copy.localizer {
            saved.copy_to(&mut self.spare);
        }
        if let Some(spare) = &mut self.spare {
            std::mem::swap(spare, &mut self.localizer);
        }
        for (number, update) in burst.iter().enumerate().filter(|(_, it)| in_memory(it)) {
            // In the order of times, the input precedes the first later one.
            let is_later = |event: &Event| event.time_s() > update.time_s();
            let place = (self.events.iter().skip(taken_in))
                .position(is_later)
                .map_or(self.events.len(), |place| taken_in + place);
            self.events.insert(place, update.event(Some(number)));
        }
        // Copies of the localizer from after the input's time do not contain the input: they are discarded.
        self.copies = from;
        for index in taken_in..self.events.len() {
            let Some(event) = self.events.get_mut(index) else {
                break;
            };
            let waits = match event {
                Event::Measurement(_, _, number) => number.take(),
                Event::Odometry(_) => None,
            };
            let event = *event;
            let verdict = self.process(&event)?;
            if let Event::Odometry(sample) = event {
                self.keep_copy_if_due(sample.time_s, index + 1);
            }
            let update = waits.and_then(|number| burst.get_mut(number));
            if let (Some(update), Some(verdict)) = (update, verdict) {
                update.verdict = verdict;
            }
        }
        self.forget();
        Ok(())
    }

    fn store_event(&mut self, event: Event) {
        if let Event::Odometry(sample) = event {
            self.now_s = sample.time_s;
        }
        self.newest_s = self.newest_s.max(event.time_s());
        if self.copies == 0 {
            return; // nothing to go back to
        }
        self.events.push_back(event);
        if let Event::Odometry(sample) = event {
            self.keep_copy_if_due(sample.time_s, self.events.len());
        }
        self.forget();
    }

    fn keep_copy_if_due(&mut self, time_s: f64, events: usize) {
        let last = self
            .copies
            .checked_sub(1)
            .and_then(|last| self.kept.get(last));
        if last.is_none_or(|last| time_s - last.time_s < SPACING_S) {
            return;
        }
        // In a replay, copies are stored at the same times as before, so that their number does not
        // exceed the capacity.
        if self.copies == COPIES && events == self.events.len() {
            self.drop_oldest();
        }
        self.keep_copy(time_s, events.min(self.events.len()));
    }

    fn keep_copy(&mut self, time_s: f64, events: usize) {
        if let Some(copy) = self.kept.get_mut(self.copies)
            && self.localizer.copy_to(&mut copy.localizer)
        {
            (copy.time_s, copy.events) = (time_s, events);
            self.copies += 1;
        }
    }

    /// Removes the oldest copies if too many inputs are stored.
    fn forget(&mut self) {
        while self.events.len() > MAX_EVENTS && self.copies > 0 {
            if self.copies == 1 {
                // More inputs at one time than can be stored: the history restarts here.
                self.events.clear();
                self.copies = 0;
                self.keep_copy(self.newest_s, 0);
                return;
            }
            self.drop_oldest();
        }
    }

    fn drop_oldest(&mut self) {
        self.kept.rotate_left(1);
        self.copies -= 1;
        let gone = self.kept.first().map_or(0, |oldest| oldest.events);
        self.events.drain(..gone.min(self.events.len()));
        for copy in self.kept.iter_mut().take(self.copies) {
            copy.events -= gone;
        }
    }
}
