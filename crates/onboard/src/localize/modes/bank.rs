//! Static bank of filters: the nominal one, and one for each fault mode of the [table](super::table).
//!
//! Multiple-model estimation (MMAE: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to
//! Tracking and Navigation, 2001, 11.6) with modes that do not switch. Filters are not mixed (as in
//! IMM), so that a filter without a radio head has never used the angles of that radio head, as
//! solution separation requires.
//!
//! Unless the biases of angles are estimated, there is also a filter without each radio head, and
//! one without each pair. If one radio head is faulty (received by a reflection, moved, spoofed),
//! the filters without it are correct. The filters without pairs identify it: without the faulty
//! radio head, the others are consistent with each other; without another one, the fault remains.
//! After the exclusion of a radio head, filters without its angles replace the previous ones,
//! including those without one further radio head.

use super::likelihood::{LikelihoodRatio, MIN_ODDS, SPEED_JUMP, information_fraction};
use super::noise_scale::NoiseScale;
use super::subsets::{CLEARED, DETECTED, HeadTest, RECOVERY_S, Subsets, exclude};
use super::table::{Carry, Mode, TABLE};
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::{Ekf, PredictedMeasurement};
use crate::localize::output::{OdometryResult, SelectedHypothesis, UpdateReason, UpdateResult};
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::settings::{ERROR_CORRELATION_S, FaultProbability, IntegritySettings};

/// Maximum probability of the error exceeding the level under a fault, however rare the fault is.
const MAX_PROBABILITY_UNDER_FAULT: f64 = 0.49;

/// Duration of an error that begins with an event, until the angles refute it (s): a wrong start, or
/// slip. It counts once against the integrity risk.
pub(in crate::localize) const EVENT_S: f64 = 20.0;

/// Number of independent epochs for which the error of an event lasts.
pub(in crate::localize) const EVENT_EPOCHS: f64 = EVENT_S / ERROR_CORRELATION_S;

clone_in_place! {
    /// Filter of a mode, weighted by its posterior probability.
    #[derive(Debug)]
    pub(super) struct ModeFilter {
        mode: &'static Mode,
        prior: f64,
        pub(super) ekf: Ekf,
        /// Likelihood ratio to the nominal mode.
        pub(super) ratio: LikelihoodRatio,
        /// Whether the vehicle was at standstill since the filter started.
        at_rest: bool,
    }
}

impl ModeFilter {
    fn new(mode: &'static Mode, given: &Ekf, faults: &FaultProbability) -> Self {
        let mut ekf = given.nominal();
        (mode.alter)(&mut ekf);
        Self {
            mode,
            prior: (mode.prior)(given.config(), faults),
            ekf,
            ratio: LikelihoodRatio::NONE,
            at_rest: true,
        }
    }

    /// Returns the modes of the table that apply to a filter.
    fn all(given: &Ekf, faults: &FaultProbability) -> Vec<Self> {
        let nominal = given.nominal();
        let apply = |it: &&Mode| (it.applies)(&nominal, faults);
        let modes = TABLE.iter().filter(apply);
        modes.map(|mode| Self::new(mode, given, faults)).collect()
    }

    /// Returns the part of the mode that is retained when another filter becomes the nominal one.
    fn carry(
        &mut self,
        carry: Carry,
        given: &Ekf,
        excluded: Option<&RadioHead>,
        faults: &FaultProbability,
    ) {
        match carry {
            Carry::All => {}
            Carry::AllButHead => exclude(&mut self.ekf, excluded, true),
            Carry::IfNotAgainst if !self.ratio.is_against() => {}
            Carry::IfNotAgainst | Carry::Nothing => *self = Self::new(self.mode, given, faults),
        }
    }

    /// Returns the posterior odds of the mode relative to the nominal mode.
    fn odds(&self) -> f64 {
        self.ratio.odds(self.prior)
    }

    /// Returns the posterior odds of the mode at one independent epoch: a fault with an onset is one
    /// error for [`EVENT_S`].
    fn odds_per_epoch(&self) -> f64 {
        let epochs = if self.mode.onset.is_some() {
            EVENT_EPOCHS
        } else {
            1.0
        };
        self.ratio.odds(self.prior / epochs)
    }

    /// Predicts with an odometry sample, after the nominal filter. If the fault may begin at this
    /// sample, previous evidence against the mode is removed.
    fn odometry(&mut self, nominal: &Ekf, sample: &OdometrySample) {
        self.ekf.odometry(sample);
        let Some(onset) = self.mode.onset else {
            return;
        };
        let was_at_rest = std::mem::replace(&mut self.at_rest, sample.speed_mps == 0.0);
        let sets_off = was_at_rest && !self.at_rest;
        // The nominal position determines whether a bend explains the jump, because the angles may
        // contradict that of the mode.
        let bend_mps = nominal.bend_mps(sample.speed_mps, nominal.sample_interval_s());
        let jump = self.ekf.speed_jump();
        let jump = if jump * sample.speed_mps.abs() > bend_mps {
            jump
        } else {
            0.0
        };
        if !(sets_off || jump > 0.0) {
            return;
        }
        if self.ratio.is_against() {
            self.ekf.clone_from(nominal);
            onset(&mut self.ekf, if sets_off { 0.0 } else { jump });
        }
        let least = if jump > 0.0 { SPEED_JUMP } else { 0.0 };
        self.ratio.raise_to(least);
    }

    /// Updates with an angle, for which the nominal filter has the given prediction.
    fn update(
        &mut self,
        nominal: (&Ekf, &Result<PredictedMeasurement, UpdateReason>),
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) {
        let predicted = self.ekf.predict_measurement(head, measured);
        if measured.resolved {
            (self.ratio).update((&self.ekf, &predicted), nominal, information_fraction);
        }
        self.ekf.update_predicted(predicted, measured);
    }
}

clone_in_place! {
    /// Bank of filters.
    #[derive(Debug)]
    pub(in crate::localize) struct Bank {
        settings: IntegritySettings,
        pub(super) heads: Vec<RadioHead>,
        faulty: Vec<bool>,
        /// Time at which each radio head last contradicted the filter without it (s).
        disagreed_s: Vec<f64>,
        /// Time of the last unidentified fault (s).
        lost_s: f64,
        /// Filter of all fault-free radio heads with the nominal model.
        pub(super) nominal: Ekf,
        /// Hypothesis of the nominal filter: nominal, or the mode that has become nominal.
        base: SelectedHypothesis,
        pub(super) modes: Vec<ModeFilter>,
        noise: NoiseScale,
        /// Prior probability of a fault of each radio head.
        head_prior: f64,
        pub(super) subsets: Subsets,
        /// Whether angles were used, which test the radio heads instead of their ranges.
        pub(super) has_angles: bool,
    }
}

impl Bank {
    /// Creates the modes around a filter at time `now_s`, without evidence.
    pub fn new(given: &Ekf, heads: &[RadioHead], settings: &IntegritySettings, now_s: f64) -> Self {
        let modes = ModeFilter::all(given, &settings.fault_probability);
        Self::with(given, heads, settings, modes, now_s)
    }

    /// Creates a bank of one filter, without hypotheses and tests of radio heads.
    pub fn of_one(given: &Ekf, settings: &IntegritySettings) -> Self {
        Self::with(given, &[], settings, Vec::new(), f64::NEG_INFINITY)
    }

    fn with(
        given: &Ekf,
        heads: &[RadioHead],
        settings: &IntegritySettings,
        modes: Vec<ModeFilter>,
        now_s: f64,
    ) -> Self {
        let faults = &settings.fault_probability;
        let nominal = given.nominal();
        let count = heads.len();
        Self {
            settings: *settings,
            subsets: Subsets::new(count),
            has_angles: false,
            faulty: vec![false; count],
            disagreed_s: vec![f64::NEG_INFINITY; count],
            lost_s: now_s,
            heads: heads.to_vec(),
            modes,
            head_prior: faults.of_radio_head(nominal.is_with_bias()),
            nominal,
            base: SelectedHypothesis::Nominal,
            noise: NoiseScale::new(count),
        }
    }

    /// Returns the filter of all fault-free radio heads with the nominal model.
    pub const fn nominal(&self) -> &Ekf {
        &self.nominal
    }

    /// Keeps a journal of the nominal filter for smoothing.
    pub fn keep_journal(&mut self) {
        self.nominal.keep_journal();
    }

    /// Returns a bank that restarts at time `now_s` with the nominal model, from an uncertain pose
    /// at the selected filter.
    pub fn restarted(&self, position_std_m: f64, now_s: f64) -> Self {
        let start = (self.leader()).restarted(self.nominal.config(), position_std_m);
        let modes = ModeFilter::all(&start, &self.settings.fault_probability);
        Self {
            noise: self.noise.resumed(),
            ..Self::with(&start, &self.heads, &self.settings, modes, now_s)
        }
    }

    /// Changes the motion model of every filter, because the odometry is at fault or is right again. The hypotheses of the
    /// odometry and the filters without single radio heads restart: without odometry, some of these filters lose the
    /// vehicle, so that the protection level stayed high after the fault.
    pub fn change_motion(&mut self, change: impl Fn(&mut Ekf)) {
        change(&mut self.nominal);
        self.subsets = Subsets::new(self.heads.len());
        for it in &mut self.modes {
            if it.mode.is_of_odometry {
                let faults = &self.settings.fault_probability;
                *it = ModeFilter::new(it.mode, &self.nominal, faults);
            } else {
                change(&mut it.ekf);
            }
        }
    }

    /// Returns the bank with the selected mode as the nominal one, once it is certain and no radio
    /// head contradicts it. The common part of the likelihood ratios is subtracted from those of
    /// the other modes.
    pub fn rebased(&self, now_s: f64) -> Option<Self> {
        let leading = self.leading()?;
        let is_certain = (leading.mode.becomes_nominal_at).is_some_and(|it| leading.odds() > it);
        let is_quiet =
            self.faulty() == 0 && self.in_doubt(CLEARED) == 0 && self.quiet_s(now_s) > RECOVERY_S;
        (is_certain && is_quiet).then(|| self.about(leading))
    }

    fn about(&self, nominal: &ModeFilter) -> Self {
        let others = self.modes.iter().filter(|it| it.mode.id != nominal.mode.id);
        let mut modes: Vec<ModeFilter> = others.cloned().collect();
        for it in &mut modes {
            it.ratio = it.ratio.to(nominal.ratio);
            it.carry(
                it.mode.on_rebase,
                &nominal.ekf,
                None,
                &self.settings.fault_probability,
            );
        }
        Self {
            base: nominal.mode.id,
            noise: self.noise.resumed(),
            ..Self::with(
                &nominal.ekf,
                &self.heads,
                &self.settings,
                modes,
                self.lost_s,
            )
        }
    }

    /// Returns the bank with the selected mode as the nominal one.
    #[cfg(test)]
    pub(super) fn about_leading(&self) -> Option<Self> {
        self.leading().map(|it| self.about(it))
    }

    /// Returns the selected mode: the most probable one, if its odds to the nominal mode exceed a minimum. The odds of a
    /// fault to all other modes together must exceed it: with the freedom of a fault, its filter can follow multipath
    /// that another mode explains as well.
    pub(super) fn leading(&self) -> Option<&ModeFilter> {
        let most = (self.modes.iter()).max_by(|one, other| one.odds().total_cmp(&other.odds()))?;
        let others = if most.mode.is_fault {
            1.0 + self.modes.iter().map(ModeFilter::odds).sum::<f64>() - most.odds()
        } else {
            1.0
        };
        (most.odds() > MIN_ODDS * others).then_some(most)
    }

    /// Returns the selected filter: the nominal one, unless another mode is selected.
    pub fn leader(&self) -> &Ekf {
        self.leading().map_or(&self.nominal, |it| &it.ekf)
    }

    /// Returns the selected hypothesis: the selected mode, or that of the nominal filter.
    pub fn selected(&self) -> SelectedHypothesis {
        match (self.leading(), self.base) {
            (Some(leading), _) => leading.mode.id,
            (None, SelectedHypothesis::Nominal) if self.faulty() > 0 => {
                SelectedHypothesis::RadioHeadsExcluded
            }
            (None, base) => base,
        }
    }

    /// Returns odds and filter of a mode.
    #[cfg(test)]
    pub(super) fn mode(&self, id: SelectedHypothesis) -> Option<(f64, &Ekf)> {
        let found = self.modes.iter().find(|it| it.mode.id == id);
        found.map(|it| (it.odds(), &it.ekf))
    }

    /// Whether the selected mode explains contradicting angles without a lost vehicle.
    pub fn may_explain_contradictions(&self) -> bool {
        self.leading()
            .is_some_and(|it| it.mode.explains_contradictions)
    }

    /// Returns the hypotheses of the protection level, each with its probability and the filter
    /// that is correct under it: the modes with their posterior probabilities, and faults of one or
    /// two radio heads, weighted by the probability that no fault mode holds.
    pub fn hypotheses(&self) -> impl Iterator<Item = (f64, &Ekf)> + Clone {
        let odds = ModeFilter::odds_per_epoch;
        let total = 1.0 + self.modes.iter().map(odds).sum::<f64>();
        let faults = (self.modes.iter()).filter(|it| it.mode.is_fault);
        let fault_free = 1.0 - faults.map(odds).sum::<f64>() / total;
        let heads = (self.subsets.iter())
            .filter(|subset| !subset.without.iter().any(|&it| self.is_faulty(it)))
            .map(move |subset| {
                let both = if subset.is_of_one() {
                    1.0
                } else {
                    self.head_prior
                };
                (fault_free * self.head_prior * both, &subset.ekf)
            });
        self.mixture().chain(heads)
    }

    /// Returns the nominal mode and all other modes, each with its posterior probability and its
    /// filter.
    pub fn mixture(&self) -> impl Iterator<Item = (f64, &Ekf)> + Clone {
        let odds = ModeFilter::odds_per_epoch;
        let total = 1.0 + self.modes.iter().map(odds).sum::<f64>();
        let modes = (self.modes.iter()).map(move |it| (odds(it), &it.ekf));
        let odds = std::iter::once((1.0, &self.nominal)).chain(modes);
        odds.map(move |(odds, ekf)| (odds / total, ekf))
    }

    /// Returns the filters without a suspected radio head, one of which may replace the nominal
    /// filter soon.
    pub fn candidates(&self) -> impl Iterator<Item = &Ekf> {
        let in_doubt = |head: &usize| self.statistic(*head) > CLEARED;
        let in_doubt = self.sound().filter(in_doubt);
        in_doubt.filter_map(|head| Some(&self.subsets.get(head, head)?.ekf))
    }

    fn sound(&self) -> impl Iterator<Item = usize> + Clone {
        let faulty = self.faulty.iter().enumerate();
        faulty.filter_map(|(head, faulty)| (!faulty).then_some(head))
    }

    /// Returns the number of radio heads identified as faulty.
    pub fn faulty(&self) -> usize {
        self.faulty.iter().filter(|faulty| **faulty).count()
    }

    fn is_faulty(&self, head: usize) -> bool {
        self.faulty.get(head).is_some_and(|faulty| *faulty)
    }

    /// Returns the ratio of the angles' measured variance to the specified one.
    pub const fn noise_scale(&self) -> f64 {
        self.noise.ratio()
    }

    /// Returns the deviation of a radio head's angles from the filter without it, in standard
    /// deviations.
    fn statistic(&self, head: usize) -> f64 {
        let test = self.subsets.get(head, head).map(|subset| subset.test(head));
        let of_angles = test.map_or(0.0, |test| self.deviations(head, &test));
        let ranges = self
            .subsets
            .get(head, head)
            .map(|subset| subset.range_test(head));
        ranges.map_or(of_angles, |test| test.statistic().max(of_angles))
    }

    /// Returns the statistic of a radio head's test with the measured noise.
    fn deviations(&self, head: usize, test: &HeadTest) -> f64 {
        test.statistic() / self.noise.ratio_of(head).sqrt()
    }

    /// Returns the number of fault-free radio heads whose statistic exceeds a threshold.
    fn in_doubt(&self, threshold: f64) -> usize {
        self.sound()
            .filter(|&head| self.statistic(head) > threshold)
            .count()
    }

    /// Predicts every filter.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryResult {
        for subset in self.subsets.iter_mut() {
            subset.ekf.odometry(sample);
        }
        let verdict = self.nominal.odometry(sample);
        for it in &mut self.modes {
            it.odometry(&self.nominal, sample);
        }
        verdict
    }

    /// Updates with an angle: the test of its radio head, and every filter that uses the radio
    /// head. All hypotheses have the nominal correlation of errors, because a filter that follows
    /// the angles makes its own errors less correlated, and would be favoured by it.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateResult {
        let number = head.number_in(&self.heads);
        if !self.has_angles {
            self.has_angles = true;
            if !self.has_subsets() {
                self.subsets.clear();
            }
            for subset in self.subsets.iter_mut() {
                subset.range_tests = [HeadTest::default(); 2];
            }
        }
        if let Some(number) = number {
            self.update_subsets(number, head, measured);
        }
        let noise_scale = number.map_or(1.0, |number| self.noise.core_ratio_of(number));
        let predicted = self.nominal.predict_measurement(head, measured);
        for it in &mut self.modes {
            (it.mode.adapt)(&mut it.ekf, noise_scale);
            it.ekf.copy_error_correlation(&self.nominal);
            it.update((&self.nominal, &predicted), head, measured);
        }
        let most = (self.modes.iter()).fold(LikelihoodRatio::NONE, |most, it| most.max(it.ratio));
        for it in &mut self.modes {
            it.ratio.limit_by(most);
        }
        self.nominal.update_predicted(predicted, measured)
    }

    /// Whether there are filters without single radio heads. If the biases of angles are estimated, a mode represents
    /// their faults.
    const fn has_subsets(&self) -> bool {
        !(self.has_angles && self.nominal.is_with_bias())
    }

    /// Starts the filters without a radio head of which there is a measurement, if there are none.
    pub(super) fn watch(&mut self, number: usize) {
        if !self.has_subsets() {
            return;
        }
        let (faulty, noise) = (&self.faulty, &self.noise);
        let keeps = |head: usize, statistic: f64| {
            let is_faulty = faulty.get(head).is_some_and(|it| *it);
            is_faulty || statistic > CLEARED * noise.ratio_of(head).sqrt()
        };
        self.subsets
            .prepare(number, &self.heads, &self.nominal, keeps);
    }

    fn update_subsets(&mut self, number: usize, head: &RadioHead, measured: &AngleMeasurement) {
        self.watch(number);
        for subset in self.subsets.iter_mut() {
            if !subset.lacks(number) {
                subset.ekf.update(head, measured);
                continue;
            }
            let Some(seen) = subset.ekf.innovation_of_excluded(head, measured) else {
                continue;
            };
            if subset.without == [number; 2] {
                self.noise.see(number, &seen);
            }
            // At standstill, repeated measurements have identical scatter and count as one.
            if seen.innovation.measurement_variance < 1.0 {
                for (mine, test) in subset.without.iter().zip(&mut subset.tests) {
                    if *mine == number {
                        test.push(&seen.innovation);
                    }
                }
            }
        }
    }

    /// Whether there is an unidentified fault, or too many radio heads are faulty.
    pub fn is_lost(&self) -> bool {
        self.in_doubt(DETECTED) > 0 || self.most_heads_are_suspect()
    }

    /// Whether at least half of several radio heads are faulty or suspected.
    pub fn most_heads_are_suspect(&self) -> bool {
        let against = self.in_doubt(DETECTED) + self.faulty();
        against > 1 && 2 * against >= self.heads.len()
    }

    /// Returns the time since the last unidentified fault (s).
    pub fn quiet_s(&self, now_s: f64) -> f64 {
        now_s - self.lost_s
    }

    /// Excludes the faulty radio head if at least two others remain and are consistent without it.
    /// Readmits radio heads that have become consistent again.
    pub fn update_exclusions(&mut self, now_s: f64) {
        for head in 0..self.heads.len() {
            let disagrees = self.statistic(head) > CLEARED;
            let Some(disagreed_s) = self.disagreed_s.get_mut(head) else {
                return;
            };
            if disagrees {
                *disagreed_s = now_s;
            } else if now_s - *disagreed_s > RECOVERY_S && self.is_faulty(head) {
                self.readmit(head);
            }
        }
        // The exclusion of a fault-free radio head is itself a fault; its probability must not
        // exceed the risk under a fault.
        let head = self.settings.fault_probability.of_radio_head(false);
        let risk = (self.settings.risk_per_epoch() / head).min(MAX_PROBABILITY_UNDER_FAULT);
        let odds = -2.0 * risk.ln();
        if let Some(faulty_head) = self.faulty_head(odds) {
            self.exclude(faulty_head);
        }
        if self.is_lost() {
            self.lost_s = now_s;
        }
    }

    /// Returns the faulty radio head if it is sufficiently more probable than every other one: the
    /// maximum statistic of the others without it is lower, by at least `odds`, than without any
    /// other radio head. Both are twice the log-likelihood ratio.
    fn faulty_head(&self, odds: f64) -> Option<usize> {
        let watched = || {
            self.sound()
                .filter(|&head| self.subsets.get(head, head).is_some())
        };
        if watched().count() < 3 || self.in_doubt(DETECTED) == 0 {
            return None;
        }
        let (mut best, mut second) = ((usize::MAX, f64::INFINITY), f64::INFINITY);
        for head in watched() {
            let disagreement = self.disagreement_without(head);
            if disagreement < best.1 {
                second = best.1;
                best = (head, disagreement);
            } else {
                second = second.min(disagreement);
            }
        }
        let (head, least) = best;
        let precise = second * second - least * least > odds;
        (precise && least < DETECTED && self.statistic(head) > DETECTED).then_some(head)
    }

    /// Returns the maximum statistic of the fault-free radio heads if `left_out` is excluded.
    fn disagreement_without(&self, left_out: usize) -> f64 {
        (self.subsets.iter())
            .filter(|subset| !subset.is_of_one() && subset.lacks(left_out))
            .flat_map(|subset| {
                let tests = subset.tests.iter().zip(&subset.range_tests);
                subset.without.iter().zip(tests)
            })
            .filter(|(head, _)| **head != left_out && !self.is_faulty(**head))
            .map(|(head, (of_angles, of_ranges))| {
                self.deviations(*head, of_angles).max(of_ranges.statistic())
            })
            .fold(0.0, f64::max)
    }

    /// Excludes a radio head from all filters, including the effect of its previous angles.
    pub(super) fn exclude(&mut self, faulty_head: usize) {
        let Some(faulty) = self.faulty.get_mut(faulty_head) else {
            return;
        };
        *faulty = true;
        if let Some(without) = self.subsets.get(faulty_head, faulty_head) {
            self.nominal = without.ekf.clone();
        }
        let known = self.heads.get(faulty_head);
        for it in &mut self.modes {
            it.carry(
                it.mode.on_exclude,
                &self.nominal,
                known,
                &self.settings.fault_probability,
            );
        }
        self.subsets.exclude(faulty_head, &self.heads);
    }

    /// Readmits a radio head.
    fn readmit(&mut self, head: usize) {
        if let Some(faulty) = self.faulty.get_mut(head) {
            *faulty = false;
        }
        let known = self.heads.get(head);
        exclude(&mut self.nominal, known, false);
        for it in &mut self.modes {
            exclude(&mut it.ekf, known, false);
        }
        for subset in self.subsets.iter_mut().filter(|subset| !subset.lacks(head)) {
            exclude(&mut subset.ekf, known, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::Pose;
    use crate::localize::ekf::EkfConfig;
    use crate::localize::ekf::state::ALONG;
    use crate::localize::output::InitialPose;
    use crate::observation::MeasurementKind;
    use crate::settings::{Shipped, Site, TomlFile, Vehicle};

    /// Simulates one minute of driving past four radio heads, of which number 2 has a bias of
    /// `bias_rad`; `sinks` receive the measurements.
    fn drive(
        bias_rad: f64,
        mut sink: impl FnMut(Option<&OdometrySample>, usize, &AngleMeasurement),
    ) {
        let (site, _) = trip();
        let road = site.build_road().unwrap().unwrap();
        for step in 1..600 {
            let time_s = f64::from(step) * 0.1;
            let odometry = OdometrySample {
                time_s,
                distance_m: 4.0 * time_s,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            };
            let pose = road.pose(4.0 * time_s);
            for (number, head) in site.radio_heads.iter().enumerate() {
                let bearing_rad = pose.point().bearing_rad(RadioHead::from(head).position);
                let bias_rad = if number == 2 { bias_rad } else { 0.0 };
                let phase_rad = std::f64::consts::PI * (bearing_rad - pose.heading_rad).cos();
                let measured = AngleMeasurement {
                    kind: MeasurementKind::Angle,
                    time_s,
                    phase_rad: phase_rad + bias_rad,
                    phase_sigma_rad: 0.05,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                sink((number == 0).then_some(&odometry), number, &measured);
            }
        }
    }

    fn trip() -> (Site, Vehicle) {
        let site = Site::from_library("trip-4", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
        (site, vehicle)
    }

    fn ekf() -> (Ekf, Vec<RadioHead>) {
        let (site, vehicle) = trip();
        let mut config = EkfConfig::new(&site, &vehicle);
        // A filter that estimates biases has no test of single radio heads.
        config.multipath_bias_probability = 0.0;
        let heads = RadioHead::received_by(&site, &vehicle);
        let start = InitialPose {
            pose: Pose::default(),
            position_std_m: 0.1,
            heading_std_rad: 0.01,
        };
        let map = Arc::new(site.build_road().unwrap().unwrap());
        (Ekf::new(config, Some(map), &heads, &start), heads)
    }

    /// Returns the bank after the drive, and one filter without some radio heads.
    fn after(bias_rad: f64, without: &[usize]) -> (Bank, Ekf) {
        let (mut alone, heads) = ekf();
        for &head in without {
            alone.set_excluded(&heads[head], true);
        }
        let mut bank = Bank::new(&ekf().0, &heads, &IntegritySettings::default(), 0.0);
        drive(bias_rad, |odometry, head, measured| {
            if let Some(sample) = odometry {
                bank.odometry(sample);
                alone.odometry(sample);
            }
            bank.update(&heads[head], measured);
            alone.update(&heads[head], measured);
        });
        (bank, alone)
    }

    /// Returns the odds of slip after a jump of the speed by 0.1 m/s. The filters of all modes are
    /// 100 m before a bend, the nominal one `ahead_m` after them.
    fn slip_odds_after_a_jump(ahead_m: f64) -> f64 {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("carrier", &Shipped).unwrap();
        let heads = RadioHead::received_by(&site, &vehicle);
        let road = site.build_road().unwrap().unwrap();
        let is_bend = |along_m: &f64| road.curvature_per_m(*along_m).abs() > 0.05;
        let bend_m = (0..1000).map(f64::from).find(is_bend).unwrap();
        let start = InitialPose {
            pose: road.pose(bend_m - 100.0),
            position_std_m: 0.3,
            heading_std_rad: 0.01,
        };
        let config = EkfConfig::new(&site, &vehicle);
        let ekf = Ekf::new(config, Some(Arc::new(road)), &heads, &start);
        let mut bank = Bank::new(&ekf, &heads, &IntegritySettings::default(), 0.0);
        let mut belief = *bank.nominal.belief();
        belief.mean[ALONG] += ahead_m;
        bank.nominal.set_belief(&belief);
        for step in 0..10 {
            let speed_mps = if step == 9 { 4.1 } else { 4.0 };
            bank.odometry(&OdometrySample {
                time_s: 0.02 * f64::from(step),
                distance_m: 0.08 * f64::from(step),
                speed_mps,
                yaw_rate_radps: None,
            });
        }
        bank.mode(SelectedHypothesis::WheelSlip).unwrap().0
    }

    #[test]
    fn a_bend_at_the_nominal_position_explains_a_jump_of_the_speed() {
        assert!(slip_odds_after_a_jump(0.0) > 0.1);
        assert!(slip_odds_after_a_jump(100.0) < 2e-3);
    }

    #[test]
    fn slip_counts_once_for_the_duration_of_its_error() {
        let (ekf, heads) = ekf();
        let settings = IntegritySettings::default();
        let bank = Bank::new(&ekf, &heads, &settings, 0.0);
        let of_slip = (bank.modes.iter())
            .position(|it| it.mode.id == SelectedHypothesis::WheelSlip)
            .unwrap();
        let shares: Vec<f64> = bank.mixture().map(|(probability, _)| probability).collect();
        let odds = shares[of_slip + 1] / shares[0];
        assert!((odds * EVENT_EPOCHS / bank.modes[of_slip].prior - 1.0).abs() < 2e-3);
    }

    #[test]
    fn only_the_faulty_source_is_reported() {
        let odds = 9.2;
        let (sound, _) = after(0.0, &[]);
        assert_eq!(sound.faulty_head(odds), None);
        let (biased, _) = after(0.3, &[]);
        assert!(biased.is_lost());
        assert_eq!(biased.faulty_head(odds), Some(2));
    }

    #[test]
    fn the_replacing_filter_never_processed_the_excluded_radio_head() {
        let (mut bank, without) = after(0.3, &[2]);
        bank.exclude(2);
        assert_eq!(bank.nominal().belief(), without.belief());
        assert_eq!(bank.faulty(), 1);
        let (_, without_both) = after(0.3, &[1, 2]);
        let subset_belief = bank.subsets.get(1, 1).unwrap().ekf.belief();
        assert_eq!(subset_belief, without_both.belief());
        // The test of the excluded radio head continues, so that it can be readmitted.
        assert!(bank.statistic(2) > 5.5 && !bank.is_lost());
        bank.readmit(2);
        assert_eq!(bank.faulty(), 0);
        assert!(bank.nominal().belief() == without.belief());
    }
}
