//! Monitor of the angle messages: unknown radio heads, two radio heads with equal SSBs, and missing
//! messages.

use std::time::{Duration, Instant};

use onboard::geometry::wrap_angle;
use onboard::live::AngleObservation;
use onboard::observation::BURST_S;

use crate::inbox::Level;

/// Time without an angle message after which angles are reported as missing, in seconds: 50 bursts
/// of 20 ms, six of 160 ms.
const ABSENT_S: f64 = 1.0;
/// Maximum number of reported radio heads, which limits the memory.
const MAX_UNKNOWN: usize = 64;

/// Minimum difference of two angles of one SSB that is a contradiction, in standard deviations; the
/// probability for Gaussian errors is 6e-7.
const CONTRADICTION_SIGMAS: f64 = 5.0;
/// Minimum number of contradictions minus SSBs without one that is reported: within 20 SSBs even if
/// only every second one is received.
const CONTRADICTIONS: u32 = 5;

/// Last angle of an SSB, and counter of contradictions within a burst.
#[derive(Debug, Clone, Copy)]
struct Sent {
    head: (u16, u8),
    time_s: f64,
    phase_rad: f64,
    sigma_rad: f64,
    contradictions: u32,
    is_reported: bool,
}

/// State of the monitor.
#[derive(Debug, Default)]
pub struct AngleWatch {
    unknown: Vec<(u16, u8)>,
    sent: Vec<Sent>,
    last: Option<Instant>,
    is_absent: bool,
}

impl AngleWatch {
    /// Records the arrival of an angle message.
    pub const fn came(&mut self, at: Instant) {
        self.last = Some(at);
    }

    /// Returns the text for an SSB of an unknown radio head, once per PCI and SSB index.
    pub fn unknown(&mut self, pci: u16, ssb_index: u8) -> Option<String> {
        let head = (pci, ssb_index);
        if self.unknown.contains(&head) || self.unknown.len() == MAX_UNKNOWN {
            return None;
        }
        self.unknown.push(head);
        Some(format!(
            "the site has no radio head with PCI {pci} and SSB index {ssb_index}: its angles are ignored"
        ))
    }

    /// Returns the text if two radio heads transmit the same SSB: angles of one burst with equal
    /// PCI and SSB index have repeatedly differed by more than their errors. The text is repeated
    /// only after an equal number of SSBs without a contradiction.
    pub fn duplicate(&mut self, angle: &AngleObservation) -> Option<String> {
        let head = (angle.pci, angle.ssb_index);
        let Some(sent) = self.sent.iter_mut().find(|it| it.head == head) else {
            if self.sent.len() < MAX_UNKNOWN {
                self.sent.push(Sent {
                    head,
                    time_s: angle.time_s,
                    phase_rad: angle.phase_rad,
                    sigma_rad: angle.sigma_rad,
                    contradictions: 0,
                    is_reported: false,
                });
            }
            return None;
        };
        let is_of_one_burst = (angle.time_s - sent.time_s).abs() < BURST_S;
        let difference_rad = wrap_angle(angle.phase_rad - sent.phase_rad).abs();
        let sigma_rad = angle.sigma_rad.hypot(sent.sigma_rad);
        if is_of_one_burst && difference_rad > CONTRADICTION_SIGMAS * sigma_rad {
            // Each burst without a contradiction subtracts one, so that a contradiction adds two.
            sent.contradictions = (sent.contradictions + 2).min(2 * CONTRADICTIONS);
        } else {
            sent.contradictions = sent.contradictions.saturating_sub(1);
            sent.is_reported &= sent.contradictions > 0;
        }
        (sent.time_s, sent.phase_rad) = (angle.time_s, angle.phase_rad);
        sent.sigma_rad = angle.sigma_rad;
        if sent.is_reported || sent.contradictions < CONTRADICTIONS {
            return None;
        }
        sent.is_reported = true;
        Some(format!(
            "two radio heads send PCI {} and SSB index {}: angles of one burst differ by {difference_rad:.2} rad",
            angle.pci, angle.ssb_index
        ))
    }

    /// Returns the event when angle messages stop or resume. There is no event before the first
    /// message, because samples may provide the angles.
    pub fn change(&mut self, now: Instant) -> Option<(Level, String)> {
        let absent = now.saturating_duration_since(self.last?);
        let is_absent = absent >= Duration::from_secs_f64(ABSENT_S);
        if is_absent == self.is_absent {
            return None;
        }
        self.is_absent = is_absent;
        Some(if is_absent {
            let text = format!("no angle message for {:.1} s", absent.as_secs_f64());
            (Level::Warn, text)
        } else {
            (Level::Info, "angle messages arrive again".to_owned())
        })
    }
}

#[cfg(test)]
mod tests {
    use onboard::observation::MeasurementKind;

    use super::*;

    #[test]
    fn each_unknown_radio_head_is_reported_once() {
        let mut watch = AngleWatch::default();
        let text = watch.unknown(99, 6).unwrap();
        assert!(
            text.contains("PCI 99") && text.contains("index 6"),
            "{text}"
        );
        assert_eq!(watch.unknown(99, 6), None);
        assert!(watch.unknown(99, 5).is_some());
        let more = (0..1000).filter(|&pci| watch.unknown(pci, 0).is_some());
        assert_eq!(more.count(), MAX_UNKNOWN - 2);
    }

    #[test]
    fn two_heads_of_one_pci_are_reported_within_20_ssbs_and_noise_is_not() {
        let angle = |burst: u32, offset_s: f64, phase_rad: f64| AngleObservation {
            kind: MeasurementKind::Angle,
            pci: 22,
            ssb_index: 1,
            time_s: 0.02 * f64::from(burst) + offset_s,
            phase_rad,
            sigma_rad: 0.03,
            snr_db: None,
            resolved: true,
        };
        let mut watch = AngleWatch::default();
        for burst in 0..1000 {
            // Two angles each, with opposite errors of three standard deviations of their
            // difference.
            for (offset_s, sign) in [(0.0, 1.0), (1e-4, -1.0)] {
                let sent = angle(burst, offset_s, 3.1 + sign * 0.06);
                assert_eq!(watch.duplicate(&sent), None);
            }
        }
        let mut reports = Vec::new();
        for burst in 1000..1100 {
            for phase_rad in [0.3, 0.9] {
                if watch.duplicate(&angle(burst, 0.0, phase_rad)).is_some() {
                    reports.push(burst);
                }
            }
        }
        assert_eq!(reports.len(), 1);
        assert!(reports[0] < 1010, "{reports:?}");
    }

    #[test]
    fn missing_messages_and_their_return_are_reported_once() {
        let (mut watch, began) = (AngleWatch::default(), Instant::now());
        let at = |s: f64| began + Duration::from_secs_f64(s);
        assert_eq!(watch.change(at(100.0)), None);
        watch.came(at(0.0));
        assert_eq!(watch.change(at(0.9)), None);
        let (level, text) = watch.change(at(1.05)).unwrap();
        assert_eq!(level, Level::Warn);
        assert!(text.contains("1.1 s") || text.contains("1.0 s"), "{text}");
        assert_eq!(watch.change(at(5.0)), None);
        watch.came(at(5.5));
        assert!(matches!(watch.change(at(5.6)), Some((Level::Info, _))));
    }
}
