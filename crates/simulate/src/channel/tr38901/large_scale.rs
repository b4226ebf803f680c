//! Large-scale parameters (table 7.5-6) and their correlations.

use onboard::gaussian::{Matrix, identity};

use super::environment::{Environment, Kind};
use crate::cholesky::cholesky;

/// Number of large-scale parameters, in the order of step 4: shadowing, K, delay spread, azimuth
/// spread and zenith spread of arrival. Departure angles are not modelled, because a radio head has
/// one antenna.
pub const COUNT: usize = 5;
const SHADOWING: usize = 0;
const K: usize = 1;
const DELAY: usize = 2;
const AZIMUTH: usize = 3;
const ZENITH: usize = 4;

/// Normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Normal {
    mean: f64,
    std: f64,
}

const fn normal(mean: f64, std: f64) -> Normal {
    Normal { mean, std }
}

/// Parameters of an environment with or without a line of sight.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Distributions of shadowing (dB), K (dB), delay spread (log10 of seconds) and azimuth and
    /// zenith spread (log10 of degrees).
    normals: [Normal; COUNT],
    /// Lower Cholesky factor of the correlation matrix.
    root: Matrix<COUNT>,
    /// Correlation distances in metres.
    pub correlation_m: [f64; COUNT],
    /// Correlation distance of the clusters in metres (table 7.6.3.1-2).
    pub cluster_correlation_m: f64,
    /// Whether there is a line of sight.
    pub line_of_sight: bool,
    /// Number of clusters.
    pub clusters: usize,
    /// Delay scaling parameter r_τ.
    pub delay_scaling: f64,
    /// Standard deviation ζ of the shadowing of each cluster (dB).
    pub cluster_shadowing_db: f64,
    /// Delay spread within a cluster (s).
    pub cluster_delay_s: f64,
    /// Azimuth spread of arrival within a cluster (degrees).
    pub cluster_azimuth_deg: f64,
    /// Zenith spread of arrival within a cluster (degrees).
    pub cluster_zenith_deg: f64,
    /// Scaling factor C_φ^NLOS (table 7.5-2).
    pub azimuth_scaling: f64,
    /// Scaling factor C_θ^NLOS (table 7.5-4).
    pub zenith_scaling: f64,
    /// Distribution of log10 of the absolute excess delay (s) without a line of sight (table
    /// 7.6.9-1).
    excess_delay: Option<Normal>,
}

/// Large-scale parameters of one link at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargeScale {
    /// Shadowing in dB; positive is more power.
    pub shadowing_db: f64,
    /// Rician K factor in dB; meaningless without a line of sight.
    pub k_db: f64,
    /// Delay spread (s).
    pub delay_spread_s: f64,
    /// Azimuth spread of arrival (degrees).
    pub azimuth_spread_deg: f64,
    /// Zenith spread of arrival (degrees).
    pub zenith_spread_deg: f64,
}

impl Parameters {
    /// Returns the parameters of an environment.
    pub fn of(environment: &Environment, line_of_sight: bool) -> Self {
        let shadowing = normal(0.0, environment.shadowing_std_db(line_of_sight));
        match environment.kind {
            Kind::Umi => {
                // Frequencies below 2 GHz use the values of 2 GHz.
                let f = (1.0 + environment.carrier_ghz.max(2.0)).log10();
                umi(f, shadowing, line_of_sight)
            }
            Kind::Factory(factory) => {
                let [length_m, width_m, height_m] = factory.hall.size_m;
                let surface_m2 =
                    2.0 * (length_m * width_m + length_m * height_m + width_m * height_m);
                let volume_by_surface_m = length_m * width_m * height_m / surface_m2;
                let f = (1.0 + environment.carrier_ghz).log10();
                factory_parameters(f, volume_by_surface_m, shadowing, line_of_sight)
            }
        }
    }

    /// Converts independent standard normal numbers to the large-scale parameters (step 4).
    pub fn large_scale(&self, normals: &[f64; COUNT]) -> LargeScale {
        let value = |index: usize| {
            let root = self.root[index].iter().zip(normals);
            let deviation: f64 = root.map(|(root, normal)| root * normal).sum();
            self.normals[index].mean + self.normals[index].std * deviation
        };
        LargeScale {
            shadowing_db: value(SHADOWING),
            k_db: value(K),
            delay_spread_s: 10f64.powf(value(DELAY)),
            azimuth_spread_deg: 10f64.powf(value(AZIMUTH)).min(104.0),
            zenith_spread_deg: 10f64.powf(value(ZENITH)).min(52.0),
        }
    }

    /// Converts a standard normal number to the excess delay (s).
    pub fn excess_delay_s(&self, deviate: f64) -> f64 {
        self.excess_delay
            .map_or(0.0, |lg| 10f64.powf(lg.mean + lg.std * deviate))
    }
}

fn umi(f: f64, shadowing: Normal, line_of_sight: bool) -> Parameters {
    if line_of_sight {
        let mut correlations = identity::<COUNT>();
        correlations[K][SHADOWING] = 0.5;
        correlations[DELAY][SHADOWING] = -0.4;
        correlations[AZIMUTH][SHADOWING] = -0.4;
        correlations[DELAY][K] = -0.7;
        correlations[AZIMUTH][K] = -0.3;
        correlations[AZIMUTH][DELAY] = 0.8;
        correlations[ZENITH][DELAY] = 0.2;
        return Parameters {
            normals: [
                shadowing,
                normal(9.0, 5.0),
                normal(-0.18 * f - 7.28, 0.39),
                normal(-0.07 * f + 1.66, 0.021 * f + 0.26),
                normal(-0.11 * f + 0.81, -0.03 * f + 0.29),
            ],
            root: cholesky(&correlations, &correlations),
            correlation_m: [10.0, 15.0, 7.0, 8.0, 12.0],
            cluster_correlation_m: 12.0,
            line_of_sight,
            clusters: 12,
            delay_scaling: 3.0,
            cluster_shadowing_db: 3.0,
            cluster_delay_s: 5e-9,
            cluster_azimuth_deg: 17.0,
            cluster_zenith_deg: 7.0,
            azimuth_scaling: 1.146,
            zenith_scaling: 1.104,
            excess_delay: None,
        };
    }
    let mut correlations = identity::<COUNT>();
    correlations[DELAY][SHADOWING] = -0.7;
    correlations[AZIMUTH][SHADOWING] = -0.4;
    correlations[AZIMUTH][DELAY] = 0.4;
    correlations[ZENITH][AZIMUTH] = 0.2;
    Parameters {
        normals: [
            shadowing,
            normal(f64::NEG_INFINITY, 0.0),
            normal(-0.22 * f - 6.87, 0.19 * f + 0.22),
            normal(-0.07 * f + 1.76, 0.05 * f + 0.27),
            normal(-0.03 * f + 0.92, -0.05 * f + 0.35),
        ],
        root: cholesky(&correlations, &correlations),
        correlation_m: [13.0, 15.0, 10.0, 9.0, 10.0],
        cluster_correlation_m: 15.0,
        line_of_sight,
        clusters: 19,
        delay_scaling: 2.1,
        cluster_shadowing_db: 3.0,
        cluster_delay_s: 11e-9,
        cluster_azimuth_deg: 22.0,
        cluster_zenith_deg: 7.0,
        azimuth_scaling: 1.273,
        zenith_scaling: 1.184,
        excess_delay: None,
    }
}

fn factory_parameters(
    f: f64,
    volume_by_surface_m: f64,
    shadowing: Normal,
    line_of_sight: bool,
) -> Parameters {
    let mut correlations = identity::<COUNT>();
    if line_of_sight {
        correlations[DELAY][K] = -0.7;
    }
    let (normals, delay_scaling, cluster_shadowing_db) = if line_of_sight {
        let delay = (26.0 * volume_by_surface_m + 14.0).log10() - 9.35;
        (
            [
                shadowing,
                normal(7.0, 8.0),
                normal(delay, 0.15),
                normal(-0.18 * f + 1.78, 0.12 * f + 0.2),
                normal(-0.2 * f + 1.5, 0.35),
            ],
            2.7,
            4.0,
        )
    } else {
        let delay = (30.0 * volume_by_surface_m + 32.0).log10() - 9.44;
        (
            [
                shadowing,
                normal(f64::NEG_INFINITY, 0.0),
                normal(delay, 0.19),
                normal(1.72, 0.3),
                normal(-0.13 * f + 1.45, 0.45),
            ],
            3.0,
            3.0,
        )
    };
    Parameters {
        normals,
        root: cholesky(&correlations, &correlations),
        correlation_m: [10.0; COUNT],
        cluster_correlation_m: 10.0,
        line_of_sight,
        clusters: 25,
        delay_scaling,
        cluster_shadowing_db,
        cluster_delay_s: 3.91e-9,
        cluster_azimuth_deg: 8.0,
        cluster_zenith_deg: 9.0,
        azimuth_scaling: 1.358,
        zenith_scaling: 1.282,
        excess_delay: (!line_of_sight).then_some(normal(-7.5, 0.4)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ChannelModel;

    #[test]
    fn correlation_matrices_have_cholesky_factors() {
        for model in [ChannelModel::Umi, ChannelModel::InfSl] {
            let environment = Environment::of(model, 3.5, None).unwrap();
            for line_of_sight in [true, false] {
                let root = Parameters::of(&environment, line_of_sight).root;
                for row in root {
                    let square: f64 = row.iter().map(|x| x * x).sum();
                    assert!(
                        (square - 1.0).abs() < 1e-12,
                        "{model:?} {line_of_sight}: {row:?}"
                    );
                }
            }
        }
    }
}
