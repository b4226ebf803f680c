//! Reliable estimates are consistent with their standard deviation for few snapshots too, where the noise
//! variance is estimated with few degrees of freedom.

use crate::common::Random;
use aoa::{
    AngleEstimate, ArbitraryArray, Array, Complex64, Covariance, Direction, DirectionFinder,
    Manifold, Method, Reason, estimate, maximum_likelihood_pilots,
};

/// Statistics of errors divided by their standard deviations.
#[derive(Default)]
struct Errors {
    count: f64,
    squares: f64,
    beyond: f64,
}

impl Errors {
    fn add(&mut self, z: f64) {
        self.count += 1.0;
        self.squares += z * z;
        self.beyond += f64::from(u8::from(z.abs() > 3.0));
    }

    /// Asserts an RMS from 0.9 to 1.15, within three standard errors. The standard error of a mean
    /// square is `sqrt(kurtosis - 1)` over the root of the number of trials; `sqrt(kurtosis - 1)`
    /// is below 2.5 for eight degrees of freedom.
    fn check_rms(&self, of: &str) {
        let mean = self.squares / self.count;
        let margin = 3.0 * 2.5 / self.count.sqrt();
        assert!(
            mean > 0.81 - margin && mean < 1.3225 + margin,
            "{of}: z-RMS {}",
            mean.sqrt()
        );
    }

    /// Asserts that at most 0.6 % of `trials` exceed three standard deviations, within three
    /// standard errors.
    fn check_beyond(&self, trials: f64, of: &str) {
        let share = self.beyond / trials;
        let most = 6e-3 + 3.0 * (6e-3 / trials).sqrt();
        assert!(share <= most, "{of}: {share} of {trials} beyond 3 sigma");
    }

    fn check(&self, of: &str) {
        self.check_rms(of);
        self.check_beyond(self.count, of);
    }
}

/// Returns snapshots of a source of constant power.
fn snapshots<const N: usize>(
    random: &mut Random,
    response: &[Complex64; N],
    snr_db: f64,
    count: usize,
) -> Vec<[Complex64; N]> {
    let amplitude = 10.0_f64.powf(snr_db / 20.0);
    let one = |_| {
        let turn = Complex64::cis(random.uniform(0.0, std::f64::consts::TAU)) * amplitude;
        response.map(|it| it * turn + random.gaussian())
    };
    (0..count).map(one).collect()
}

/// Runs trials of one condition, by maximum likelihood from the covariance and from despread
/// pilots.
fn condition<const N: usize>(
    random: &mut Random,
    count: usize,
    snr_db: f64,
    trials: usize,
) -> [Errors; 2] {
    let array = Array::<N>::half_wavelength();
    let mut errors = [Errors::default(), Errors::default()];
    for _ in 0..trials {
        let phase = array.phase_from_angle(random.uniform(0.6, 2.5));
        let received = snapshots(random, &array.response(phase), snr_db, count);
        let covariance = Covariance::from_snapshots(&received).unwrap();
        let all: [AngleEstimate; 2] = [
            estimate(Method::MaximumLikelihood, &covariance, &array).unwrap(),
            maximum_likelihood_pilots(&received, None, &array).unwrap(),
        ];
        for (errors, found) in errors.iter_mut().zip(all) {
            if found.is_reliable() {
                errors.add((found.phase_rad - phase) / found.phase_sigma_rad);
            }
        }
    }
    errors
}

/// Minimum shares of reliable estimates of a condition for a separate test of its RMS, and of its
/// errors beyond three standard deviations. With smaller shares, the SNR is near the threshold, and
/// the reliable estimates are those with underestimated noise.
const RMS_SHARE: f64 = 0.2;
const BEYOND_SHARE: f64 = 0.85;

/// Checks all conditions for one number of antennas. Returns how many conditions have enough
/// reliable estimates for the test of the RMS, and for that of the errors beyond three standard
/// deviations.
fn check_row<const N: usize>(trials: usize) -> [usize; 2] {
    let mut random = Random::new(N as u64);
    let mut counts = [0, 0];
    let mut all = Errors::default();
    for count in [1, 2, 5, 10, 20] {
        for snr_db in [0.0, 5.0, 10.0, 20.0, 30.0] {
            for errors in condition::<N>(&mut random, count, snr_db, trials) {
                let of = format!("{N} antennas, {count} snapshots, {snr_db} dB");
                let trials = trials as f64;
                errors.check_beyond(trials, &of);
                if errors.count > RMS_SHARE * trials {
                    counts[0] += 1;
                    errors.check_rms(&of);
                }
                if errors.count > BEYOND_SHARE * trials {
                    counts[1] += 1;
                    errors.check_beyond(errors.count, &of);
                }
                all.count += errors.count;
                all.squares += errors.squares;
                all.beyond += errors.beyond;
            }
        }
    }
    all.check(&format!("{N} antennas"));
    counts
}

#[test]
fn errors_of_reliable_angles_follow_their_standard_deviation() {
    // Five numbers of snapshots, five SNRs, two estimators.
    let counts = [
        check_row::<2>(4000),
        check_row::<3>(3000),
        check_row::<4>(3000),
        check_row::<8>(1500),
    ];
    for (counts, least) in counts
        .into_iter()
        .zip([[18, 14], [22, 16], [26, 18], [30, 24]])
    {
        assert!(counts[0] >= least[0] && counts[1] >= least[1], "{counts:?}");
    }
}

fn print_row<const N: usize>(trials: usize) {
    let mut random = Random::new(100 + N as u64);
    for count in [1, 2, 3, 4, 5, 6, 8, 10, 14, 20] {
        for snr_db in (0..=30).step_by(5) {
            let [errors, _] = condition::<N>(&mut random, count, f64::from(snr_db), trials);
            if errors.count > 0.0 {
                println!(
                    "{N:8} {count:9} {snr_db:6} {:8.3} {:5.2} {:14.4}",
                    errors.count / trials as f64,
                    (errors.squares / errors.count).sqrt(),
                    errors.beyond / errors.count,
                );
            }
        }
    }
}

#[test]
#[ignore = "prints a table of a minute; trials by FEW_SNAPSHOTS_TRIALS"]
fn table_of_few_snapshots() {
    let trials = std::env::var("FEW_SNAPSHOTS_TRIALS").map_or(20_000, |it| it.parse().unwrap());
    println!("antennas snapshots snr_db reliable z_rms beyond_3_sigma");
    print_row::<2>(trials);
    print_row::<3>(trials);
    print_row::<4>(trials);
    print_row::<6>(trials);
    print_row::<8>(trials);
}

#[test]
fn errors_of_a_circular_array_are_consistent() {
    let array = ArbitraryArray::<5>::circular(0.4).unwrap();
    let finder = DirectionFinder::new(array, [0.0, 0.0]).unwrap();
    let mut random = Random::new(3);
    for count in [1, 2, 5] {
        let mut errors = Errors::default();
        for _ in 0..600 {
            let azimuth = random.uniform(-3.0, 3.0);
            let response = array.response(Direction::new(azimuth, 0.0));
            let received = snapshots(&mut random, &response, 20.0, count);
            let covariance = Covariance::from_snapshots(&received).unwrap();
            let found = finder.estimate(&covariance).unwrap();
            if found.is_reliable() {
                errors.add((found.direction.azimuth_rad - azimuth) / found.azimuth_sigma_rad());
            }
        }
        // One snapshot of five antennas leaves seven degrees of freedom, one too few.
        assert_eq!(errors.count > 0.0, count > 1, "{count} snapshots");
        if count > 1 {
            errors.check(&format!("{count} snapshots"));
        }
    }
}

#[test]
fn one_snapshot_of_four_antennas_is_reliable_only_if_the_noise_is_known() {
    let array = Array::<4>::half_wavelength();
    let mut random = Random::new(9);
    let received = snapshots(&mut random, &array.response(0.5), 30.0, 1);
    let unknown = maximum_likelihood_pilots(&received, None, &array).unwrap();
    assert_eq!(unknown.doubt(), Some(Reason::TooFewSnapshots));
    let known = maximum_likelihood_pilots(&received, Some(1.0), &array).unwrap();
    assert_eq!(known.verdict.reason(), None);
}
