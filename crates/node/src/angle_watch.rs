//! Watch over angles: radio heads that the site does not have, and angle messages that no longer come.

use std::time::{Duration, Instant};

use crate::inbox::Level;

/// Time without an angle message after which angles are absent, in seconds: 50 bursts of 20 ms, six of 160 ms.
const ABSENT_S: f64 = 1.0;
/// Maximum number of radio heads that are reported; it bounds the memory.
const MAX_UNKNOWN: usize = 64;

/// Radio heads reported so far, and the last angle message.
#[derive(Debug, Default)]
pub struct AngleWatch {
    unknown: Vec<(u16, u8)>,
    last: Option<Instant>,
    is_absent: bool,
}

impl AngleWatch {
    /// Notes the arrival of an angle message.
    pub const fn came(&mut self, at: Instant) {
        self.last = Some(at);
    }

    /// Text for an SSB whose radio head the site does not have, once for each PCI and SSB index.
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

    /// Event when angle messages begin to be absent or come again. Without any message so far there is none: samples
    /// may provide the angles.
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
            (Level::Info, "angle messages come again".to_owned())
        })
    }
}

#[cfg(test)]
mod tests {
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
    fn absence_is_reported_once_and_so_is_its_end() {
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
