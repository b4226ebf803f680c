//! A drive that has been located.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use onboard::Execution;
use onboard::localize::PoseEstimate;
use onboard::localize::ekf::EstimatedConstants;

/// Where the vehicle was at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedPose {
    /// Time, pose and covariance.
    pub estimate: PoseEstimate,
    /// Odometer speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, where there is a gyroscope.
    pub yaw_rate_radps: Option<f64>,
    /// Number of places the vehicle may be at, while the first pose is searched for; the estimate
    /// is their mean.
    pub searching: Option<usize>,
    /// Whether the angles came from elsewhere than expected, so that the pose is not to be relied on.
    pub is_lost: bool,
    /// How far the array has come from its survey.
    pub constants: Option<EstimatedConstants>,
}

/// What is remarkable about one item of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// When in the drive it came, in seconds.
    pub time_s: f64,
    /// Which item, what is wrong with it, and whether it was left out.
    pub text: String,
}

/// Remarks in order of time; of those that differ in numbers only the first stands for all.
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
    let told = gathered.into_iter().map(|(mut remark, more)| {
        if more > 0 {
            remark.text = format!("{} (and {more} more like this)", remark.text);
        }
        remark
    });
    told.collect()
}

/// A located drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocatedDrive {
    /// One pose per odometry sample.
    pub poses: Vec<LocatedPose>,
    /// The angles and what became of them.
    pub executions: Vec<Execution>,
    /// The poses as seen from the end of the drive, from the first known one on, where asked for.
    pub smoothed: Vec<LocatedPose>,
    /// What the drive showed of the vehicle by its end, where the localizer looks for it.
    pub constants: Option<EstimatedConstants>,
    /// What was remarkable about single items of the input, in order of time.
    pub remarks: Vec<Remark>,
    /// What is wrong with the input as it was given; these are among the remarks too.
    pub diagnoses: Vec<Diagnosis>,
}

/// What is wrong with the input as it was given.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// What speaks for it, and what to check.
    pub text: String,
    /// Whether it is the start alone, which a vehicle that is found again has overcome.
    pub is_of_start: bool,
    /// Whether the drive was located well all the same.
    pub is_harmless: bool,
}

/// Share of the time that a drive may be lost without that being its result.
const MOST_LOST: f64 = 0.2;

impl LocatedDrive {
    /// Whether it never was where it could be relied on: lost for long, or at its end, or never found.
    pub fn is_lost_for_long(&self) -> bool {
        let ends_lost = self.poses.last().is_none_or(|last| last.is_lost);
        ends_lost || self.lost_share() > MOST_LOST
    }

    /// Share of the time without a position that can be relied on: angles came from elsewhere than
    /// expected, or the vehicle was never found.
    pub fn lost_share(&self) -> f64 {
        if self.poses.iter().all(|pose| pose.searching.is_some()) {
            return 1.0;
        }
        let lost = self.poses.iter().filter(|pose| pose.is_lost).count();
        lost as f64 / self.poses.len() as f64
    }

    /// What of the diagnoses did harm.
    pub fn suspicions(&self) -> impl Iterator<Item = &Diagnosis> {
        self.diagnoses.iter().filter(|it| !it.is_harmless)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remarks_that_differ_in_numbers_are_one() {
        let remark = |time_s: f64, text: &str| Remark {
            time_s,
            text: text.to_owned(),
        };
        let told = gathered(vec![
            remark(3.0, "at 3 s: off by -0.5 m"),
            remark(2.0, "no angle"),
            remark(1.0, "at 1.25 s: off by 2 m"),
            remark(4.0, "at 4 s: off by 7 m"),
        ]);
        let texts: Vec<&str> = told.iter().map(|it| it.text.as_str()).collect();
        let first = "at 1.25 s: off by 2 m (and 2 more like this)";
        assert_eq!(texts, [first, "no angle"]);
    }
}
