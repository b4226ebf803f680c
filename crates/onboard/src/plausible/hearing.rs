//! Reception of radio heads along the road according to the link budget. It reveals different
//! coordinate frames of radio heads, road and start, and interfering cells.

use super::warning::Warning;
use crate::geometry::Point;
use crate::link_budget::LinkBudget;
use crate::radio_head::RadioHead;
use crate::road::Road;
use crate::settings::{Site, Vehicle};
use crate::walls::Walls;

/// Minimum power of an SSB relative to noise, or to noise plus interference, for detection with
/// four antennas (dB; `cargo test -p nr-ssb --test all detection`).
const FOUND_DB: f64 = -10.0;
/// Number of radio heads that determine a position without a road.
const FOR_A_PLACE: usize = 3;
/// Maximum number of positions that are examined along a road.
const MAX_PLACES: f64 = 400.0;
/// Minimum distance between examined positions along a road (m).
const STEP_M: f64 = 5.0;
/// Maximum distance of a radio head from the examined positions (m): distance between the sites of
/// urban macro cells (TR 38.901, 7.2).
const MAX_DISTANCE_M: f64 = 500.0;
/// Minimum distance of a vehicle from a radio head (m).
const NEAREST_M: f64 = 10.0;

/// Returns warnings for radio heads that are received nowhere along the road, or are far from it.
/// Without a road, the positions of the other radio heads are examined.
pub(super) fn without_reception(
    site: &Site,
    vehicle: &Vehicle,
    road: Option<&Road>,
) -> Vec<Warning> {
    let air = Air::new(site, vehicle);
    let where_ = if road.is_some() {
        "along the road"
    } else {
        "near any other"
    };
    air.without_reception(&air.places(road), where_)
}

/// Returns warnings for cells with simultaneous SSBs that are needed at a position where the
/// interference of the others is too strong.
pub(super) fn with_interference(
    site: &Site,
    vehicle: &Vehicle,
    road: Option<&Road>,
) -> Vec<Warning> {
    let air = Air::new(site, vehicle);
    air.with_interference(site, &air.places(road))
}

/// Returns a warning if no radio head is received at the start.
pub(super) fn without_reception_at_start(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let air = Air::new(site, vehicle);
    let pose = vehicle.start.pose?;
    let heads = air.heads.iter();
    let nearest_m = heads
        .clone()
        .map(|head| head.position.distance_m(pose.point()))
        .fold(f64::INFINITY, f64::min);
    let is_received = heads
        .clone()
        .any(|head| air.snr_db(head, pose.point()) >= FOUND_DB);
    (!is_received).then(|| Warning {
        key: "start.pose".to_owned(),
        value: format!("[{}, {}]", pose.x_m, pose.y_m),
        why: format!("no radio head is received there: the nearest is {nearest_m:.0} m away"),
        write: "specify it in metres in the frame of the radio heads".to_owned(),
    })
}

/// Returns the positions along a road, one step apart up to the maximum number, each with its
/// distance along the road (m).
pub(super) fn steps_along(
    road: &Road,
    step_m: f64,
    most: f64,
) -> impl Iterator<Item = (f64, Point)> {
    let steps = (road.length_m() / step_m).ceil().clamp(1.0, most);
    (0..=steps as usize)
        .map(move |step| road.length_m() * step as f64 / steps)
        .map(|along_m| (along_m, road.pose(along_m).point()))
}

fn along(road: &Road) -> Vec<Point> {
    let steps = steps_along(road, STEP_M, MAX_PLACES);
    steps.map(|(_, place)| place).collect()
}

/// Received power of the radio heads.
struct Air {
    heads: Vec<RadioHead>,
    /// Indices of the radio heads in the site.
    numbers: Vec<usize>,
    budget: LinkBudget,
    walls: Walls,
    array_m: f64,
}

impl Air {
    fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let received = site.radio_heads.iter().enumerate();
        let received = received.filter(|(_, head)| vehicle.receiver.receives(head.pci));
        let (numbers, heads) = received
            .map(|(number, it)| (number, RadioHead::from(it)))
            .unzip();
        Self {
            heads,
            numbers,
            budget: LinkBudget::new(site, vehicle),
            walls: Walls::new(site),
            array_m: vehicle.array.position_m[2],
        }
    }

    /// Returns the examined positions: along the road, or those of the other radio heads.
    fn places(&self, road: Option<&Road>) -> Vec<Point> {
        match road {
            Some(road) => along(road),
            None => self.heads.iter().map(|it| it.position).collect(),
        }
    }

    fn snr_db(&self, head: &RadioHead, place: Point) -> f64 {
        let distance_m = head.distance_m(place, self.array_m).max(NEAREST_M);
        let seen = self.walls.seen(head, place);
        seen.map_or(f64::NEG_INFINITY, |head| {
            self.budget.snr_db(&head, distance_m)
        })
    }

    fn hidden(&self, head: &RadioHead, places: &[Point]) -> bool {
        let mut others = places.iter().filter(|place| **place != head.position);
        !self.walls.is_empty() && !others.any(|place| self.walls.seen(head, *place).is_some())
    }

    fn without_reception(&self, places: &[Point], where_: &str) -> Vec<Warning> {
        let heads = || self.heads.iter().zip(&self.numbers);
        let hidden = heads().filter(|(head, _)| self.hidden(head, places));
        let hidden = hidden.map(|(head, number)| Warning {
            key: format!("radio_heads[{number}].position_m"),
            value: format!("[{}, {}]", head.position.x_m, head.position.y_m),
            why: format!("walls block its line of sight everywhere {where_}"),
            write: "specify its position and the walls' polyline_m in one frame; omit doors"
                .to_owned(),
        });
        let far = heads().filter_map(|(head, number)| {
            let others = places.iter().filter(|place| **place != head.position);
            let distance_m = others
                .map(|place| head.distance_m(*place, self.array_m))
                .reduce(f64::min)?
                .max(NEAREST_M);
            let snr_db = self.budget.snr_db(head, distance_m);
            let why = if snr_db < FOUND_DB {
                format!(
                    "it is received nowhere {where_}: at the minimum distance of {distance_m:.0} m, its \
                         SNR is {snr_db:.0} dB, and the detection limit of an SSB is {FOUND_DB} dB"
                )
            } else if distance_m > MAX_DISTANCE_M {
                format!(
                    "the minimum distance {where_} is {distance_m:.0} m, and the sites of urban macro \
                         cells are {MAX_DISTANCE_M} m apart (TR 38.901, 7.2)"
                )
            } else {
                return None;
            };
            Some(Warning {
                key: format!("radio_heads[{number}].position_m"),
                value: format!("[{}, {}]", head.position.x_m, head.position.y_m),
                why,
                write: format!(
                    "specify all positions in metres in one local frame (no degrees, no map grid), or \
                         a sufficient eirp_dbm: now {}",
                    head.eirp_dbm
                ),
            })
        });
        far.chain(hidden).collect()
    }

    fn with_interference(&self, site: &Site, places: &[Point]) -> Vec<Warning> {
        let count = self.heads.len();
        // For each radio head: minimum ratio to the interference, its position, and the strongest
        // interferer.
        let mut worst: Vec<Option<(f64, Point, usize)>> = vec![None; count];
        let mut snr_db = vec![0.0; count];
        let mut by_strength: Vec<usize> = (0..count).collect();
        for place in places {
            for (snr_db, head) in snr_db.iter_mut().zip(&self.heads) {
                *snr_db = self.snr_db(head, *place);
            }
            by_strength.sort_by(|&a, &b| snr_db[b].total_cmp(&snr_db[a]));
            for &wanted in by_strength.iter().take(FOR_A_PLACE) {
                let index = self.heads[wanted].ssb_index;
                let mut others = by_strength
                    .iter()
                    .copied()
                    .filter(|&other| other != wanted && self.heads[other].ssb_index == index);
                let Some(strongest) = others.next() else {
                    continue;
                };
                let ratio_db = snr_db[wanted] - snr_db[strongest];
                let is_lost = snr_db[wanted] >= FOUND_DB && ratio_db < FOUND_DB;
                if is_lost && worst[wanted].is_none_or(|(before_db, ..)| ratio_db < before_db) {
                    worst[wanted] = Some((ratio_db, *place, strongest));
                }
            }
        }
        let free: Vec<String> = (0..site.ssb_indices())
            .filter(|index| self.heads.iter().all(|head| head.ssb_index != *index))
            .map(|index| index.to_string())
            .collect();
        let write = if free.is_empty() {
            "write the index of a radio head that stands farther away".to_owned()
        } else {
            format!("specify another index; unused are {}", free.join(", "))
        };
        let lost = worst.iter().enumerate();
        lost.filter_map(|(wanted, worst)| {
            let (ratio_db, place, strongest) = (*worst)?;
            Some(Warning {
                key: format!("radio_heads[{}].ssb_index", self.numbers[wanted]),
                value: self.heads[wanted].ssb_index.to_string(),
                why: format!(
                    "radio_heads[{}] transmits at the same time: at ({:.0}, {:.0}) it is \
                     {:.0} dB stronger, and an SSB is detected up to {} dB below another",
                    self.numbers[strongest], place.x_m, place.y_m, -ratio_db, -FOUND_DB
                ),
                write: write.clone(),
            })
        })
        .collect()
    }
}
