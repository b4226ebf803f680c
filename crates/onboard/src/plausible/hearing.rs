//! Who hears whom, by the link budget: where radio heads, road and start are not in one frame, or
//! cells send at one time, it shows here.

use super::warning::Warning;
use crate::geometry::Point;
use crate::link_budget::LinkBudget;
use crate::radio_head::RadioHead;
use crate::road::Road;
use crate::settings::{Site, Vehicle};
use crate::walls::Walls;

/// An SSB is found down to so much above noise, or above what else is on the air at its time, with
/// four antennas (dB; `cargo test -p nr-ssb --test all detection`).
const FOUND_DB: f64 = -10.0;
/// A place takes so many radio heads where no road helps.
const FOR_A_PLACE: usize = 3;
/// Places along a road that are looked at, and how far from each other at the least (m).
const MOST_PLACES: f64 = 400.0;
const STEP_M: f64 = 5.0;
/// Nearer to its mast no vehicle comes (m).
const NEAREST_M: f64 = 10.0;

/// Radio heads that are heard nowhere along the road, or near any other where there is none.
pub(super) fn unheard(site: &Site, vehicle: &Vehicle, road: Option<&Road>) -> Vec<Warning> {
    let air = Air::new(site, vehicle);
    let where_ = if road.is_some() {
        "along the road"
    } else {
        "near any other"
    };
    air.unheard(&air.places(road), where_)
}

/// Of cells that send at one time, those that are wanted somewhere and are too weak there beside the
/// others.
pub(super) fn drowned(site: &Site, vehicle: &Vehicle, road: Option<&Road>) -> Vec<Warning> {
    let air = Air::new(site, vehicle);
    air.drowned(site, &air.places(road))
}

/// A start from which nothing is heard.
pub(super) fn unheard_at_start(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let air = Air::new(site, vehicle);
    let pose = vehicle.start.pose?;
    let heads = air.heads.iter();
    let nearest_m = heads
        .clone()
        .map(|head| head.position.distance_m(pose.point()))
        .fold(f64::INFINITY, f64::min);
    let is_heard = heads
        .clone()
        .any(|head| air.snr_db(head, pose.point()) >= FOUND_DB);
    (!is_heard).then(|| Warning {
        key: "start.pose".to_owned(),
        value: format!("[{}, {}]", pose.x_m, pose.y_m),
        why: format!("no radio head is heard there: the nearest stands {nearest_m:.0} m away"),
        write: "write it in metres in the frame of the radio heads".to_owned(),
    })
}

/// Places along a road, a step apart or as many as there may be at most; before each the distance along it (m).
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
    let steps = steps_along(road, STEP_M, MOST_PLACES);
    steps.map(|(_, place)| place).collect()
}

/// The radio heads that a vehicle listens to, and how strong they are where.
struct Air {
    heads: Vec<RadioHead>,
    /// Their numbers in the site.
    numbers: Vec<usize>,
    budget: LinkBudget,
    walls: Walls,
    array_m: f64,
}

impl Air {
    fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let heard = site.radio_heads.iter().enumerate();
        let heard = heard.filter(|(_, head)| vehicle.receiver.hears(head.pci));
        let (numbers, heads) = heard
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

    /// Where to listen: along the road, or at the others' places.
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

    fn unheard(&self, places: &[Point], where_: &str) -> Vec<Warning> {
        let heads = || self.heads.iter().zip(&self.numbers);
        let hidden = heads().filter(|(head, _)| self.hidden(head, places));
        let hidden = hidden.map(|(head, number)| Warning {
            key: format!("radio_heads[{number}].position_m"),
            value: format!("[{}, {}]", head.position.x_m, head.position.y_m),
            why: format!("walls keep it out of sight everywhere {where_}"),
            write: "write its place, and the walls' points_m, in one frame; leave doors out"
                .to_owned(),
        });
        let far = heads().filter_map(|(head, number)| {
            let others = places.iter().filter(|place| **place != head.position);
            let distance_m = others
                .map(|place| head.distance_m(*place, self.array_m))
                .reduce(f64::min)?
                .max(NEAREST_M);
            let snr_db = self.budget.snr_db(head, distance_m);
            (snr_db < FOUND_DB).then(|| Warning {
                key: format!("radio_heads[{number}].position_m"),
                value: format!("[{}, {}]", head.position.x_m, head.position.y_m),
                why: format!(
                    "it is heard nowhere {where_}: {distance_m:.0} m away at the nearest, its \
                         SNR is {snr_db:.0} dB at best, and an SSB is found down to {FOUND_DB} dB"
                ),
                write: format!(
                    "write all places in metres in one frame (no degrees, no grid of a map), or \
                         an eirp_dbm that reaches: now {}",
                    head.eirp_dbm
                ),
            })
        });
        far.chain(hidden).collect()
    }

    fn drowned(&self, site: &Site, places: &[Point]) -> Vec<Warning> {
        let count = self.heads.len();
        // Of each the least ratio to the others, where, and who is strongest there.
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
            format!("write an index of its own; free are {}", free.join(", "))
        };
        let lost = worst.iter().enumerate();
        lost.filter_map(|(wanted, worst)| {
            let (ratio_db, place, strongest) = (*worst)?;
            Some(Warning {
                key: format!("radio_heads[{}].ssb_index", self.numbers[wanted]),
                value: self.heads[wanted].ssb_index.to_string(),
                why: format!(
                    "radio_heads[{}] sends at the same time and drowns it: at ({:.0}, {:.0}) it is \
                     {:.0} dB stronger, and an SSB is found down to {} dB below another",
                    self.numbers[strongest], place.x_m, place.y_m, -ratio_db, -FOUND_DB
                ),
                write: write.clone(),
            })
        })
        .collect()
    }
}
