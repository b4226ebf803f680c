//! State machine of the searches: phases, and transitions that follow from the evidence.

use std::cmp::Ordering;

/// Phase of the localizer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Searching for the initial pose.
    Searching,
    /// Tracking from a given pose without a road, which the first angle begins to confirm.
    Given,
    /// Tracking.
    Tracking,
    /// Tracking, with a search in parallel.
    Confirming,
    /// Lost, with a search in parallel, nearby or wide.
    Relocalizing { wide: bool },
}

/// Evidence for the next phase.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a fact of its own; the phases are the state machine"
)]
pub(super) struct Evidence {
    /// Whether the angles of most radio heads contradict the prediction.
    pub is_lost: bool,
    /// Whether the angles of most radio heads agree with the prediction.
    pub is_consistent: bool,
    /// Whether the selected hypothesis explains contradicting angles without a lost vehicle.
    pub may_explain_contradictions: bool,
    /// Whether the minimum time since the last search has elapsed.
    pub pause_has_elapsed: bool,
    /// Comparison of the likelihoods at the best position of the search and at the filter's
    /// position.
    pub search: Ordering,
    /// Whether the search has determined one position.
    pub is_found: bool,
    /// Whether the search verifies a given start.
    pub is_of_start: bool,
    /// Whether the filter of a given start and its search have reached one position.
    pub is_merged: bool,
    /// Whether another start is more probable than the given one.
    pub other_start_is_likelier: bool,
    /// Whether the search of a given start has found the reported position, and the nominal filter has it too. A fault
    /// of the odometry also explains a wrong start: its filter can reach the position, but remains uncertain.
    pub agrees: bool,
    /// Whether no odometry has arrived since the search was reported. The covariance then covers
    /// the position of the filter and that of the search.
    pub is_just_reported: bool,
    /// Whether the vehicle has driven the minimum distance for a result of the search.
    pub has_moved: bool,
    /// Whether the vehicle has driven a long distance since the start of the search.
    pub has_moved_far: bool,
    /// Whether angles were received for the maximum duration of a search.
    pub maximum_search_duration_reached: bool,
}

/// Action between two phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Transition {
    Stay,
    /// Start a search.
    Begin(Phase),
    /// Report the result of the search.
    Report,
    /// The result of the search replaces the filter.
    TakeOver,
    /// End the search; the next one may have to wait.
    End {
        rests: bool,
    },
}

impl Phase {
    pub fn next(self, by: &Evidence) -> Transition {
        let is_ahead = by.search == Ordering::Greater;
        // A diverged filter can be consistent with the angles, so that every other position must
        // also be less probable.
        let is_confirmed = by.search == Ordering::Less && by.is_consistent;
        match self {
            Self::Tracking => match (
                by.is_lost && by.pause_has_elapsed,
                by.may_explain_contradictions,
            ) {
                (false, _) => Transition::Stay,
                (true, true) => Transition::Begin(Self::Confirming),
                (true, false) => Transition::Begin(Self::Relocalizing { wide: false }),
            },
            Self::Confirming => {
                let is_long = by.maximum_search_duration_reached
                    || (by.may_explain_contradictions && by.has_moved_far);
                let is_over = if by.is_of_start {
                    // Until one position remains, another one may still be correct. A long search
                    // ends, unless the angles favour another position.
                    by.search == Ordering::Less
                        && (by.agrees
                            || (!by.other_start_is_likelier
                                && (by.maximum_search_duration_reached || by.has_moved_far)))
                } else {
                    !is_ahead && (is_confirmed || is_long || by.is_found)
                };
                // Given start and search agree, so that a solution elsewhere has diverged.
                if by.is_merged && by.is_found && by.has_moved && !by.agrees {
                    Transition::TakeOver
                } else if (is_ahead && by.has_moved)
                    || (by.is_lost && !by.may_explain_contradictions)
                {
                    Transition::Report
                } else if is_over {
                    Transition::End {
                        rests: by.may_explain_contradictions,
                    }
                } else {
                    Transition::Stay
                }
            }
            Self::Relocalizing { .. } if by.is_just_reported => Transition::Stay,
            // Filter and search may have reached the same position with different angles.
            Self::Relocalizing { .. } if by.agrees => Transition::End { rests: true },
            Self::Relocalizing { .. } if is_ahead && !by.has_moved => Transition::Stay,
            Self::Relocalizing { .. } if is_ahead && by.is_found => Transition::TakeOver,
            Self::Relocalizing { .. } if by.is_merged && by.is_found => Transition::TakeOver,
            // The search that verifies a doubtful start continues until the given start or another
            // one is confirmed.
            Self::Relocalizing { .. }
                if is_confirmed || (!is_ahead && by.is_found && !by.is_of_start) =>
            {
                Transition::End { rests: true }
            }
            Self::Relocalizing { wide: false } if by.maximum_search_duration_reached => {
                Transition::Begin(Self::Relocalizing { wide: true })
            }
            Self::Searching | Self::Given | Self::Relocalizing { .. } => Transition::Stay,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No evidence.
    const NONE: Evidence = Evidence {
        is_lost: false,
        is_consistent: false,
        may_explain_contradictions: false,
        pause_has_elapsed: true,
        search: Ordering::Equal,
        is_found: false,
        is_of_start: false,
        is_merged: false,
        other_start_is_likelier: false,
        agrees: false,
        is_just_reported: false,
        has_moved: false,
        has_moved_far: false,
        maximum_search_duration_reached: false,
    };

    #[test]
    fn phase_transitions_equal_the_table() {
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
        let merged = Evidence {
            is_of_start: true,
            is_merged: true,
            is_found: found,
            ..moved
        };
        for (phase, evidence, expected) in [
            (Searching, is_lost, Stay),
            (Given, is_lost, Stay),
            (Tracking, NONE, Stay),
            (Tracking, is_lost, Begin(near)),
            (
                Tracking,
                is(|it| (it.is_lost, it.pause_has_elapsed) = (true, false)),
                Stay,
            ),
            (
                Tracking,
                is(|it| (it.is_lost, it.may_explain_contradictions) = (true, true)),
                Begin(Confirming),
            ),
            (Confirming, NONE, Stay),
            (Confirming, is_lost, Report),
            (
                Confirming,
                is(|it| (it.is_lost, it.may_explain_contradictions) = (true, true)),
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
                behind(is(|it| (it.is_of_start, it.agrees) = (true, true))),
                End { rests: false },
            ),
            (
                Confirming,
                behind(is(|it| (it.is_of_start, it.is_found) = (true, true))),
                Stay,
            ),
            (Confirming, merged, TakeOver),
            (
                Confirming,
                Evidence {
                    agrees: true,
                    ..behind(merged)
                },
                End { rests: false },
            ),
            (wide, merged, TakeOver),
            (
                wide,
                is(|it| (it.is_of_start, it.is_found) = (true, true)),
                Stay,
            ),
            (
                Confirming,
                is(|it| (it.is_of_start, it.maximum_search_duration_reached) = (true, true)),
                Stay,
            ),
            (
                Confirming,
                behind(is(|it| {
                    (it.is_of_start, it.maximum_search_duration_reached) = (true, true);
                })),
                End { rests: false },
            ),
            (
                Confirming,
                behind(is(|it| {
                    (
                        it.is_of_start,
                        it.maximum_search_duration_reached,
                        it.other_start_is_likelier,
                    ) = (true, true, true);
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
                is(|it| it.maximum_search_duration_reached = true),
                End { rests: false },
            ),
            (Confirming, is(|it| it.has_moved_far = true), Stay),
            (
                Confirming,
                is(|it| (it.has_moved_far, it.may_explain_contradictions) = (true, true)),
                End { rests: true },
            ),
            (near, NONE, Stay),
            (
                wide,
                ahead(is(|it| {
                    (it.agrees, it.other_start_is_likelier) = (true, true);
                })),
                End { rests: true },
            ),
            (
                near,
                is(|it| (it.maximum_search_duration_reached, it.is_just_reported) = (true, true)),
                Stay,
            ),
            (
                near,
                is(|it| it.maximum_search_duration_reached = true),
                Begin(wide),
            ),
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
            (
                wide,
                is(|it| it.maximum_search_duration_reached = true),
                Stay,
            ),
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
