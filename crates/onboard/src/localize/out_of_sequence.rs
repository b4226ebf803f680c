//! Going back in time for angles that come late.
//!
//! An SSB has its own time, and arrives after newer odometry: on a vehicle always. So copies of the
//! localizer are kept at intervals, with everything it was given since. A late angle is put where it
//! belongs: the newest copy from before it is taken, and what came after is given to it again, once
//! for all angles of a burst. The result is that of angles in time, to the last bit. Once warm nothing
//! is allocated.

use std::collections::VecDeque;

use super::localizer::Localizer;
use super::output::{OdometryVerdict, UpdateReason, UpdateVerdict};
use crate::BoxError;
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// How late an angle may come, at least, in seconds.
pub const HISTORY_S: f64 = 0.5;

/// Copies kept.
const COPIES: usize = 8;

/// Time between two copies in seconds: the oldest of them is at least [`HISTORY_S`] old.
const SPACING_S: f64 = HISTORY_S / (COPIES - 2) as f64;

/// What is usually remembered of what came in ...
const USUAL_EVENTS: usize = 256;

/// ... and the most; with more, the oldest copies are given up early.
const MOST_EVENTS: usize = 4096;

/// A localizer that can go back in time.
pub struct History {
    localizer: Box<dyn Localizer>,
    /// What came in since the oldest copy, as if none had been late.
    events: VecDeque<Event>,
    /// Copies in order of time; the ones beyond `copies` are there for reuse.
    kept: [Checkpoint; COPIES],
    copies: usize,
    /// What the localizer is swapped with when it goes back, so that its memory serves again.
    spare: Option<Box<dyn Localizer>>,
    /// Time of the newest odometry ...
    now_s: f64,
    /// ... and of the newest of all that came in.
    newest_s: f64,
}

/// An angle, and what the localizer did with it.
#[derive(Debug, Clone, Copy)]
pub struct AngleUpdate {
    /// Number by which its giver knows it.
    pub number: usize,
    /// The radio head it is to.
    pub head: RadioHead,
    /// The angle.
    pub measured: AngleMeasurement,
    /// What the localizer did with it.
    pub verdict: UpdateVerdict,
}

#[derive(Clone, Copy)]
enum Event {
    Odometry(OdometrySample),
    /// An angle, and its number in its burst as long as that waits to hear what became of it.
    Angle(RadioHead, AngleMeasurement, Option<usize>),
}

impl Event {
    const fn time_s(&self) -> f64 {
        match self {
            Self::Odometry(sample) => sample.time_s,
            Self::Angle(_, measured, _) => measured.time_s,
        }
    }
}

#[derive(Default)]
struct Checkpoint {
    localizer: Option<Box<dyn Localizer>>,
    time_s: f64,
    /// Number of the `events` that it has taken in.
    events: usize,
}

impl History {
    /// A history that begins with this localizer.
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

    /// The localizer as it is now.
    pub fn localizer(&self) -> &dyn Localizer {
        self.localizer.as_ref()
    }

    /// Keeps from now on what smoothing takes, and no copies any more: a late angle is refused.
    pub fn keep_journal(&mut self) {
        self.localizer.keep_journal();
        self.copies = 0;
    }

    /// Moves on by an odometry sample, later than the one before.
    ///
    /// # Errors
    /// Whatever the localizer fails with.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        let verdict = self.localizer.odometry(sample)?;
        self.remember(Event::Odometry(*sample));
        Ok(verdict)
    }

    /// Takes in the angles of a burst, wherever in time they belong, and writes down what it did with
    /// each.
    ///
    /// # Errors
    /// Whatever the localizer fails with.
    pub fn update(&mut self, burst: &mut [AngleUpdate]) -> Result<(), BoxError> {
        for number in 0..burst.len() {
            let (_, rest) = burst.split_at_mut(number);
            let Some(update) = rest.first_mut() else {
                break;
            };
            // Between the same odometry samples angles can be taken in any order, if need be. A time
            // that is no number is for the localizer to refuse.
            let time_s = update.measured.time_s;
            if time_s < self.now_s || (self.copies > 0 && time_s < self.newest_s) {
                return self.update_late(rest);
            }
            update.verdict = self.localizer.update(&update.head, &update.measured)?;
            self.remember(Event::Angle(update.head, update.measured, None));
        }
        Ok(())
    }

    fn update_late(&mut self, burst: &mut [AngleUpdate]) -> Result<(), BoxError> {
        for update in &mut *burst {
            let reason = if update.measured.time_s.is_nan() {
                UpdateReason::Unusable
            } else {
                UpdateReason::TooLate
            };
            update.verdict = UpdateVerdict::unused(reason);
        }
        let copies = self.kept.iter().take(self.copies);
        let oldest_s = (copies.clone().next()).map_or(f64::INFINITY, |copy| copy.time_s);
        let in_memory = |update: &&AngleUpdate| update.measured.time_s >= oldest_s;
        let times_s = burst.iter().filter(in_memory).map(|it| it.measured.time_s);
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
            // In time it would have come before the first that is later.
            let is_later = |event: &Event| event.time_s() > update.measured.time_s;
            let place = (self.events.iter().skip(taken_in))
                .position(is_later)
                .map_or(self.events.len(), |place| taken_in + place);
            let event = Event::Angle(update.head, update.measured, Some(number));
            self.events.insert(place, event);
        }
        // Copies made after it have not heard it.
        self.copies = from;
        for index in taken_in..self.events.len() {
            match self.events.get_mut(index) {
                Some(Event::Odometry(sample)) => {
                    let sample = *sample;
                    self.localizer.odometry(&sample)?;
                    self.keep_copy_if_due(sample.time_s, index + 1);
                }
                Some(Event::Angle(head, measured, waits)) => {
                    let verdict = self.localizer.update(head, measured)?;
                    if let Some(update) = waits.take().and_then(|number| burst.get_mut(number)) {
                        update.verdict = verdict;
                    }
                }
                None => {}
            }
        }
        self.forget();
        Ok(())
    }

    fn remember(&mut self, event: Event) {
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
        // Going back, copies come at the times they came at before: there is room for them.
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

    /// Gives up the oldest copies where too much has come in since.
    fn forget(&mut self) {
        while self.events.len() > MOST_EVENTS && self.copies > 0 {
            if self.copies == 1 {
                // A single moment holds more than can be remembered: begin anew from here.
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
