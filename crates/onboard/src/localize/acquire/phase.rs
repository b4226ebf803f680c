//! What the localizer is at, and what follows from the evidence: the state machine of its searches.

use std::cmp::Ordering;

/// What the localizer is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// It searches for the first pose.
    Searching,
    /// It tracks from a given pose in the plane, which the first angle begins to confirm.
    Given,
    /// It tracks.
    Tracking,
    /// It tracks; a search runs beside it.
    Confirming,
    /// It is lost; a search runs beside it, nearby or wide.
    Relocalizing { wide: bool },
}

/// What the next phase depends on.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a fact of its own; the phases are the state machine"
)]
pub(super) struct Evidence {
    /// Most radio heads' angles come from elsewhere than predicted.
    pub is_lost: bool,
    /// They come from where they are predicted.
    pub is_consistent: bool,
    /// They may come from elsewhere without the vehicle being lost.
    pub may_mislead: bool,
    /// The last search is long enough ago.
    pub is_rested: bool,
    /// Whether the angles are likelier at the best place searched, or at the filter's.
    pub search: Ordering,
    /// The search is of one place.
    pub is_found: bool,
    /// It is of a start that was given,
    pub is_of_start: bool,
    /// which is less probable than another start,
    pub doubts_start: bool,
    /// or of which the search has found the reported position.
    pub agrees: bool,
    /// No odometry since the search is reported: before anything moves the covariance covers both.
    pub is_just_reported: bool,
    /// Enough way was driven for a find; a long one.
    pub has_moved: bool,
    pub has_moved_far: bool,
    /// Angles were heard for long.
    pub is_patient: bool,
}

/// What is done between two phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Transition {
    Stay,
    /// A search begins.
    Begin(Phase),
    /// The search is reported.
    Report,
    /// Its find takes over.
    TakeOver,
    /// It ends, and the next may have to wait.
    End {
        rests: bool,
    },
}

impl Phase {
    pub fn next(self, by: &Evidence) -> Transition {
        let is_ahead = by.search == Ordering::Greater;
        // A diverged filter can become self-consistent: every other place must be less likely, too.
        let is_confirmed = by.search == Ordering::Less && by.is_consistent;
        match self {
            Self::Tracking => match (by.is_lost && by.is_rested, by.may_mislead) {
                (false, _) => Transition::Stay,
                (true, true) => Transition::Begin(Self::Confirming),
                (true, false) => Transition::Begin(Self::Relocalizing { wide: false }),
            },
            Self::Confirming => {
                let is_long = by.is_patient || (by.may_mislead && by.has_moved_far);
                let is_over = if by.is_of_start {
                    // Until one place is left another may yet be the right one; what takes long is not worth its cost,
                    // unless the angles speak for another.
                    by.search == Ordering::Less
                        && (by.is_found
                            || (!by.doubts_start && (by.is_patient || by.has_moved_far)))
                } else {
                    !is_ahead && (is_confirmed || is_long || by.is_found)
                };
                if (is_ahead && by.has_moved) || (by.is_lost && !by.may_mislead) {
                    Transition::Report
                } else if is_over {
                    Transition::End {
                        rests: by.may_mislead,
                    }
                } else {
                    Transition::Stay
                }
            }
            Self::Relocalizing { .. } if by.is_just_reported => Transition::Stay,
            // Filter and search may have come to the same position, whatever the angles were by which they did.
            Self::Relocalizing { .. } if by.agrees => Transition::End { rests: true },
            Self::Relocalizing { .. } if is_ahead && !by.has_moved => Transition::Stay,
            Self::Relocalizing { .. } if is_ahead && by.is_found => Transition::TakeOver,
            // A start that is in doubt has its search go on until either is certain.
            Self::Relocalizing { .. }
                if is_confirmed || (!is_ahead && by.is_found && !by.doubts_start) =>
            {
                Transition::End { rests: true }
            }
            Self::Relocalizing { wide: false } if by.is_patient => {
                Transition::Begin(Self::Relocalizing { wide: true })
            }
            Self::Searching | Self::Given | Self::Relocalizing { .. } => Transition::Stay,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing speaks for anything.
    const NONE: Evidence = Evidence {
        is_lost: false,
        is_consistent: false,
        may_mislead: false,
        is_rested: true,
        search: Ordering::Equal,
        is_found: false,
        is_of_start: false,
        doubts_start: false,
        agrees: false,
        is_just_reported: false,
        has_moved: false,
        has_moved_far: false,
        is_patient: false,
    };

    #[test]
    fn phases_follow_the_table() {
        use Ordering::{Greater, Less};
        use Phase::{Confirming, Given, Relocalizing, Searching, Tracking};
        use Transition::{Begin, End, Report, Stay, TakeOver};
        let (near, wide) = (Relocalizing { wide: false }, Relocalizing { wide: true });
        let (lost, found) = (true, true);
        let is = |change: fn(&mut Evidence)| {
            let mut evidence = NONE;
            change(&mut evidence);
            evidence
        };
        let ahead = |evidence: Evidence| Evidence {
            search: Greater,
            ..evidence
        };
        let behind = |evidence: Evidence| Evidence {
            search: Less,
            ..evidence
        };
        let is_lost = Evidence {
            is_lost: lost,
            ..NONE
        };
        let is_found = Evidence {
            is_found: found,
            ..NONE
        };
        let moved = is(|it| it.has_moved = true);
        for (phase, evidence, expected) in [
            (Searching, is_lost, Stay),
            (Given, is_lost, Stay),
            (Tracking, NONE, Stay),
            (Tracking, is_lost, Begin(near)),
            (
                Tracking,
                is(|it| (it.is_lost, it.is_rested) = (true, false)),
                Stay,
            ),
            (
                Tracking,
                is(|it| (it.is_lost, it.may_mislead) = (true, true)),
                Begin(Confirming),
            ),
            (Confirming, NONE, Stay),
            (Confirming, is_lost, Report),
            (
                Confirming,
                is(|it| (it.is_lost, it.may_mislead) = (true, true)),
                Stay,
            ),
            (Confirming, ahead(NONE), Stay),
            (Confirming, ahead(is_found), Stay),
            (Confirming, ahead(moved), Report),
            (Confirming, is_found, End { rests: false }),
            (Confirming, behind(NONE), Stay),
            (
                Confirming,
                behind(is(|it| (it.is_of_start, it.is_consistent) = (true, true))),
                Stay,
            ),
            (
                Confirming,
                behind(is(|it| (it.is_of_start, it.is_found) = (true, true))),
                End { rests: false },
            ),
            (
                Confirming,
                is(|it| (it.is_of_start, it.is_patient) = (true, true)),
                Stay,
            ),
            (
                Confirming,
                behind(is(|it| (it.is_of_start, it.is_patient) = (true, true))),
                End { rests: false },
            ),
            (
                Confirming,
                behind(is(|it| {
                    (it.is_of_start, it.is_patient, it.doubts_start) = (true, true, true);
                })),
                Stay,
            ),
            (
                Confirming,
                behind(is(|it| it.is_consistent = true)),
                End { rests: false },
            ),
            (
                Confirming,
                is(|it| it.is_patient = true),
                End { rests: false },
            ),
            (Confirming, is(|it| it.has_moved_far = true), Stay),
            (
                Confirming,
                is(|it| (it.has_moved_far, it.may_mislead) = (true, true)),
                End { rests: true },
            ),
            (near, NONE, Stay),
            (
                wide,
                ahead(is(|it| (it.agrees, it.doubts_start) = (true, true))),
                End { rests: true },
            ),
            (
                near,
                is(|it| (it.is_patient, it.is_just_reported) = (true, true)),
                Stay,
            ),
            (near, is(|it| it.is_patient = true), Begin(wide)),
            (near, ahead(is_found), Stay),
            (
                near,
                ahead(Evidence {
                    is_found: found,
                    ..moved
                }),
                TakeOver,
            ),
            (near, is_found, End { rests: true }),
            (
                near,
                behind(is(|it| it.is_consistent = true)),
                End { rests: true },
            ),
            (wide, is(|it| it.is_patient = true), Stay),
            (
                wide,
                ahead(Evidence {
                    is_found: found,
                    ..moved
                }),
                TakeOver,
            ),
            (wide, behind(NONE), Stay),
        ] {
            assert_eq!(phase.next(&evidence), expected, "{phase:?} by {evidence:?}");
        }
    }
}
