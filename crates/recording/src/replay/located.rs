//! Located drive.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use onboard::AngleResult;
use onboard::localize::ekf::EstimatedConstants;
use onboard::localize::{PoseEstimate, UpdateResult};

use crate::range_log::LoggedRange;

/// Estimate at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedPose {
    /// Time, pose and covariance.
    pub estimate: PoseEstimate,
    /// Odometer speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s; `None` without a gyroscope.
    pub yaw_rate_radps: Option<f64>,
    /// Number of possible positions during the search for the first pose; the estimate is their
    /// mean. `None` after the search.
    pub searching: Option<usize>,
    /// Whether the angles contradict the pose, so that the pose is invalid.
    pub is_lost: bool,
    /// Estimated constants of the vehicle.
    pub constants: Option<EstimatedConstants>,
}

/// Range and its result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedRange {
    /// The range.
    pub range: LoggedRange,
    /// Verdict of the localizer.
    pub verdict: UpdateResult,
}

/// Remark on one item of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// Time in the drive in seconds.
    pub time_s: f64,
    /// Item, its defect, and whether it was omitted.
    pub text: String,
}

/// Sorts remarks by time. Remarks that differ in numbers only are merged into the first one.
pub fn gathered(mut remarks: Vec<Remark>) -> Vec<Remark> {
    remarks.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let is_of_number = |it: char| it.is_ascii_digit() || ".-".contains(it);
    let kind = |remark: &Remark| remark.text.replace(is_of_number, "");
    let mut first: BTreeMap<String, usize> = BTreeMap::new();
    let mut gathered: Vec<(Remark, usize)> = Vec::new();
    for remark in remarks {
        match first.entry(kind(&remark)) {
            Entry::Occupied(at) => {
                if let Some((_, more)) = gathered.get_mut(*at.get()) {
                    *more += 1;
                }
            }
            Entry::Vacant(at) => {
                at.insert(gathered.len());
                gathered.push((remark, 0));
            }
        }
    }
    let remarks = gathered.into_iter().map(|(mut remark, more)| {
        if more > 0 {
            remark.text = format!("{} (and {more} more like this)", remark.text);
        }
        remark
    });
    remarks.collect()
}

/// Located drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocatedDrive {
    /// One pose per odometry sample.
    pub poses: Vec<LocatedPose>,
    /// Results of the angles.
    pub aoa_estimates: Vec<AngleResult>,
    /// Results of the ranges.
    pub ranges: Vec<LocatedRange>,
    /// Smoothed poses from the first known one; empty unless requested.
    pub smoothed: Vec<LocatedPose>,
    /// Estimated constants of the vehicle at the end of the drive; `None` if the localizer
    /// estimates none.
    pub constants: Option<EstimatedConstants>,
    /// Remarks on single items of the input, in order of time.
    pub remarks: Vec<Remark>,
    /// Diagnoses of systematic errors in the input, which are also part of the remarks.
    pub diagnoses: Vec<Diagnosis>,
}

/// Diagnosis of a systematic error in the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Evidence, and recommended checks.
    pub text: String,
    /// Whether the error concerns the start only, which does not matter after the vehicle is found
    /// again.
    pub is_of_start: bool,
    /// Whether the drive was located well nevertheless.
    pub is_harmless: bool,
}

/// Maximum fraction of the time in state `lost` of a usable result.
const MAX_LOST: f64 = 0.2;

impl LocatedDrive {
    /// Whether the result is unusable: lost for more than 20 % of the time, lost at the end, or
    /// never found.
    pub fn is_lost_for_long(&self) -> bool {
        let ends_lost = self.poses.last().is_none_or(|last| last.is_lost);
        ends_lost || self.lost_share() > MAX_LOST
    }

    /// Returns the fraction of the time without a valid position: the angles contradict the pose,
    /// or the vehicle was never found.
    pub fn lost_share(&self) -> f64 {
        if self.poses.iter().all(|pose| pose.searching.is_some()) {
            return 1.0;
        }
        let lost = self.poses.iter().filter(|pose| pose.is_lost).count();
        lost as f64 / self.poses.len() as f64
    }

    /// Returns the diagnoses that affected the result.
    pub fn suspicions(&self) -> impl Iterator<Item = &Diagnosis> {
        self.diagnoses.iter().filter(|it| !it.is_harmless)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remarks_that_differ_in_numbers_are_merged() {
        let remark = |time_s: f64, text: &str| Remark {
            time_s,
            text: text.to_owned(),
        };
        let merged = gathered(vec![
            remark(3.0, "at 3 s: off by -0.5 m"),
            remark(2.0, "no angle"),
            remark(1.0, "at 1.25 s: off by 2 m"),
            remark(4.0, "at 4 s: off by 7 m"),
        ]);
        let texts: Vec<&str> = merged.iter().map(|it| it.text.as_str()).collect();
        let first = "at 1.25 s: off by 2 m (and 2 more like this)";
        assert_eq!(texts, [first, "no angle"]);
    }
}
