//! Environments of TR 38.901: line-of-sight probability and path loss.

use onboard::settings::SPEED_OF_LIGHT_MPS;

use crate::scenario::{ChannelModel, HallSettings};

/// Environment at a carrier frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Environment {
    /// Carrier frequency in GHz.
    pub carrier_ghz: f64,
    /// Street canyon or factory.
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Umi,
    Factory(Factory),
}

/// Indoor factory (table 7.2-4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factory {
    /// Whether the clutter is dense.
    dense: bool,
    /// Whether the radio heads are above the clutter.
    high: bool,
    pub hall: HallSettings,
}

/// Geometry of the link between the vehicle and a radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkGeometry {
    /// Horizontal distance in metres.
    pub level_m: f64,
    /// Height of the radio head in metres.
    pub head_m: f64,
    /// Height of the array in metres.
    pub array_m: f64,
}

impl LinkGeometry {
    /// Returns the distance in metres, at least 1 m because the models are valid in the far field
    /// only.
    pub fn distance_m(&self) -> f64 {
        self.level_m.hypot(self.head_m - self.array_m).max(1.0)
    }
}

impl Environment {
    /// Creates the environment of a model at a carrier frequency. The default hall is the one of
    /// the model's calibration (table 7.8-7). Returns `None` for a model that is not from TR
    /// 38.901.
    pub fn of(model: ChannelModel, carrier_ghz: f64, hall: Option<HallSettings>) -> Option<Self> {
        let (dense, high) = match model {
            ChannelModel::Rician | ChannelModel::Paths => return None,
            ChannelModel::Umi => {
                let kind = Kind::Umi;
                return Some(Self { carrier_ghz, kind });
            }
            ChannelModel::InfSl => (false, false),
            ChannelModel::InfDl => (true, false),
            ChannelModel::InfSh => (false, true),
            ChannelModel::InfDh => (true, true),
        };
        let (clutter_density, clutter_size_m, clutter_height_m) = if dense {
            (0.6, 2.0, 6.0)
        } else {
            (0.2, 10.0, 2.0)
        };
        // Calibration halls: small for SL and DH, large for DL and SH.
        let size_m = if dense == high {
            [120.0, 60.0, 10.0]
        } else {
            [300.0, 150.0, 10.0]
        };
        let hall = hall.unwrap_or(HallSettings {
            size_m,
            clutter_density,
            clutter_size_m,
            clutter_height_m,
        });
        Some(Self {
            carrier_ghz,
            kind: Kind::Factory(Factory { dense, high, hall }),
        })
    }

    /// Returns the heights of radio head and array in metres. If both are equal (a site without
    /// heights), the heights of the model are used (tables 7.2-1 and 7.8-7).
    pub fn heights_m(&self, head_m: f64, array_m: f64) -> [f64; 2] {
        if head_m != array_m {
            return [head_m, array_m];
        }
        let head_m = match self.kind {
            Kind::Umi => 10.0,
            Kind::Factory(Factory { high: true, .. }) => 8.0,
            Kind::Factory(_) => 1.5,
        };
        [head_m, 1.5]
    }

    /// Returns the probability of a line of sight (table 7.4.2-1).
    pub fn line_of_sight_probability(&self, link: &LinkGeometry) -> f64 {
        let level_m = link.level_m;
        match self.kind {
            Kind::Umi if level_m <= 18.0 => 1.0,
            Kind::Umi => {
                let near = 18.0 / level_m;
                near + (-level_m / 36.0).exp() * (1.0 - near)
            }
            Kind::Factory(Factory { high, hall, .. }) => {
                let mut reach_m = -hall.clutter_size_m / (1.0 - hall.clutter_density).ln();
                if high {
                    let above_m = hall.clutter_height_m - link.array_m;
                    // An array above the clutter always has a line of sight.
                    if above_m <= 0.0 {
                        return 1.0;
                    }
                    reach_m *= (link.head_m - link.array_m).max(0.0) / above_m;
                }
                (-level_m / reach_m).exp()
            }
        }
    }

    /// Returns the correlation distance of the line-of-sight state in metres (table 7.6.3.1-2).
    pub fn state_correlation_m(&self) -> f64 {
        match self.kind {
            Kind::Umi => 50.0,
            Kind::Factory(Factory { hall, .. }) => 0.5 * hall.clutter_size_m,
        }
    }

    /// Returns the path loss in dB with or without a line of sight (table 7.4.1-1).
    pub fn path_loss_db(&self, link: &LinkGeometry, line_of_sight: bool) -> f64 {
        let decades = link.distance_m().log10();
        let carrier = self.carrier_ghz.log10();
        match self.kind {
            Kind::Umi => {
                // The model is valid from 1.5 m upwards.
                let array_m = link.array_m.max(1.5);
                let breakpoint_m =
                    4.0 * (link.head_m - 1.0).max(0.0) * (array_m - 1.0) * self.carrier_ghz * 1e9
                        / SPEED_OF_LIGHT_MPS;
                let near_db = 32.4 + 21.0 * decades + 20.0 * carrier;
                let apart_m = link.head_m - array_m;
                let bend = breakpoint_m * breakpoint_m + apart_m * apart_m;
                let clear_db = if link.level_m <= breakpoint_m {
                    near_db
                } else {
                    32.4 + 40.0 * decades + 20.0 * carrier - 9.5 * bend.max(1.0).log10()
                };
                if line_of_sight {
                    return clear_db;
                }
                let hidden_db = 35.3 * decades + 22.4 + 21.3 * carrier - 0.3 * (array_m - 1.5);
                clear_db.max(hidden_db)
            }
            Kind::Factory(Factory { dense, high, .. }) => {
                let clear_db = 31.84 + 21.5 * decades + 19.0 * carrier;
                if line_of_sight {
                    return clear_db;
                }
                let law =
                    |at_1_m: f64, per_decade: f64| at_1_m + per_decade * decades + 20.0 * carrier;
                let sparse_low_db = law(33.0, 25.5);
                let hidden_db = match (dense, high) {
                    (false, false) => sparse_low_db,
                    (true, false) => law(18.6, 35.7).max(sparse_low_db),
                    (false, true) => law(32.4, 23.0),
                    (true, true) => law(33.63, 21.9),
                };
                clear_db.max(hidden_db)
            }
        }
    }

    /// Returns the standard deviation of the shadowing in dB (table 7.4.1-1).
    pub fn shadowing_std_db(&self, line_of_sight: bool) -> f64 {
        match self.kind {
            Kind::Umi if line_of_sight => 4.0,
            Kind::Umi => 7.82,
            Kind::Factory(_) if line_of_sight => 4.3,
            Kind::Factory(Factory { dense, high, .. }) => match (dense, high) {
                (false, false) => 5.7,
                (true, false) => 7.2,
                (false, true) => 5.9,
                (true, true) => 4.0,
            },
        }
    }
}
