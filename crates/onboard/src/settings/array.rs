//! Antenna array of the vehicle.

use std::sync::Arc;

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::array_shape::ArrayShape;
use super::check::Check;
use super::error::SettingsError;
use crate::elements::for_elements;
use crate::manifold::{AnyManifold, ArrayManifold, Measurand};

/// `[array]`: the antenna array. The geometry is a uniform linear array unless `shape` specifies
/// another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ArraySettings {
    /// Number of antennas.
    #[schemars(range(min = 2, max = 16))]
    pub elements: u8,
    /// Array geometry.
    #[serde(skip_serializing_if = "ArrayShape::is_row")]
    pub shape: ArrayShape,
    /// Distance between neighbouring antennas in wavelengths, along the row or the circle.
    #[schemars(range(min = 0.05, max = 0.5))]
    pub spacing_wavelengths: f64,
    /// Antenna gain in dBi.
    #[schemars(range(min = -60.0, max = 60.0))]
    pub rx_gain_dbi: f64,
    /// Position of the array's centre in the vehicle frame `[forward, left, up]`, in metres. The
    /// origin is the point on the ground whose motion the odometer measures.
    #[schemars(inner(range(min = -100.0, max = 100.0)))]
    pub position_m: [f64; 3],
    /// Standard deviation of the array's forward and left position, each in metres.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub position_std_m: f64,
    /// Direction of the array axis (along the row) relative to the vehicle's forward axis,
    /// counter-clockwise, in radians.
    #[schemars(range(min = -3.2, max = 3.2))]
    pub mounting_rad: f64,
    /// Standard deviation of `mounting_rad`, in radians; 0 means exactly known. Default: treated as
    /// exact until angles contradict it, then 0.005 on a road vehicle and 0.02 on a differential
    /// drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 3.2))]
    pub mounting_std_rad: Option<f64>,
    /// Random walk of `mounting_rad`, in radians per square root of metre driven.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub mounting_drift_rad_per_sqrt_m: f64,
    /// Residual phase difference between neighbouring antennas of the row after calibration, in
    /// radians. Positive: each antenna leads the previous one.
    #[schemars(range(min = -3.2, max = 3.2))]
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad`, in radians; 0 means exactly known. Default: treated as
    /// exact until angles contradict it, then 0.02.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 3.2))]
    pub phase_std_rad: Option<f64>,
    /// Random walk of `phase_rad`, in radians per square root of metre driven.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub phase_drift_rad_per_sqrt_m: f64,
    /// Random walk of each antenna's gain, in dB per square root of metre driven. A gain error does
    /// not bias the angle of a single wave, so only simulations use this value.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub gain_drift_db_per_sqrt_m: f64,
    /// Complex gain `[re, im]` of each receiver channel. Samples are divided by it. Default: ideal
    /// channels.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = -1e3, max = 1e3))))]
    pub channel_gains: Option<Vec<[f64; 2]>>,
}

impl Default for ArraySettings {
    fn default() -> Self {
        Self {
            elements: 4,
            shape: ArrayShape::default(),
            spacing_wavelengths: 0.5,
            rx_gain_dbi: 5.0,
            position_m: [0.0; 3],
            position_std_m: 0.0,
            mounting_rad: 0.0,
            mounting_std_rad: None,
            mounting_drift_rad_per_sqrt_m: 0.0,
            phase_rad: 0.0,
            phase_std_rad: None,
            phase_drift_rad_per_sqrt_m: 0.0,
            gain_drift_db_per_sqrt_m: 0.0,
            channel_gains: None,
        }
    }
}

impl ArraySettings {
    /// Returns the complex gain of each channel.
    pub fn calibration(&self) -> Vec<Complex64> {
        match &self.channel_gains {
            Some(gains) => gains
                .iter()
                .map(|&[re, im]| Complex64::new(re, im))
                .collect(),
            None => vec![Complex64::ONE; self.elements.into()],
        }
    }

    /// Returns the manifold of a non-linear array; `None` for a uniform linear array.
    ///
    /// # Errors
    /// [`aoa::Error`] if the positions or the response table do not form an array of `N` antennas.
    pub fn manifold<const N: usize>(&self) -> Result<Option<ArrayManifold<N>>, aoa::Error> {
        ArrayManifold::new(&self.shape, self.spacing_wavelengths)
    }

    /// Returns the [`manifold`](Self::manifold) for the configured number of antennas. Requires
    /// checked settings.
    pub fn any_manifold(&self) -> Option<Arc<dyn AnyManifold>> {
        for_elements!(self.elements, N => {
            let manifold = self.manifold::<N>().ok()??;
            Some(Arc::new(manifold))
        })
    }

    /// Returns the angle that the array measures. Requires checked settings.
    pub fn measurand(&self) -> Measurand {
        self.try_measurand().unwrap_or_else(|_| self.in_a_row())
    }

    fn try_measurand(&self) -> Result<Measurand, aoa::Error> {
        for_elements!(self.elements, N => {
            let manifold = self.manifold::<N>()?;
            Ok(manifold.map_or_else(|| self.in_a_row(), |it| Measurand::azimuth(&it)))
        })
    }

    const fn in_a_row(&self) -> Measurand {
        Measurand::ElectricalAngle {
            elements: self.elements,
            spacing_wavelengths: self.spacing_wavelengths,
        }
    }

    pub(super) fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        self.try_measurand().map_err(|error| {
            let antennas = format!("{} antennas", self.elements);
            check.error("array.shape", antennas, &error.to_string())
        })?;
        for (key, phase_rad) in [
            ("array.phase_rad", self.phase_rad),
            ("array.phase_std_rad", self.phase_std_rad.unwrap_or(0.0)),
            (
                "array.phase_drift_rad_per_sqrt_m",
                self.phase_drift_rad_per_sqrt_m,
            ),
        ] {
            let in_a_row = self.shape.is_row() || phase_rad == 0.0;
            check.that(
                in_a_row,
                key,
                phase_rad,
                "it must be 0 unless the antennas are in a row: use array.channel_gains",
            )?;
        }
        let Some(gains) = &self.channel_gains else {
            return Ok(());
        };
        let allowed = format!(
            "it must have one gain for each antenna, and array.elements is {}",
            self.elements
        );
        let fits = gains.len() == usize::from(self.elements);
        let count = format!("a list of {}", gains.len());
        check.that(fits, "array.channel_gains", count, &allowed)?;
        gains.iter().enumerate().try_for_each(|(index, [re, im])| {
            let usable = (re * re + im * im).is_normal();
            let key = format!("array.channel_gains[{index}]");
            check.that(usable, &key, format!("[{re}, {im}]"), "it must not be zero")
        })
    }
}
