//! Functions of the same signature for the search, the scan and the receivers.

use nr_ssb::Complex32;
use nr_ssb::receiver::ReceiverConfig;
use nr_ssb::search::{SearchConfig, Searcher};
use recording::scan::{
    ChannelFault, SampleBlock, Scan, ScanSettings, SsbSearch, SsbSearchConfig, scan,
};

use crate::air::{receivers, slices};
use crate::{SPACING, Scene};

/// Detected SSBs of the cell, and reported tones.
pub struct Detected {
    /// Number of SSBs in the samples.
    pub bursts: usize,
    pub ssbs: usize,
    /// Frequencies of the tones relative to the centre of the samples.
    pub tones_hz: Vec<f64>,
}

type Detector = fn(&Scene, &[Vec<Complex32>]) -> Detected;

/// Name, whether the samples have twice the base rate, number of bursts, and function.
pub const DETECTORS: [(&str, bool, usize, Detector); 4] = [
    ("search", false, 1, search),
    ("scan", true, 1, scan_band),
    ("stream", true, 3, stream),
    ("window", false, 3, window),
];

impl Scene {
    /// Counts the bursts of the cell among the given SSBs (PCI, and first sample at the base rate).
    fn detected(&self, ssbs: &[(u16, f64)], tones_hz: Vec<f64>) -> Detected {
        let first = self.cell.ssb_start(self.cell.ssb_indices[0]);
        let is_there = |number: &usize| {
            let start = first + (number * 153_600) as f64;
            ssbs.iter()
                .any(|(pci, at)| *pci == self.cell.pci && (at - start).abs() < 1.5)
        };
        Detected {
            bursts: self.bursts,
            ssbs: (0..self.bursts).filter(is_there).count(),
            tones_hz,
        }
    }

    fn centre_hz(&self) -> f64 {
        self.cell.ssb_freq_hz - self.offset_hz
    }
}

fn search(scene: &Scene, samples: &[Vec<Complex32>]) -> Detected {
    let config = SearchConfig {
        ssb_freq_hz: Some(scene.cell.ssb_freq_hz),
        ..SearchConfig::new(SPACING, samples.len())
    };
    let mut searcher = Searcher::new(config).unwrap();
    let found = searcher.search(&slices(samples)).unwrap();
    let found: Vec<_> = found
        .iter()
        .map(|ssb| (ssb.pci.get(), ssb.sample_start))
        .collect();
    let tones = searcher.tones().map(|it| it.frequency_hz).collect();
    scene.detected(&found, tones)
}

fn scan_band(scene: &Scene, samples: &[Vec<Complex32>]) -> Detected {
    let mut source = SampleBlock {
        antennas: slices(samples),
        sample_rate_hz: scene.rate_hz(),
        centre_frequency_hz: Some(scene.centre_hz()),
    };
    let Scan { ssbs, faults, .. } = scan(&mut source, &ScanSettings::default()).unwrap();
    let found: Vec<_> = ssbs
        .iter()
        .map(|it| (it.ssb.pci.get(), it.sample_start / scene.factor as f64))
        .collect();
    let tones = faults.iter().filter_map(|fault| match fault {
        ChannelFault::Tone(tone) => Some(tone.frequency_hz),
        _ => None,
    });
    scene.detected(&found, tones.collect())
}

fn stream(scene: &Scene, samples: &[Vec<Complex32>]) -> Detected {
    let config = ReceiverConfig::new(scene.cell.ssb_freq_hz, SPACING, samples.len());
    let at_hz = [scene.rate_hz(), scene.centre_hz()];
    let mut found = Vec::new();
    let tones = receivers::stream(config, at_hz, samples, &mut |beam| {
        found.push((beam.ssb.pci.get(), beam.ssb.sample_start));
    });
    let tones = tones.iter().map(|it| it.frequency_hz + scene.offset_hz);
    scene.detected(&found, tones.collect())
}

fn window(scene: &Scene, samples: &[Vec<Complex32>]) -> Detected {
    let config = ReceiverConfig::new(scene.cell.ssb_freq_hz, SPACING, samples.len());
    let first = (scene.cell.delay as usize).saturating_sub(300);
    let mut found = Vec::new();
    let tones = receivers::windows(config, (first, scene.bursts), samples, &mut |beam| {
        found.push((beam.ssb.pci.get(), beam.ssb.sample_start));
    });
    let tones = tones.iter().map(|it| it.frequency_hz).collect();
    scene.detected(&found, tones)
}

/// Returns the angle of the only SSB.
pub fn angle_rad(scene: &Scene, samples: &[Vec<Complex32>]) -> Option<f64> {
    let frequency_hz = scene.cell.ssb_freq_hz;
    let config = SsbSearchConfig::new(
        scene.rate_hz(),
        frequency_hz,
        frequency_hz,
        SPACING,
        samples.len(),
    );
    let mut search = SsbSearch::new(config).unwrap();
    let found = search.search(&slices(samples)).unwrap();
    let angle = found.first()?.angle?.from_row()?;
    Some(angle.angle_rad)
}
